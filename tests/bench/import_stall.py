"""How long the loop and the render thread are deaf while a scene of 100 MB comes in and goes.

usage: import_stall.py BUILD_DIR -o RESULT.json [--megabytes N] [--meshes N] [--device NAME]

A small view runs all the while. Stalls are the daemon's own (/metrics): how late a timer of 5 ms comes
on the loop, what processor time the loop took meanwhile (a late timer without it waited for the machine),
and how long the render thread works between two looks at what else there is to do.
"""
import http.client
import json
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import threading
import time

import numpy

import by_hand
import live

VIEW_SCENE = by_hand.ROOT / "tests/scenes/cornell.glb"
VIEW_SIZE = (96, 96)
SIDE_MAX = 4096  # vertices of a mesh along one side
FACES = ("http", "framed")
SERIES = ("loop_stall", "loop_work", "render_stall")
WARM_FRAMES = 50
LEVELS_MS = (20, 50, 100)
GOAL_MS = 50


# --- the scene ------------------------------------------------------------------------------------


def sheet(side, seed):
    """A height field: positions, normals, texture coordinates, indices, as bytes. The same for the same
    seed; 32 bytes a vertex and 24 a square."""
    x, z = (a.astype(numpy.float32) / (side - 1) for a in numpy.meshgrid(numpy.arange(side), numpy.arange(side)))
    y = numpy.float32(0.05) * numpy.sin((seed % 7 + 3) * x * 9) * numpy.cos((seed % 5 + 2) * z * 9)
    positions = numpy.stack([x, y + numpy.float32(seed * 1e-3), z], axis=-1).astype(numpy.float32)
    normals = numpy.zeros_like(positions)
    normals[..., 1] = 1
    corner = (numpy.arange(side - 1)[:, None] * side + numpy.arange(side - 1)[None, :]).ravel()
    indices = numpy.stack([corner, corner + side, corner + 1, corner + 1, corner + side,
                           corner + side + 1], axis=-1).astype(numpy.uint32)
    return positions, normals, numpy.stack([x, z], axis=-1), indices


def side_for(megabytes, meshes):
    return int(numpy.ceil((megabytes * 1e6 / meshes / 56) ** 0.5)) + 1


class Builder:
    def __init__(self):
        self.doc = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [],
                    "meshes": [], "accessors": [], "bufferViews": [],
                    "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}]}
        self.parts, self.size = [], 0

    def accessor(self, array, kind, component):
        data = array.tobytes()
        self.doc["bufferViews"].append({"buffer": 0, "byteOffset": self.size, "byteLength": len(data)})
        entry = {"bufferView": len(self.doc["bufferViews"]) - 1, "componentType": component,
                 "count": array.size // {"VEC3": 3, "VEC2": 2, "SCALAR": 1}[kind], "type": kind}
        if kind == "VEC3":
            flat = array.reshape(-1, 3)
            entry["min"], entry["max"] = flat.min(0).tolist(), flat.max(0).tolist()
        self.doc["accessors"].append(entry)
        self.parts.append(data)
        self.size += len(data)
        return len(self.doc["accessors"]) - 1

    def add_sheet(self, side, seed):
        positions, normals, uv, indices = sheet(side, seed)
        self.doc["meshes"].append({"primitives": [{
            "attributes": {"POSITION": self.accessor(positions, "VEC3", 5126),
                           "NORMAL": self.accessor(normals, "VEC3", 5126),
                           "TEXCOORD_0": self.accessor(uv, "VEC2", 5126)},
            "indices": self.accessor(indices.ravel(), "SCALAR", 5125)}]})
        self.add_node({"mesh": len(self.doc["meshes"]) - 1})

    def add_node(self, node):
        self.doc["nodes"].append(node)
        self.doc["scenes"][0]["nodes"].append(len(self.doc["nodes"]) - 1)

    def dumps(self):
        self.doc["buffers"] = [{"byteLength": self.size}]
        text = json.dumps(self.doc).encode()
        text += b" " * (-len(text) % 4)
        head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + self.size)
        return b"".join([head, struct.pack("<I4s", len(text), b"JSON"), text,
                         struct.pack("<I4s", self.size, b"BIN\0"), *self.parts])


