"""How often the interval of a spot check holds the error of the whole frame.

usage: check_coverage.py [SCENE...] [-o RESULT.json] [--size N] [--spp N] [--seeds N] [--truths FOLDER]

Scenes x (direct, and rsm on three rungs of its ladder) x numbers of pixels x seeds: each is one `bounce render
--check`, and two cases, against the whole equation and against the model. A figure without an upper end counts as
flagged. References are kept in FOLDER, for a second run with another build. random_scenes.py makes scenes. The error of the whole frame is measured here, on all pixels
of the same frame, with the two halves of a reference of its own seed (algorithms.md E1, E2).
Exits with 1 if fewer than 90 % of the intervals that are not flagged hold it, or more than a quarter
are flagged. Fewer than 200 cases cannot show that: of them it wants what 90 % would give in all but one
run of a thousand. $BOUNCE and $BOUNCED name the executables.
"""
import argparse
import itertools
import json
import math
import shlex
import sys
from pathlib import Path

import numpy

from harness.bench.store import machine
from harness.daemon import Daemon, NoDevice

SETTINGS = [("direct", {}), ("rsm", {"vpls": 16}), ("rsm", {"vpls": 256}), ("rsm", {"vpls": 4096})]
AGAINST = ("model", "full")
PIXELS = (128, 256, 512)
REFERENCE_SEED = 77001  # unlike any that a check below is given
HELD_LEAST, FLAGGED_MOST = 0.9, 0.25
CASES_ENOUGH, SIGMAS = 200, 3
SKIPPED = 77


def full_error(frame, reference):
    """Relative RMSE of all pixels that are finite, as image/metric.h has it; and its relative standard
    deviation by the reference's noise (None where no error is left above it)."""
    image, a, b = (picture.layer(name).astype(float) for picture, name in
                   ((frame, "beauty"), (reference, "half_a"), (reference, "half_b")))
    finite = numpy.isfinite(image) & numpy.isfinite(a) & numpy.isfinite(b)
    square = ((image - a) * (image - b))[finite]
    mean = ((a + b) / 2)[finite].mean()
    # d = (I - R)^2 - (A - B)^2 / 4, of which noise makes I - R vary by half of A - B.
    noise = (((image - (a + b) / 2) * (a - b))[finite] ** 2).sum() ** 0.5 / square.size
    if mean == 0:
        return math.inf, None  # black: such a case is left out
    error = max(square.mean(), 0) ** 0.5 / mean
    return float(error), float(noise / (2 * square.mean())) if error else None


class Kept:
    """A reference of an earlier run."""

    def __init__(self, arrays):
        self.layer = arrays.__getitem__


