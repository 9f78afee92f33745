"""Figures of screen-space bias compensation (algorithms.md B3), of `ssbc`: what a clamp takes off, who gives it back, at what price.

usage: bias_compensation.py BUILD_DIR SCENES_DIR -o RESULT.json [--scenes NAME,NAME] [--side N] [--runs N]
                            [--parts levels,cost,...] [--brdf lambert|full] [--truths FOLDER] [--sheet FILE.jpg]

Of each scene, with so many virtual lights and rays that noise is small; clamps are told by their radius 1 / sqrt(clamp)
as a part of the scene's diagonal. Shares are of the sum of indirect light: `taken` by the clamp, of what short rays alone bring, and
`given_back` of that by the screen and by both. `off_percent`: relative RMSE of the indirect layer against the reference, whose own
noise is taken out by its halves.

`ladder`: from clamped light over iterations, all pixels of the screen without levels, rays and both, to what one reflection alone is
off; `off_percent` and of the sum, milliseconds of a frame. `levels`: parts that a pixel looks at and milliseconds of an iteration, by
how many levels there are. `iterations`: 0 to 4.
`thresholds`: how far a picture is off that of all pixels, one level, by when parts are looked at closer. `radii`: clamps. `cost`: an
iteration beside the frame, residual=screen, medians of runs. `growth`: milliseconds of a frame by pixels, virtual lights and reflections, the
rest as by default. The sheet has clamped, screen, both and truth side by side, a row a scene.
"""
import math
import pathlib
import sys

import numpy

import by_hand
import films
import live
import many_light

SCENES = ("cornell_box_spot_side", "cornell_box", "sponza_dabrovic")
QUIET = {"vpls": 16384, "walk_vpls": 16384, "rays": 64, "far_rays": 32, "cache_cells": 16384}
RADIUS = 0.1
RADII = (0.01, 0.02, 0.05, 0.1, 0.2)
THRESHOLDS = ((0.32, 0.16), (0.16, 0.08), (0.08, 0.04), (0.04, 0.02), (0.02, 0.02), (0.01, 0.01))
LEVELS = 6
ITERATIONS = 4


class Subject:
    """A scene, its truth, and `ssbc` of it."""

    def __init__(self, scene, name, options):
        info = scene.info()
        self.scene, self.side, self.runs = scene, options.side, options.runs
        self.diagonal_m = math.dist(info["bounds_min"], info["bounds_max"])
        self.name, self.brdf, self.truths, self.truth = name, options.brdf, options.truths, None

    def clamp(self, radius):
        return {"clamp": f"{1 / (radius * self.diagonal_m) ** 2:.9g}"}

    def render(self, side=None, **settings):
        return self.scene.render(size=(side or self.side,) * 2, technique="ssbc", layers=["indirect"], fresh="all",
                                 parameters={"brdf": self.brdf, **settings})

    def frame_ms(self, **settings):
        frames = [self.render(**settings) for _ in range(self.runs)]
        whole = [sum(p.get("ms") or 0 for p in frame.report["passes"] if p["name"] not in many_light.NOT_TIMED) for frame in frames]
        return round(float(numpy.median(whole)), 1)

    def picture(self, **settings):
        return many_light.picture(self.render(**settings), "indirect")

    def halves(self):
        if self.truth is None:
            self.truth = many_light.truth_of(self.scene, self.name, (self.side, self.side), self.brdf, self.truths)["indirect"]
        return self.truth

    def off(self, picture):
        return round(many_light.error_percent(picture, self.halves()), 2)

    def sum_off(self, picture):
        return round(100 * float(picture.mean() / numpy.mean(self.halves()) - 1), 2)

    def residual(self, iterations, **settings):
        """Parts a pixel and iteration, milliseconds of one, and the last picture."""
        frames = [self.render(residual="screen", iterations=iterations, **settings) for _ in range(self.runs)]
        ms = numpy.median([pass_ms(frame, "residual") for frame in frames])
        parts = frames[0].report["counts"]["screen_parts"] / (self.side ** 2 * iterations)
        return {"parts": round(parts, 1), "ms": round(float(ms) / iterations, 2)}, many_light.picture(frames[0], "indirect")


def pass_ms(frame, name):
    return sum(p.get("ms") or 0 for p in frame.report["passes"] if p["name"] == name)


RUNGS = {
    "clamped": {"residual": "screen", "iterations": 0},
    **{f"screen, {n}": {"residual": "screen", "iterations": n} for n in range(1, ITERATIONS + 1)},
    "screen, 2, all pixels": {"residual": "screen", "iterations": 2, "residual_levels": 1, "residual_threshold": 0, "residual_edge_threshold": 0},
    "both, 2": {"residual": "both", "iterations": 2},
    "rays": {"residual": "rays"},
}


def ladder(subject):
    clamp = subject.clamp(RADIUS)
    for name, settings in RUNGS.items():
        frame = subject.render(**QUIET, **clamp, **settings)
        picture = many_light.picture(frame, "indirect")
        yield {"rung": name, "off_percent": subject.off(picture), "sum_percent": subject.sum_off(picture), "ms": round(many_light.times_ms([frame]))}
    once = many_light.picture(subject.scene.render(size=(subject.side,) * 2, technique="reference", layers=["indirect"], seed=1, parameters={
        "brdf": subject.brdf, "alpha": "mask", "bounces": 1, "spp": many_light.TRUTH_SPP}), "indirect")
    yield {"rung": "one reflection", "off_percent": subject.off(once), "sum_percent": subject.sum_off(once)}


