"""The first frame of a dropped file: from its first byte to a viewer's first picture.

usage: first_frame.py BUILD_DIR -o RESULT.json [--runs 5]

A made-up room with 82,000 triangles, 16 textures of 1024 x 1024 (JPEG), a lamp and a camera, another one for each run, is given to a
daemon on the software device; a view of 640x360 by `auto` is opened when the daemon has named the scene, and its first frame (JPEG) ends
the time. `cold`: a daemon that was just started, whose driver has compiled nothing; `new`: just started, the driver's cache is full;
`warm`: a daemon that has rendered the one before. Medians, and what of them was upload and import, and the frame's own report.
"""
import io
import pathlib
import statistics
import sys
import tempfile
import time

import numpy
from PIL import Image

import by_hand
import live

sys.path.insert(0, str(by_hand.ROOT / "clients"))
from harness import gltf, shapes  # noqa: E402

SIZE, RUNS = (640, 360), 5
GOAL_S = {"cold": 2, "new": 2, "warm": 1}
TEXTURES, SIDE, BALLS, BALL_TRIANGLES = 16, 1024, 4, 20480


def jpeg(number):
    """A texture that no other has: coloured waves with grain."""
    random = numpy.random.default_rng(number)
    x, y = numpy.meshgrid(*[numpy.linspace(0, 1, SIDE)] * 2)
    colours = [.5 + .4 * numpy.sin(2 * numpy.pi * (a * x + b * y)) for a, b in random.integers(1, 9, (3, 2))]
    grain = random.integers(0, 24, (SIDE, SIDE, 1))
    out = io.BytesIO()
    Image.fromarray((220 * numpy.stack(colours, -1) + grain).clip(0, 255).astype(numpy.uint8)).save(out, "JPEG", quality=90)
    return out.getvalue()


class Writer(gltf.Writer):
    def material_of_jpeg(self, data):
        image = self._append("images", {"bufferView": self.view(data), "mimeType": "image/jpeg"})
        texture = self._append("textures", {"source": image})
        return self.material(f"texture {texture}", roughness=.8, pbr={"baseColorTexture": {"index": texture}})


def add_shape(w, name, shape, material, offset=(0, 0, 0)):
    positions, normals, indices, uv = shape
    flat = uv if uv is not None else numpy.stack([numpy.arctan2(positions[:, 0], positions[:, 2]) / 6.2831853 + .5, normals[:, 1]], -1)
    w.node(name, mesh=w.mesh(name, positions, normals, indices, material, flat), translation=list(offset))


def room(run):
    w = Writer()
    materials = [w.material_of_jpeg(jpeg(TEXTURES * run + i)) for i in range(TEXTURES)]
    walls = [((0, -2, 0), (4, 0, 0), (0, 0, -4)), ((0, 2, 0), (4, 0, 0), (0, 0, 4)), ((-4, 0, 0), (0, 0, -4), (0, 2, 0)),
             ((4, 0, 0), (0, 0, 4), (0, 2, 0)), ((0, 0, -4), (4, 0, 0), (0, 2, 0)), ((0, 0, 4), (-4, 0, 0), (0, 2, 0))]
    for i, wall in enumerate(walls):
        add_shape(w, f"wall {i}", shapes.quad(*wall), materials[i])
    for i in range(BALLS):
        points, faces = shapes.icosphere(BALL_TRIANGLES)
        add_shape(w, f"ball {i}", (points, points, faces, None), materials[len(walls) + i], (1.6 * (i - 1.5), -1 + .3 * (i % 2), -1.5 + .7 * (i % 3)))
    for i in range(len(walls) + BALLS, TEXTURES):
        add_shape(w, f"shelf {i}", shapes.quad((0, -1.5 + .4 * (i - 11), -3.9), (2, 0, 0), (0, .15, 0)), materials[i])
    w.light("lamp", "point", 60, position=(.5, 1.4, .5))
    w.camera("camera", (0, .2, 3.7), (0, -.12, -1), yfov=.9)
    return w.glb()


def first_frame(bounced, url, path):
    with bounced.connect(url) as client:
        began = time.monotonic()
        scene = client.scenes.add(path)
        there = time.monotonic()
        with scene.view(size=SIZE) as view:
            frame = view.next(120)
        ended = time.monotonic()
        triangles = scene.info()["counts"]["triangles"]
    report = frame.report
    return {"s": ended - began, "import_s": there - began, "frame_ms": report["time_ms"]["total"], "compile_ms": report["time_ms"].get("compile", 0),
            "load_ms": report["time_ms"].get("load", 0), "technique": report["technique"], "triangles": triangles}


def runs_of(options, kind, folder):
    """One after the other, of rooms that nobody has seen."""
    bounced, seen = live.package(options.build), []
    for run in range(options.runs):
        caches = folder / ("caches" if kind == "new" else f"caches {kind} {run}")
        path = folder / f"{kind}{run}.glb"
        path.write_bytes(room(len(seen) + 100 * sorted(GOAL_S).index(kind)))
        with live.daemon(options.build, env={"MESA_SHADER_CACHE_DIR": str(caches)}.items()) as daemon:
            if kind == "warm" or (kind == "new" and run == 0):
                other = folder / "other.glb"
                other.write_bytes(room(1000 + run))
                first_frame(bounced, daemon.url, other)
            if kind == "new" and run == 0:
                daemon.restart()
            seen.append(first_frame(bounced, daemon.url, path))
    return seen


def main(words=None):
    made = by_hand.parser(__doc__, has_scenes=False)
    made.add_argument("--runs", type=by_hand.count, default=RUNS)
    options = by_hand.parse(made, words)
    result = {"command": f"first_frame.py BUILD -o RESULT --runs {options.runs}", "machine": live.machine(options.build), "rows": []}
    with tempfile.TemporaryDirectory() as folder:
        for kind in ("cold", "new", "warm"):
            seen = runs_of(options, kind, pathlib.Path(folder))
            medians = {key: round(statistics.median(one[key] for one in seen), 3) for key in ("s", "import_s", "frame_ms", "compile_ms", "load_ms")}
            result["rows"].append({"daemon": kind, "goal_s_on_usual_machine": GOAL_S[kind], **medians, "technique": seen[0]["technique"], "triangles": seen[0]["triangles"]})
            by_hand.say(str(result["rows"][-1]))
    by_hand.write(result, options.output)


if __name__ == "__main__":
    sys.exit(main())
