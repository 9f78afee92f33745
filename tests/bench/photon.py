"""Figures of `photon`: how far its indirect light is off the reference, and at what price, by rung, by how many photons there are, and
with environment maps instead of triangles, ours and as printed; and what four times the pixels take (algorithms.md B5).

usage: photon.py BUILD_DIR SCENES_DIR -o RESULT.json [--scenes NAME,NAME] [--side N] [--spp N]

`off_percent`: mean over the picture of |x / (x + m) - t / (t + m)| in hundredths, m the truth's mean: a caustic in a reference is few
bright pixels, whose squares say nothing of the others. `mean`: of the picture's indirect light by the truth's. `photons_per_s`: that
set out, by the time of the pass. `pixels_times`: of a picture with four times the pixels, the technique's passes by those of this one.
"""
import sys

import numpy

import by_hand
import live
import many_light

SCENES = ("cornell_box", "cornell_box_spot_side", "glass_sphere_box", "sponza_dabrovic")
IMAGES = {"intersections": "images"}
COUNTS = (1 << 13, 1 << 15, 1 << 17, 1 << 19)
PASSES = ("env_maps", "photons", "density", "upsample", "caustics", "gloss", "filter")


def luminance(frame):
    return many_light.picture(frame, "indirect")[..., :3].astype(float).mean(2)


def off_percent(picture, truth):
    mean = truth.mean()
    return round(100 * float(numpy.abs(picture / (picture + mean) - truth / (truth + mean)).mean()), 2)


def settings(client):
    ladder = next(t for t in client.techniques() if t["name"] == "photon")["ladder"]
    for rung, words in enumerate(ladder):
        yield f"rung {rung}", dict(pair.split("=") for pair in words.split())
    for count in COUNTS:
        yield f"photons={count}", {"photons": count, "finest": 1, "depth_threshold": 0, "normal_threshold": 0}
    yield "images", IMAGES
    yield "images, 16 of 512 texels", {**IMAGES, "env_maps": 16, "env_map_size": 512}
    yield "paper_mode", {"paper_mode": 1, "light_rays": 16}


def passes_of(frame):
    return {p["name"]: round(p["ms"], 1) for p in frame.report["passes"] if p["name"] in PASSES and p.get("ms")}


def rendered(scene, side, parameters, technique="photon"):
    return scene.render(size=(side, side), technique=technique, layers=["indirect"], fresh="all", aa=1, parameters=parameters)


def row_of(name, frame, truth, parameters):
    picture, passes = luminance(frame), passes_of(frame)
    row = {"settings": name, "off_percent": off_percent(picture, truth), "mean": round(float(picture.mean() / truth.mean()), 4),
           "ms": round(sum(p.get("ms") or 0 for p in frame.report["passes"] if p["name"] not in many_light.NOT_TIMED), 1), "passes_ms": passes}
    if "photons" in passes:
        row["photons_per_s"] = round(1000 * int(parameters.get("photons", 1 << 17)) / passes["photons"])
    lost = [flag for flag in frame.report.get("flags", []) if flag.startswith("photons_lost")]
    return {**row, **({"flag": lost[0]} if lost else {})}


def rows_of(client, scene, options):
    truth = luminance(scene.render(size=(options.side,) * 2, technique="reference", layers=["indirect"], parameters={"spp": options.spp}))
    for name, parameters in settings(client):
        frame = rendered(scene, options.side, parameters)
        row = row_of(name, frame, truth, parameters)
        if name == "rung 1":
            larger = passes_of(rendered(scene, 2 * options.side, parameters))
            row["pixels_times"] = round(sum(larger.values()) / sum(passes_of(frame).values()), 2)
        yield row
    yield row_of("many_light", rendered(scene, options.side, {}, "many_light"), truth, {})


def main(words=None):
    made = by_hand.parser(__doc__)
    by_hand.add_names(made, SCENES)
    made.add_argument("--side", type=by_hand.count, default=192)
    made.add_argument("--spp", type=by_hand.count, default=512)
    options = by_hand.parse(made, words, names=SCENES)
    result = {"command": f"photon.py BUILD SCENES -o RESULT --scenes {','.join(options.names)} --side {options.side} --spp {options.spp}",
              "machine": live.machine(options.build), "rows": []}
    with live.package(options.build).private() as client:
        for name in options.names:
            for row in rows_of(client, client.scenes.add(options.scenes / f"{name}.glb"), options):
                result["rows"].append({"scene": name, **row})
                by_hand.say(result["rows"][-1])
    by_hand.write(result, options.output)


if __name__ == "__main__":
    sys.exit(main())
