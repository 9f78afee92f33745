"""Metamorphic relations: what a change to the scene must do to the picture, for every technique.

The truth of the picture is not needed. Exact relations hold to rounding; statistical ones within
what the technique itself is off by, measured: its picture against one with a far finer rung of
its ladder. A reference's noise is known: its own variance layer judges it.
"""
import argparse
import dataclasses
import itertools
import shlex
from pathlib import Path

import numpy as np

from . import relations_edit as edit
from . import relations_measure as measure
from . import relations_scenes as scenes
from .daemon import Daemon, RenderError
from .relations_box import closed_box
from .techniques import chosen
from .verdicts import FAIL, SKIP, Table, Verdict, judged

LAYERS = ("beauty", "direct", "indirect", "emission", "albedo", "normal", "depth")
EXACT = 1e-6
TRANSLATED = 1e-4
# By so many sizes and more, as a power of ten, doubles are too few: some coordinate in single precision
# is another, and a ray by chance goes another way.
FAR_FOR_CHANCE = 5
NOT_BY_CHANCE = ("direct", "emission")
CHANCES = 8  # seeds, of which one knows what chance alone does to a sum
# Samples all over a pixel, or its variance would not know of what its centre just missed: through the
# centre alone, blades of grass fall on this side or that by rounding.
REFERENCE_SETTINGS = {"filter": "box"}
REFERENCE_RUNG = 3  # of its ladder: whatever it is, the variance layer says what noise there is
OUTWARD = np.array([0.6, -0.64, 0.48])  # a unit vector along no axis
TURN = [0.1830127, 0.3061862, 0.2041241, 0.9083396]  # about no axis of the scenes
FAR = 2  # rungs from one to the next where nothing tells how many samples they have
SAMPLES_AHEAD = 16  # times as many from one to the next
SAMPLES = ("vpls", "shadow_size", "spp")
MIDDLE_VPLS_COMPARED = 256  # of what is there to be compared with, which takes long
# Of techniques that light blocks of pixels: with as many blocks as they have by default, pictures as
# small as these would have none but single pixels.
COARSE = {"coarsest": "8"}
PERMUTATIONS = ((1, 2, 0), (2, 1, 0))


@dataclasses.dataclass
class Case:
    """One technique on one scene, with what has been rendered so far."""
    daemon: Daemon
    technique: object
    registry: list
    scene: str
    glb: object
    size: tuple
    long: bool
    folder: Path
    frames: dict = dataclasses.field(default_factory=dict)

    def __post_init__(self):
        self.camera = edit.camera_names(self.glb)[0]
        self.rungs = rungs(self.technique, self.registry)
        low, high = edit.corners(self.glb)
        self.size_m = float(np.linalg.norm(high - low))

    def offset(self, power):
        """A translation by 10^power sizes of the scene."""
        return [float(v) for v in OUTWARD * self.size_m * 10.0 ** power]

    def has_finest(self):
        """Whether the ladder goes on beyond the finer rung."""
        return self.rungs["finest"] != self.rungs["finer"]

    def render(self, tag, glb=None, rung="middle", seed=0):
        """The frame of a variant; `tag` is its name, and that of its file."""
        if (tag, rung, seed) not in self.frames:
            path = self.folder / f"{self.scene}.{tag}.glb"
            if not path.exists():
                (glb or self.glb).save(path)
            self.frames[tag, rung, seed] = self.daemon.render(
                path, self.technique.name, self.rungs[rung], self.size, self.camera,
                LAYERS + ("variance",) * self.technique.is_reference, seed, timeout_s=600)
        return self.frames[tag, rung, seed]


def _own_rungs(technique):
    ladder = technique.ladder or ({},)
    if technique.is_reference:
        ladder = [{**settings, **REFERENCE_SETTINGS} for settings in ladder[REFERENCE_RUNG:][:1]]
    middle = _middle(technique, ladder)
    finer = _further(ladder, middle)
    return {"middle": ladder[middle], "finer": ladder[finer],
            "finest": ladder[_further(ladder, finer)]}


