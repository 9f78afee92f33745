"""`auto` beside every fixed choice: what it takes, and what the cheapest fixed settings with at most its error take; with a budget
its error, and the least of fixed settings that take no longer than that.

usage: auto_choice.py BUILD_DIR SCENES_DIR -o RESULT.json [--scenes NAME,NAME] [--sizes WxH,WxH] [--budgets MS,MS] [--truths FOLDER]

A fixed choice is a technique and a rung of its ladder (`reference`: with its noise filtered). Relative RMSE of beauty against the
reference, by pixel, the truth's own noise taken out by its two halves; milliseconds of rendering of a new frame, light and camera side
anew, the structure of rays, readback and encoding left out; medians and means of three seeds. `auto` by itself, whose time is that of all
frames that it rendered, and with each budget.
"""
import pathlib
import sys

import numpy

import by_hand
import live
import many_light

SCENES = ("cornell_box", "cornell_box_spot_side", "sponza_dabrovic", "teapot_box")
FIXED = {"many_light": ({}, 5), "multires_gather": ({"indirect_visibility": "rays"}, 5), "hisr": ({"indirect_visibility": "rays"}, 4),
         "direct": ({}, 1), "reference": ({"noise_filter": "on", "alpha": "mask"}, 5)}
SEEDS = 3
ONCE = ("compile", "load", "readback", "check", "encode")


def milliseconds(frame):
    """Of rendering: the report's total counts all frames of a job, its passes those of the last."""
    times = frame.report["time_ms"]
    structure = sum(p.get("ms") or 0 for p in frame.report["passes"] if p["name"] == "bvh")
    return times["total"] - sum(times.get(name, 0) for name in ONCE) - structure


def measured(scene, size, truth, **asked):
    frames = [scene.render(size=size, layers=["beauty"], fresh="all", seed=seed, **asked) for seed in range(SEEDS)]
    error = numpy.mean([many_light.error_percent(many_light.picture(frame, "beauty"), truth) for frame in frames])
    return frames[0].report, {"ms": round(float(numpy.median([milliseconds(frame) for frame in frames])), 1), "beauty_percent": round(float(error), 2)}


def fixed_rows(scene, size, truth, ladders):
    for technique, (given, count) in FIXED.items():
        for rung in ladders[technique][:count]:
            parameters = {**given, **dict(word.split("=") for word in rung.split())}
            _, row = measured(scene, size, truth, technique=technique, parameters=parameters)
            yield {"technique": technique, "settings": rung, **row}


def auto_row(scene, size, truth, fixed, **asked):
    report, row = measured(scene, size, truth, technique="auto", **asked)
    said = {**asked, **row, "own_estimate_percent": round(100 * report.get("own_estimate", 0), 2), "technique": report["technique"],
            "rays": report["parameters"].get("rays")}
    if "budget_ms" in asked:
        in_time = [one for one in fixed if one["ms"] <= asked["budget_ms"]]
        best = min(in_time, key=lambda one: one["beauty_percent"], default=None)
        return {**said, "best_fixed": best, "times_its_error": round(row["beauty_percent"] / best["beauty_percent"], 2) if best else None}
    as_good = [one for one in fixed if one["beauty_percent"] <= row["beauty_percent"] * 1.02]
    best = min(as_good, key=lambda one: one["ms"], default=None)
    return {**said, "best_fixed": best, "times_its_ms": round(row["ms"] / best["ms"], 2) if best else None}


def main(words=None):
    made = by_hand.parser(__doc__)
    by_hand.add_names(made, SCENES)
    made.add_argument("--sizes", default="256x192,512x384")
    made.add_argument("--budgets", default="300,1200")
    made.add_argument("--truths", type=pathlib.Path)
    options = by_hand.parse(made, words, names=SCENES)
    result = {"command": f"auto_choice.py BUILD SCENES -o RESULT --scenes {','.join(options.names)} --sizes {options.sizes} --budgets {options.budgets}",
              "machine": live.machine(options.build), "rows": []}
    with live.package(options.build).private() as daemon:
        ladders = {one["name"]: one["ladder"] for one in daemon.techniques()}
        for name in options.names:
            scene = daemon.scenes.add(options.scenes / f"{name}.glb")
            for size in (tuple(int(side) for side in text.split("x")) for text in options.sizes.split(",")):
                truth = many_light.truth_of(scene, name, size, "full", options.truths)["beauty"]
                fixed = list(fixed_rows(scene, size, truth, ladders))
                asked = [{}] + [{"budget_ms": int(ms)} for ms in options.budgets.split(",") if ms]
                row = {"scene": name, "size": f"{size[0]}x{size[1]}", "auto": [auto_row(scene, size, truth, fixed, **one) for one in asked], "fixed": fixed}
                result["rows"].append(row)
                for one in row["auto"]:
                    by_hand.say(f"{name} {row['size']}: {one}")
    by_hand.write(result, options.output)


if __name__ == "__main__":
    sys.exit(main())
