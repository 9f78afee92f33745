"""multires_gather beside rsm with the same VPLs: fragments, error and time of the indirect light.

usage: block_gather.py BUILD_DIR SCENES_DIR -o RESULT.json [--runs N] [--size N]

Both techniques take turns, from one daemon, with the camera's side made anew each time: medians, and
ratios within a turn. Time is that of all passes of the indirect light that belong to the camera: for
rsm `gather`, for multires_gather all that find, light and interpolate blocks. Errors are of the
indirect layer: relative RMSE over the mean, RMS over the largest value, both over all pixels; and, over
those that are lit, the 99th percentile of |error| / (value + 1 % of the mean), of the sum of the
channels.
"""
import numpy

import by_hand
from harness.bench.measure import spread
from harness.bench.papers import errors
from harness.daemon import Daemon

SCENES = ("cornell_box_spot_side", "cornell_dragon_bunny", "sponza_dabrovic", "sibenik", "garden")
VPLS = (256, 1024)
NOT_INDIRECT = ("gbuffer", "direct", "shadow_map", "rsm", "vpl_grid", "composite", "readback")
FAST_ENOUGH = {"cornell_box_spot_side": {256: 5, 1024: 10}, "sponza_dabrovic": {256: 3, 1024: 6}}
HEAD = ("| scene | VPLs | fragments | RMS / largest | relative RMSE (less the worst .01 %) | p99 | mean "
        "| `rsm`, blocks, ms | times as fast (goal) |\n" + "|---" * 9 + "|")
GOALS = {"fragments": .05, "rmse_max": .02, "rel_rmse": .06, "p99": .25}


def stage_ms(report):
    return sum(p["ms"] for p in report["passes"] if p["name"] not in NOT_INDIRECT)


def percentile_99(reference, picture):
    value, other = (numpy.asarray(p, numpy.float64).sum(axis=-1) for p in (reference, picture))
    lit = value > 0
    return float(numpy.percentile(abs(other - value)[lit] / (value[lit] + .01 * value.mean()), 99))


def compare(full, blocks):
    counts, size = blocks.report["counts"], full.layer("indirect").shape
    found = errors.between(full.layer("indirect"), blocks.layer("indirect"))
    if found is None:
        raise SystemExit(f"{full.command}: no indirect light to compare with")
    return {"fragments": counts["fragments"] / (size[0] * size[1]),
            "p99": percentile_99(full.layer("indirect"), blocks.layer("indirect")), **found}


def measure(daemon, path, vpls, size, runs):
    def frame(technique):
        return daemon.render(path, technique, {"brdf": "lambert", "vpls": vpls}, size=(size, size),
                             layers=("indirect",), extra=("--fresh", "camera"), timeout_s=600)

    def turn():
        return frame("rsm"), frame("multires_gather")

    result = compare(*turn())
    full, blocks = zip(*([stage_ms(f.report) for f in turn()] for _ in range(runs)))
    last = frame("multires_gather").report["passes"]
    result["rsm_ms"], result["blocks_ms"] = spread(full), spread(blocks)
    result["faster"] = spread([a / b for a, b in zip(full, blocks)])
    result["passes_ms"] = {p["name"]: p["ms"] for p in last if p["name"] not in NOT_INDIRECT}
    return result


def row_of(name, vpls, r):
    goal = FAST_ENOUGH.get(name, {}).get(vpls)
    return (f"| {name} | {vpls:,} | {100 * r['fragments']:.1f} % | {100 * r['rmse_max']:.2f} % | "
            f"{100 * r['rel_rmse']:.1f} % ({100 * r['trimmed']:.1f} %) | {100 * r['p99']:.0f} % | "
            f"{100 * r['signed']:+.2f} % | {r['rsm_ms']['median']:.0f}, "
            f"{r['blocks_ms']['median']:.0f} | {r['faster']['median']:.1f}{f' ({goal})' if goal else ''} |")


def main(words=None):
    parser = by_hand.parser(__doc__)
    parser.add_argument("--runs", type=by_hand.count, default=5)
    parser.add_argument("--size", type=by_hand.count, default=1024)
    options = by_hand.parse(parser, words, SCENES)
    result = {"machine": by_hand.machine(), "size": options.size, "runs": options.runs, "goals": GOALS,
              "command": f"block_gather.py BUILD SCENES -o RESULT --runs {options.runs} "
                         f"--size {options.size}", "scenes": []}
    print(HEAD)
    with Daemon() as daemon:
        for name in SCENES:
            for vpls in VPLS:
                found = measure(daemon, options.scenes / f"{name}.glb", vpls, options.size,
                                options.runs)
                result["scenes"].append({"scene": name, "vpls": vpls, **found})
                print(row_of(name, vpls, found), flush=True)
                by_hand.write(result, options.output)


if __name__ == "__main__":
    main()
