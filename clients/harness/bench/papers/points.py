"""Maletz, Wang and Bowers 2011: points in a second, what clusters cost, importance against chance, how many pixels are told, what
sub-frames cost, what more points are worth, surfaces that shine."""
from . import scenes
from .figure import Figure, Group, Line, Panel, Run, Target, each, error, fragments_share, frame_ms, passes_ms

FULL = {"brdf": "full"}
SCENES = {s.name: s for s in (scenes.CORNELL, scenes.BOX, scenes.SPONZA)}
# Each pixel told by itself.
PIXELS = {"finest": 1, "depth_threshold": 0, "normal_threshold": 0}
POINTS, EXPLORE, CLUSTERS, EXPLOIT = 262144, 2, 512, 2048
PROJECTED = EXPLOIT + EXPLORE * CLUSTERS
# What is projected is the question, not what comes to points before, what rays bring beside it, nor what a filter makes of it.
MAP = {"map_rays": 0}
ONCE = {**FULL, **PIXELS, **MAP, "indirect_bounces": 1}
BARE = {**ONCE, "noise_filter": "off"}
EXPLOITS = (256, 1024, EXPLOIT, 8192)

# The paper's, of which clusters are a share.
CLUSTERED_SIZE = 512
SPEED_SIZE, SAMPLED_SIZE, TOLD_SIZE = 192, 48, 192
SUB_FRAMES = 4
COUNTS = (1 << 14, 1 << 16, 1 << 18, 1 << 20)
# `many_light` at a rung that takes about as long.
SHINING = {s.name: s for s in (scenes.BUDDHA, scenes.TEAPOT)}
SHINING_SIZE = 160
AS_LONG = {"vpls": 8192, "rays": 32, "far_rays": 32, "walk_vpls": 8192, "cache_cells": 8192, "photons": 1 << 20}


def groups():
    made = [Group(f"speed, {name}", (Run("ours", scene, "point_projection", {"brdf": "lambert", **PIXELS, **MAP}, SPEED_SIZE),
                                     Run("printed", scene, "point_projection", {"brdf": "lambert", **PIXELS, "paper_mode": 1}, SPEED_SIZE)))
            for name, scene in SCENES.items()]
    made += [Group(f"sampled, {name}", tuple(_sampled(scene))) for name, scene in SCENES.items()]
    made += [Group(f"told, {name}", tuple(_told(scene))) for name, scene in SCENES.items()]
    made += [Group(f"points, {name}", tuple(_counts(scene))) for name, scene in SCENES.items()]
    made += [Group(f"clusters, {name}", (Run("frame", scene, "point_projection", {**ONCE, "brdf": "lambert"}, CLUSTERED_SIZE),))
             for name, scene in SCENES.items()]
    made += [Group(f"sub-frames, {name}", tuple(Run(str(count), scene, "point_projection", FULL, TOLD_SIZE, aa=count) for count in (1, SUB_FRAMES)))
             for name, scene in SCENES.items()]
    return made + [Group(f"shining, {name}", tuple(_shining(scene))) for name, scene in SHINING.items()]


def _sampled(scene):
    yield Run("all", scene, "point_projection", {**BARE, "projection": "all"}, SAMPLED_SIZE, timed=False)
    for exploit in EXPLOITS:
        for by in ("importance", "uniform"):
            settings = {**BARE, "projection": by, "exploit": exploit}
            yield Run(f"{by} {exploit}", scene, "point_projection", settings, SAMPLED_SIZE, against=("all",), timed=False)


def _truth(scene, size):
    return Run("truth", scene, "reference", {"spp": 512, "light_vertices": "off"}, size, timed=False)


def _told(scene):
    yield _truth(scene, TOLD_SIZE)
    yield Run("pixels", scene, "point_projection", {**FULL, **PIXELS}, TOLD_SIZE, against=("truth",))
    yield Run("blocks", scene, "point_projection", {**FULL, "finest": 1}, TOLD_SIZE, against=("truth",))


def _counts(scene):
    yield _truth(scene, SAMPLED_SIZE)
    for count in COUNTS:
        yield Run(str(count), scene, "point_projection", {**FULL, **PIXELS, "points": count}, SAMPLED_SIZE, against=("truth",))


def _shining(scene):
    yield Run("truth", scene, "reference", {"spp": 512}, SHINING_SIZE, timed=False)
    yield Run("points", scene, "point_projection", FULL, SHINING_SIZE, against=("truth",))
    yield Run("many lights", scene, "many_light", {**FULL, **AS_LONG}, SHINING_SIZE, against=("truth",))


# --- what is drawn --------------------------------------------------------------------------

