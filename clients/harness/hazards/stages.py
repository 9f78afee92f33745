"""Rows about stages that some techniques have: T multiresolution splatting, N image-space
radiosity, S bias compensation, I importance-driven points, P photons, R the reference."""
import numpy as np

from . import answers
from .beams import hold_cube_room
from .pictures import two_windows
from .ranges import steps_room
from .row import row
from .scene import DOWN, UP, Scene
from .senders import one_plane, sphere_room


@row(5, "grazing receivers", "S")
def grazing(case):
    """A wall lit by 1 lx before a floor, seen at every angle to the wall: never more than the
    closed form, and all of it but where the wall is seen at over 75 degrees."""
    settings = case.bounces(1)
    scene = Scene()
    grey = scene.grey()
    scene.quad((0, 10, 0), (200, 0, 0), (0, 10, 0), grey)  # 20 m high, before it 1 m of floor
    scene.quad((0, 0, 1), (200, 0, 0), (0, 0, -1), grey)
    scene.sun((0, 0, -1))
    angles = [0, 30, 60, 75, 85, 89, 89.9]
    for angle in np.radians(angles):
        away = np.array([5 * np.sin(angle), 0.3, 0.2 + 5 * np.cos(angle)])
        scene.eye(away, (0, 0, 0.2), 0.02)
    path = case.save(scene)
    exact = 0.5 * answers.wall_bounce(20, 0.2)
    for camera, angle in enumerate(angles):
        view = case.render(path, (9, 9), camera, settings=settings, best=True)
        depth_of_floor = view.light("direct")[..., 0] == 0  # the sun grazes the floor
        e = view.irradiance("indirect", 0.5)[depth_of_floor]
        case.expect(e.size > 0, view, "floor in the picture", "none")
        slack = case.technique.tolerance_indirect + 0.05 + (
            4 * e.std() / exact if case.technique.is_sampled else 0)
        case.expect(e.max() <= exact * (1 + slack), view, f"E <= {exact:.4g} at {angle} degrees",
                    f"{e.max():.4g}")
        if angle <= 75:
            case.near(view, f"E at {angle} degrees", e.mean(), exact, slack)


@row(6, "lamp that grazes a surface", "NP")
def grazing_light(case):
    """Texels far out stand for large areas, but send no more than they got."""
    settings = case.bounces(1)
    height, half = 0.01, 1.0
    scene = Scene()
    grey = scene.grey()
    scene.floor(half, grey)
    scene.quad((0.3, 0.5, 0), (0.02, 0, 0), (0, 0, 0.02), grey)
    scene.lamp((0, height, 0))
    scene.probe((0.3, 0.5, 0), DOWN)

    def direct(x, z):
        return answers.lamp_over_floor(height, np.hypot(x, z))

    wanted = answers.bounce_off_floor((0.3, 0.5, 0), DOWN, half, 0.5, direct, grain=height)
    seen, noise, view = case.probe(scene, 0, "indirect", settings=settings, best=True)
    case.near(view, "E over a lamp near the floor", seen, wanted,
              case.technique.tolerance_indirect + 0.01, noise)


@row(10, "sums in 16 bits", "TP")
def half_sums(case):
    """A sum in 16 bits stops growing at 2048 equal terms."""
    case.needs_indirect()
    case.needs_range("vpls", 24576)
    view = case.render(sphere_room(triangles=81920), (17, 17), settings={"vpls": 24576})
    case.near(view, "mean E", view.irradiance("indirect", 0.5).mean(), 0.5,
              case.technique.tolerance_indirect)


@row(12, "order of addition", "TP")
def order(case):
    path = case.save(steps_room())
    first = case.render(path, (49, 37))
    case.daemon.restart()
    case.same(case.render(path, (49, 37)), first, 1e-5)


@row(14, "albedo 1", "SIPR")
def white(case):
    """In a white sphere each bounce adds as much as came directly."""
    case.needs_indirect()
    unlimited = case.model.indirect_bounces > 64
    count = 3 if unlimited else case.model.indirect_bounces
    settings = case.bounces(count)
    view = case.render(sphere_room(1.0), (17, 17), settings=settings, best=True, samples=256)
    e = view.irradiance("indirect", 1.0)
    case.near(view, f"mean E of {count} bounces", e.mean(), count,
              case.technique.tolerance_indirect + 1e-3 * count, case.noise(e))


@row(30, "background beside a surface", "TN")
def background(case):
    """A sphere over a lit floor, cut off from the rest: the background stays black."""
    scene = Scene()
    grey = scene.grey()
    scene.floor(0.6, grey)
    scene.sphere(grey, 0.3, 5120, inward=False, center=(0, 0.5, 0))
    scene.lamp((0.4, 1.2, 0.5))
    scene.eye((0, 0.6, 2), (0, 0.3, 0), 0.9)
    view = case.render(scene, (65, 65))
    outside = ~view.covered()
    case.expect(outside.any() and view.covered().any(), view, "surface and background", "one alone")
    case.dark(view, "beauty", outside)


