"""Nichols, Shopf and Wyman 2009, Sec. 4.2: both approximations against a million VPLs at each pixel."""
from . import scenes
from .figure import Figure, Group, Line, Panel, Run, Target, each, error, frame_ms

SIZE = 128  # a million VPLs at every pixel are 2e10 evaluations
MILLION = {"vpls": 1048576, "rsm_size": 1024}
TAUS = (.005, .03, .1)
SCENES = {"cornell_box_spot_side": scenes.BOX}
PAPER = 30 * 60 / .05  # half an hour over a frame at 20 a second


def groups():
    return [Group(name, (
        Run("full", scene, "rsm", MILLION, SIZE, timed=False),
        *(Run(f"tau {tau:g}", scene, "hisr", {"vpls": 65536, "tau": tau}, SIZE, against=("full",))
          for tau in TAUS))) for name, scene in SCENES.items()]


def panels(found):
    lines = tuple(Line(name, tuple((frame_ms(points["full"]) / frame_ms(points[f"tau {t:g}"]),
                                    error(points[f"tau {t:g}"], "full")) for t in TAUS))
                  for name, points in each(found, SCENES))
    return [Panel("Error over speed-up", "full frame over ours", "relative RMSE", lines, log_x=True,
                  percent_y=True)]


def targets(found):
    made = []
    for name, points in each(found, SCENES):
        ours = points["tau 0.03"]
        made += [Target("B2.7", f"RMS over the mean: {name}", error(ours, "full"), "5 to 6 %",
                        most=.05, percent=True),
                 Target("B2.7", f"the same over the largest value: {name}",
                        error(ours, "full", "rmse_max"), "5 to 6 %", most=.05, percent=True),
                 Target("B2.7", f"full frame over ours, {ours['size']}x{ours['size']}: {name}",
                        frame_ms(points["full"]) / frame_ms(ours), PAPER, least=PAPER)]
    return made


FIGURE = Figure(
    "combined", "Against a million VPLs at every pixel (Nichols, Shopf and Wyman 2009, Sec. 4.2)",
    "Both approximations together are 5 to 6 % RMS off a gather of a million VPLs at every pixel, "
    "which takes half an hour.",
    groups, panels, targets)
