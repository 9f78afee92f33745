"""Novák, Engelhardt and Dachsbacher 2011: what an iteration over the picture costs, how many parts of it a pixel looks at, how much of
what a clamp takes off comes back."""
from . import scenes
from .figure import Figure, Group, Line, Panel, Run, Target, each, error, frame_ms, passes_ms

DIAGONALS_M = {scenes.CORNELL: 3.487, scenes.BOX: 3.487, scenes.SPONZA: 41.594}
SCENES = {s.name: s for s in DIAGONALS_M}
REACH = .1  # of the scene's diagonal: what lies nearer is clamped
# So many virtual lights and rays that little is noise.
QUIET = {"vpls": 16384, "walk_vpls": 16384, "rays": 64, "far_rays": 32, "cache_cells": 16384}
SIZE, ITERATIONS = 192, 4

LEVELS, LEVELS_SIZE = (1, 2, 3, 4, 5, 6), 512
LEVELLED = {s.name: s for s in (scenes.CORNELL, scenes.BOX)}
THRESHOLDS_SR = ((.32, .16), (.16, .08), (.08, .04), (.04, .02), (.02, .02), (.01, .01))
PAPER = (.08, .04)


def groups():
    made = [Group(f"cost, {name}", (Run("1", scene, "ssbc", {"residual": "screen", "iterations": 1}, SIZE),)) for name, scene in SCENES.items()]
    made += [Group(f"levels, {name}", tuple(_levels(scene))) for name, scene in LEVELLED.items()]
    made += [Group(f"given back, {name}", tuple(_iterations(scene))) for name, scene in SCENES.items()]
    return made + [Group(f"thresholds, {name}", tuple(_thresholds(scene))) for name, scene in SCENES.items()]


def _run(label, scene, settings, size=SIZE, against=()):
    clamp = f"{1 / (REACH * DIAGONALS_M[scene]) ** 2:.6g}"
    return Run(label, scene, "ssbc", {"clamp": clamp, **settings}, size, against=against, timed=False)


def _screen(iterations):
    return {"residual": "screen", "iterations": iterations}


def _levels(scene):
    for count in LEVELS:
        yield _run(str(count), scene, {**_screen(1), "residual_levels": count}, LEVELS_SIZE)


def _iterations(scene):
    yield _run("rays", scene, {**QUIET, "residual": "rays"})
    for count in range(ITERATIONS + 1):
        yield _run(str(count), scene, {**QUIET, **_screen(count)}, against=("rays",))


def _thresholds(scene):
    yield _run("all", scene, {**_screen(1), "residual_levels": 1, "residual_threshold": 0, "residual_edge_threshold": 0})
    for smooth, edge in THRESHOLDS_SR:
        settings = {**_screen(1), "residual_threshold": smooth, "residual_edge_threshold": edge}
        yield _run(f"{smooth:g} {edge:g}", scene, settings, against=("all",))


# --- what is drawn --------------------------------------------------------------------------

def _of(kind, found, names=SCENES):
    return each({name: found[f"{kind}, {name}"] for name in names if f"{kind}, {name}" in found}, names)


def _parts(point):
    """Of the picture, that a pixel looks at in an iteration; at least one."""
    return max(1.0, point["counts"].get("screen_parts", 0) / point["size"] ** 2)


def _given_back(points, iterations):
    """Of the light that the clamp takes off, by the picture alone. 0 where it takes nothing."""
    taken = error(points["0"], "rays", "signed")
    return 1 - error(points[str(iterations)], "rays", "signed") / taken if taken else 0.0


def panels(found):
    made = []
    levelled, given, closer = _of("levels", found, LEVELLED), _of("given back", found), _of("thresholds", found)
    if levelled:
        made.append(Panel(f"Parts that a pixel looks at, {LEVELS_SIZE}x{LEVELS_SIZE}", "levels", "parts",
                          tuple(Line(name, tuple((n, _parts(points[str(n)])) for n in LEVELS)) for name, points in levelled), log_y=True))
    if given:
        made.append(Panel("What the picture gives back", "iterations", "of what the clamp takes off",
                          tuple(Line(name, tuple((n, _given_back(points, n)) for n in range(ITERATIONS + 1))) for name, points in given),
                          percent_y=True))
    if closer:
        lines = [Line(name, tuple((_parts(points[f"{a:g} {b:g}"]), error(points[f"{a:g} {b:g}"], "all")) for a, b in THRESHOLDS_SR))
                 for name, points in closer]
        made.append(Panel(f"Thresholds of {THRESHOLDS_SR[0][0]:g} to {THRESHOLDS_SR[-1][0]:g} sr", "parts that a pixel looks at",
                          "relative RMSE against all pixels", tuple(lines), log_x=True, log_y=True, percent_y=True))
    return made


def targets(found):
    made = []
    for name, points in _of("cost", found):
        made.append(Target("B3.1", f"an iteration, of the frame: {name}", passes_ms(points["1"], "residual") / frame_ms(points["1"]),
                           "19 to 27 %", most=.27, percent=True))
    for name, points in _of("levels", found, LEVELLED):
        made.append(Target("B3.2", f"parts with one level over six, {LEVELS_SIZE}x{LEVELS_SIZE}: {name}",
                           _parts(points[str(LEVELS[0])]) / _parts(points[str(LEVELS[-1])]), "quickly decreases", least=20))
    for name, points in _of("given back", found):
        made.append(Target("B3.3", f"given back by the picture, 2 iterations: {name}", _given_back(points, 2), "most", least=.9, percent=True))
        first, last = _given_back(points, 1), _given_back(points, ITERATIONS)
        made.append(Target("B3.4", f"1 iteration, of what {ITERATIONS} give back: {name}", first / last if last else 0.0, "1 is enough", least=.9, percent=True))
    for name, points in _of("thresholds", found):
        made.append(Target("B3.5", f"off all pixels, {PAPER[0]:g} and {PAPER[1]:g} sr: {name}", error(points[f"{PAPER[0]:g} {PAPER[1]:g}"], "all"),
                           "no number", most=.01, percent=True))
    return made


FIGURE = Figure(
    "compensation", "What a clamp takes off (Novák, Engelhardt and Dachsbacher 2011)",
    "27 ms of 100 to 139 for an iteration; up to 4,000 parts of the picture for a pixel with one level, soon fewer with more; one iteration is "
    "enough for diffuse surfaces, and gives back most of what a clamp takes off.",
    groups, panels, targets)
