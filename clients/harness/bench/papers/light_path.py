"""Nichols, Shopf and Wyman 2009, Fig. 10: time while the light moves."""
from . import scenes
from .figure import (Figure, Group, Line, Panel, Run, Target, along, frame_ms, most_over_least,
                     stage_ms)

SIZE, PLACES = 512, 6
REACH_M = .8  # the light goes so far to the side, and half as far towards the eye
COARSE = 1024  # 32x32 blocks of the light's map; one level of splitting makes 64x64
LEAVES = 4096
TAUS = (.1, .03, .005)
LABELS = ("isr", *(f"hisr tau={tau:g}" for tau in TAUS))


def groups():
    return [Group(f"place {i}", tuple(_runs(_moved(i)))) for i in range(PLACES)]


def _moved(number):
    share = number / (PLACES - 1)
    reach_m = REACH_M * share
    return scenes.with_moved_light(scenes.DRAGON, number, (-reach_m, 0.0, .5 * reach_m))


def _runs(scene):
    yield Run("isr", scene, "isr", {"vpls": COARSE, "cluster_levels": 1}, SIZE)
    for tau in TAUS:
        yield Run(f"hisr tau={tau:g}", scene, "hisr", {"vpls": LEAVES, "tau": tau}, SIZE)


def _lines(found, value, labels=LABELS):
    return tuple(Line(label, along(found, "place", PLACES, label, value)) for label in labels)


def panels(found):
    start = next(iter(found.values()))["isr"]
    place = "place of the light"
    return [Panel("Frame", place, "time over isr’s at the start",
                  _lines(found, lambda p: frame_ms(p) / frame_ms(start))),
            Panel("Gathering alone", place, "time over isr’s at the start",
                  _lines(found, lambda p: stage_ms(p) / stage_ms(start))),
            Panel("VPLs of isr", place, "VPLs",
                  _lines(found, lambda p: p["counts"]["vpls"], ("isr",)))]


def targets(found):
    if not found:
        return []
    return [Target("Fig. 10", f"slowest over fastest gather along the light’s path: {line.label}",
                   most_over_least(line.points), "no number") for line in _lines(found, stage_ms)]


FIGURE = Figure(
    "light_path", "A light that moves (Nichols, Shopf and Wyman 2009, Fig. 10)",
    "As the light moves, what it sees becomes more or less complex, and so does the number of VPLs: the "
    "frame rate changes.",
    groups, panels, targets)