@row(31, "black is data", "T")
def black_is_data(case):
    """A floor black by halves beside a lit wall: no light on the black half, and on the white one
    what it has beside white."""
    views = []
    for albedo in (0.5, 0.0):
        scene = Scene()
        white = scene.grey()
        scene.quad((-0.5, 0, 0), (0.5, 0, 0), (0, 0, -1), scene.grey(albedo))
        scene.quad((0.5, 0, 0), (0.5, 0, 0), (0, 0, -1), white)
        scene.quad((0, 1, -1), (1, 0, 0), (0, 1, 0), white)
        scene.sun((0, 0, -1))
        scene.window((0, 0, 0), UP, 1.0, distance=0.5)
        views.append(case.render(case.save(scene, f"{albedo:g}"), (64, 64)))
    case.dark(views[1], "indirect", np.s_[:, :32])
    settings = case.model.indirect_bounces
    case.needs(settings <= 1, "more than one bounce carries light from one half to the other")
    case.same(views[1], views[0], 1e-3, where=np.s_[:, 32:])


@row(33, "each pixel once", "TN")
def coverage(case):
    """A hole or a pixel counted twice shows in a sphere, where E is the same everywhere."""
    case.needs_indirect()
    unlimited = case.model.indirect_bounces > 64
    wanted = answers.bounces_in_sphere(0.5, None if unlimited else case.model.indirect_bounces, 1.0)
    scene = sphere_room(triangles=81920)
    scene.eye((0.3, 0.5, -0.2), (-1, 0.1, 0.4), 1.5)  # depths and slopes of all kinds
    path = case.save(scene)
    sizes = ((67, 49), (128, 128)) + (((1023, 769),) if case.full else ())
    for size in sizes:
        view = case.render(path, size, 1)
        case.flat(view, "indirect E", view.irradiance("indirect", 0.5), wanted, 0.1)


@row(34, "lists that are full", "T")
def small_limits(case):
    """Every number that it reads at its smallest, and all of them together."""
    keys = [key for key, p in case.technique.parameters.items() if not p["choices"]]
    path = case.save(steps_room())
    smallest = {key: f"{case.technique.parameters[key]['minimum']:g}" for key in keys}
    for settings in [{key: smallest[key]} for key in keys] + [smallest]:
        case.render(path, (49, 37), settings=settings)


@row(38, "hits in a convex room", "P")
def convex_hits(case):
    """Photons that miss are light that is missing."""
    hold_cube_room(case)


@row(39, "hits of the surface left", "P")
def self_hits(case):
    one_plane(case)


@row(43, "senders at no distance", "I")
def no_distance(case):
    """At 1e-6 from walls and corners: no E above that of a half space of the brightest point."""
    settings = case.bounces(1)
    scene = Scene()
    scene.room(scene.grey())
    scene.lamp()
    gap = 1e-6
    for at in ((1 - gap, -1, 0), (1 - gap, -1, 1 - gap), (-1 + gap, -1, 0.3)):
        scene.window(at, UP, 1e-7, distance=0.02)
    path = case.save(scene)
    for camera in range(3):
        seen, noise, view = case.probe(path, camera, "indirect", settings=settings)
        case.expect(0.1 * 0.5 < seen <= 0.5 + 4 * noise, view, "E from 0.05 to 0.5", f"{seen:.4g}")


@row(44, "ties in depth and order", "IP")
def ties(case):
    """Two surfaces in one place; the same bytes each time."""
    scene = two_windows()
    scene.floor(0.5, scene.grey((0.9, 0.1, 0.1)))
    scene.floor(0.5, scene.grey((0.1, 0.9, 0.1)))
    path = case.save(scene)
    first = case.render(path, (33, 33), 1)
    for _ in range(100 if case.full else 3):
        case.daemon.restart()
        case.same(case.render(path, (33, 33), 1), first, 0)


@row(46, "random numbers twice", "IP")
def halves(case):
    """Errors under two seeds have nothing to do with each other."""
    case.needs_indirect()
    path = case.save(sphere_room(triangles=81920))
    # What is interpolated between blocks is off alike under any seed.
    settings = {"finest": "1", "coarsest": "64"} if case.technique.has("finest") else {}
    a, b = (case.render(path, (33, 33), seed=seed, settings=settings).irradiance("indirect", 0.5)
            for seed in (1, 2))
    case.needs((a != b).any(), "uses no random numbers")
    view = case.render(path, (33, 33), seed=2, settings=settings)
    case.expect(view.irradiance("indirect", 0.5).tobytes() == b.tobytes(), view,
                "the same picture under the same seed", "another")
    mean = (a.mean() + b.mean()) / 2
    correlation = ((a - mean) * (b - mean)).mean() / (a.std() * b.std())
    limit = 4 / np.sqrt(a.size)
    case.expect(abs(correlation) <= limit, view, f"correlation within {limit:.3g}",
                f"{correlation:.3g}")