def strip(subject):
    clamp = subject.clamp(RADIUS)
    shown = [subject.picture(**QUIET, **clamp, **RUNGS[name]) for name in ("clamped", "screen, 2", "both, 2")]
    return numpy.concatenate([*shown, numpy.mean(subject.halves(), axis=0)], axis=1)


def levels(subject):
    clamp = subject.clamp(RADIUS)
    for count in range(1, LEVELS + 1):
        row = {"levels": count}
        for name, smooth, edge in (("own", 0.02, 0.02), ("paper", 0.08, 0.04)):
            row[name], _ = subject.residual(1, residual_levels=count, residual_threshold=smooth, residual_edge_threshold=edge, **clamp)
        yield row


def thresholds(subject):
    clamp = subject.clamp(RADIUS)
    _, all_pixels = subject.residual(1, residual_levels=1, residual_threshold=0, residual_edge_threshold=0, **clamp)
    none = subject.picture(residual="screen", iterations=0, **clamp)
    given = float((all_pixels - none).mean())
    for smooth, edge in THRESHOLDS:
        row, picture = subject.residual(1, residual_threshold=smooth, residual_edge_threshold=edge, **clamp)
        off = picture - all_pixels
        yield {"smooth_sr": smooth, "edge_sr": edge, **row, "off_given_percent": round(100 * float(numpy.sqrt((off ** 2).mean())) / given, 2),
               "sum_percent": round(100 * float(off.mean()) / given, 2)}


def shares(subject, clamp, iterations):
    """What is taken off, and how much of that comes back."""
    none = subject.picture(residual="screen", iterations=0, **QUIET, **clamp)
    rays = subject.picture(residual="rays", **QUIET, **clamp)
    taken = float((rays - none).mean())
    row = {"taken_percent": round(100 * taken / float(rays.mean()), 2), "off_percent": {"clamped": subject.off(none), "rays": subject.off(rays)},
           "given_back_percent": {}}
    for residual in ("screen", "both"):
        for count in iterations:
            picture = subject.picture(residual=residual, iterations=count, **QUIET, **clamp)
            name = f"{residual}, {count}"
            row["off_percent"][name] = subject.off(picture)
            row["given_back_percent"][name] = round(100 * float((picture - none).mean()) / taken, 1)
    return row


def cost(subject):
    frames = [subject.render(residual="screen", iterations=1) for _ in range(subject.runs)]
    whole = subject.frame_ms(residual="screen", iterations=1)
    iteration = numpy.median([pass_ms(frame, "residual") for frame in frames])
    return {"frame_ms": whole, "iteration_ms": round(float(iteration), 1),
            "iteration_of_frame": round(float(iteration / whole), 3), "ns_per_pixel": round(1e6 * float(iteration) / subject.side ** 2)}


SIDES, VPLS, BOUNCES = (96, 192, 384), (256, 1024, 4096, 16384), (1, 2, 4, 16)


def growth(subject):
    return {"pixels": [{"side": side, "ms": subject.frame_ms(side=side)} for side in SIDES],
            "vpls": [{"vpls": count, "ms": subject.frame_ms(vpls=count)} for count in VPLS],
            "bounces": [{"indirect_bounces": count, "ms": subject.frame_ms(indirect_bounces=count)} for count in BOUNCES]}


PARTS = {
    "ladder": lambda subject: list(ladder(subject)),
    "growth": growth,
    "cost": cost,
    "levels": lambda subject: list(levels(subject)),
    "thresholds": lambda subject: list(thresholds(subject)),
    "iterations": lambda subject: shares(subject, subject.clamp(RADIUS), range(1, ITERATIONS + 1)),
    "radii": lambda subject: [{"radius": radius, **shares(subject, subject.clamp(radius), (2,))} for radius in RADII],
}


def rows_of(subject, name, parts):
    row = {"scene": name, "side": subject.side, "diagonal_m": round(subject.diagonal_m, 3), **{part: PARTS[part](subject) for part in parts}}
    by_hand.say(row)
    return row


def main(words=None):
    made = by_hand.parser(__doc__)
    by_hand.add_names(made, SCENES)
    made.add_argument("--side", type=by_hand.count, default=192)
    made.add_argument("--runs", type=by_hand.count, default=5)
    made.add_argument("--parts", type=lambda text: text.split(","), default=list(PARTS))
    made.add_argument("--brdf", choices=("lambert", "full"), default="lambert")
    made.add_argument("--truths", type=pathlib.Path)
    made.add_argument("--sheet", type=pathlib.Path)
    options = by_hand.parse(made, words, names=SCENES)
    strips = []
    result = {"command": f"bias_compensation.py BUILD SCENES -o RESULT --side {options.side} --runs {options.runs} --parts {','.join(options.parts)} --brdf {options.brdf} --scenes {','.join(options.names)}",
              "machine": live.machine(options.build), "rows": []}
    with live.package(options.build).private() as daemon:
        for name in options.names:
            scene = daemon.scenes.add(options.scenes / f"{name}.glb")
            subject = Subject(scene, name, options)
            result["rows"].append(rows_of(subject, name, options.parts))
            if options.sheet:
                strips.append(strip(subject))
    by_hand.write(result, options.output)
    if strips:
        films.save(strips, options.sheet)


if __name__ == "__main__":
    sys.exit(main())
