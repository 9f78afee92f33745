"""Cost curves: a frame's time over one number alone, in a box with five balls."""
from . import scenes
from .figure import Figure, Group, Line, Panel, Run, Target, each, frame_ms, indirect_ms

TECHNIQUES = ("rsm", "multires_gather", "multires_splat", "isr", "hisr")
BASE_VPLS, BASE_SIZE = 256, 512
TRIANGLES_EACH = (1280, 5120, 20480, 81920)
SIZES = (128, 256, 512, 1024, 2048)
VPL_COUNTS = (64, 256, 1024, 4096, 16384, 65536)
VPLS_SIZE = 256
LIGHTS = (1, 2, 4, 8, 16)
LIGHTS_SIZE = 256
SPLAT_MOST = {"pixels": 1024, "VPLs": 1024, "lights": 16, "triangles": 81920}  # more takes too long
AXES = {"triangles": (tuple(5 * n + 10 for n in TRIANGLES_EACH), TRIANGLES_EACH, "triangles"),
        "pixels": (SIZES, SIZES, "pixels along each side"),
        "VPLs": (VPL_COUNTS, VPL_COUNTS, "VPLs"),
        "lights": (LIGHTS, LIGHTS, "lights")}


def groups():
    return [Group(name, tuple(_runs(name))) for name in AXES]


def _runs(axis):
    for value in AXES[axis][1]:
        for technique in TECHNIQUES:
            if technique != "multires_splat" or value <= SPLAT_MOST[axis]:
                yield _run(axis, value, technique)


def _run(axis, value, technique):
    scene, size, vpls = scenes.balls(), BASE_SIZE, BASE_VPLS
    if axis == "triangles":
        scene = scenes.balls(value)
    elif axis == "pixels":
        size = value
    elif axis == "VPLs":
        size, vpls = VPLS_SIZE, value
    else:
        scene, size = scenes.balls(light_count=value), LIGHTS_SIZE
    return Run(f"{technique} {value}", scene, technique, {"vpls": vpls}, size)


def _curve(found, axis, technique, value):
    points = found[axis]
    return [(x, value(points[f"{technique} {v}"])) for x, v in zip(*AXES[axis][:2])
            if f"{technique} {v}" in points]


def panels(found):
    return [Panel(f"Frame over {axis}", AXES[axis][2], "ms",
                  tuple(Line(t, tuple(_curve(found, axis, t, frame_ms))) for t in TECHNIQUES),
                  log_x=True, log_y=True)
            for axis, _ in each(found, AXES)]


def growth(curve):
    """(factor along x, factor of time) from a curve's first point to its last."""
    (x0, y0), (x1, y1) = curve[0], curve[-1]
    return x1 / x0, y1 / y0


def targets(found):
    """No target: the table of how much longer a frame takes over each axis."""
    made = []
    for axis, _ in each(found, AXES):
        for technique in TECHNIQUES:
            x, whole = growth(_curve(found, axis, technique, frame_ms))
            _, indirect = growth(_curve(found, axis, technique, indirect_ms))
            made += [Target(axis, f"{technique}: frame, {x:.4g} times the {AXES[axis][2]}", whole),
                     Target(axis, f"{technique}: its indirect light", indirect)]
    return made


FIGURE = Figure(
    "cost", "Cost curves",
    "Not the papers’: what a frame of ours costs over triangles, pixels, VPLs for each light, and lights.",
    groups, panels, targets, curves=tuple(AXES))