def _of(kind, found, names=SCENES):
    return each({name: found[f"{kind}, {name}"] for name in names if f"{kind}, {name}" in found}, names)


def _giga_points(point):
    """0 of a frame that projected nothing."""
    ms = passes_ms(point, "project")
    return SPEED_SIZE ** 2 * PROJECTED / ms / 1e6 if ms else 0.0


def _moving_ms(point):
    """What each camera costs anew: all but points and their clusters."""
    return frame_ms(point) - passes_ms(point, "points", "point_clusters")


def panels(found):
    made = []
    sampled, counted = _of("sampled", found), _of("points", found)
    if sampled:
        lines = [Line(f"{name}, {by}", tuple((n, error(points[f"{by} {n}"], "all")) for n in EXPLOITS))
                 for name, points in sampled for by in ("importance", "uniform")]
        made.append(Panel("Some points instead of all", "points drawn, beside 1,024", "relative RMSE against all", tuple(lines),
                          log_x=True, log_y=True, percent_y=True))
    if counted:
        made.append(Panel("Points of the scene", "points", "relative RMSE against the truth",
                          tuple(Line(name, tuple((n, error(points[str(n)], "truth")) for n in COUNTS)) for name, points in counted),
                          log_x=True, percent_y=True))
    return made


def targets(found):
    made = []
    for name, points in _of("speed", found):
        made.append(Target("B4.1", f"thousands of millions of points a second, {SPEED_SIZE}x{SPEED_SIZE}: {name}", _giga_points(points["ours"]),
                           .2, least=.25))
        made.append(Target("B4.1", f"the same as printed: {name}", _giga_points(points["printed"])))
    for name, points in _of("sampled", found):
        made.append(Target("B4.2", f"off all points, importance over chance, {PROJECTED:,} of {POINTS:,}: {name}",
                           error(points[f"importance {EXPLOIT}"], "all") / error(points[f"uniform {EXPLOIT}"], "all"), most=.5))
    for name, points in _of("clusters", found):
        clusters_ms = passes_ms(points["frame"], "point_clusters")
        made.append(Target("B4.3", f"clusters, of a frame of {CLUSTERED_SIZE}x{CLUSTERED_SIZE}: {name}", clusters_ms / frame_ms(points["frame"]),
                           "up to .33 %", most=.01, percent=True))
        made.append(Target("B4.3", f"ns a point, of {POINTS:,}: {name}", clusters_ms / POINTS * 1e6, 38))
    for name, points in _of("told", found):
        made.append(Target("B4.4", f"pixels told: {name}", fragments_share(points["blocks"]), "25 to 33 %", most=.3, percent=True))
        made.append(Target("B4.4", f"off the truth, over that of all pixels told: {name}",
                           error(points["blocks"], "truth") / error(points["pixels"], "truth"), 1, most=1.05))
        made.append(Target("B4.4", f"time, of that of all pixels told: {name}", frame_ms(points["blocks"]) / frame_ms(points["pixels"]),
                           percent=True))
    for name, points in _of("sub-frames", found):
        more, one = points[str(SUB_FRAMES)], points["1"]
        made.append(Target("B4.5", f"{SUB_FRAMES} sub-frames over one: {name}", frame_ms(more) / frame_ms(one), "2 to 3", most=3))
        made.append(Target("B4.5", f"the same without points and clusters: {name}", _moving_ms(more) / _moving_ms(one)))
    for name, points in _of("points", found):
        made.append(Target("B4.6", f"off the truth, {COUNTS[-1]:,} points over {POINTS:,}: {name}",
                           error(points[str(COUNTS[-1])], "truth") / error(points[str(POINTS)], "truth"), 1, least=.95, most=1.05))
    for name, points in _of("shining", found, SHINING):
        ours, other = points["points"], points["many lights"]
        for kind, said in (("rel_rmse", "light"), ("tones", "tones x / (x + mean)")):
            off, others = error(ours, "truth", kind), error(other, "truth", kind)
            made.append(Target("shining", f"{said} off the truth: {name}", off, percent=True))
            made.append(Target("shining", f"over that of many_light: {name}", off / others))
        made.append(Target("shining", f"time, of that of many_light: {name}", frame_ms(ours) / frame_ms(other), percent=True))
    return made


FIGURE = Figure(
    "points", "Points (Maletz, Wang and Bowers 2011)",
    "3,072 of 262,144 points, drawn by importance, look like all of them; a quarter to a third of the pixels is enough; a million points are "
    "no better; 3 to 4 seconds for 512x512 on a graphics card, .2 to .27 thousand millions of points a second, under 10 ms of them for clusters; "
    "twice as many pixels along each side, for edges, take 2 to 3 times as long; surfaces that shine.",
    groups, panels, targets)
