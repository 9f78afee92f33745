"""Nichols and Wyman 2010, Table 2 and Fig. 14: time against the resolution of indirect light, the
number of VPLs, and triangles."""
from . import scenes
from .figure import (DIRECT, Figure, Group, Line, Panel, Run, Target, each, fragments_share, frame_ms,
                     indirect_ms, passes_ms)

SIZES = (128, 256, 512, 1024)
LEAST, MOST = SIZES[0], SIZES[-1]
VPLS = 256
# Frames a second of Table 2, and which of our scenes stand for theirs.
PAPER_FPS = {"simple teapot": (68, 50, 33, 22), "spinning Buddha": (60, 42, 30, 24),
             "dragon and bunny": (59, 42, 28, 21), "flying bunnies": (52, 41, 31, 25)}
OURS = {"teapot_box": (scenes.TEAPOT, "simple teapot"), "buddha_room": (scenes.BUDDHA, "spinning Buddha"),
        "cornell_dragon_bunny": (scenes.DRAGON, "dragon and bunny"), "sponza_dabrovic": (scenes.SPONZA, None)}
VPL_COUNTS = (16, 64, 256, 1024)
SIZE_OF_MANY = 512  # and less: 1,024 VPLs at more pixels take too long
TRIANGLES_EACH = (1280, 5120, 20480, 81920)  # of each of five balls
PAPER_TRIANGLES = 22 / 25  # time at 417 thousand triangles over that at 6.3 thousand


def groups():
    made = [Group(name, tuple(_run(str(size), scene, size, VPLS) for size in SIZES))
            for name, (scene, _) in OURS.items()]
    made.append(Group("VPLs", tuple(
        _run(f"{count} at {size}", scenes.DRAGON, size, count) for count in VPL_COUNTS
        for size in SIZES if count < VPL_COUNTS[-1] or size <= SIZE_OF_MANY)))
    made.append(Group("triangles", tuple(
        _run(str(n), scenes.balls(n), MOST, VPLS) for n in TRIANGLES_EACH)))
    return made


def _run(label, scene, size, vpls):
    return Run(label, scene, "multires_splat", {"vpls": vpls, "surface_detail": "off"}, size)


def as_in_paper_ms(points, size):
    """A frame whose indirect light has `size` pixels a side in a picture of the largest: the paper's
    window does not change. Ours has no such setting, so passes of two frames are put together."""
    return passes_ms(points[str(MOST)], *DIRECT) + indirect_ms(points[str(size)])


def _growth(points, value):
    return tuple((size, value(size) / value(LEAST)) for size in SIZES)


def panels(found):
    scenes_found = each(found, OURS)
    return [*(_panels_of_size(scenes_found) if scenes_found else ()), *_panels_of("VPLs", found),
            *_panels_of("triangles", found)]


def _panels_of_size(scenes_found):
    side = "pixels along each side"
    ours, whole, shares = [], [], []
    for name, points in scenes_found:
        ours.append(Line(name, _growth(points, lambda size: as_in_paper_ms(points, size))))
        whole.append(Line(name, _growth(points, lambda size: frame_ms(points[str(size)]))))
        shares.append(Line(name, tuple((size, fragments_share(points[str(size)])) for size in SIZES)))
    paper = [Line(f"paper: {name}", tuple((size, fps[0] / f) for size, f in zip(SIZES, fps)), paper=True)
             for name, fps in PAPER_FPS.items()]
    return [Panel("Indirect light in a picture of 1024x1024", side, "time over that at 128x128",
                  (*ours, *paper), log_x=True),
            Panel("The whole picture", side, "time over that at 128x128",
                  (*whole, Line("pixels", _growth({}, lambda size: size * size), paper=True)),
                  log_x=True, log_y=True),
            Panel("Subsplats for each VPL", side, "share of the pixels", tuple(shares), log_x=True,
                  log_y=True, percent_y=True)]


def _panels_of(name, found):
    if name not in found:
        return []
    points = found[name]
    if name == "VPLs":
        lines = tuple(Line(f"{size}x{size}", tuple(
            (count, frame_ms(points[f"{count} at {size}"]) / frame_ms(points[f"16 at {size}"]))
            for count in VPL_COUNTS if f"{count} at {size}" in points)) for size in SIZES)
        return [Panel("VPLs, dragon and bunny", "VPLs", "frame over that with 16", lines, log_x=True)]
    least = points[str(TRIANGLES_EACH[0])]
    counts = [points[str(n)] for n in TRIANGLES_EACH]
    lines = (Line("frame", tuple((p["counts"]["triangles"], frame_ms(p) / frame_ms(least)) for p in counts)),
             Line("indirect light", tuple((p["counts"]["triangles"], indirect_ms(p) / indirect_ms(least))
                                          for p in counts)))
    return [Panel("Triangles", "triangles", "time over that with the fewest", lines, log_x=True)]


def targets(found):
    made = []
    for name, points in each(found, OURS):
        fps = PAPER_FPS.get(OURS[name][1])
        ratio = as_in_paper_ms(points, MOST) / as_in_paper_ms(points, LEAST)
        made.append(Target("B1.4", f"time of 1024x1024 over 128x128, the window the same: {name}",
                           ratio, fps[0] / fps[-1] if fps else None, most=3.1))
    if "triangles" in found:
        least, most = (found["triangles"][str(n)] for n in (TRIANGLES_EACH[0], TRIANGLES_EACH[-1]))
        made.append(Target("B1.8", "frame with 64 times as many triangles", frame_ms(most) / frame_ms(least),
                           PAPER_TRIANGLES, least=.8, most=1.2))
        made.append(Target("B1.8", "its indirect light alone", indirect_ms(most) / indirect_ms(least)))
    return made


FIGURE = Figure(
    "resolution", "Resolution, VPLs and triangles (Nichols and Wyman 2010, Table 2 and Fig. 14)",
    "From 128x128 to 1024x1024, 64 times the pixels, a frame takes 3.1, 2.5, 2.8 and 2.1 times as long in four "
    "scenes, whose triangles, 6 to 417 thousand, do not matter; splatting remains the bottleneck as VPLs grow.",
    groups, panels, targets)
