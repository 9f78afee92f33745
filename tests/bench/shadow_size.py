"""What a shadow map's size does to direct light, whatever the picture's size.

usage: shadow_size.py BUILD SCENE... -o RESULT.json

Relative RMSE of the direct layer, in per cent, against a map of 4096 texels a side, and the pass's time. Whether a
small picture could do with a small map is what this answers.
"""
import argparse
import json
import os
import shlex
import sys
from pathlib import Path

import numpy

from harness.bench.store import machine
from harness.daemon import Daemon

PICTURES_PX = (64, 128, 256)
TRUTH, MAPS = 4096, (2048, 1024, 512, 256, 128)


def render(daemon, scene, side_px, texels):
    frame = daemon.render(scene, "direct", {"shadow_size": texels}, size=(side_px, side_px), layers=("direct",),
                          timeout_s=600)
    ms = sum(one["ms"] for one in frame.report["passes"] if one["name"] == "shadow_map" and one["state"] == "ran")
    return frame.layer("direct").astype(float), ms


def off_percent(image, truth):
    sure = numpy.isfinite(truth).all(-1)
    mean = truth[sure].mean()
    return 100 * numpy.sqrt(((image - truth)[sure] ** 2).mean()) / mean if mean > 0 else 0.0


def rows_of(daemon, path):
    scene = "scene:" + daemon.hold(path)["id"]
    for side_px in PICTURES_PX:
        truth, _ = render(daemon, scene, side_px, TRUTH)
        row = {"scene": path.stem, "picture_px": side_px, "off_percent": {}, "shadow_map_ms": {}}
        for texels in MAPS:
            image, ms = render(daemon, scene, side_px, texels)
            row["off_percent"][texels] = round(float(off_percent(image, truth)), 2)
            row["shadow_map_ms"][texels] = round(ms, 1)
        if side_px != PICTURES_PX[0]:
            del row["shadow_map_ms"]  # the first picture's maps are there
        yield row


def main(words):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build", type=Path)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args(words)
    os.environ["BOUNCE"] = str(options.build / "clients/cli/bounce")
    os.environ["BOUNCED"] = str(options.build / "server/bounced")
    rows = []
    with Daemon(None) as daemon:
        for path in options.scenes:
            rows += rows_of(daemon, path)
            print(rows[-1], file=sys.stderr, flush=True)
    shown = shlex.join(["shadow_size.py", "BUILD", *(path.name for path in options.scenes)])
    lines = ",\n  ".join(json.dumps(row) for row in rows)
    head = json.dumps({"machine": machine(), "command": shown}, indent=1)
    options.output.write_text(f'{head[:-2]},\n "rows": [\n  {lines}\n ]\n}}\n', encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
