"""What the filter of noise does to references of few samples.

usage: noise_filter.py BUILD SCENE... -o RESULT.json [--size 256x192] [--samples 8,32] [--truth-spp 192]
           [--set KEY=VALUE]... [--truths FOLDER]

For each scene and number of samples a pixel: the relative RMSE of direct and indirect light in per cent,
raw and filtered, against a reference of another seed whose noise is taken out (`bounce compare`); how far
the filter moves the mean, in per cent; and what it takes, all layers together, by a frame's report.
FOLDER keeps truths for the next time.
"""
import argparse
import json
import sys
import tempfile
from pathlib import Path

from bounce import Bounce
from harness.bench.store import machine

LAYERS = ("indirect", "direct")


class Referee(Bounce):
    def truth(self, scene, out, options):
        sets = [word for pair in options.set for word in ("--set", pair)]
        self("reference", scene, "-o", out, "--size", options.size, "--spp", options.truth_spp, "--seed", 77, "-q", *sets)

    def frame(self, scene, out, options, spp, noise_filter):
        """Without halves, so that all its noise counts; returns what its filter took, in ms."""
        report = out.with_suffix(".json")
        pairs = [*options.set, f"spp={spp}", f"noise_filter={noise_filter}"]
        self("render", scene, "-o", out, "--size", options.size, "--technique", "reference", "-q", "--seed", 5,
             "--layers", ",".join(("beauty", *LAYERS)), "--report", report,
             *[word for pair in pairs for word in ("--set", pair)])
        return sum(one["ms"] for one in json.loads(report.read_text())["passes"] if one["name"] == "filter")


def row_of(bounce, scene, spp, truth, options, folder):
    raw, filtered = folder / "raw.exr", folder / "filtered.exr"
    bounce.frame(scene, raw, options, spp, "off")
    row = {"scene": scene.stem, "spp": spp, "filter_ms": round(bounce.frame(scene, filtered, options, spp, "on"), 1)}
    for layer in LAYERS:
        before, after = (bounce.off(truth, file, layer) or [0, 0] for file in (raw, filtered))
        row[layer] = {"raw_percent": round(before[0], 2), "filtered_percent": round(after[0], 2),
                      "mean_moved_percent": round(100 * (100 + after[1]) / (100 + before[1]) - 100, 2)}
    return row


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("build", type=lambda text: Path(text).resolve())
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("-o", "--out", required=True, type=Path)
    parser.add_argument("--size", default="256x192")
    parser.add_argument("--samples", default="8,32")
    parser.add_argument("--truth-spp", type=int, default=192)
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--truths", type=Path)
    options = parser.parse_args()
    bounce = Referee(options.build)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for scene in options.scenes:
            truth = (options.truths or Path(folder)) / f"{scene.stem}.truth.exr"
            bounce.truth(scene, truth, options)
            for spp in map(int, options.samples.split(",")):
                rows.append(row_of(bounce, scene, spp, truth, options, Path(folder)))
                print(json.dumps(rows[-1]), flush=True)
    result = {"command": "tests/bench/noise_filter.py " + " ".join(map(str, sys.argv[1:])), "machine": machine(),
              "rows": rows}
    options.out.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
