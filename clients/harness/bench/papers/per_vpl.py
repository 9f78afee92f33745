"""Nichols and Wyman 2010, Table 1: a list of subsplats for each VPL, refined by what the VPL's light does
on a glossy Buddha."""
from . import scenes
from .figure import Figure, Group, Line, Panel, Run, Target, error, frame_ms, passes_ms

SIZES = (32, 64, 128, 256)
LARGE = SIZES[-1]
VPL_COUNTS = (256, 1024)
COARSEST = 16  # blocks along the side that lists begin with, as in the paper
# Subsplats of Table 1 for all VPLs, and frames a second with 256 of them.
PAPER = {256: (120500, 220400, 421800, 852000), 1024: (484900, 893900, 1730000, 3220000)}
PAPER_FPS = (65, 52, 39, 27)
SHARE_LIMIT, EVALUATIONS_LIMIT = .05, 2.0


def groups():
    return [Group(f"{count} VPLs", tuple(_runs(count)),
                  needs=(("multires_splat", "radiance_threshold"),)) for count in VPL_COUNTS]


def _runs(count):
    for size in SIZES:
        settings = {"brdf": "full", "vpls": count}
        yield Run(f"full {size}", scenes.BUDDHA, "rsm", settings, size, timed=False)
        yield Run(f"lists {size}", scenes.BUDDHA, "multires_splat", {**settings, "coarsest": COARSEST},
                  size, against=(f"full {size}",))


def share(point, count):
    """Subsplats over pixels times VPLs; None where nothing was glossy, so that none was counted."""
    subsplats = point["counts"].get("subsplats")
    return None if subsplats is None else subsplats / (count * point["size"] ** 2)


def paper_shares(count):
    return [subsplats / (count * size * size) for subsplats, size in zip(PAPER[count], SIZES)]


def _counted(found):
    """(number of VPLs, points) of what was measured."""
    return [(count, found[f"{count} VPLs"]) for count in VPL_COUNTS if f"{count} VPLs" in found]


def panels(found):
    side = "pixels along each side"
    shares, times, errors = [], [], []
    for count, points in _counted(found):
        lists = [points[f"lists {size}"] for size in SIZES]
        shares += [Line(f"{count} VPLs", tuple((p["size"], share(p, count)) for p in lists)),
                   Line(f"paper: {count} VPLs", tuple(zip(SIZES, paper_shares(count))), paper=True)]
        times.append(Line(f"{count} VPLs", tuple(
            (p["size"], frame_ms(p) / frame_ms(lists[0])) for p in lists)))
        errors.append(Line(f"{count} VPLs", tuple(
            (size, error(p, f"full {size}")) for size, p in zip(SIZES, lists))))
    times.append(Line("paper: 256 VPLs", tuple(
        (s, PAPER_FPS[0] / fps) for s, fps in zip(SIZES, PAPER_FPS)), paper=True))
    return [Panel("Subsplats for each VPL", side, "share of the pixels", tuple(shares), log_x=True,
                  log_y=True, percent_y=True),
            Panel("Frame", side, f"time over that at {SIZES[0]}x{SIZES[0]}", tuple(times),
                  log_x=True),
            Panel("Error", side, "relative RMSE against every pixel", tuple(errors), log_x=True,
                  percent_y=True)]


def targets(found):
    made = []
    for count, points in _counted(found):
        large = points[f"lists {LARGE}"]
        if share(large, count) is None:
            continue
        side = f"{large['size']}x{large['size']}"
        subsplats_ms = passes_ms(large, "subsplats")
        shared_ms = passes_ms(large, "discontinuity", "fragments")
        plain_ns = passes_ms(large, "splat") / (large["counts"]["fragments"] * count)
        each_ns = subsplats_ms / large["counts"]["subsplats_tested"]
        made += [Target("B1.1", f"subsplats for each of {count} VPLs at {side}", share(large, count),
                        paper_shares(count)[-1], most=SHARE_LIMIT, percent=True),
                 Target("B1.1", "error of what they light", error(large, f"full {LARGE}"), percent=True),
                 Target("B1.2", f"testing and lighting a subsplat over lighting a fragment, {count} VPLs",
                        each_ns / plain_ns, "about 2", most=EVALUATIONS_LIMIT),
                 Target("B1.3", f"lists for {count} VPLs over one for all", subsplats_ms / shared_ms,
                        "most of the frame", least=float(count))]
    return made


FIGURE = Figure(
    "per_vpl", "A list for each VPL (Nichols and Wyman 2010, Table 1)",
    "For a glossy Buddha each VPL has a list of its own, of 5 % of the pixels at 256x256; refining the "
    "lists takes most of the time: 65 frames a second at 32x32 become 27 at 256x256.",
    groups, panels, targets)