@row(48, "edges of surfaces", "P")
def edges(case):
    """A plate over a lit floor: right in the middle, at its edge at least a quarter, never more."""
    settings = case.bounces(1)
    scene = Scene()
    grey = scene.grey()
    scene.floor(2, grey)
    scene.ceiling(0.5, grey, 1)
    scene.spot((0, 0.9, 0), DOWN, 1.0, (0.5, 0.8))
    points = ((0, 0), (0.49, 0), (0.49, 0.49))
    for x, z in points:
        scene.probe((x, 1, z), DOWN, distance=0.01)
    path = case.save(scene)

    def direct(x, z):
        r2 = 0.81 + x * x + z * z
        return answers.cone(0.9 / np.sqrt(r2), 0.5, 0.8) * 0.9 / r2 ** 1.5

    for camera, (x, z) in enumerate(points):
        seen, noise, view = case.probe(path, camera, "indirect", settings=settings, best=True)
        wanted = answers.bounce_off_floor((x, 1, z), DOWN, 2, 0.5, direct)
        slack = case.technique.tolerance_indirect + 5e-3
        if camera == 0:
            case.near(view, "E in the middle", seen, wanted, slack, noise)
        case.expect((0.25 - slack) * wanted <= seen <= (1 + slack) * wanted + 4 * noise, view,
                    f"E from a quarter of {wanted:.4g} to it", f"{seen:.4g}")


@row(49, "fireflies", "PR")
def variance_law(case):
    """Four times the samples: half the deviation; of photons less, which lie more evenly than by chance."""
    case.needs_indirect()
    key = next((key for key in ("spp", "samples", "photons") if case.technique.has(key)), None)
    case.needs(key, "has no number of samples")
    room = steps_room()
    deviations = []
    fewest, most = (1024, 4) if key == "photons" else (64, 2.8)
    for count in (fewest, 4 * fewest):
        halves_ = [case.render(room, (17, 13), settings={key: count}, seed=seed).light("indirect")
                   for seed in (1, 2)]
        deviations.append((halves_[0] - halves_[1]).std())
    view = case.render(room, (17, 13), settings={key: 4 * fewest}, seed=1)
    ratio = deviations[0] / deviations[1]
    case.expect(1.4 < ratio < most, view, f"deviation of {fewest} over that of {4 * fewest} samples: 2",
                f"{ratio:.3g}")


@row(50, "caustics twice", "P")
def caustic_once(case):
    """Light of a lamp by way of a mirror is that of its mirror image, once (D10)."""
    case.needs(case.model.glossy_senders, "mirrors send no light on")
    settings = case.bounces(1)
    scene = Scene()
    scene.floor(1, scene.grey())
    scene.quad((-1, 1, 0), (0, 0, -1), (0, 1, 0), scene.grey(1.0, roughness=0.0, metallic=1.0))
    scene.lamp((-0.5, 1, 0))
    scene.probe((0, 0, 0), UP, distance=0.3)
    seen, noise, view = case.probe(scene, 0, "indirect", settings={**settings, "brdf": None})
    case.near(view, "E from the mirrored lamp", seen, answers.lamp_over_floor(1, 1.5), 0.1, noise)


@row(51, "direct light twice", "SP")
def direct_once(case):
    case.needs_indirect()
    unlimited = case.model.indirect_bounces > 64
    wanted = answers.bounces_in_sphere(0.5, None if unlimited else case.model.indirect_bounces, 1.0)
    view = case.render(sphere_room(triangles=81920), (17, 17), best=True)
    e = view.irradiance("indirect", 0.5)
    case.near(view, "mean indirect E", e.mean(), wanted, case.technique.tolerance_indirect + 1e-3,
              case.noise(e))


@row(52, "more compensated than was cut", "S")
def no_energy_made(case):
    """Up to the corners of a cube room: never above the closed form."""
    settings = case.bounces(1)
    scene = Scene()
    scene.room(scene.grey())
    scene.lamp()
    scene.window((0, -1, 0), UP, 1.0, distance=0.5)
    view = case.render(scene, (33, 33), settings=settings)
    e = view.irradiance("indirect", 0.5)
    case.expect(e.max() <= 0.5 * 0.590616 * 1.01 + 4 * case.noise(e), view,
                "E <= 0.2953 and 1 %, its value in the middle", f"{e.max():.4g}")
