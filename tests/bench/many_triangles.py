"""Frames by their number of triangles and of nodes: raster passes under a point light.

usage: many_triangles.py BUILD_DIR -o RESULT.json [--runs 5] [--size 512] [--largest 10000000] [--before BOUNCED]
                         [--ways raster rays] [--only waves]

Waves on a floor, in sheets of a million triangles at most, lit by a point light above them, in technique
`direct`: once wholly in view, and once by a camera that sees a corner of them. And one box shown by many
nodes, at 256x256. What cameras and lights see is drawn, or found by rays (`drawing`). Frames are made anew and
counted without loading, compiling and encoding; medians. The structure that rays ask is kept from the first
frame on, as it is while a light or a camera moves: so frames by rays ask for shadow maps of another size each.
Its building is `bvh_ms`. `processor_ms` is what the daemon's process needed for a frame, which other work on the machine
changes less. `first_s` is the scene's first frame, uploads included; `memory_mb` what the process holds in the end.
`--before` names the daemon of an earlier build, which takes turns with this one, scene by scene.
"""
import json
import os
import pathlib
import re
import struct
import tempfile
import time

import numpy

import by_hand
from harness.bench.measure import times_of
from harness.daemon import Daemon

WAYS = ("raster", "rays")
SHADOW_SIZE = 1024
SHEET_MAX = 1000000  # triangles of a mesh
TRIANGLES = (10000, 100000, 1000000, 10000000)
NODES = (4096, 65542)
NODES_SIZE = 256
WIDTH_M = 10
GOAL_PER_HUNDREDFOLD = {"raster": 2.5, "rays": 1.5}
GOAL_NODES_MS = 1000
LOOKING_DOWN = (-.342, 0, 0, .94)  # 40 degrees below the horizon
VIEWS = {"all": {"translation": [0, 9.5, 11], "rotation": LOOKING_DOWN},
         "corner": {"translation": [3.5, 1.5, 5.5], "rotation": LOOKING_DOWN}}


