"""The command line of redraw.py."""
import argparse
from pathlib import Path

from harness.bench import options
from . import FIGURES

ROUNDS = 3
HELP = """Figures of the papers redrawn on the techniques that are here, and cost curves.

Frames of a group take turns, and ratios are formed within a group. Scenes that DIR lacks are skipped,
and named. Groups that papers.json has are not measured again; Ctrl-C keeps what there is. DIR gets
papers.html, papers.csv, papers.json and a drawing of each figure."""


def _names(text):
    names = FIGURES if text == "all" else tuple(text.split(","))
    for name in names:
        if name not in FIGURES:
            raise argparse.ArgumentTypeError(f"{name or 'nothing'}: must be all or of "
                                             + ", ".join(FIGURES))
    return names


def parse(words):
    parser = argparse.ArgumentParser(prog="redraw.py", description=HELP, allow_abbrev=False,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("build", type=Path, metavar="BUILD_DIR", help="the build that is measured")
    add("--figures", type=_names, default=FIGURES, metavar="NAME[,NAME...]",
        help="all, the default, or of " + ", ".join(FIGURES))
    add("--scenes", type=Path, required=True, metavar="DIR", help="where the scene set's files are")
    add("--runs", type=options.at_least(1, int), default=ROUNDS, metavar="N",
        help="timed frames, after one that is not; default %(default)s")
    add("--shrink", type=options.at_least(1, int), default=1, metavar="N",
        help="sizes in pixels divided by N, to see quickly that all works; default 1")
    add("--device", metavar="SPEC", help="as of bounce render")
    add("-o", "--output", type=Path, default=Path("papers"), metavar="DIR", help="default ./papers")
    add("--title", default="Papers, redrawn", metavar="TEXT")
    asked = parser.parse_args(words)
    if not asked.scenes.is_dir():
        parser.error(f"--scenes {asked.scenes}: no such folder")
    return asked
