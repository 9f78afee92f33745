"""Nichols, Shopf and Wyman 2009, Fig. 11: image-space radiosity over its threshold of depth, from maps
of three sizes."""
from . import scenes
from .figure import Figure, Group, Line, Panel, Run, Target, each, error, frame_ms

SIZE = 512
COARSE = 1024  # blocks that clusters start from, as in the paper
FINE = {"64x64": 1, "128x128": 2, "256x256": 3}  # levels below them
DEPTHS = (.01, .02, .05, .1, .3)
ALL_LEAVES = 65536
SCENES = {"cornell_dragon_bunny": scenes.DRAGON, "sponza_dabrovic": scenes.SPONZA}


def groups():
    return [Group(name, tuple(_runs(scene))) for name, scene in SCENES.items()]


def _runs(scene):
    yield Run("leaves", scene, "multires_gather", {"vpls": ALL_LEAVES}, SIZE, timed=False)
    yield Run("regular", scene, "multires_gather", {"vpls": COARSE}, SIZE, against=("leaves",))
    for fine, levels in FINE.items():
        for depth in DEPTHS:
            settings = {"vpls": COARSE, "cluster_levels": levels, "cluster_depth_threshold": depth}
            yield Run(_label(fine, depth), scene, "isr", settings, SIZE, against=("leaves",))


def _label(fine, depth):
    return f"{fine}, {depth:g}"


def panels(found):
    made = []
    for name, points in each(found, SCENES):
        regular = points["regular"]
        for title, y, value, percent in (
                (f"VPLs, {name}", "VPLs", lambda p: p["counts"]["vpls"], False),
                (f"Frame, {name}", "time over 1,024 regular VPLs",
                 lambda p: frame_ms(p) / frame_ms(regular), False),
                (f"Error, {name}", "relative RMSE against all texels",
                 lambda p: error(p, "leaves"), True)):
            lines = tuple(Line(f"isr from {fine}", tuple(
                (d, value(points[_label(fine, d)])) for d in DEPTHS)) for fine in FINE)
            plain = Line("1,024 regular", tuple((d, value(regular)) for d in (DEPTHS[0], DEPTHS[-1])))
            made.append(Panel(title, "threshold of the light’s depths", y, (*lines, plain),
                              log_x=True, percent_y=percent))
    return made


def targets(found):
    made = []
    for name, points in each(found, SCENES):
        most, least = (points[_label("256x256", d)] for d in (DEPTHS[0], DEPTHS[-1]))
        some, regular = points[_label("128x128", .3)], points["regular"]
        made += [Target("Fig. 11",
                        f"VPLs at the least over those at the largest threshold, 256x256: {name}",
                        most["counts"]["vpls"] / least["counts"]["vpls"], "no number"),
                 Target("Fig. 11", f"their frames: {name}", frame_ms(most) / frame_ms(least),
                        "no number"),
                 Target("Fig. 11", f"error over that of 1,024 regular VPLs, .3, 128x128: {name}",
                        error(some, "leaves") / error(regular, "leaves"), "no number")]
    return made


FIGURE = Figure(
    "clusters", "Clusters of virtual lights (Nichols, Shopf and Wyman 2009, Fig. 11)",
    "Lower thresholds of depth make more light patches and slower frames, the more so the finer the "
    "map; large thresholds end at what the other passes cost.", groups, panels, targets)
