"""Nichols, Shopf and Wyman 2009, Figs. 8 and 9: error of blocks of pixels alone, the VPLs being the same."""
from . import scenes
from .figure import Figure, Group, Line, Panel, Run, Target, each, error, fragments_share, stage_ms

VPLS, SIZE = 1024, 1024
DEPTHS = (.01, .02, .05, .1, .2, .5)
NORMALS = (0, .1, .25, .5, .9, 1.4)
DEPTH, NORMAL = .05, .25
SCENES = {"cornell_box_spot_side": scenes.BOX, "cornell_dragon_bunny": scenes.DRAGON,
          "sponza_dabrovic": scenes.SPONZA}
METHODS = {"hisr": ("hisr", {"vpls": VPLS}), "multires_gather": ("multires_gather", {"vpls": VPLS}),
           "rsm_splat": ("rsm_splat", {"vpls": VPLS, "splat_share": .05})}
RMS_LIMIT, SHARE_LIMIT = .02, .05
SPEED_LEAST = 21  # pixels over fragments in the paper


def groups():
    made = [Group(name, tuple(_sweep(scene))) for name, scene in SCENES.items()]
    made += [Group(f"methods, {name}", tuple(_methods(scene))) for name, scene in SCENES.items()]
    return made


def _sweep(scene):
    """Pictures and counts; what they cost is in gather_or_splat."""
    yield _full(scene, False)
    yield _blocks("every pixel", scene, 0, 0)
    for depth in DEPTHS:
        yield _blocks(f"depth {depth:g}", scene, depth, NORMAL)
    for normal in NORMALS:
        yield _blocks(f"normal {normal:g}", scene, DEPTH, normal)


def _full(scene, timed):
    return Run("full", scene, "rsm", {"vpls": VPLS}, SIZE, timed=timed)


def _blocks(label, scene, depth, normal):
    settings = {"vpls": VPLS, "depth_threshold": depth, "normal_threshold": normal}
    return Run(label, scene, "multires_gather", settings, SIZE, against=("full",), timed=False)


def _methods(scene):
    yield _full(scene, True)
    for label, (technique, settings) in METHODS.items():
        yield Run(label, scene, technique, settings, SIZE, against=("full",))


def _sweep_lines(found, kind, values, get):
    return tuple(Line(name, tuple((v, get(points[f"{kind} {v:g}"])) for v in values))
                 for name, points in each(found, SCENES))


def panels(found):
    made = []
    for kind, values in (("depth", DEPTHS), ("normal", NORMALS)):
        axis = f"threshold of {kind}s"
        for title, value in (("Over the mean, less the worst .01 %", lambda p: error(p, "full", "trimmed")),
                             ("Over the largest", lambda p: error(p, "full", "rmse_max")),
                             ("Fragments", fragments_share)):
            y = "share of the pixels" if value is fragments_share else "RMS error against every pixel"
            made.append(Panel(f"{title}, by {kind}", axis, y, _sweep_lines(found, kind, values, value),
                              percent_y=True))
    names = tuple(name for name in SCENES if f"methods, {name}" in found)
    if names:
        made.append(Panel("Fig. 8: other ways, the same VPLs", "", "relative RMSE against every pixel", tuple(
            Line(label, tuple((i, error(found[f"methods, {n}"][label], "full")) for i, n in enumerate(names)))
            for label in METHODS), names=names, percent_y=True))
    return [panel for panel in made if panel.lines]


def targets(found):
    made = []
    for name, points in each(found, SCENES):
        made.append(Target("B2.5", f"error at thresholds of 0: {name}", error(points["every pixel"], "full"), 0.0,
                           most=1e-5, percent=True))
        best = _best_within(points)
        if best:
            made.append(Target("B2.5", f"least RMS over the mean at up to 5 % fragments ({best['label']}): {name}",
                               error(best, "full"), "2 to 3 %", most=RMS_LIMIT, percent=True))
            made.append(Target("B2.5", f"the same over the largest value: {name}",
                               error(best, "full", "rmse_max"), "2 to 3 %", most=RMS_LIMIT, percent=True))
        else:
            least = min(fragments_share(p) for label, p in points.items() if label != "full")
            made.append(Target("B2.5", f"fewest fragments of all thresholds: {name}", least, .048,
                               most=SHARE_LIMIT, percent=True))
    for name in SCENES:
        points = found.get(f"methods, {name}")
        if points:
            made.append(Target("B2.8", f"stage, every pixel over blocks: {name}",
                               stage_ms(points["full"]) / stage_ms(points["multires_gather"]), "up to 180",
                               least=SPEED_LEAST))
    return made


def _best_within(points):
    """The least error of those with few enough fragments; None where there is none."""
    few = [p for label, p in points.items()
           if label != "full" and fragments_share(p) <= SHARE_LIMIT]
    return min(few, key=lambda p: error(p, "full"), default=None)


FIGURE = Figure(
    "eye_error", "Error of blocks of pixels (Nichols, Shopf and Wyman 2009, Figs. 8 and 9)",
    "At thresholds that are fast enough blocks of pixels alone are 2 to 3 % RMS off gathering at every pixel; at a "
    "threshold of 0 nothing is off.", groups, panels, targets)