def _middle(technique, ladder):
    """The rung that the defaults are on, or a cheaper one."""
    defaults = {key: parameter["standard"] for key, parameter in technique.parameters.items()}
    for place, rung in enumerate(ladder):
        if technique.for_comparison and float(rung.get("vpls", 0)) >= MIDDLE_VPLS_COMPARED:
            return place
        if all(float(defaults[key]) == float(value) for key, value in rung.items()):
            return place
    return len(ladder) // 2


def _further(ladder, place):
    """The first rung with so many more samples; a few rungs on where there is none."""
    keys = [key for key in SAMPLES if key in ladder[place]]
    here = [float(ladder[place][key]) ** (2 if key == "shadow_size" else 1) for key in keys]
    for further in range(place + 1, len(ladder)):
        there = [float(ladder[further][key]) ** (2 if key == "shadow_size" else 1) for key in keys]
        if any(b >= SAMPLES_AHEAD * a for a, b in zip(here, there)):
            return further
    return min(place + FAR, len(ladder) - 1)


def rungs(technique, registry):
    """The settings that relations are judged at, far finer ones, and finer ones yet.

    What another technique's ladder refines and this one has too (the shadow maps of both) is
    refined along: its ladder climbs by what pays most, its error is that of all.
    """
    own = _own_rungs(technique)
    for other in registry:
        for name, settings in _own_rungs(other).items():
            for key, value in settings.items():
                if technique.has(key):
                    own[name] = {key: value, **own[name]}
    blocks = {key: value for key, value in COARSE.items() if technique.has(key)}
    return {name: {**settings, **blocks} for name, settings in own.items()}


def exact(case, a, b, note, factor=1.0, order=(0, 1, 2), mask=None, tolerance=EXACT,
          layers=measure.LIGHT_LAYERS):
    """Frame b must be `factor` times frame a, with a's channels in another order."""
    if case.technique.is_reference:
        yield from within_noise(*noisy(a, factor, order), *noisy(b), note)
        return
    floor = measure.FLOOR_EXACT if tolerance <= EXACT else measure.FLOOR_STATISTICAL
    figure, layer = measure.light_difference(a, b, factor, order, mask, floor, layers)
    yield figure, tolerance, note if figure == 0 else f"{note}, {layer}"


def noisy(frame, factor=1.0, order=(0, 1, 2)):
    """Beauty of a traced picture and its variance."""
    order = list(order)
    return (frame.layer().astype(np.float64)[..., order] * factor,
            frame.layer("variance").astype(np.float64)[..., order] * factor ** 2)


def within_noise(image, variance, other, other_variance, note):
    everything, tiles = measure.sigmas(image, other, variance + other_variance)
    yield everything, measure.SIGMAS_ALL, f"{note}, standard deviations of the sum"
    yield tiles, measure.SIGMAS_TILE, f"{note}, standard deviations of 99 % of the tiles"


# --- exact -------------------------------------------------------------------------------------


def light_power(case):
    for power in (-30, -20, -10, -3, 1, 7, 20, 30) if case.long else (-30, 7, 30):
        lit = case.render(f"power{power}", edit.brightened(case.glb, 2.0 ** power))
        yield from exact(case, case.render("base"), lit, f"2^{power}", 2.0 ** power)


def scene_scale(case):
    for power in (-13, -7, -2, 3, 11, 20) if case.long else (-13, 20):
        factor = 2.0 ** power
        base = case.render("base")
        other = case.render(f"scale{power}", edit.scaled(case.glb, factor))
        yield from exact(case, base, other, f"2^{power}")
        seen = (base.planes["A"] > 0) & (other.planes["A"] > 0)
        a, b = (frame.planes["depth.Z"][seen][:, None] for frame in (base, other))
        yield float(measure.relative(a * np.float64(factor), b).max()), EXACT, f"2^{power}, depth"


def reorder(case):
    for seed in (1, 2, 3) if case.long else (1,):
        other = case.render(f"order{seed}", edit.reordered(case.glb, seed))
        yield from exact(case, case.render("base"), other, f"order {seed}")


def colour_channels(case):
    base = case.render("png", edit.pictures_as_png(case.glb))
    for order in PERMUTATIONS if case.long else PERMUTATIONS[:1]:
        name = "".join("RGB"[i] for i in order)
        other = case.render(f"channels{name}", edit.channels_permuted(case.glb, order))
        yield from exact(case, base, other, f"RGB to {name}", order=order)


