"""`many_light`, or another technique with a ladder: error against run time, beside the reference.

usage: many_light.py BUILD_DIR SCENES_DIR -o RESULT.json [--technique NAME] [--scenes NAME,NAME] [--size WxH] [--brdf lambert|full]
                     [--truths FOLDER]

For each rung of its ladder: relative RMSE of the indirect layer and of beauty against the reference, by pixel, mean of eight seeds,
the truth's own noise taken out by its two halves; error of the mean over 8x8 pixels; of the mean picture's sum. Milliseconds of a new
frame's passes, light and camera side, without the structure that rays are asked of, readback and encoding; medians of the seeds. The
reference with 8 and 32 samples a pixel, raw and filtered, and how long it takes to 5 %, where that is beyond what was run by
1 / sqrt(samples). References are kept in FOLDER, where there is one.
"""
import pathlib
import sys

import numpy

import by_hand
import live

SCENES = ("cornell_box", "cornell_box_spot_side", "sponza_dabrovic")
SEEDS, RUNGS = 8, 5
TRUTH_SPP, TRUTH_SEEDS = 96, (77, 78)
REFERENCE_SPP = (8, 32)
LAYERS = ("indirect", "beauty")
NOT_TIMED = ("bvh", "readback", "encode")
GOAL_PERCENT = 5


def picture(frame, layer):
    return frame.layers[layer][..., :3].astype(float)


def render(scene, size, technique, parameters, seed=0):
    return scene.render(size=size, technique=technique, layers=list(LAYERS), fresh="all", seed=seed, parameters=parameters)


def truth_of(scene, name, size, brdf, folder):
    """Two halves of each layer that share no random number."""
    kept = folder / f"{name}.{brdf}.{size[0]}x{size[1]}.npz" if folder else None
    if kept and kept.exists():
        file = numpy.load(kept)
        return {layer: (file[f"{layer}0"], file[f"{layer}1"]) for layer in LAYERS}
    halves = [render(scene, size, "reference", {"brdf": brdf, "alpha": "mask", "spp": TRUTH_SPP}, seed) for seed in TRUTH_SEEDS]
    made = {layer: tuple(picture(half, layer) for half in halves) for layer in LAYERS}
    if kept:
        numpy.savez(kept, **{f"{layer}{i}": made[layer][i] for layer in LAYERS for i in (0, 1)})
    return made


def blocks(image, side=8):
    height, width = (length // side * side for length in image.shape[:2])
    return image[:height, :width].reshape(height // side, side, width // side, side, -1).mean(axis=(1, 3))


def error_percent(seen, halves):
    """Relative RMSE without the halves' noise, which they do not share."""
    a, b = halves
    return 100 * float(numpy.sqrt(max(((seen - a) * (seen - b)).mean(), 0)) / ((a + b) / 2).mean())


def times_ms(frames):
    return float(numpy.median([sum(p.get("ms") or 0 for p in frame.report["passes"] if p["name"] not in NOT_TIMED) for frame in frames]))


def figures(frames, truth):
    mean = {layer: numpy.mean([picture(frame, layer) for frame in frames], axis=0) for layer in LAYERS}
    row = {"ms": round(times_ms(frames), 1)}
    for layer in LAYERS:
        row[f"{layer}_percent"] = round(float(numpy.mean([error_percent(picture(frame, layer), truth[layer]) for frame in frames])), 2)
    halves = tuple(blocks(half) for half in truth["indirect"])
    row["indirect_8x8_percent"] = round(float(numpy.mean([error_percent(blocks(picture(frame, "indirect")), halves) for frame in frames])), 2)
    row["of_mean_picture_percent"] = round(error_percent(mean["indirect"], truth["indirect"]), 2)
    both = (truth["indirect"][0] + truth["indirect"][1]) / 2
    row["sum_percent"] = round(100 * float(mean["indirect"].mean() / both.mean() - 1), 2)
    return row


def reference_rows(scene, size, brdf, truth):
    for spp in REFERENCE_SPP:
        for filtered in ("off", "on"):
            frame = render(scene, size, "reference", {"brdf": brdf, "alpha": "mask", "spp": spp, "noise_filter": filtered}, seed=1)
            ms = sum(p.get("ms") or 0 for p in frame.report["passes"] if p["name"] in ("trace", "filter"))
            error = error_percent(picture(frame, "indirect"), truth["indirect"])
            yield {"spp": spp, "noise_filter": filtered, "ms": round(ms, 1), "indirect_percent": round(error, 2),
                   "beauty_percent": round(error_percent(picture(frame, "beauty"), truth["beauty"]), 2),
                   f"s_to_{GOAL_PERCENT}_percent_by_samples": round(1e-3 * ms * max(error / GOAL_PERCENT, 1) ** 2, 2)}


def rows_of(scene, name, size, options):
    truth = truth_of(scene, name, size, options.brdf, options.truths)
    both = (truth["indirect"][0] + truth["indirect"][1]) / 2
    noise = numpy.sqrt(((truth["indirect"][0] - truth["indirect"][1]) ** 2).mean() / 4) / both.mean()
    row = {"scene": name, "size": f"{size[0]}x{size[1]}", "brdf": options.brdf, "truth_noise_percent": round(100 * float(noise), 2),
           "indirect_of_beauty": round(float(both.mean() / numpy.mean(truth["beauty"])), 3), "rungs": [],
           "reference": list(reference_rows(scene, size, options.brdf, truth))}
    for rung in options.ladder[:options.rungs]:
        settings = {"brdf": options.brdf, **dict(word.split("=") for word in rung.split())}
        frames = [render(scene, size, options.technique, settings, seed) for seed in range(SEEDS)]
        row["rungs"].append({"settings": rung, **figures(frames, truth)})
        by_hand.say(f"{name} {rung}: {row['rungs'][-1]}")
    return row


def main(words=None):
    made = by_hand.parser(__doc__)
    by_hand.add_names(made, SCENES)
    made.add_argument("--size", type=lambda text: tuple(int(side) for side in text.split("x")), default=(256, 192))
    made.add_argument("--brdf", choices=("lambert", "full"), default="lambert")
    made.add_argument("--technique", default="many_light")
    made.add_argument("--rungs", type=by_hand.count, default=RUNGS)
    made.add_argument("--truths", type=pathlib.Path)
    options = by_hand.parse(made, words, names=SCENES)
    size, scenes = "x".join(map(str, options.size)), ",".join(options.names)
    result = {"command": f"many_light.py BUILD SCENES -o RESULT --technique {options.technique} --size {size} --brdf {options.brdf} --rungs {options.rungs} --scenes {scenes}", "machine": live.machine(options.build), "rows": []}
    with live.package(options.build).private() as daemon:
        options.ladder = next(one["ladder"] for one in daemon.techniques() if one["name"] == options.technique)
        for name in options.names:
            scene = daemon.scenes.add(options.scenes / f"{name}.glb")
            result["rows"].append(rows_of(scene, name, options.size, options))
    by_hand.write(result, options.output)


if __name__ == "__main__":
    sys.exit(main())
