"""One leg of a day on a GPU, from an unpacked bundle.

usage: run LEG OUT [--seconds N]

Makes OUT/LEG/: result.json, written after every step, so that what ends the leg costs only the step
that ran; files.tar.gz, everything that tests said and benches wrote. Ends itself before nine minutes
are over, and says what it did not do. Exits 0 if something passed and nothing failed, and 1 else.
Writes nowhere else but in the bundle and in a folder of its own under $TMPDIR.
"""
import argparse
import collections
import json
import os
import pathlib
import re
import shutil
import sys
import tarfile
import tempfile

import host
import legs
import steps

ROOT = pathlib.Path(__file__).resolve().parents[1]
PYTHON = ROOT / "bin/python3"
FORMAT = 1
TESTS_AT_ONCE = 6
BAD = ("failed", "late")


def places(out):
    return {"@SOURCE@": ROOT / "source", "@BUILD@": ROOT / "build", "@SCENES@": ROOT / "scenes",
            "@PYTHON@": PYTHON, "@OUT@": out}


def placed(text, where):
    for word, path in where.items():
        text = text.replace(word, str(path))
    return text


def tests_of(leg, where):
    listed = json.loads((ROOT / "day/tests.json").read_text(encoding="utf-8"))
    for test in listed:
        if test["suite"] in leg.suites:
            yield {**test, "words": [placed(word, where) for word in test["words"]],
                   "environment": {k: placed(v, where) for k, v in test["environment"].items()}}


def benches_of(leg, where):
    for bench in leg.benches:
        # As long as the leg has: what comes behind it is worth no more than what it measures.
        yield {"name": bench.name, "suite": "bench", "seconds": legs.LEG_SECONDS, "alone": True,
               "environment": {}, "words": [placed(word, where) for word in bench.words],
               "goes_on": bench.goes_on, "ends": bench.ends}


def environment_in(scratch, leg):
    """Of this process, and where the bundle is; what is kept is kept in `scratch`."""
    found = {**os.environ, "PATH": f"{ROOT / 'bin'}:{os.environ.get('PATH', '/usr/bin:/bin')}",
             "BOUNCE": str(ROOT / "build/clients/cli/bounce"),
             "BOUNCED": str(ROOT / "build/server/bounced"),
             "BOUNCE_PYTHON": str(PYTHON), "PYTHONPATH": str(ROOT / "source/clients"),
             "PYTHONDONTWRITEBYTECODE": "1", "PYTHONUNBUFFERED": "1", "LC_ALL": "C.UTF-8",
             "TMPDIR": str(scratch), "HOME": str(scratch / "home"),
             "XDG_CACHE_HOME": str(scratch / "cache"), "XDG_RUNTIME_DIR": str(scratch / "run"),
             "MESA_SHADER_CACHE_DIR": str(scratch / "shaders"),
             "__GL_SHADER_DISK_CACHE_PATH": str(scratch / "shaders"), **dict(leg.environment)}
    for name in ("home", "cache", "shaders", "run"):
        (scratch / name).mkdir(mode=0o700)
    return {**found, **host.driver_environment(scratch, found)}


def name_python_in_scripts():
    """Programs of the tests' own that begin with the name of a Python that is not here."""
    for path in (ROOT / "source/tests").rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        if re.match(r"#!\S*python3\n", text):
            path.write_text(f"#!{PYTHON}\n" + text.split("\n", 1)[1], encoding="utf-8")


def run_leg(name, out, seconds):
    leg = legs.LEGS[name]
    folder, scratch = out / name, pathlib.Path(tempfile.mkdtemp(prefix="day-"))
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    files = scratch / "files"
    (files / "logs").mkdir(parents=True)
    environment = environment_in(scratch, leg)
    where = places(files)
    head = {"format": FORMAT, "leg": name, "what": leg.what,
            **host.facts(where["@BUILD@"] / "server/bounced", environment)}

    def save(outcomes):
        beside = folder / "result.part"
        beside.write_text(json.dumps({**head, "steps": outcomes}, indent=1) + "\n", encoding="utf-8")
        beside.replace(folder / "result.json")

    todo = [*tests_of(leg, where), *benches_of(leg, where)]
    width = min(TESTS_AT_ONCE, max(1, (os.cpu_count() or 1) // 2))
    runner = steps.Runner(todo, files / "logs", environment, seconds, width,
                          lambda outcomes: (save(outcomes), print_last(outcomes)))
    save(list(runner.outcomes.values()))
    try:
        outcomes = runner.run()
        save(outcomes)
        pack(files, folder / "files.tar.gz")
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    return outcomes


def pack(files, path):
    """Pictures stay: what was measured on them is in the figures."""
    def wanted(entry):
        return None if "/pictures" in entry.name else entry
    with tarfile.open(path, "w:gz") as tar:
        tar.add(files, arcname=".", filter=wanted)


printed = set()


def print_last(outcomes):
    for outcome in outcomes:
        if outcome["result"] != "not run" and outcome["name"] not in printed:
            printed.add(outcome["name"])
            print(f"{outcome['result']:8}{outcome['took_s']:8.1f} s  {outcome['suite']}/{outcome['name']}",
                  flush=True)


def print_legs():
    for name, leg in legs.LEGS.items():
        print(f"{name:10}{leg.seconds:5} s  {leg.what}")


def main(words):
    parser = argparse.ArgumentParser(prog="run", description=__doc__.splitlines()[0])
    parser.add_argument("leg", choices=legs.LEGS)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--seconds", type=float, default=legs.LEG_SECONDS,
                        help="that the leg may work for; default %(default)s")
    if not words:
        parser.print_usage()
        print_legs()
        return 2
    options = parser.parse_args(words)
    name_python_in_scripts()
    outcomes = run_leg(options.leg, options.out.resolve(), options.seconds)
    counts = collections.Counter(outcome["result"] for outcome in outcomes)
    print(f"{options.leg}: " + ", ".join(f"{count} {result}" for result, count in counts.items())
          + f"; {options.out / options.leg}")
    return 0 if counts["passed"] and not any(counts[result] for result in BAD) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
