"""Rays that choose among many virtual lights: what choosing takes, and the noise that is left.

usage: many_vpls.py BUILD_DIR SCENES_DIR -o RESULT.json [--vpls 1024,2048,8192,32768] [--before BUILD_DIR]

`rsm`, 16 rays, Lambert. Milliseconds of `weigh` and `choose` at 256x192, medians of five; relative RMSE against a ray to
every virtual light at 128x96, mean of four seeds, as rays leave it and filtered, per cent. `--before`: an earlier build's, in turns.
"""
import os
import pathlib
import sys

import numpy

import by_hand
import live

SCENES = ("cornell_box_spot_side", "sponza_dabrovic")
RUNS, SEEDS = 5, 4
PASSES = ("weigh", "choose", "visibility", "vpl_order")
NOISE_SIZE, TIME_SIZE = (128, 96), (256, 192)
ALL = 1 << 20


def frame(scene, size, **parameters):
    seed = parameters.pop("seed", 0)
    return scene.render(size=size, technique="rsm", layers=["indirect"], fresh="all", seed=seed,
                        parameters={"brdf": "lambert", "indirect_visibility": "rays", **parameters})


def times_of(scene, vpls):
    reports = [frame(scene, TIME_SIZE, vpls=vpls).report for _ in range(RUNS + 1)][1:]
    took = {name: [sum(p.get("ms") or 0 for p in report["passes"] if p["name"] == name) for report in reports] for name in PASSES}
    return {f"{name}_ms": round(float(numpy.median(took[name])), 1) for name in PASSES}


def noise_of(scene, vpls, truth, words):
    off = [numpy.sqrt(((frame(scene, NOISE_SIZE, vpls=vpls, seed=seed, noise_filter=words).layers["indirect"].astype(float) - truth) ** 2).mean())
           for seed in range(SEEDS)]
    return round(100 * float(numpy.mean(off) / truth.mean()), 2)


def row_of(scene, name, vpls):
    truth = frame(scene, NOISE_SIZE, vpls=vpls, rays=ALL).layers["indirect"].astype(float)
    return {"scene": name, "vpls": vpls, **times_of(scene, vpls), "noise_percent": noise_of(scene, vpls, truth, "off"),
            "filtered_percent": noise_of(scene, vpls, truth, "on")}


def main(words=None):
    made = by_hand.parser(__doc__)
    made.add_argument("--vpls", type=lambda text: [int(word) for word in text.split(",")], default=[1024, 2048, 8192, 32768])
    made.add_argument("--before", type=pathlib.Path)
    options = by_hand.parse(made, words, names=SCENES)
    result = {"command": "many_vpls.py BUILD SCENES -o RESULT", "machine": live.machine(options.build), "rows": []}
    bounced = live.package(options.build)
    builds = {"now": options.build, **({"before": options.before.resolve()} if options.before else {})}
    for when, build in builds.items():
        os.environ["BOUNCED"] = str(build / by_hand.PROGRAMS["BOUNCED"])
        with bounced.private() as daemon:
            for name in SCENES:
                scene = daemon.scenes.add(options.scenes / f"{name}.glb")
                for vpls in options.vpls:
                    result["rows"].append({"build": when, **row_of(scene, name, vpls)})
                    by_hand.say(str(result["rows"][-1]))
    by_hand.write(result, options.output)


if __name__ == "__main__":
    sys.exit(main())
