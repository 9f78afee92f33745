"""Yao, Wang, Chan, Yong and Paul 2010, Table 1 and Fig. 13: photons in a second, what pixels cost, what more photons are worth;
and how many environment maps it takes."""
from . import scenes
from .figure import Figure, Group, Line, Panel, Run, Target, each, error, frame_ms, passes_ms

SIZES = (256, 512, 1024)
SMALL, LARGE = 512, 1024  # of the paper's ratio
PHOTONS = 131072
FULL = {"brdf": "full"}  # the only one of these papers that is about more than diffuse light
# Millions of photons a second, from end to end at 512x512, and times of 1024x1024 over that, of the rows of Table 1.
PAPER_RATES, PAPER_TIMES = (8.4, 2.4, 2.9, 9.8, 9.7, 5.4, 6.4, 10.0), (1.96, 1.06, 1.33, 2.42, 2.26, 2.01, 1.38, 1.17)
SCENES = {s.name: s for s in (scenes.CORNELL, scenes.BOX, scenes.GLASS, scenes.RING, scenes.SPONZA)}

COUNTS = tuple(1 << power for power in (12, 14, 16, 18))
MOST = 1 << 20
COUNTED = {s.name: s for s in (scenes.BOX, scenes.CORNELL)}
COUNTED_SIZE, RADIUS_M = 128, .15
# What does not go by single pixels.
BY_BLOCKS = ("photons", "discontinuity", "fragments", "surfaces", "density", "upsample")
# Each pixel told by itself.
PIXELS = {"finest": 1, "depth_threshold": 0, "normal_threshold": 0}

MAPS = (1, 2, 4, 8, 16)
MAPPED = {s.name: s for s in (scenes.BOX, scenes.CORNELL, scenes.SPONZA)}
MAPPED_SIZE = 64


def groups():
    made = [Group(name, tuple(Run(str(size), scene, "photon", {**FULL, "photons": PHOTONS}, size) for size in SIZES))
            for name, scene in SCENES.items()]
    made += [Group(f"photons, {name}", tuple(_counts(scene))) for name, scene in COUNTED.items()]
    return made + [Group(f"maps, {name}", tuple(_maps(scene))) for name, scene in MAPPED.items()]


def _counts(scene):
    settings = {**FULL, **PIXELS}
    yield Run("truth", scene, "reference", {"spp": 1024, "light_vertices": "off"}, COUNTED_SIZE, timed=False)
    yield Run("most", scene, "photon", {**settings, "photons": MOST, "photon_radius": RADIUS_M}, COUNTED_SIZE, timed=False)
    for count in COUNTS:
        yield Run(f"fixed {count}", scene, "photon", {**settings, "photons": count, "photon_radius": RADIUS_M}, COUNTED_SIZE,
                  against=("most",), timed=False)
        yield Run(f"pilot {count}", scene, "photon", {**settings, "photons": count}, COUNTED_SIZE, against=("truth",))


def _maps(scene):
    settings = {**FULL, "photons": PHOTONS}
    yield Run("rays", scene, "photon", settings, MAPPED_SIZE)
    for count in MAPS:
        images = {**settings, "intersections": "images", "env_maps": count}
        yield Run(f"{count}", scene, "photon", images, MAPPED_SIZE, against=("rays",))
        yield Run(f"printed {count}", scene, "photon", {**images, "paper_mode": 1, "light_rays": 16}, MAPPED_SIZE, against=("rays",))


# --- what is drawn --------------------------------------------------------------------------

def _rate(point):
    return PHOTONS / frame_ms(point) / 1e3


def _counted(found):
    return each({name: found[f"photons, {name}"] for name in COUNTED if f"photons, {name}" in found}, COUNTED)


def _mapped(found):
    return each({name: found[f"maps, {name}"] for name in MAPPED if f"maps, {name}" in found}, MAPPED)


