"""Direct light of skies with a sun: error against run time, beside the reference's.

usage: skies.py BUILD SCENE@SKY... -o RESULT.json [--size 192x144] [--rays 4,16,64,256] [--samples 4,16,64,256]
           [--truth-spp 4096] [--truths FOLDER]

For each scene under each map: `direct` with so many `light_rays`, and the reference with so many samples, as they are and
filtered, all in the middles of pixels; the relative RMSE of direct light in per cent, its mean's error, and the time of the
passes that make it. The noise of the truth, of other samples, is taken out (`bounce compare`). FOLDER keeps truths for the next time.
"""
import argparse
import json
import tempfile
from pathlib import Path

from bounce import Bounce, name_of, write

# Not made again for another camera, or for light that is edited.
KEPT = ("bvh", "emitters", "readback", "compile")


class Referee(Bounce):
    def frame(self, scene, sky, technique, settings, out, options):
        report = out.with_suffix(".json")
        self("render", scene, "--environment", sky, "-o", out, "--size", options.size, "--technique", technique, "-q", "--seed", 5,
             "--aa", 1, "--fail-on", "none", "--layers", "beauty,direct", "--report", report,
             *[word for pair in settings for word in ("--set", pair)])
        return sum(one["ms"] for one in json.loads(report.read_text())["passes"] if one["name"] not in KEPT)

    def truth(self, scene, sky, out, options):
        self("reference", scene, "--environment", sky, "-o", out, "--size", options.size, "--spp", options.truth_spp, "--seed", 77,
             "--set", "bounces=0", "--set", "alpha=mask", "-q")


def asked(options):
    for rays in options.rays.split(","):
        yield "direct", [f"light_rays={rays}"]
    for spp in options.samples.split(","):
        for noise_filter in ("off", "on"):
            yield "reference", [f"spp={spp}", "bounces=0", "alpha=mask", f"noise_filter={noise_filter}"]


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("build", type=lambda text: Path(text).resolve())
    parser.add_argument("cases", nargs="+")
    parser.add_argument("-o", "--out", required=True, type=Path)
    parser.add_argument("--size", default="192x144")
    parser.add_argument("--rays", default="4,16,64,256")
    parser.add_argument("--samples", default="4,16,64,256")
    parser.add_argument("--truth-spp", type=int, default=4096)
    parser.add_argument("--truths", type=Path)
    options = parser.parse_args()
    bounce = Referee(options.build)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for case in options.cases:
            (scene, sky), name = case.split("@"), name_of(case)
            truth, picture = (options.truths or Path(folder)) / f"{name}.direct.exr", Path(folder) / "picture.exr"
            bounce.truth(scene, sky, truth, options)
            for technique, settings in asked(options):
                ms = bounce.frame(scene, sky, technique, settings, picture, options)
                off = bounce.off(truth, picture, "direct")
                rows.append({"case": name, "technique": technique, "settings": settings, "ms": round(ms, 1),
                             "rel_rmse_percent": round(off[0], 2), "signed_percent": round(off[1], 2)})
                print(json.dumps(rows[-1]), flush=True)
    write(options.out, "skies.py", rows)


if __name__ == "__main__":
    main()
