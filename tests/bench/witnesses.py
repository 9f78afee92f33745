"""Figures of the two witnesses: our reference beside an independent renderer's pictures.

usage: witnesses.py BUILD_DIR SHARED_DIR -o RESULT.json [--samples N]

For each Lambertian picture and layer the debiased relative RMSE with its interval, and the relative
difference of the means with its standard error, in percent, by pixel and by block of 4 x 4 and 8 x 8
pixels (tests/golden/witnesses.py); for the
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


def by_block(witnesses, ours, theirs):
    figures = {side: percent(witnesses.figure(ours, theirs, block_px=side))
               for side in witnesses.BLOCKS_PX}
    return {f"blocks_{side}px": {key: figure[key] for key in ("rel_rmse", "low", "high")}
            for side, figure in figures.items()}


def by_tracing(witnesses, samples, folder):
    for scene, pixel_filter in witnesses.PICTURES:
        theirs = witnesses.load_theirs(scene, pixel_filter)
        start = time.monotonic()
        ours = witnesses.render_ours(scene, pixel_filter, witnesses.size_of(theirs), samples, folder)
        row = {"scene": scene, "filter": pixel_filter, "samples_per_half": 2 * samples,
               "seconds": round(time.monotonic() - start, 1),
               **{layer: {**percent(witnesses.figure(ours[layer], theirs[layer])),
                          **by_block(witnesses, ours[layer], theirs[layer])} for layer in ours}}
        print(json.dumps(row), file=sys.stderr, flush=True)
        yield row


def by_hand(witnesses, folder):
    for scene, pixel_filter in witnesses.PICTURES:
        if pixel_filter != "point":
            continue
        theirs = witnesses.load_theirs(scene, pixel_filter)["direct"]
        for count in range(len(witnesses.HABITS) + 1):
            habits = witnesses.HABITS[:count]
            size = witnesses.size_of({"direct": theirs})
            ours, twins = witnesses.by_hand(scene, size, habits, folder)
            yield {"scene": scene, "habits": habits, "twin_pixels": int((twins > 0).sum()),
                   "direct": percent(witnesses.figure([ours, ours], theirs)),
                   "direct_without_twins": percent(
                       witnesses.figure([ours, ours], theirs, twins == 0))}


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
    import witnesses
    with tempfile.TemporaryDirectory() as folder:
        result = {"machine": machine(),
                  "command": f"witnesses.py BUILD SHARED --samples {options.samples}",
                  "pictures": list(by_tracing(witnesses, options.samples, folder)),
                  "by_hand": list(by_hand(witnesses, folder))}
    pathlib.Path(options.o).write_text(json.dumps(result, indent=1) + "\n")


main()
