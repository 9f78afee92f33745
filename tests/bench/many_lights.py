"""Error of references against samples, where lights are many and where they are few.

usage: many_lights.py BUILD SCENE... -o RESULT.json [--before BUILD] [--size 96x96] [--samples 8,32,128]

To the scenes come corridors of 36 m made here: one panel; 120 panels and 40 spots; 120 spheres and
as many spots. The error is the root mean square of the noise of direct light and of beauty, by the two halves'
difference, over the mean. --before: an earlier build, for its figures beside.
"""
import argparse
import json
import os
import tempfile
import time
from pathlib import Path

from harness.bench.rungs import noise
from harness.bench.store import machine
from harness.daemon import Daemon
from harness.gltf import Writer
from harness.shapes import add, box, icosphere, quad


def corridor(lamps, spots, spheres):
    w = Writer()
    w.extensions.add("KHR_materials_emissive_strength")
    white = w.material("white", (.7, .7, .7))
    glow = w.material("glow", (.5, .5, .5), emissiveFactor=[1, 1, 1],
                      extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 2000}})
    for center, u, v in (((0, 0, -18), (1.5, 0, 0), (0, 0, -18)), ((0, 3, -18), (1.5, 0, 0), (0, 0, 18)),
                         ((-1.5, 1.5, -18), (0, 0, -18), (0, 1.5, 0)), ((1.5, 1.5, -18), (0, 0, 18), (0, 1.5, 0)),
                         ((0, 1.5, -36), (1.5, 0, 0), (0, 1.5, 0)), ((0, 1.5, 0), (-1.5, 0, 0), (0, 1.5, 0))):
        add(w, "wall", quad(center, u, v), white)
    for i in range(6):
        add(w, "pillar", box((.2, 1.5, .2)), white, translation=[1.15 if i % 2 else -1.15, 1.5, -5.5 - 5.5 * i])
    points, faces = icosphere(20)
    ball = (points * .07, points, faces, None)
    lamp = ball if spheres else quad((0, 0, 0), (.1, 0, 0), (0, 0, .05))
    places = [(.3, -12)] if lamps == 1 else [(.7 if i % 2 else -.7, -.5 - i // 2 * 35 / (lamps // 2 - 1))
                                             for i in range(lamps)]
    for x, z in places:
        add(w, "lamp", lamp, glow, translation=[x, 2.8 if spheres else 2.9, z])
    for i in range(spots):
        side = 1 if i % 2 else -1
        w.light(f"spot{i}", "spot", 60, (1.3 * side, 2.6, -1 - 34 * i / spots), (-side, -1.5, .3),
                cone=(.1745, .5236))
    w.camera("Camera", (.2, 1.6, -.3), (-.2, -.3, -9.7), yfov=1.1)
    return w


CORRIDORS = {"corridor_one": (1, 0, False), "corridor_panels": (120, 40, False),
             "corridor_spheres": (120, 40, True)}


def measured(daemon, scene, spp, size):
    start = time.monotonic()
    frame = daemon.render(scene, "reference", {"spp": spp}, size=size, seed=9,
                          layers=("beauty", "direct", "halves"), timeout_s=500)
    seconds = time.monotonic() - start
    return {"direct": round(noise(frame.planes, "direct") or 0, 5), "beauty": round(noise(frame.planes, "beauty"), 5),
            "seconds": round(seconds, 2)}


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("build", type=lambda text: Path(text).resolve())
    parser.add_argument("scenes", nargs="*", type=Path)
    parser.add_argument("-o", "--out", required=True, type=Path)
    parser.add_argument("--before", type=lambda text: Path(text).resolve())
    parser.add_argument("--size", default="96x96")
    parser.add_argument("--samples", default="8,32,128")
    options = parser.parse_args()
    size = tuple(int(side) for side in options.size.split("x"))
    os.environ["BOUNCE"] = str(options.build / "clients/cli/bounce")
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        scenes = list(options.scenes)
        for name, what in CORRIDORS.items():
            scenes.append(Path(folder) / f"{name}.glb")
            corridor(*what).write_glb(scenes[-1])
        for name, build in (("before", options.before), ("now", options.build)):
            if not build:
                continue
            os.environ["BOUNCED"] = str(build / "server/bounced")
            with Daemon() as daemon:
                for scene in scenes:
                    for spp in options.samples.split(","):
                        rows.append({"scene": scene.stem, "code": name, "spp": int(spp),
                                     **measured(daemon, scene, int(spp), size)})
                        print(json.dumps(rows[-1]), flush=True)
    result = {"machine": machine(), "command": f"many_lights.py BUILD SCENES/... --before BUILD --size {options.size} "
              f"--samples {options.samples} -o RESULT.json", "rows": rows}
    options.out.write_text(json.dumps(result, indent=1) + "\n")


main()
