"""Nichols and Wyman 2010, Sec. 5.2: what it costs to ask a block's neighbours too."""
from . import scenes
from .figure import Figure, Group, Line, Panel, Run, Target, each, error, fragments_share, frame_ms

KINDS = ("plain", "diagonal", "adjacent")
PAPER = {"diagonal": 1.03, "adjacent": 1.4}
SCENES = {"cornell_dragon_bunny": scenes.DRAGON, "sponza_dabrovic": scenes.SPONZA}
VPLS, SIZE = 64, 1024


def groups():
    return [Group(name, tuple(_runs(scene))) for name, scene in SCENES.items()]


def _runs(scene):
    yield Run("full", scene, "rsm", {"vpls": VPLS}, SIZE, timed=False)
    for kind in KINDS:
        yield Run(kind, scene, "multires_splat",
                  {"vpls": VPLS, "surface_detail": "off", "neighbourhood": kind}, SIZE, against=("full",))


def panels(found):
    names = tuple(found)
    lines = tuple(Line(kind, tuple((i, frame_ms(found[n][kind]) / frame_ms(found[n]["plain"]))
                                   for i, n in enumerate(names))) for kind in KINDS)
    paper = tuple(Line(f"paper: {kind}, at most", tuple((i, ratio) for i in range(len(names))), paper=True)
                  for kind, ratio in PAPER.items())
    errors = tuple(Line(kind, tuple((i, error(found[n][kind], "full")) for i, n in enumerate(names)))
                   for kind in KINDS)
    return [Panel("Frame", "", "time over plain", (*lines, *paper), names=names),
            Panel("Error", "", "relative RMSE against every pixel", errors, names=names, percent_y=True)]


def targets(found):
    made = []
    for name, points in each(found, SCENES):
        for kind, ratio in PAPER.items():
            made.append(Target("B1.6", f"frame, {kind} over plain: {name}",
                               frame_ms(points[kind]) / frame_ms(points["plain"]), ratio, most=ratio))
            made.append(Target("B1.6", "its fragments, likewise",
                               fragments_share(points[kind]) / fragments_share(points["plain"])))
    return made


FIGURE = Figure(
    "neighbourhood", "Asking neighbours (Nichols and Wyman 2010, Sec. 5.2)",
    "Refining where a discontinuity is in any adjacent block costs up to 40 %; diagonal blocks alone cost 2 to 3 % and "
    "are needed.", groups, panels, targets)
