"""Puts into a bundle what tests and benches start and read, and the list of tests.

usage: pack.py BUILD STAGE

What a test needs is what the build says it depends on: no list is kept by hand. STAGE/day/tests.json has
of each test name, suite, command, environment, seconds, and whether others may run beside it.
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys

import legs

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Of the source tree: all but what only other machines read.
READ = ("clients/harness", "clients/python", "deploy", "tests")
UNREAD = ("tests/bench/results/", "tests/import/", "tests/fuzz/", "tests/journal/", "tests/web/",
          "tests/faults/")


def introspect(build, what):
    out = subprocess.run(["meson", "introspect", build, f"--{what}"], check=True, capture_output=True)
    return json.loads(out.stdout)


def suite_of(test):
    return test["suite"][0].split(":")[-1]


class Places:
    """This machine's folders, by the words that stand for the bundle's."""

    def __init__(self, build):
        # Most special first: the build may lie in the source tree.
        self.pairs = [(f"{ROOT}/../shared", "@SCENES@"), (str(build), "@BUILD@"),
                      (str(ROOT), "@SOURCE@"), ("/usr/bin/python3", "@PYTHON@")]

    def __call__(self, text):
        for here, there in self.pairs:
            text = text.replace(here, there)
        return text


def entry(test, places):
    return {"name": test["name"], "suite": suite_of(test),
            "words": [places(word) for word in test["cmd"]],
            "environment": {name: places(value) for name, value in test["env"].items()},
            "seconds": test["timeout"], "alone": not test["is_parallel"]}


def copy_file(base, path, target):
    destination = target / pathlib.Path(path).relative_to(base)
    destination.parent.mkdir(parents=True, exist_ok=True)
    if not destination.exists():
        shutil.copy2(path, destination)


def copy_built(build, tests, stage):
    """The programs, and what else the build makes for these tests."""
    files = {target["id"]: target["filename"] for target in introspect(build, "targets")}
    wanted = {file for test in tests for target in test["depends"] for file in files[target]}
    wanted |= {str(build / path) for path in legs.programs()}
    for path in sorted(wanted):
        copy_file(build, path, stage / "build")
    copy_links(build, stage)


def copy_links(build, stage):
    """By which programs of the build find Python packages of the source."""
    for path in build.rglob("*"):
        if path.is_symlink() and path.resolve().is_relative_to(ROOT / "clients"):
            link = stage / "build" / path.relative_to(build)
            target = stage / "source" / path.resolve().relative_to(ROOT)
            link.parent.mkdir(parents=True, exist_ok=True)
            link.symlink_to(os.path.relpath(target, link.parent))


def copy_source(stage):
    listed = subprocess.run(["git", "-C", ROOT, "ls-files", "-co", "--exclude-standard", "-z", *READ],
                            check=True, capture_output=True, text=True).stdout.split("\0")
    for path in filter(None, listed):
        if not path.startswith(UNREAD) and (ROOT / path).is_file():
            copy_file(ROOT, ROOT / path, stage / "source")


def main():
    build, stage = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
    tests = [test for test in introspect(build, "tests") if suite_of(test) in legs.suites()]
    places = Places(build)
    (stage / "day/tests.json").write_text(
        json.dumps([entry(test, places) for test in tests], indent=1) + "\n")
    copy_built(build, tests, stage)
    copy_source(stage)
    missing = legs.suites().keys() - {suite_of(test) for test in tests}
    if missing:
        sys.exit(f"this build has no tests of {', '.join(sorted(missing))}")


if __name__ == "__main__":
    main()