class Stage:
    def __init__(self, daemon, size, spp, truths):
        self.daemon, self.size, self.spp, self.truths = daemon, (size, size), spp, truths
        self.name = None  # of the scene, where references are kept by it
        self.references = {}
        self.seeds = itertools.count(1)

    def render(self, scene, technique, settings, **more):
        return self.daemon.render(scene, technique, settings, size=self.size, timeout_s=1200, **more)

    def reference(self, scene, technique, against):
        model = {"model_of": technique} if against == "model" else {}
        key = self.name or scene, *model.values()
        kept = self.truths and self.truths / ("-".join(map(str, (*key, self.size[0], self.spp))) + ".npz")
        if kept and kept.exists():
            self.references[key] = Kept(numpy.load(kept))
        if key not in self.references:
            # Direct light has next to no noise: its model has neither bounces nor soft shadows.
            spp = self.spp if model.get("model_of") != "direct" else max(self.spp // 8, 2)
            self.references[key] = self.render(scene, "reference", {**model, "spp": spp},
                                               seed=REFERENCE_SEED,
                                               layers=("beauty", "half_a", "half_b"))
            if kept:
                kept.parent.mkdir(parents=True, exist_ok=True)
                truth = self.references[key]
                numpy.savez(kept, **{name: truth.layer(name) for name in ("half_a", "half_b")})
        return self.references[key]


def cases_of(stage, name, scene, seeds):
    for technique, settings in SETTINGS:
        frame = stage.render(scene, technique, settings, layers=("beauty",))
        truths = {against: full_error(frame, stage.reference(scene, technique, against))
                  for against in AGAINST}
        for turn in range(seeds):
            # A seed of its own for each check: those of one scene that share a seed trace nearly the
            # same pixels, and are lucky or not together.
            seed = next(stage.seeds)
            pixels = PIXELS[turn % len(PIXELS)]
            report = stage.daemon.report(scene, technique, settings, stage.size, seed=seed,
                                         timeout_s=600, extra=("--check", str(pixels)))
            for error in report["error"]:
                if error["metric"] != "rel_rmse":
                    continue  # nothing is relative to black
                full, noise = truths[error["against"]]
                flagged = error["high"] is None
                held = error["low"] <= full and (flagged or full <= error["high"])
                yield {"scene": name, "technique": technique, "settings": settings,
                       "against": error["against"], "pixels": pixels, "seed": seed, "full": full,
                       "full_noise": noise, "value": error["value"], "low": error["low"],
                       "high": error["high"], "flagged": flagged, "held": held,
                       "check_ms": report["time_ms"]["check"]}


def summary(cases):
    sure = [case for case in cases if not case["flagged"]]
    widths = [case["high"] / case["low"] for case in sure if case["low"]]
    return {"cases": len(cases), "flagged": len(cases) - len(sure),
            "held": sum(case["held"] for case in sure), "unflagged": len(sure),
            "held_share": sum(case["held"] for case in sure) / max(len(sure), 1),
            "flagged_share": 1 - len(sure) / max(len(cases), 1),
            "above": sum(case["full"] > case["high"] for case in sure),
            "below": sum(case["full"] < case["low"] for case in sure),
            "median_high_over_low": float(numpy.median(widths)) if widths else None,
            "median_check_ms": float(numpy.median([case["check_ms"] for case in cases]))}


def by(cases, key):
    return {str(value): summary([case for case in cases if case[key] == value])
            for value in sorted({case[key] for case in cases})}


def rounded(value):
    if isinstance(value, float):
        return float(f"{value:.5g}")
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    return [rounded(item) for item in value] if isinstance(value, list) else value


def write(path, result):
    """One case a line: figures, not prose."""
    cases = result.pop("cases")
    text = json.dumps(result, indent=1)
    lines = ",\n  ".join(json.dumps(case) for case in cases)
    Path(path).write_text(text[:-2] + f',\n "cases": [\n  {lines}\n ]\n}}\n', encoding="utf-8")


def measure(options):
    cases = []
    with Daemon(options.device) as daemon:
        stage = Stage(daemon, options.size, options.spp, options.truths)
        for path in options.scenes:
            scene = "scene:" + daemon.hold(path)["id"]
            stage.name = path.stem
            new = list(cases_of(stage, path.stem, scene, options.seeds))
            cases += new
            figures = summary(new)
            print(f"{path.stem:24} {figures['held']:3} of {figures['unflagged']:3} held, "
                  f"{figures['flagged']:2} flagged", file=sys.stderr, flush=True)
    return cases


def is_good(total):
    """By the figures of `summary`."""
    cases = max(total["unflagged"], 1)
    slack = 0 if total["cases"] >= CASES_ENOUGH else SIGMAS / cases ** 0.5
    held = HELD_LEAST - slack * (HELD_LEAST * (1 - HELD_LEAST)) ** 0.5
    flagged = FLAGGED_MOST + slack * (FLAGGED_MOST * (1 - FLAGGED_MOST)) ** 0.5
    return total["held_share"] >= held and total["flagged_share"] <= flagged


def parse(words):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("-o", "--output", type=Path)
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--device")
    parser.add_argument("--truths", type=Path)
    return parser.parse_args(words)


def main(words):
    options = parse(words)
    try:
        cases = measure(options)
    except NoDevice as none:
        print(f"skipped: {none}")
        return SKIPPED
    total = summary(cases)
    shown = [Path(word).name if "/" in word else word for word in words]
    result = {"machine": machine(), "command": shlex.join(["check_coverage.py", *shown]),
              "total": total, "by_against": by(cases, "against"), "by_pixels": by(cases, "pixels"),
              "by_technique": by(cases, "technique"), "cases": cases}
    if options.output:
        write(options.output, rounded(result))
    print(json.dumps({key: rounded(result[key]) for key in ("total", "by_against")}, indent=1))
    return 0 if is_good(total) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