def translation(case):
    base = case.render("base")
    mask = measure.silhouettes(base) | measure.map_edges(base)
    for power in _distances(case):
        tag, note = f"moved{power}", f"by 1e{power} sizes"
        glb = edit.under_a_root(case.glb, translation=case.offset(power))
        by_chance = case.technique.is_sampled and power >= FAR_FOR_CHANCE
        yield from exact(case, base, case.render(tag, glb), f"{note}, {100 * mask.mean():.0f} % of "
                         "pixels on edges", mask=mask, tolerance=TRANSLATED,
                         layers=NOT_BY_CHANCE if by_chance else measure.LIGHT_LAYERS)
        if by_chance:
            yield from _statistical(case, tag, glb, note)


def _distances(case):
    if case.long:
        return (0, 3, 5, 7)
    return (3, 7) if case.technique.is_sampled else (7,)


# --- statistical -------------------------------------------------------------------------------


def within_own_error(case, image, other, sides, note, slack=0.0):
    """Verdicts on two pictures of what should be one thing.

    `sides` makes (image, finer image) of both. It is not called where the pictures agree without
    it; where the finer ones do not explain a difference, their own error is measured too.
    """
    pairs = []
    figure, tolerance, level = measure.over_levels(image, other, measure.discretisation(pairs),
                                                   slack)
    mean = abs(measure.signed(other, image))
    if figure > tolerance or mean > measure.MARGIN:
        pairs = sides()
        figure, tolerance, level = measure.over_levels(image, other,
                                                       measure.discretisation(pairs), slack)
    if figure > tolerance and case.has_finest():
        truth = (measure.lit(case.render("base", rung="finer")),
                 measure.lit(case.render("base", rung="finest")))
        figure, tolerance, level = measure.over_levels(
            image, other, measure.discretisation([*pairs, truth, truth]), slack)
    yield figure, tolerance, f"{note}, of {100 * level:g} % of the pixels"
    allowed = measure.MARGIN + sum(abs(measure.signed(a, b)) for a, b in pairs)
    if mean > allowed and case.technique.is_sampled:
        allowed += measure.SIGMAS_ALL * _sum_by_chance(case)
    yield mean, allowed, f"{note}, sum of the light"


def _sum_by_chance(case):
    """Standard deviation of how far two pictures' sums of light are apart, of one scene and two
    seeds, relative."""
    images = [measure.lit(case.render("base", seed=seed)) for seed in range(CHANCES)]
    apart = [measure.signed(a, b) for a, b in itertools.combinations(images, 2)]
    return float(np.sqrt(np.mean(np.square(apart))))


def _statistical(case, tag, glb, note):
    base, other = case.render("base"), case.render(tag, glb)
    if case.technique.is_reference:
        yield from within_noise(*noisy(base), *noisy(other), note)
        return

    def sides():
        return [(measure.lit(case.render(name)), measure.lit(case.render(name, rung="finer")))
                for name in ("base", tag)]

    yield from within_own_error(case, measure.lit(base), measure.lit(other), sides, note,
                                measure.seen_otherwise(base, other) + measure.corners(base))


def rotation(case):
    yield from _statistical(case, "turned", edit.under_a_root(case.glb, rotation=TURN), "turned")


def subdivision(case):
    glb, share = edit.subdivided(case.glb)
    if share == 0:
        yield None, None, "no triangle is flat"
        return
    yield from _statistical(case, "subdivided", glb,
                            f"{100 * share:.0f} % of the triangles cut in 4")


def split_lights(case):
    if not case.glb.lights():
        yield None, None, "no lights"
        return
    yield from _statistical(case, "halves", edit.lights_halved(case.glb), "lights twice, halved")


