"""What the scripts that are run by hand share: their machine, their command line, their result.

    options = by_hand.parse(by_hand.parser(__doc__), words)
    by_hand.write({"machine": by_hand.machine(), ...}, options.output)

Importing it makes the harness importable, and what measures the machine.
"""
import argparse
import json
import os
import pathlib
import platform
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "clients"), str(ROOT / "deploy")]

# What the harness starts, and where a build has it.
PROGRAMS = {"BOUNCE": "clients/cli/bounce", "BOUNCED": "server/bounced"}
COUNT_MAX = 16384


def machine():
    model = "unknown"
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            model = line.split(":", 1)[1].strip()
            break
    return {"cpu": model, "cores": os.cpu_count(), "kernel": platform.release(),
            "load_before": os.getloadavg()[0]}


def say(line):
    print(line, file=sys.stderr, flush=True)


# --- the command line -----------------------------------------------------------------------------

def count(text):
    """Of runs, frames, pixels: 0 would measure nothing."""
    if not text.isdecimal() or not 1 <= int(text) <= COUNT_MAX:
        raise argparse.ArgumentTypeError(f"{text}: a whole number from 1 to {COUNT_MAX}")
    return int(text)


def parser(doc, has_scenes=True):
    """For the words that all of them take: BUILD_DIR SCENES_DIR -o RESULT.json; without SCENES_DIR
    for those that use the bundled scenes."""
    made = argparse.ArgumentParser(description=doc.splitlines()[0])
    made.add_argument("build", metavar="BUILD_DIR", type=pathlib.Path)
    if has_scenes:
        made.add_argument("scenes", metavar="SCENES_DIR", type=pathlib.Path)
    made.add_argument("-o", "--output", metavar="RESULT.json", type=pathlib.Path, required=True)
    return made


def add_names(made, standard):
    made.add_argument("--scenes", dest="names", metavar="NAME,NAME",
                      type=lambda text: tuple(text.split(",")), default=standard)


def name_programs(build, refuse):
    """Of a build, to the harness."""
    for variable, place in PROGRAMS.items():
        os.environ.setdefault(variable, str(build.resolve() / place))
        if not pathlib.Path(os.environ[variable]).is_file():
            refuse(f"BUILD_DIR: there is no {os.environ[variable]}")


def parse(made, words, names=()):
    """Checks what would else be found out after hours: that every scene is there, of `--scenes` or
    of `names`, and a folder for the result. Names the build's programs to the harness."""
    options = made.parse_args(words)
    options.build = options.build.resolve()
    name_programs(options.build, made.error)
    for name in getattr(options, "names", names):
        if not (options.scenes / f"{name}.glb").is_file():
            made.error(f"SCENES_DIR: there is no {options.scenes / name}.glb")
    if not options.output.resolve().parent.is_dir():
        made.error(f"-o: there is no folder {options.output.parent}")
    return options


def write(result, path):
    path.write_text(json.dumps(result, indent=1) + "\n")
