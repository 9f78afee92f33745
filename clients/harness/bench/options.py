"""The command line of bench."""
import argparse
import re
import sys
from pathlib import Path

from ..daemon import cache_folder

EXIT_USAGE = 2
SEED_COUNT = 3
HELP = """Error against run time: every technique at every rung of its ladder, in every scene; beside
them "auto" with several budgets, "reference+filter", and, where Blender is installed, "cycles" and
"cycles+filter": the same scene, camera and samples by its path tracer, raw and behind our filter.

Each point is rendered again and again, each time taking nothing over from earlier frames, and timed;
its picture is compared with two references: the whole rendering equation ("full"), and the technique's
own model of it ("model"). DIR gets bench.html, bench.svg, bench.csv and bench.json. Points that
bench.json has are not run again; Ctrl-C keeps what there is."""


def _size(text):
    found = re.fullmatch(r"([1-9]\d{0,4})x([1-9]\d{0,4})", text)
    if not found:
        raise argparse.ArgumentTypeError(f"{text}: must be WIDTHxHEIGHT in pixels")
    return int(found[1]), int(found[2])


def _setting(text):
    key, equals, value = text.partition("=")
    if not (key and equals and value):
        raise argparse.ArgumentTypeError(f"{text}: must be KEY=VALUE")
    return key, value


def _ladder(text):
    """ "rsm:vpls=16,64" as ("rsm", ({"vpls": "16"}, {"vpls": "64"})) """
    technique, colon, rest = text.partition(":")
    key, equals, values = rest.partition("=")
    rungs = tuple({key: value} for value in values.split(","))
    if not (technique and colon and key and equals and all(rung[key] for rung in rungs)):
        raise argparse.ArgumentTypeError(f"{text}: must be TECHNIQUE:KEY=VALUE,VALUE,...")
    return technique, rungs


def at_least(least, kind):
    def parse(text):
        try:
            value = kind(text)
        except ValueError:
            value = None
        if value is None or not least <= value < 2 ** 31:
            raise argparse.ArgumentTypeError(f"{text}: must be a number from {least}")
        return value
    return parse


def parse(words):
    parser = argparse.ArgumentParser(prog="bounce bench", description=HELP, allow_abbrev=False,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("scenes", nargs="*", type=Path, metavar="SCENE", help=".glb or .gltf")
    add("--technique", action="append", metavar="NAME", help="only these; repeatable")
    add("--ladder", action="append", type=_ladder, default=[], metavar="TECHNIQUE:KEY=V,V,...",
        help="rungs instead of those that the technique declares; repeatable")
    add("--size", type=_size, default=(256, 256), metavar="WxH", help="default 256x256")
    add("--camera", help="name or index; default: the scene's first")
    add("--runs", type=at_least(1, int), default=30, metavar="N",
        help="timed frames a point, after one that is not; default 30")
    add("--set", action="append", type=_setting, default=[], dest="settings", metavar="KEY=VALUE",
        help="for every technique that reads KEY, the reference too; repeatable")
    quality = parser.add_mutually_exclusive_group()
    quality.add_argument("--reference-spp", type=at_least(2, int), default=1024, metavar="N",
                         help="samples a pixel of references; default 1024")
    quality.add_argument("--reference-error", type=at_least(1e-3, float), metavar="PCT",
                         help="as many samples as it takes for a noise below PCT %% of the mean")
    add("--seed", action="append", type=at_least(0, int), dest="seeds", metavar="N",
        help=f"of techniques whose picture it changes; repeatable; default 1 to {SEED_COUNT}")
    add("--device", metavar="SPEC", help="as of bounce render")
    add("--cache", type=Path, default=cache_folder("references"), metavar="DIR",
        help="references are kept here; default %(default)s")
    add("-o", "--output", type=Path, default=Path("bench"), metavar="DIR", help="default ./bench")
    add("--title", default="Error against run time", metavar="TEXT")
    papers = parser.add_argument_group("instead of all that")
    papers.add_argument("--figures", nargs="?", metavar="NAME,...|all",
                        help="figures and claims of the source papers, as papers.html; needs --scenes; "
                             "options: bounce bench --figures --help")
    papers.add_argument("--scenes", dest="scene_set", metavar="DIR", help="of --figures: the scene set's folder")
    options = parser.parse_args(words)
    if options.scene_set is not None:
        refuse("--scenes goes with --figures alone")
    if options.reference_spp % 2:
        parser.error(f"--reference-spp {options.reference_spp}: must be even, half for each half")
    options.seeds = options.seeds or list(range(1, SEED_COUNT + 1))
    options.settings = dict(options.settings)
    options.ladders = dict(options.ladder)
    options.scenes = options.scenes or [_bundled(parser)]
    for scene in options.scenes:
        if not scene.is_file():
            parser.error(f"{scene}: no such file")
    return options


def refuse(message):
    """Ends the program for a mistake in its words that only the daemon's registry shows."""
    print(f"bounce bench: {message}", file=sys.stderr)
    raise SystemExit(EXIT_USAGE)


def _bundled(parser):
    """The Cornell box of the source tree, where there is one."""
    scene = Path(__file__).resolve().parents[3] / "tests" / "scenes" / "cornell.glb"
    if not scene.is_file():
        parser.error("no SCENE")
    return scene
