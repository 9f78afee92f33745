"""Light that is known on paper, for every technique whose model can meet it.

Which closed forms hold for a technique, and what their answer is, follows from the model that it
declares; how near it must come, from its declared tolerance. The scenes: oracles_scenes.py.
"""
import argparse
import dataclasses
import math
import shlex
from pathlib import Path

import numpy as np

from .daemon import Daemon, RenderError
from .oracles_scenes import ORACLES
from .techniques import chosen
from .verdicts import FAIL, SKIP, Table, Verdict, judged

SIGMAS = 4.0
SAMPLED_RAYS, SAMPLED_TOLERANCE = 256, 0.02  # of a pixel, to lights that have a size
TRACED_SIDE = 24  # pixels at least, of a reference: a view is one measurement, its noise the mean's
# Of techniques that take a number of bounces: numbers for which more answers are known, (usually, with --long).
BOUNCES = {"bounces": ((1,), (1, 2, 3)), "indirect_bounces": ((3,), (2, 3, 8))}
VARIANCE = {"beauty": "variance", "direct": "direct_variance", "indirect": "indirect_variance"}


@dataclasses.dataclass(frozen=True)
class Reading:
    """A technique with some settings, and the model that it has with them."""
    technique: object
    model: object
    settings: dict
    note: str = ""


def readings(technique, long):
    yield Reading(technique, technique.model, {})
    for key, counts in BOUNCES.items():
        for count in counts[long] if technique.has(key) else ():
            yield Reading(technique, dataclasses.replace(technique.model, indirect_bounces=count),
                          {key: count}, f"{key}={count}")


def model_of(oracle, reading):
    """The model for the lights of an oracle: of some it may have no light that surfaces send on."""
    model = reading.model
    if oracle.needs.kinds <= model.indirect_lights:
        return model
    return dataclasses.replace(model, indirect_bounces=0)


def is_sampled(oracle, reading):
    """Whether its direct light is sought by rays, which are noisy."""
    return reading.technique.has("light_rays") and oracle.needs.kinds != {"punctual"}


def reason_against(oracle, reading):
    """Why an oracle does not apply, or ""."""
    missing = [key for key in oracle.asks if not reading.technique.has(key)]
    if missing:
        return f"no parameter {missing[0]}"
    if not oracle.full_brdf and not reading.technique.has("brdf"):
        return "surfaces cannot be made Lambertian"
    return oracle.needs(model_of(oracle, reading))


def tolerance_of(technique, layer):
    if layer in ("direct", "emission"):
        return technique.tolerance_direct
    return max(technique.tolerance_direct, technique.tolerance_indirect)


@dataclasses.dataclass
class Sighting:
    """One layer of one view: what is there, what should be, and the noise of what is there."""
    view: str
    layer: str
    seen: np.ndarray
    expected: np.ndarray
    variance: np.ndarray

    def error_of_sum(self):
        """(relative error, its standard deviation)"""
        total = self.expected.sum()
        return (abs(self.seen.sum() / total - 1), math.sqrt(self.variance.sum()) / total)

    def largest_error(self):
        with np.errstate(all="ignore"):
            error = np.abs(self.seen / self.expected - 1)
        return float(np.where(np.isfinite(error), error, np.inf).max())


def sight(daemon, oracle, reading, view, path):
    """The sightings of one view."""
    technique = reading.technique
    settings = {**technique.tolerance_settings, **reading.settings, **oracle.settings}
    if not oracle.full_brdf and technique.has("brdf"):
        settings["brdf"] = "lambert"
    if is_sampled(oracle, reading):
        settings["light_rays"] = SAMPLED_RAYS
    side = max(oracle.side, TRACED_SIDE if technique.is_reference else 0)
    expected = oracle.expected(view, view.points(side), model_of(oracle, reading))
    if not expected:
        return
    layers = ["beauty", *(name for name in expected if name != "beauty")]
    if technique.is_reference:
        layers.append("variance")  # stands for all of them
    extra = ()
    if oracle.environment:
        extra = ("--environment", ",".join(map(str, oracle.environment)))
    frame = daemon.render(path, technique.name, settings, (side, side), view.name, layers,
                          extra=extra, timeout_s=600)
    for layer, value in expected.items():
        seen = frame.layer(layer).astype(np.float64)
        value = np.asarray(value, float)
        value = value[..., None] if value.ndim >= 2 and value.shape[-1] != 3 else value
        variance = np.zeros_like(seen)
        if technique.is_reference and layer in VARIANCE:
            variance = frame.layer(VARIANCE[layer]).astype(np.float64)
        yield Sighting(view.name, layer, seen, np.broadcast_to(value, seen.shape), variance)