def panels(found):
    made, timed = [], each(found, SCENES)
    if timed:
        made.append(Panel("Four times the pixels, twice", "pixels along each side", f"frame over that at {SIZES[0]}x{SIZES[0]}",
                          tuple(Line(name, tuple((size, frame_ms(points[str(size)]) / frame_ms(points[str(SIZES[0])])) for size in SIZES))
                                for name, points in timed), log_x=True))
    counted = _counted(found)
    if counted:
        half = Line("1 / sqrt(photons)", tuple((n, (COUNTS[0] / n) ** .5) for n in COUNTS), paper=True)
        made.append(Panel(f"Noise of a disk of {RADIUS_M:g} m", "photons", f"error over that with {COUNTS[0]:,}",
                          (*(Line(name, tuple((n, _noise(points, n) / _noise(points, COUNTS[0])) for n in COUNTS))
                             for name, points in counted), half), log_x=True, log_y=True))
        made.append(Panel("Fig. 13: off the truth, disks by a pilot", "photons", "relative RMSE",
                          tuple(Line(name, tuple((n, error(points[f"pilot {n}"], "truth")) for n in COUNTS)) for name, points in counted),
                          log_x=True, log_y=True, percent_y=True))
    mapped = _mapped(found)
    if mapped:
        lines = [Line(f"{name}{said}", tuple((n, 1 + error(points[f"{kind}{n}"], "rays", "signed")) for n in MAPS))
                 for name, points in mapped for kind, said in (("", ""), ("printed ", ", as printed"))]
        made.append(Panel("Environment maps instead of triangles", "maps, at most", "indirect light, of that by rays", tuple(lines), log_x=True,
                          percent_y=True))
    return made


def _noise(points, count):
    return error(points[f"fixed {count}"], "most")


def targets(found):
    made = []
    for name, points in each(found, SCENES):
        made.append(Target("B5.1", f"millions of photons a second from end to end, {SMALL}x{SMALL}: {name}", _rate(points[str(SMALL)]),
                           f"{min(PAPER_RATES):g} to {max(PAPER_RATES):g}", least=10))
        large, small = points[str(LARGE)], points[str(SMALL)]
        made.append(Target("B5.2", f"frame of {LARGE}x{LARGE} over {SMALL}x{SMALL}: {name}", frame_ms(large) / frame_ms(small),
                           f"{min(PAPER_TIMES):g} to {max(PAPER_TIMES):g}", most=2.4))
        made.append(Target("B5.2", f"photons, blocks, and light of blocks alone: {name}", passes_ms(large, *BY_BLOCKS) / passes_ms(small, *BY_BLOCKS)))
    for name, points in _counted(found):
        # What the one that is compared with has of its own adds its share.
        fewer, more = (_noise(points, n) ** 2 / (1 / n + 1 / MOST) for n in (COUNTS[0], COUNTS[-1]))
        made.append(Target("B5.6", f"variance times photons, {COUNTS[-1]:,} over {COUNTS[0]:,}, a disk of {RADIUS_M:g} m: {name}",
                           more / fewer, 1, most=1.25))
        made.append(Target("B5.6", f"off the truth, {COUNTS[-1]:,} photons: {name}", error(points[f"pilot {COUNTS[-1]}"], "truth"), percent=True))
    for name, points in _mapped(found):
        most = str(MAPS[-2])
        made.append(Target("B5.4", f"indirect light with {most} chosen maps, of that by rays: {name}", 1 + error(points[most], "rays", "signed"),
                           "enough", least=.95, percent=True))
        made.append(Target("B5.5", f"indirect light with {most} maps by the printed looks, of that by rays: {name}", 1 + error(points[f"printed {most}"], "rays", "signed"), percent=True))
        made.append(Target("B5.4", f"share of a frame by rays that {most} maps take: {name}",
                           passes_ms(points[most], "env_maps") / frame_ms(points["rays"]), percent=True))
    return made


FIGURE = Figure(
    "photons", "Photons (Yao, Wang, Chan, Yong and Paul 2010, Table 1 and Fig. 13)",
    "2.4 to 10 million photons a second on a graphics card, with 8 to 12 environment maps; four times the pixels take 1.06 to 2.42 times "
    "as long; pictures get smoother as photons become more.",
    groups, panels, targets)