def make_scene(megabytes, meshes, seed):
    """A .glb of at least so many megabytes; another one for another seed."""
    built = Builder()
    for mesh in range(meshes):
        built.add_sheet(side_for(megabytes, meshes), 1000 * seed + mesh)
    built.add_node({"camera": 0, "translation": [0.5, 1, 2.5],
                    "rotation": [-0.17, 0, 0, 0.985]})
    return built.dumps()


# --- what the daemon says -------------------------------------------------------------------------


def parse_stalls(text, name):
    """(counts behind each upper end in milliseconds, the longest of late in milliseconds)."""
    ends = {float(end) * 1e3: float(count) for end, count in
            re.findall(rf'^bounced_{name}_seconds_bucket{{le="([^"]+)"}} (\S+)$', text, re.M)}
    longest = re.search(rf"^bounced_{name}_seconds_max (\S+)$", text, re.M)
    return ends, float(longest[1]) * 1e3


def difference(before, after):
    """Of one phase: how many stalls were longer than each level, and the longest, exactly where it was
    the longest of late and else not above the end of its bucket."""
    (counts0, longest0), (counts1, longest1) = before, after
    new = {end: counts1[end] - counts0[end] for end in counts1}
    total = new[float("inf")]
    row = {f"over_{level}_ms": int(total - new[float(level)]) for level in LEVELS_MS}
    bound = min((end for end, count in new.items() if count == total), default=0) if total else 0
    row["longest_ms"] = round(longest1, 2) if longest1 > longest0 else min(bound, round(longest1, 2))
    return row


class Daemon:
    def __init__(self, program, folder, device):
        self.socket_path = f"{folder}/s.sock"
        self.log = pathlib.Path(folder) / "log"
        words = [program, "--http", "127.0.0.1:0", "--listen", "unix:" + self.socket_path, "--data",
                 f"{folder}/data", *(["--device", device] if device else [])]
        self.process = subprocess.Popen(words, stderr=open(self.log, "wb"))
        while not (port := re.search(r"http://127\.0\.0\.1:(\d+)", self.log.read_text())):
            if self.process.poll() is not None:
                raise SystemExit(self.log.read_text())
            time.sleep(0.05)
        self.port = int(port[1])

    def request(self, method, path, body=None, media="application/json"):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=600)
        connection.request(method, path, body, {"Content-Type": media})
        response = connection.getresponse()
        data = response.read()
        connection.close()
        if response.status >= 300:
            raise SystemExit(f"{method} {path}: {response.status} {data[:300]!r}")
        return data

    def stalls(self):
        text = self.request("GET", "/metrics").decode()
        return {name: parse_stalls(text, name) for name in SERIES}

    def stop(self):
        self.process.terminate()
        self.process.wait(60)


class View(threading.Thread):
    """A client that looks at another scene, and moves on with every frame."""

    def __init__(self, bounced, daemon):
        super().__init__(daemon=True)
        self.client = bounced.connect("unix:" + daemon.socket_path)
        self.scene = self.client.scenes.add(str(VIEW_SCENE))
        self.bounced, self.times, self.is_over, self.fault = bounced, [], False, None

    def run(self):
        try:
            self._run()
        except Exception as fault:  # told by check
            self.fault = fault

    def check(self):
        """Whether it looks on; the reason if it does not."""
        if not self.is_alive():
            raise self.fault or RuntimeError("the view ended by itself")

    def _run(self):
        with self.scene.view(size=VIEW_SIZE, encoding="jpeg", technique="rsm") as view:
            for number, _ in enumerate(view):
                self.times.append(time.monotonic())
                if self.is_over:
                    return
                view.update(pose=self.bounced.Pose(eye=(0.3 * (number % 10) / 10, 1, 3.2), target=(0, 1, 0)))

    def stop(self):
        self.is_over = True
        self.join(60)
        self.client.close()


# --- phases ---------------------------------------------------------------------------------------


def phase(daemon, view, name, work, settle_s=0.0):
    before, start_s = daemon.stalls(), time.monotonic()
    work()
    took_s = time.monotonic() - start_s
    time.sleep(settle_s)
    after, end_s = daemon.stalls(), time.monotonic()
    times = [t for t in list(view.times) if start_s <= t <= end_s]
    gaps_ms = [1e3 * (b - a) for a, b in zip(times, times[1:])]
    row = {"phase": name, "seconds": round(took_s, 2), "view_frames": len(times),
           "view_gap_ms_max": round(max(gaps_ms), 1) if gaps_ms else None}
    for name in SERIES:
        row[name] = difference(before[name], after[name])
    by_hand.say(json.dumps(row))
    return row


