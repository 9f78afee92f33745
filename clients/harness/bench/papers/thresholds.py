"""Nichols and Wyman 2010, Figs. 10 and 11: time and error against the threshold of normals."""
from . import scenes
from .figure import Figure, Group, Line, Panel, Run, Target, each, error, fragments_share, frame_ms

THRESHOLDS = (.1, .25, .5, .9, 1.4)
QUALITY, FAST = .25, 1.4  # Fig. 11's
SIZES = (256, 512, 1024)
LARGE = SIZES[-1]
VPLS = 256
PAPER = 32 / 8  # frames a second of Fig. 11
SCENES = {"cornell_dragon_bunny": (scenes.DRAGON, "CameraClose"),
          "buddha_room": (scenes.BUDDHA, "CameraClose")}
DETAILS = ("off", "paper", "direction")


def groups():
    return [Group(name, tuple(_runs(*place))) for name, place in SCENES.items()]


def _runs(scene, camera):
    for size in SIZES:
        yield Run(f"full {size}", scene, "rsm", {"vpls": VPLS}, size, camera, timed=False)
        for threshold in THRESHOLDS:
            yield _run(scene, camera, size, threshold, "off")
    for threshold in (QUALITY, FAST):
        for detail in DETAILS[1:]:
            yield _run(scene, camera, LARGE, threshold, detail)


def _run(scene, camera, size, threshold, detail):
    settings = {"vpls": VPLS, "surface_detail": detail, "normal_threshold": threshold}
    return Run(_label(size, threshold, detail), scene, "multires_splat", settings, size, camera,
               against=(f"full {size}",))


def _label(size, threshold, detail="off"):
    return f"{threshold:g} at {size}, {detail}"


def panels(found):
    made = []
    for name, points in each(found, SCENES):
        def line(size, value):
            return Line(f"{size}x{size}", tuple(
                (t, value(points[_label(size, t)], size)) for t in THRESHOLDS))
        made += [
            Panel(f"Frame, {name}", "threshold of normals", f"time over that at {QUALITY:g}",
                  tuple(line(size, lambda p, s: frame_ms(p) / frame_ms(points[_label(s, QUALITY)]))
                        for size in SIZES)),
            Panel(f"Error, {name}", "threshold of normals", "relative RMSE against every pixel",
                  (*(line(size, lambda p, s: error(p, f"full {s}")) for size in SIZES),
                   *(_with_detail(points, detail) for detail in DETAILS[1:])), percent_y=True)]
    return made


def _with_detail(points, detail):
    return Line(f"{LARGE}x{LARGE}, surface_detail={detail}", tuple(
        (t, error(points[_label(LARGE, t, detail)], f"full {LARGE}")) for t in (QUALITY, FAST)))


def targets(found):
    made = []
    for name, points in each(found, SCENES):
        def at(threshold, detail="off"):
            return points[_label(LARGE, threshold, detail)]
        made += [
            Target("B1.5", f"frame at T_n .25 over that at 1.4: {name}",
                   frame_ms(at(QUALITY)) / frame_ms(at(FAST)), PAPER, least=PAPER),
            Target("B1.5", "its fragments, likewise",
                   fragments_share(at(QUALITY)) / fragments_share(at(FAST))),
            *(Target("B1.5", f"its error at {t:g}, surface_detail={detail}",
                     error(at(t, detail), f"full {LARGE}"), percent=True)
              for t in (QUALITY, FAST) for detail in DETAILS)]
    return made


FIGURE = Figure(
    "thresholds", "The threshold of normals (Nichols and Wyman 2010, Figs. 10 and 11)",
    "A close Buddha at 1024x1024 runs at 8 frames a second with a threshold of .25 and at 32 with 1.4, "
    "four times as fast, its small features blurred away; at low resolutions the threshold does not matter.",
    groups, panels, targets)
