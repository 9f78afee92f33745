"""Nichols, Shopf and Wyman 2009, Figs. 12 and 13: hierarchical image-space radiosity over its threshold
and the depth of its tree; and what more leaves cost."""
from . import scenes
from .figure import Figure, Group, Line, Panel, Run, Target, each, error, frame_ms, stage_ms

SIZE = 512
LEAVES = {"64x64": 4096, "128x128": 16384, "256x256": 65536}
FULL_LEAVES, DEFAULT_TAU = "256x256", .03
TAUS = (.002, .005, .01, .03, .1, .2)
MILLION = {"vpls": 1048576, "rsm_size": 1024}
COUNTS = (1024, 4096, 16384, 65536)
SCENES = {"cornell_dragon_bunny": scenes.DRAGON, "cornell_box_spot_side": scenes.BOX}
TIMED = "cornell_dragon_bunny"  # of the others the errors, and gathering over the number of leaves
ERROR_LIMIT = .03


def groups():
    made = [Group(name, tuple(_runs(scene, name == TIMED))) for name, scene in SCENES.items()]
    made += [Group(f"leaves, {name}", tuple(
        Run(f"{technique} {count}", scene, technique, {"vpls": count}, SIZE)
        for count in COUNTS for technique in ("hisr", "multires_gather"))) for name, scene in SCENES.items()]
    return made


def _runs(scene, timed):
    yield Run("million", scene, "multires_gather", MILLION, SIZE, timed=False)
    for fine, count in LEAVES.items():
        yield Run(f"all {fine}", scene, "multires_gather", {"vpls": count}, SIZE, against=("million",),
                  timed=False)
        for tau in TAUS:
            yield Run(_label(fine, tau), scene, "hisr", {"vpls": count, "tau": tau}, SIZE,
                      against=("million", f"all {fine}"), timed=timed)


def _label(fine, tau):
    return f"{fine}, {tau:g}"


def panels(found):
    made = []
    for name, points in each(found, SCENES):
        if name == TIMED:
            made.append(_frames(points))
        for title, value in (
                ("Fig. 13: error, a million VPLs", lambda p, _: error(p, "million")),
                ("Error, the same leaves", lambda p, fine: error(p, f"all {fine}"))):
            made.append(Panel(f"{title}, {name}", "tau", "relative RMSE", _over_tau(points, value), log_x=True,
                              percent_y=True))
    lines = []
    for name, points in _of_leaves(found):
        for technique in ("hisr", "multires_gather"):
            lines.append(Line(f"{technique}, {name}", tuple(
                (n, stage_ms(points[f"{technique} {n}"]) / stage_ms(points[f"{technique} {COUNTS[0]}"]))
                for n in COUNTS)))
    if lines:
        made.append(Panel("Gathering over the number of leaves", "leaves", "time over that with 1,024",
                          tuple(lines), log_x=True, log_y=True))
    return made


def _over_tau(points, value):
    return tuple(Line(f"down to {fine}", tuple((t, value(points[_label(fine, t)], fine)) for t in TAUS))
                 for fine in LEAVES)


def _frames(points):
    fastest = points[_label("64x64", TAUS[-1])]
    return Panel(f"Fig. 12: frame, {TIMED}", "tau", f"time over 64x64 at {TAUS[-1]:g}",
                 _over_tau(points, lambda p, _: frame_ms(p) / frame_ms(fastest)), log_x=True, log_y=True)


def _of_leaves(found):
    return [(name, found[f"leaves, {name}"]) for name in SCENES if f"leaves, {name}" in found]


def targets(found):
    made = []
    for name, points in each(found, SCENES):
        default = points[_label(FULL_LEAVES, DEFAULT_TAU)]
        made += [Target("B2.6", f"RMS over the mean against a million VPLs, tau {DEFAULT_TAU:g}: {name}", error(default, "million"),
                        "3 to 4 %", most=ERROR_LIMIT, percent=True),
                 Target("B2.6", f"the same over the largest value: {name}", error(default, "million", "rmse_max"),
                        "3 to 4 %", most=ERROR_LIMIT, percent=True),
                 Target("B2.6", f"of it, what all 65,536 leaves are off: {name}",
                        error(points[f"all {FULL_LEAVES}"], "million"), percent=True)]
        if name != TIMED:
            continue
        slow, fast = (points[_label(FULL_LEAVES, t)] for t in (TAUS[0], TAUS[-1]))
        made.append(Target("B2.11", f"share of the frame that does not gather, tau .2: {name}",
                           1 - stage_ms(fast) / frame_ms(fast), "all at 50 fps", least=.9, percent=True))
        made.append(Target("Fig. 12", f"frame at tau .002 over .2, 256x256: {name}", frame_ms(slow) / frame_ms(fast),
                           "no number"))
    for name, points in _of_leaves(found):
        made.append(Target("Fig. 13", f"gathering, 65,536 leaves over 1,024: {name}",
                           stage_ms(points[f"hisr {COUNTS[-1]}"]) / stage_ms(points[f"hisr {COUNTS[0]}"]),
                           "no number"))
    return made


FIGURE = Figure(
    "tree", "A tree of virtual lights (Nichols, Shopf and Wyman 2009, Figs. 12 and 13)",
    "Lower error thresholds introduce more patches, the more so the deeper the tree may be descended; at thresholds that are "
    "fast enough the error is 3 to 4 % against a million VPLs. Frames end at some 50 a second, where other passes are all.",
    groups, panels, targets)
