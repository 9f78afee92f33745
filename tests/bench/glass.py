"""Figures of glass in `many_light`: how far a picture is off the reference, and at what price, by rung and with caustics off.

usage: glass.py BUILD_DIR SCENES_DIR -o RESULT.json [--scenes NAME,NAME] [--side N] [--spp N] [--lamp-radius M]

`off_percent`: mean over the picture of |x / (x + m) - t / (t + m)| in hundredths, m the truth's mean: a point's caustic in a
reference is few bright pixels, whose squares say nothing of the others. `mean`: of the picture by the truth's. The truth leaves
out what glass shows of a point's caustic, and what such sends on through glass; with --lamp-radius punctual lights are balls of so
many metres in it, which brings that, with noise.
"""
import sys

import numpy

import by_hand
import live
import many_light

SCENES = ("glass_sphere_box",)
RUNGS = (0, 1, 2, 3)


def luminance(frame):
    return many_light.picture(frame, "beauty").astype(float).mean(2)


def off_percent(picture, truth):
    mean = truth.mean()
    return round(100 * float(numpy.abs(picture / (picture + mean) - truth / (truth + mean)).mean()), 2)


def rows_of(client, scene, options):
    size = (options.side,) * 2
    asked = {"spp": options.spp, **({"lamp_radius": options.lamp_radius} if options.lamp_radius else {})}
    truth = luminance(scene.render(size=size, technique="reference", layers=["beauty"], parameters=asked))
    ladder = next(t for t in client.techniques() if t["name"] == "many_light")["ladder"]
    settings = [(f"rung {rung}", dict(pair.split("=") for pair in ladder[rung].split())) for rung in RUNGS]
    for name, parameters in [*settings, ("caustics=off", {"caustics": "off"})]:
        frame = scene.render(size=size, technique="many_light", layers=["beauty"], fresh="all", aa=4, parameters=parameters)
        picture = luminance(frame)
        passes = {p["name"]: round(p["ms"], 1) for p in frame.report["passes"] if p["name"] in ("light_paths", "far", "gloss", "caustics")}
        yield {"settings": name, "off_percent": off_percent(picture, truth), "mean": round(float(picture.mean() / truth.mean()), 4),
               "ms": round(sum(p.get("ms") or 0 for p in frame.report["passes"] if p["name"] not in many_light.NOT_TIMED), 1), "passes_ms": passes}


def main(words=None):
    made = by_hand.parser(__doc__)
    by_hand.add_names(made, SCENES)
    made.add_argument("--side", type=by_hand.count, default=192)
    made.add_argument("--spp", type=by_hand.count, default=1024)
    made.add_argument("--lamp-radius", type=float, default=0)
    options = by_hand.parse(made, words, names=SCENES)
    result = {"command": f"glass.py BUILD SCENES -o RESULT --scenes {','.join(options.names)} --side {options.side} --spp {options.spp} --lamp-radius {options.lamp_radius}",
              "machine": live.machine(options.build), "rows": []}
    with live.package(options.build).private() as client:
        for name in options.names:
            for row in rows_of(client, client.scenes.add(options.scenes / f"{name}.glb"), options):
                result["rows"].append({"scene": name, **row})
                by_hand.say(result["rows"][-1])
    by_hand.write(result, options.output)


if __name__ == "__main__":
    sys.exit(main())