def _together(sightings):
    """One sighting a layer out of those of all views, side by side."""
    for layer in dict.fromkeys(sighting.layer for sighting in sightings):
        same = [sighting for sighting in sightings if sighting.layer == layer]
        yield Sighting("all views", layer, *(np.concatenate([getattr(item, name) for item in same])
                                             for name in ("seen", "expected", "variance")))


def judge_sighting(oracle, reading, sighting, reproduce):
    tolerance = tolerance_of(reading.technique, sighting.layer)
    if is_sampled(oracle, reading):
        tolerance = max(tolerance, SAMPLED_TOLERANCE)
    note = ", ".join(word for word in (sighting.layer, reading.note) if word)
    if not sighting.expected.any():
        figure, tolerance = float(np.abs(np.nan_to_num(sighting.seen, nan=np.inf)).max()), 0
        note += ", exactly 0"
    elif oracle.whole or reading.technique.is_sampled:
        figure, deviation = sighting.error_of_sum()
        tolerance += SIGMAS * deviation
        note += ", of the sum"
    else:
        figure = sighting.largest_error()
    return judged(reading.technique.name, oracle.name, sighting.view, figure, tolerance, note,
                  reproduce)


def judge(daemon, oracle, reading, folder, reproduce):
    """All verdicts of one oracle on one technique."""
    def fault(note, command=""):
        return Verdict(reading.technique.name, oracle.name, "", FAIL, note=note, command=command)

    writer = oracle.build()
    for view in oracle.views:
        view.place(writer)
    path = folder / (oracle.name.replace(" ", "_").replace(",", "") + ".glb")
    writer.write_glb(path)
    try:
        sightings = [sighting for view in oracle.views
                     for sighting in sight(daemon, oracle, reading, view, path)]
    except RenderError as error:
        return [fault(str(error), error.command)]
    if not sightings:
        return [Verdict(reading.technique.name, oracle.name, "", SKIP,
                        note="nothing of it is in the model")]
    return [judge_sighting(oracle, reading, sighting, reproduce)
            for sighting in (_together(sightings) if oracle.whole else sightings)]


def parser():
    out = argparse.ArgumentParser(prog="bounce stability --oracles",
                                  description="closed forms of light: techniques x oracles")
    out.add_argument("--technique", action="append", default=[], help="repeatable; default: all")
    out.add_argument("--only", action="append", default=[], metavar="ORACLE",
                     help='repeatable; by the beginning of a name: "D8"')
    out.add_argument("--long", action="store_true", help="more numbers of bounces")
    out.add_argument("--keep", type=Path, metavar="FOLDER", help="leave the scenes there")
    out.add_argument("--list", action="store_true", help="the names alone")
    out.add_argument("--json", action="store_true")
    return out


def command(technique, oracle):
    return shlex.join(["bounce", "stability", "--oracles", "--technique", technique.name,
                       "--only", oracle.name])


def run_technique(daemon, technique, oracles, long, folder, table):
    for oracle in oracles:
        known = list(readings(technique, long))
        apply = [reading for reading in known if not reason_against(oracle, reading)]
        if not apply:
            table.add(Verdict(technique.name, oracle.name, "", SKIP,
                              note=reason_against(oracle, known[0])))
        for reading in apply:
            for verdict in judge(daemon, oracle, reading, folder, command(technique, oracle)):
                table.add(verdict)


def main(words):
    options = parser().parse_args(words)
    oracles = [oracle for oracle in ORACLES
               if not options.only or oracle.name.startswith(tuple(options.only))]
    if options.list:
        print("\n".join(oracle.name for oracle in oracles))
        return 0
    table = Table("oracle", "view", options.json)
    with Daemon() as daemon:
        folder = options.keep or daemon.folder
        folder.mkdir(parents=True, exist_ok=True)
        for technique in chosen(daemon, options.technique):
            run_technique(daemon, technique, oracles, options.long, folder, table)
    return table.finish()
