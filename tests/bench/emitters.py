"""What techniques make of light of emissive surfaces and skies, and of further bounces, against the whole equation.

usage: emitters.py BUILD SCENE[@SKY]... -o RESULT.json [--size 96x96] [--truth-spp 512] [--techniques rsm,hisr]
           [--truths FOLDER]

For each scene and technique, with what papers have (light_rays=0), the defaults, and indirect_bounces=8, and with
rays that hide indirect light: relative RMSE and the mean's error of beauty and indirect light in per cent, the reference's
noise taken out; what passes of this light took, in ms. Glass is taken as opaque on both sides.
FOLDER keeps truths for the next time.
"""
import argparse
import json
import sys
import tempfile
from pathlib import Path

from bounce import Bounce
from harness.bench.store import machine

LAYERS = ("beauty", "indirect")
PASSES = ("emitters", "area_light", "light_paths", "gather")
SETTINGS = ("light_rays=0", "indirect_bounces=1", "indirect_bounces=8")


def environment_of(case):
    return ["--environment", case[1]] if len(case) > 1 else []


class Referee(Bounce):
    def truth(self, case, out, options):
        self("reference", case[0], *environment_of(case), "-o", out, "--size", options.size, "--spp", options.truth_spp,
             "--set", "transmission=off", "--seed", 77, "-q")

    def frame(self, case, technique, setting, out, options):
        report = out.with_suffix(".json")
        self("render", case[0], *environment_of(case), "-o", out, "--size", options.size, "--technique", technique, "-q",
             "--aa", 1, "--fail-on", "none", "--layers", "beauty,direct,indirect", "--report", report, "--set", "indirect_visibility=rays",
             "--set", setting)
        return json.loads(report.read_text())["passes"]


def row_of(bounce, case, technique, setting, truth, options, folder):
    picture = folder / "picture.exr"
    passes = bounce.frame(case, technique, setting, picture, options)
    row = {"scene": "@".join(Path(word).stem for word in case), "technique": technique, "setting": setting}
    for layer in LAYERS:
        off = bounce.off(truth, picture, layer)
        row[layer] = {"rel_rmse_percent": round(off[0], 2), "signed_percent": round(off[1], 2)} if off else None
    row["passes_ms"] = {one["name"]: round(one["ms"], 1) for one in passes if one["name"] in PASSES}
    return row


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("build", type=lambda text: Path(text).resolve())
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("-o", "--out", required=True, type=Path)
    parser.add_argument("--size", default="96x96")
    parser.add_argument("--truth-spp", type=int, default=512)
    parser.add_argument("--techniques", default="rsm,multires_gather,isr,hisr")
    parser.add_argument("--truths", type=Path)
    options = parser.parse_args()
    bounce = Referee(options.build)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for scene in options.scenes:
            case = scene.split("@")
            truth = (options.truths or Path(folder)) / ("@".join(Path(word).stem for word in case) + ".truth.exr")
            bounce.truth(case, truth, options)
            for technique in options.techniques.split(","):
                for setting in SETTINGS:
                    rows.append(row_of(bounce, case, technique, setting, truth, options, Path(folder)))
                    print(json.dumps(rows[-1]), flush=True)
    result = {"command": "tests/bench/emitters.py " + " ".join(sys.argv[1:]), "machine": machine(), "rows": rows}
    options.out.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