def added_lights(case):
    """I(a + b) = I(a) + I(b), without emission, which would be in both."""
    glb, lamp = edit.with_a_lamp(edit.without_emission(case.glb), case.camera)
    first = set(edit.light_nodes(glb)) - {lamp}
    parts = {"lights_ab": first | {lamp}, "lights_a": first, "lights_b": {lamp}}
    note = "the lights and one lamp"
    frames = {tag: case.render(tag, edit.with_lights(glb, keep)) for tag, keep in parts.items()}
    if case.technique.is_reference:
        (a, a_variance), (b, b_variance) = (noisy(frames[tag]) for tag in ("lights_a", "lights_b"))
        yield from within_noise(*noisy(frames["lights_ab"]), a + b, a_variance + b_variance, note)
        return
    images = {tag: measure.lit(frame) for tag, frame in frames.items()}
    total = images["lights_a"] + images["lights_b"]

    def sides():
        truths = {tag: measure.lit(case.render(tag, rung="finer")) for tag in parts}
        return [(images["lights_ab"], truths["lights_ab"]),
                (total, truths["lights_a"] + truths["lights_b"])]

    yield from within_own_error(case, images["lights_ab"], total, sides, note)


RELATIONS = {"light_power": light_power, "scene_scale": scene_scale, "reorder": reorder,
             "colour_channels": colour_channels, "translation": translation,
             "rotation": rotation, "subdivision": subdivision, "split_lights": split_lights,
             "added_lights": added_lights}


# --- the command -------------------------------------------------------------------------------


def command(technique, relation, scene, options):
    words = ["bounce", "stability", "--relations", "--technique", technique, "--only", relation,
             "--size", f"{options.size[0]}x{options.size[1]}"]
    words += ["--scenes", scene] if scene else []
    return shlex.join(words + ["--long"] * options.long)


def judge(case, relation, options):
    """The verdicts of one relation on one scene."""
    reproduce = command(case.technique.name, relation, case.scene, options)
    try:
        for figure, tolerance, note in RELATIONS[relation](case):
            if figure is None:
                yield Verdict(case.technique.name, relation, case.scene, SKIP, note=note)
            else:
                yield judged(case.technique.name, relation, case.scene, figure, tolerance, note,
                             reproduce)
    except RenderError as fault:
        yield Verdict(case.technique.name, relation, case.scene, FAIL, note=str(fault),
                      command=fault.command)


def _size(text):
    return tuple(int(side) for side in text.split("x"))


def parser():
    out = argparse.ArgumentParser(prog="bounce stability --relations",
                                  description="metamorphic relations: techniques x scenes")
    out.add_argument("--technique", action="append", default=[], help="repeatable; default: all")
    known = [*RELATIONS, "closed_box"]
    out.add_argument("--only", action="append", default=[], choices=known, metavar="RELATION",
                     help="repeatable: " + ", ".join(known))
    out.add_argument("--scenes", default="handful",
                     help="quick, handful (default), all, or names with commas")
    out.add_argument("--size", type=_size, default=(96, 72), metavar="WxH")
    out.add_argument("--long", action="store_true", help="more steps of each relation")
    out.add_argument("--keep", type=Path, metavar="FOLDER", help="leave the changed scenes there")
    out.add_argument("--json", action="store_true")
    return out


def run_scene(daemon, technique, registry, name, relations, options, table):
    glb = scenes.load(name)
    if glb is None:
        for relation in relations:
            table.add(Verdict(technique.name, relation, name, SKIP,
                              note=f"not in {scenes.folder()}"))
        return
    folder = options.keep or daemon.folder / "scenes"
    folder.mkdir(parents=True, exist_ok=True)
    case = Case(daemon, technique, registry, name, edit.prepared(glb), options.size, options.long,
                folder)
    for relation in relations:
        for verdict in judge(case, relation, options):
            table.add(verdict)


def main(words):
    options = parser().parse_args(words)
    wanted = options.only or [*RELATIONS, "closed_box"]
    table = Table("relation", "scene", options.json)
    with Daemon() as daemon:
        registry = chosen(daemon)
        for technique in chosen(daemon, options.technique):
            if "closed_box" in wanted:
                for verdict in closed_box(daemon, technique, options,
                                          command(technique.name, "closed_box", None, options)):
                    table.add(verdict)
            on_scenes = [relation for relation in wanted if relation in RELATIONS]
            names = scenes.names(options.scenes) if on_scenes else ()
            if technique.for_comparison and not (options.technique or options.long):
                names = names[:1]
            for name in names:
                run_scene(daemon, technique, registry, name, on_scenes, options, table)
    return table.finish()
