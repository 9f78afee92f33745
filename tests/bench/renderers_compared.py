"""Figures of our reference beside an independent renderer's pictures.

usage: renderers_compared.py BUILD_DIR SHARED_DIR -o RESULT.json [--samples N]

For each Lambertian picture and layer the debiased relative RMSE with its interval, and the relative
difference of the means with its standard error, in percent, by pixel and by block of 4 x 4 and 8 x 8
pixels (tests/golden/independent_renderer.py); for the
`point` pictures also the direct layer by hand, with one more of the other renderer's habits at a
time, with and without the pixels where two surfaces lie in one place.
"""
import argparse
import dataclasses
import json
import os
import pathlib
import sys
import tempfile
import time

from by_hand import machine

ROOT = pathlib.Path(__file__).resolve().parents[2]


def percent(figure):
    return {key: round(100 * value, 4) for key, value in dataclasses.asdict(figure).items()}


def by_block(independent_renderer, ours, theirs):
    figures = {side: percent(independent_renderer.figure(ours, theirs, block_px=side))
               for side in independent_renderer.BLOCKS_PX}
    return {f"blocks_{side}px": {key: figure[key] for key in ("rel_rmse", "low", "high")}
            for side, figure in figures.items()}


def by_tracing(independent_renderer, samples, folder):
    for scene, pixel_filter in independent_renderer.PICTURES:
        theirs = independent_renderer.load_theirs(scene, pixel_filter)
        start = time.monotonic()
        ours = independent_renderer.render_ours(scene, pixel_filter, independent_renderer.size_of(theirs), samples, folder)
        row = {"scene": scene, "filter": pixel_filter, "samples_per_half": 2 * samples,
               "seconds": round(time.monotonic() - start, 1),
               **{layer: {**percent(independent_renderer.figure(ours[layer], theirs[layer])),
                          **by_block(independent_renderer, ours[layer], theirs[layer])} for layer in ours}}
        print(json.dumps(row), file=sys.stderr, flush=True)
        yield row


def by_hand(independent_renderer, folder):
    for scene, pixel_filter in independent_renderer.PICTURES:
        if pixel_filter != "point":
            continue
        theirs = independent_renderer.load_theirs(scene, pixel_filter)["direct"]
        for count in range(len(independent_renderer.HABITS) + 1):
            habits = independent_renderer.HABITS[:count]
            size = independent_renderer.size_of({"direct": theirs})
            ours, twins = independent_renderer.by_hand(scene, size, habits, folder)
            yield {"scene": scene, "habits": habits, "twin_pixels": int((twins > 0).sum()),
                   "direct": percent(independent_renderer.figure([ours, ours], theirs)),
                   "direct_without_twins": percent(
                       independent_renderer.figure([ours, ours], theirs, twins == 0))}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build")
    parser.add_argument("shared")
    parser.add_argument("-o", required=True)
    parser.add_argument("--samples", type=int, default=128)
    options = parser.parse_args()
    os.environ["BD_BUILD_DIR"] = str(pathlib.Path(options.build).resolve())
    os.environ["BD_SHARED_DIR"] = str(pathlib.Path(options.shared).resolve())
    sys.path.insert(0, str(ROOT / "tests/golden"))
    import independent_renderer
    with tempfile.TemporaryDirectory() as folder:
        result = {"machine": machine(),
                  "command": f"renderers_compared.py BUILD SHARED --samples {options.samples}",
                  "pictures": list(by_tracing(independent_renderer, options.samples, folder)),
                  "by_hand": list(by_hand(independent_renderer, folder))}
    pathlib.Path(options.o).write_text(json.dumps(result, indent=1) + "\n")


main()