def send(bounced, daemon, face, data, folder):
    """The scene's id, once it is durable."""
    if face == "framed":
        path = pathlib.Path(folder) / "large.glb"
        path.write_bytes(data)
        with bounced.connect("unix:" + daemon.socket_path, timeout_s=600) as client:
            return client.scenes.add(str(path), name="large").id
    blob = bounced.files.blob_name(data)
    daemon.request("PUT", "/v1/blobs/" + blob, data, "application/octet-stream")
    reply = daemon.request("POST", "/v1/scenes", json.dumps({"blob": blob, "name": "large"}))
    return json.loads(reply)["id"]


class Watched:
    """A daemon with a view on it, warm."""

    def __init__(self, bounced, options, folder):
        self.daemon = Daemon(os.environ["BOUNCED"], folder, options.device)
        try:
            self.view = View(bounced, self.daemon)
            self.view.start()
            self._warm()
        except BaseException:
            self.daemon.stop()
            raise

    def _warm(self):
        """Until shaders are compiled."""
        while len(self.view.times) < WARM_FRAMES:
            self.view.check()
            time.sleep(0.1)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.view.stop()
        self.daemon.stop()

    def phase(self, name, work):
        row = phase(self.daemon, self.view, name, work, settle_s=1.0)
        self.view.check()
        return row


def measure(bounced, options, face, seed):
    data = make_scene(options.megabytes, options.meshes, seed)
    move = json.dumps({"ops": [{"set_transform": {"node": 0, "translation": [0, 0.1, 0]}}]})
    scene, rows = [], []
    with tempfile.TemporaryDirectory() as folder:
        with Watched(bounced, options, folder) as on:
            ask = on.daemon.request
            rows = [
                on.phase("view alone", lambda: time.sleep(5)),
                on.phase("upload and import",
                         lambda: scene.append("/v1/scenes/" + send(bounced, on.daemon, face, data, folder))),
                on.phase("edit", lambda: ask("POST", scene[0] + "/edits", move)),
                on.phase("first frame", lambda: ask("GET", scene[0] + "/frame.png?size=64x64&technique=direct")),
            ]
        # The imports that are kept hold the scene too: a new daemon's last reference is the store's.
        with Watched(bounced, options, folder) as on:
            rows.append(on.phase("remove, after a restart", lambda: on.daemon.request("DELETE", scene[0])))
    return len(data), [{"face": face, **row} for row in rows]


def markdown(rows):
    lines = ["| face | phase | s | loop deaf: longest, over 50 ms | loop's own work: longest | render thread deaf: "
             "longest, over 50 ms | view: frames, longest gap |", "|---|---|---|---|---|---|---|"]
    for row in rows:
        loop, work, render = (row[name] for name in SERIES)
        gap = row["view_gap_ms_max"]
        lines.append(f"| {row['face']} | {row['phase']} | {row['seconds']:.1f} | {loop['longest_ms']:.0f} ms, "
                     f"{loop['over_50_ms']} | {work['longest_ms']:.0f} ms | {render['longest_ms']:.0f} ms, "
                     f"{render['over_50_ms']} | {row['view_frames']}{'' if gap is None else f', {gap:.0f} ms'} |")
    return "\n".join(lines)


def main(words):
    parser = by_hand.parser(__doc__, has_scenes=False)
    parser.add_argument("--megabytes", type=by_hand.count, default=100)
    parser.add_argument("--meshes", type=by_hand.count, default=20)
    parser.add_argument("--device", default=os.environ.get("BD_DEVICE"))
    options = live.parse(parser, words)
    if side_for(options.megabytes, options.meshes) > SIDE_MAX:
        parser.error("more megabytes than so many meshes hold: --meshes")
    bounced = live.package(options.build)
    machine, rows, scene_bytes = live.machine(options.build), [], 0
    for seed, face in enumerate(FACES):
        scene_bytes, more = measure(bounced, options, face, seed)
        rows += more
    print(markdown(rows))
    by_hand.write({"machine": machine, "command":
        f"import_stall.py BUILD --megabytes {options.megabytes} --meshes {options.meshes}" +
        (f" --device {options.device}" if options.device else ""), "scene_bytes": scene_bytes,
        "meshes": options.meshes, "goal_ms": GOAL_MS, "rows": rows}, options.output)


if __name__ == "__main__":
    main(sys.argv[1:])
