"""A view at rest: error against the seconds that it has rested.

usage: at_rest.py BUILD_DIR SCENES_DIR -o RESULT.json [--scenes NAME,NAME] [--brdf lambert|full] [--seeds 8] [--truths FOLDER]

A view of 256x192 by `auto`, opened where nothing moves, takes each frame until its final one, for each seed anew. Of each step, over the
seeds: seconds since the view was opened when the frame was there, its own milliseconds (total less compiling), and by pixel relative
RMSE of the indirect layer and of beauty, the root of the mean square, against two halves of the reference whose samples are spread over
the pixel; the halves' own noise is taken out. References are kept in FOLDER, where there is one.
"""
import pathlib
import sys
import time

import numpy

import by_hand
import live
import many_light

SCENES = ("cornell_box", "cornell_box_spot_side", "sponza_dabrovic")
SIZE, SEEDS = (256, 192), 8
TRUTH_SPP, TRUTH_SEEDS = 256, (77, 78)
LAYERS = ("indirect", "beauty")


def truth_of(scene, name, brdf, folder):
    kept = folder / f"{name}.{brdf}.box.npz" if folder else None
    if kept and kept.exists():
        file = numpy.load(kept)
        return {layer: (file[f"{layer}0"], file[f"{layer}1"]) for layer in LAYERS}
    parameters = {"spp": TRUTH_SPP, "filter": "box", "alpha": "mask", "brdf": brdf}
    halves = [scene.render(size=SIZE, technique="reference", layers=["indirect"], seed=seed, parameters=parameters) for seed in TRUTH_SEEDS]
    made = {layer: tuple(many_light.picture(half, layer) for half in halves) for layer in LAYERS}
    if kept:
        numpy.savez(kept, **{f"{layer}{i}": made[layer][i] for layer in LAYERS for i in (0, 1)})
    return made


def seen_by(scene, brdf, seed):
    """The frames of a view from its opening to its final one, and when each was there."""
    began = time.monotonic()
    with scene.view(size=SIZE, layers=["indirect"], encoding="exr", seed=seed, parameters={"brdf": brdf}) as view:
        for frame in view:
            yield time.monotonic() - began, frame
            if frame.final:
                return


def row_of(seen, truth):
    frame = seen[0][1]
    errors = {layer: [many_light.error_percent(many_light.picture(one, layer), truth[layer]) for _, one in seen] for layer in LAYERS}
    own_ms = [one.report["time_ms"]["total"] - one.report["time_ms"].get("compile", 0) for _, one in seen]
    return {"step": frame.step, "aa": frame.report["aa"], "rays": frame.report["parameters"]["rays"], "why_final": frame.why_final.split(":")[0],
            "s": round(float(numpy.median([s for s, _ in seen])), 2), "own_ms": round(float(numpy.median(own_ms)), 1),
            **{f"{layer}_percent": round(float(numpy.sqrt(numpy.mean(numpy.square(errors[layer])))), 2) for layer in LAYERS}}


def rows_of(scene, brdf, seeds, truth):
    """Of the steps that every seed had."""
    list(seen_by(scene, brdf, seeds))  # programs are compiled and the scene is there
    views = [list(seen_by(scene, brdf, seed)) for seed in range(seeds)]
    by_step = [{frame.step: (s, frame) for s, frame in seen} for seen in views]
    steps = sorted(set.intersection(*(set(one) for one in by_step)))
    return [row_of([one[step] for one in by_step], truth) for step in steps]


def main(words=None):
    made = by_hand.parser(__doc__)
    by_hand.add_names(made, SCENES)
    made.add_argument("--brdf", choices=("lambert", "full"), default="lambert")
    made.add_argument("--seeds", type=by_hand.count, default=SEEDS)
    made.add_argument("--truths", type=pathlib.Path)
    options = by_hand.parse(made, words, names=SCENES)
    scenes = ",".join(options.names)
    result = {"command": f"at_rest.py BUILD SCENES -o RESULT --brdf {options.brdf} --seeds {options.seeds} --scenes {scenes}",
              "machine": live.machine(options.build), "rows": []}
    with live.package(options.build).private() as daemon:
        for name in options.names:
            scene = daemon.scenes.add(options.scenes / f"{name}.glb")
            truth = truth_of(scene, name, options.brdf, options.truths)
            for row in rows_of(scene, options.brdf, options.seeds, truth):
                result["rows"].append({"scene": name, **row})
                by_hand.say(f"{name} {row}")
    by_hand.write(result, options.output)


if __name__ == "__main__":
    sys.exit(main())
