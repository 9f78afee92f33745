"""Functions and files that the daemon enters for one request: a build of its own, watched by entered.c.

usage: entered.py BUILD_DIR -o RESULT.json

BUILD_DIR is set up where it is not there, with every function instrumented; minutes. A daemon is asked some times for each:
`GET frame.png` of the bundled box by `direct`, and a `set_light` of an edit, until its connection is gone. What is entered
each time counts, after a first one that also enters what is done once: other threads' work (upkeep) comes and goes.
"""
import argparse
import collections
import json
import mmap
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENE = "cornell.glb"
SLOTS = 1 << 16
TIMES = 4
SETTLED_S = .3  # a connection is gone by then
LIGHT = {"ops": [{"set_light": {"light": 0, "intensity": 7}}]}


def build(folder):
    if not (folder / "build.ninja").exists():
        flags = "-finstrument-functions -g"
        subprocess.run(["meson", "setup", str(folder), str(ROOT), "-Dbuildtype=plain", f"-Dc_args={flags} -O1", f"-Dcpp_args=-O1 -g"],
                       check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["ninja", "-C", str(folder), "server/bounced", "clients/python/bounced_pb2.py"], check=True, stdout=subprocess.DEVNULL)
    recorder = folder / "entered.so"
    subprocess.run(["cc", "-O1", "-shared", "-fPIC", "-o", str(recorder), str(ROOT / "tests/house/entered.c")], check=True)
    return folder / "server/bounced", recorder


class Recording:
    """The file that the daemon maps, too."""

    def __init__(self, path):
        path.write_bytes(bytes(8 * (SLOTS + 1)))
        with open(path, "r+b") as file:
            self.map = mmap.mmap(file.fileno(), 0)

    def of(self, ask):
        """Addresses of what is entered while `ask` runs."""
        self.map[:] = bytes(len(self.map))
        self.map[:8] = struct.pack("<Q", 1)
        ask()
        time.sleep(SETTLED_S)
        self.map[:8] = bytes(8)
        return {address for address in struct.unpack(f"<{SLOTS}Q", self.map[8:]) if address}


def base_of(pid, program):
    """Where the program's first byte lies."""
    for line in open(f"/proc/{pid}/maps", encoding="ascii"):
        if line.rstrip().endswith(str(program)):
            return int(line.split("-")[0], 16)
    raise SystemExit(f"no mapping of {program}")


def names(program, addresses):
    """(function, file) of each."""
    words = ["addr2line", "-f", "-e", str(program), *(hex(address) for address in sorted(addresses))]
    lines = subprocess.run(words, check=True, capture_output=True, text=True).stdout.splitlines()
    for function, place in zip(lines[::2], lines[1::2]):
        path = pathlib.Path(os.path.realpath(place.split(":")[0]))
        if path.is_relative_to(ROOT):
            yield function, str(path.relative_to(ROOT))


def summary(found):
    found = set(found)
    files = {file for _, file in found}
    rooms = collections.Counter(os.path.dirname(file) for file in files)
    return {"functions": len(found), "files": len(files), "net_files": sum(n for room, n in rooms.items() if room.startswith("server/net")),
            "rooms": dict(rooms.most_common()), "entered": sorted(f"{file}: {function}" for function, file in found)}


def figures(daemon, recording, program):
    scene = daemon.add_scene(SCENE)
    base = base_of(daemon.process.pid, program)

    def picture(seed):
        status, _, data = daemon.request("GET", f"/v1/scenes/{scene}/frame.png?size=64x64&technique=direct&seed={seed}")
        assert status == 200, data

    def edit(intensity):
        LIGHT["ops"][0]["set_light"]["intensity"] = intensity
        status, answer = daemon.json("POST", f"/v1/scenes/{scene}/edits", LIGHT)
        assert status == 200, answer

    result = {}
    for name, ask in (("frame.png", picture), ("set_light", edit)):
        ask(1)
        each = [recording.of(lambda ask=ask, n=n: ask(2 + n)) for n in range(TIMES)]
        result[name] = summary(names(program, {address - base for address in set.intersection(*each)}))
    return result


def main():
    made = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    made.add_argument("build", type=pathlib.Path)
    made.add_argument("-o", "--output", type=pathlib.Path, required=True)
    options = made.parse_args()
    program, recorder = build(options.build.resolve())
    folder = options.build.resolve()
    recording = Recording(folder / "entered.map")
    os.environ.update(BD_BOUNCED=str(program), BD_PB2_DIR=str(folder / "clients/python"), BD_BUILD_DIR=str(folder))
    sys.path.insert(0, str(ROOT / "tests/net"))
    from conftest import Daemon
    watched = {"LD_PRELOAD": str(recorder), "BD_ENTERED": str(folder / "entered.map")}
    with tempfile.TemporaryDirectory() as home:
        daemon = Daemon(pathlib.Path(home), "--device", "software", env={**os.environ, **watched})
        try:
            result = figures(daemon, recording, program)
        finally:
            daemon.stop()
    options.output.write_text(json.dumps(result, indent=1) + "\n")
    for name, row in result.items():
        print(name, *(f"{key} {row[key]}" for key in ("functions", "files", "net_files")))


if __name__ == "__main__":
    sys.exit(main())