class Builder:
    def __init__(self, view):
        self.doc = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [], "meshes": [],
                    "accessors": [], "bufferViews": [], "extensionsUsed": ["KHR_lights_punctual"],
                    "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
                    "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 1000}]}}}
        self.parts, self.size = [], 0
        self.add_node({"camera": 0, **VIEWS[view]})
        self.add_node({"translation": [.3, 2.5, .2], "extensions": {"KHR_lights_punctual": {"light": 0}}})

    def accessor(self, array, kind, component):
        data = array.tobytes()
        self.doc["bufferViews"].append({"buffer": 0, "byteOffset": self.size, "byteLength": len(data)})
        entry = {"bufferView": len(self.doc["bufferViews"]) - 1, "componentType": component,
                 "count": array.size // {"VEC3": 3, "SCALAR": 1}[kind], "type": kind}
        if kind == "VEC3":
            flat = array.reshape(-1, 3)
            entry["min"], entry["max"] = flat.min(0).tolist(), flat.max(0).tolist()
        self.doc["accessors"].append(entry)
        self.parts.append(data)
        self.size += len(data)
        return len(self.doc["accessors"]) - 1

    def add_mesh(self, positions, indices):
        attributes = {"POSITION": self.accessor(positions.astype(numpy.float32), "VEC3", 5126)}
        self.doc["meshes"].append({"primitives": [{
            "attributes": attributes, "indices": self.accessor(indices.astype(numpy.uint32).ravel(), "SCALAR", 5125)}]})
        return len(self.doc["meshes"]) - 1

    def add_node(self, node):
        self.doc["nodes"].append(node)
        self.doc["scenes"][0]["nodes"].append(len(self.doc["nodes"]) - 1)

    def save(self, path):
        self.doc["buffers"] = [{"byteLength": self.size}]
        text = json.dumps(self.doc).encode()
        text += b" " * (-len(text) % 4)
        with open(path, "wb") as file:
            file.write(struct.pack("<4sII", b"glTF", 2, 28 + len(text) + self.size))
            file.write(struct.pack("<I4s", len(text), b"JSON") + text)
            file.write(struct.pack("<I4s", self.size, b"BIN\0"))
            for part in self.parts:
                file.write(part)


def sheet(side, x0, z0, width):
    """Waves over a square of the floor: a grid of `side` squares a side, row by row."""
    along = numpy.linspace(0, width, side + 1)
    x, z = numpy.meshgrid(x0 + along, z0 + along)
    y = .25 * numpy.sin(3 * x) * numpy.cos(2.3 * z) + .03 * numpy.sin(17 * x + 13 * z)
    first = (numpy.arange(side)[:, None] * (side + 1) + numpy.arange(side)).ravel()
    below = first + side + 1
    triangles = numpy.stack([first, below, first + 1, first + 1, below, below + 1], axis=-1)
    return numpy.stack([x, y, z], axis=-1).reshape(-1, 3), triangles.reshape(-1, 3)


def save_waves(path, triangle_count, view):
    built = Builder(view)
    tiles = int(numpy.ceil((triangle_count / SHEET_MAX) ** .5))
    side = int((triangle_count / 2) ** .5 / tiles)
    width = WIDTH_M / tiles
    for tile in range(tiles * tiles):
        x0, z0 = -WIDTH_M / 2 + width * (tile % tiles), -WIDTH_M / 2 + width * (tile // tiles)
        built.add_node({"mesh": built.add_mesh(*sheet(side, x0, z0, width))})
    built.save(path)
    return 2 * side * side * tiles * tiles


def box():
    corners = numpy.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    faces = numpy.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    triangles = numpy.concatenate([4 * numpy.arange(6)[:, None] + [0, 1, 2], 4 * numpy.arange(6)[:, None] + [0, 2, 3]])
    return corners[faces].reshape(-1, 3), triangles


def save_boxes(path, node_count, view):
    """One box shown by so many nodes, at random places of the floor up to a metre and a half above it."""
    built = Builder(view)
    mesh = built.add_mesh(*box())
    draw = numpy.random.default_rng(1)
    places = draw.uniform([-WIDTH_M / 2, 0, -WIDTH_M / 2], [WIDTH_M / 2, 1.5, WIDTH_M / 2], (node_count, 3))
    turns = draw.normal(size=(node_count, 4))
    turns /= numpy.linalg.norm(turns, axis=1)[:, None]
    half = .5 * WIDTH_M / node_count ** .5
    for place, turn in zip(places.tolist(), turns.tolist()):
        built.add_node({"mesh": mesh, "translation": place, "rotation": turn, "scale": [half] * 3})
    built.save(path)
    return 12 * node_count


def memory_mb(daemon):
    text = pathlib.Path(f"/proc/{daemon.pid}/status").read_text()
    return {name: int(re.search(rf"{key}:\s+(\d+)", text)[1]) / 1024
            for name, key in (("now", "VmRSS"), ("peak", "VmHWM"))}


def processor_ms(daemon):
    fields = pathlib.Path(f"/proc/{daemon.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return 1000 * (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def pass_ms(report, name):
    return sum(each["ms"] for each in report["passes"] if each["name"] == name)


def measure(path, size, runs, way, bounced=None):
    made = Daemon(arguments=["--device", "software"])
    made.bounced = str(bounced or made.bounced)
    with made as daemon:
        start = time.monotonic()
        scene = daemon.hold(path)
        held_s = time.monotonic() - start

        def frame(turn):
            settings = {"shadow_size": SHADOW_SIZE - turn} if way == "rays" else {}
            if not bounced:
                settings["drawing"] = way
            return daemon.report(f"scene:{scene['id']}", "direct", settings, size=(size, size), timeout_s=600,
                                 extra=("--fresh", "camera" if way == "rays" else "all"))

        start = time.monotonic()
        first = frame(0)
        first_s = time.monotonic() - start
        before_ms = processor_ms(daemon)
        frames = [frame(1 + turn) for turn in range(runs)]
        needed_ms = (processor_ms(daemon) - before_ms) / runs
        return {"import_s": held_s, "first_s": first_s, "first_load_ms": first["time_ms"]["load"],
                "bvh_ms": pass_ms(first, "bvh"),
                "time_ms": times_of(frames), "processor_ms": needed_ms, "memory_mb": memory_mb(daemon)}


def cases(largest, only):
    for count in NODES:
        for view in VIEWS:
            if only != "waves":
                yield f"boxes {count} {view}", save_boxes, count, view, NODES_SIZE
    for count in TRIANGLES:
        if only == "boxes":
            return
        for view in VIEWS:
            if count <= largest:
                yield f"waves {count} {view}", save_waves, count, view, None


def growth(found, view, way):
    """Of what the process needs, by a hundredfold of triangles."""
    needed = {count: found[f"waves {count} {view} {way}"]["processor_ms"] for count in TRIANGLES
              if f"waves {count} {view} {way}" in found}
    return {f"{count} to {100 * count}": needed[100 * count] / needed[count]
            for count in needed if 100 * count in needed}


def tell(name, entry):
    by_hand.say(f"{name}: {entry['time_ms']['frame']['median']:.0f} ms, {entry['processor_ms']:.0f} of "
                f"processors, first {entry['first_s']:.2f} s, import {entry['import_s']:.2f} s, "
                f"{entry['memory_mb']['peak']:.0f} MB")


def run(options, keep):
    found, before = {}, {}
    with tempfile.TemporaryDirectory() as folder:
        for name, save, count, view, own_size in cases(options.largest, options.only):
            path, size = pathlib.Path(folder) / "scene.glb", own_size or options.size
            scene = {"triangles": save(path, count, view), "size": size}
            runs = options.runs if count < max(TRIANGLES) else 1
            for way in options.ways:
                found[f"{name} {way}"] = {**scene, **measure(path, size, runs, way)}
                tell(f"{name} {way}", found[f"{name} {way}"])
            if options.before:
                before[f"{name} raster"] = {**scene, **measure(path, size, runs, "raster", options.before)}
                tell(f"  before, {name}", before[f"{name} raster"])
            keep(found, before)


def main(words=None):
    parser = by_hand.parser(__doc__, has_scenes=False)
    parser.add_argument("--size", type=by_hand.count, default=512)
    parser.add_argument("--runs", type=by_hand.count, default=5)
    parser.add_argument("--largest", type=int, default=max(TRIANGLES))
    parser.add_argument("--before", type=pathlib.Path, metavar="BOUNCED")
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=WAYS)
    parser.add_argument("--only", choices=("waves", "boxes"))
    options = by_hand.parse(parser, words)
    command = (f"many_triangles.py BUILD -o RESULT --size {options.size} --runs {options.runs} "
               f"--largest {options.largest} --ways {' '.join(options.ways)}" +
               (f" --only {options.only}" if options.only else "") + (" --before BOUNCED" if options.before else ""))
    result = {"machine": by_hand.machine(), "technique": "direct", "size": options.size, "runs": options.runs,
              "command": command,
              "goals": {"per_hundredfold": GOAL_PER_HUNDREDFOLD, f"boxes {max(NODES)}": GOAL_NODES_MS}}

    def keep(found, before):
        result.update(growth={way: {view: growth(found, view, way) for view in VIEWS} for way in options.ways},
                      scenes=found)
        if before:
            result["before"] = {"growth": {view: growth(before, view, "raster") for view in VIEWS}, "scenes": before}
        by_hand.write(result, options.output)

    run(options, keep)


if __name__ == "__main__":
    main()
