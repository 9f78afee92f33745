"""The command line of bench --figures."""
import argparse
from pathlib import Path

from .. import options
from . import FIGURES

ROUNDS = 3
HELP = """Figures of the source papers redrawn on the techniques that are here, what the papers claim beside what
was found, and cost curves.

Frames of a group take turns, and ratios are formed within a group. What DIR of --scenes lacks is skipped, and named.
Groups that papers.json has are not measured again; Ctrl-C keeps what there is. DIR of -o gets papers.html,
papers.csv, papers.json and a drawing of each figure."""


class _Parser(argparse.ArgumentParser):
    def error(self, message):
        options.refuse(message.removeprefix("argument "))


def wanted(words):
    return any(word.partition("=")[0] == "--figures" for word in words)


def _names(text):
    names = FIGURES if text == "all" else tuple(text.split(","))
    for name in names:
        if name not in FIGURES:
            raise argparse.ArgumentTypeError(f"{name or 'nothing'}: must be all or of "
                                             + ", ".join(FIGURES))
    return names


def parse(words):
    """Mistakes end the program after one line."""
    parser = _Parser(prog="bounce bench", description=HELP, allow_abbrev=False,
                     formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--figures", type=_names, nargs="?", const=FIGURES, required=True, metavar="NAME[,NAME...]",
        help="all, the default, or of " + ", ".join(FIGURES))
    add("--scenes", type=Path, metavar="DIR", help="where the scene set's files are")
    add("--runs", type=options.at_least(1, int), default=ROUNDS, metavar="N",
        help="timed frames, after one that is not; default %(default)s")
    add("--shrink", type=options.at_least(1, int), default=1, metavar="N",
        help="sizes in pixels divided by N, to see quickly that all works; default 1")
    add("--device", metavar="SPEC", help="as of bounce render")
    add("-o", "--output", type=Path, default=Path("papers"), metavar="DIR", help="default ./papers")
    add("--title", default="Papers, redrawn", metavar="TEXT")
    asked, others = parser.parse_known_args(words)
    if others:
        options.refuse(f"{others[0]} does not go with --figures")
    if asked.scenes is None:
        options.refuse("--figures needs --scenes DIR, where the scene set's .glb files are")
    if not asked.scenes.is_dir():
        options.refuse(f"--scenes {asked.scenes}: no such folder")
    return asked
