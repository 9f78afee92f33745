"""A sky that is turned, and the next picture: from the edit to its pixels.

usage: turned_sky.py BUILD_DIR SCENES_DIR SKIES_DIR -o RESULT.json [--turns 25]

256x256, the edit sends a quaternion alone. Milliseconds: median and 95th percentile of edit and frame together, what the passes of the last took.
"""
import math
import pathlib
import sys
import time

import numpy

import by_hand
import live

CASES = (("suzanne", "studio"), ("suzanne", "sky"), ("garden", "sunset"))
TECHNIQUES = ("direct", "multires_gather")
SIZE = (256, 256)


def turn(scene, technique, radians):
    begin = time.monotonic()
    with scene.edit() as edit:
        edit.set_environment(rotation=(0, math.sin(radians / 2), 0, math.cos(radians / 2)))
    report = scene.render(size=SIZE, technique=technique).report
    return (time.monotonic() - begin) * 1e3, report


def row_of(scene, names, technique, turns):
    scene.render(size=SIZE, technique=technique)
    took = [turn(scene, technique, 0.05 * (i + 1)) for i in range(turns)]
    ms = [one for one, _ in took]
    ran = {p["name"]: round(p.get("ms") or 0, 1) for p in took[-1][1]["passes"] if p["state"] == "ran"}
    return {"scene": names[0], "sky": names[1], "technique": technique, "p50_ms": round(float(numpy.median(ms)), 1),
            "p95_ms": round(float(numpy.percentile(ms, 95)), 1), "passes_ms": ran}


def main(words=None):
    made = by_hand.parser(__doc__)
    made.add_argument("skies", metavar="SKIES_DIR", type=pathlib.Path)
    made.add_argument("--turns", type=by_hand.count, default=25)
    options = by_hand.parse(made, words, names=[scene for scene, _ in CASES])
    bounced = live.package(options.build)
    result = {"command": "turned_sky.py BUILD SCENES SKIES -o RESULT", "machine": live.machine(options.build), "turns": options.turns, "rows": []}
    with bounced.private() as daemon:
        for names in CASES:
            sky = bounced.Environment(map=options.skies / f"{names[1]}.exr")
            scene = daemon.scenes.add(options.scenes / f"{names[0]}.glb", environment=sky)
            for technique in TECHNIQUES:
                result["rows"].append(row_of(scene, names, technique, options.turns))
                by_hand.say(str(result["rows"][-1]))
            scene.remove()
    by_hand.write(result, options.output)


if __name__ == "__main__":
    sys.exit(main())
