"""Direct light of emitters and skies as `direct` shows it at its defaults, against the reference without bounces.

usage: area_direct.py BUILD SCENE[@SKY]... -o RESULT.json [--size 256x192] [--truth-spp 2048] [--truths FOLDER]

For each scene: relative RMSE, median and 90th percentile of the relative error in per cent, by pixel and of means over 8x8, and
the mean's error; the truth's own noise is in them. `brdf=lambert` on both sides too, without what gloss adds. The truth takes
glass for opaque: of solids with the full BRDF, through which `direct` lets light straight on, the figure says that.
FOLDER keeps truths for the next time.
"""
import argparse
import json
import tempfile
from pathlib import Path

from bounce import Bounce, name_of, write
from harness import exr
from many_lamps import off


class Referee(Bounce):
    def direct(self, case, technique, settings, out, options):
        sky = ["--environment", case[1]] if len(case) > 1 else []
        self("render", case[0], *sky, "-o", out, "--size", options.size, "--technique", technique, "-q", "--seed", 5, "--aa", 1,
             "--fail-on", "none", "--layers", "beauty,direct", *[word for pair in settings for word in ("--set", pair)])
        return exr.layer(exr.read(out.read_bytes())[0], "direct").astype(float)


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("build", type=lambda text: Path(text).resolve())
    parser.add_argument("cases", nargs="+")
    parser.add_argument("-o", "--out", required=True, type=Path)
    parser.add_argument("--size", default="256x192")
    parser.add_argument("--truth-spp", type=int, default=2048)
    parser.add_argument("--truths", type=Path)
    options = parser.parse_args()
    bounce = Referee(options.build)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for case in options.cases:
            words, name = case.split("@"), name_of(case)
            for brdf in ("full", "lambert"):
                kept = (options.truths or Path(folder)) / f"{name}.{brdf}.direct.exr"
                settings = [f"brdf={brdf}", f"spp={options.truth_spp}", "bounces=0", "alpha=mask", "transmission=off"]
                truth = (exr.layer(exr.read(kept.read_bytes())[0], "direct").astype(float) if kept.exists()
                         else bounce.direct(words, "reference", settings, kept, options))
                image = bounce.direct(words, "direct", [f"brdf={brdf}"], Path(folder) / "picture.exr", options)
                rows.append({"case": name, "brdf": brdf, "off_percent": off(image, truth)})
                print(json.dumps(rows[-1]), flush=True)
    write(options.out, "area_direct.py", rows)


if __name__ == "__main__":
    main()
