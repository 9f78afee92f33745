"""Rows about size, place and strength: what changes the units must not change the picture."""
import numpy as np

from . import answers
from .row import row
from .scene import UP, Scene


def steps_room(scale=1.0, power=1.0, offset=None, sun=True):
    """A room with steps, corners and three kinds of light: edges and depth differences enough."""
    scene = Scene(scale, power, offset)
    grey, red = scene.grey(), scene.grey((0.7, 0.3, 0.2))
    scene.floor(1, grey)
    scene.quad((0, 1, -1), (1, 0, 0), (0, 1, 0), red)
    scene.quad((-1, 1, 0), (0, 0, -1), (0, 1, 0), grey)
    scene.block(red, 0.25, (-0.3, 0.25, -0.4))
    scene.block(grey, 0.125, (0.4, 0.125, 0.2))
    scene.lamp((0.2, 1.1, 0.3), 1.5)
    scene.spot((-0.5, 1.6, 0.5), (0.3, -1, -0.4), 3.0)
    if sun:
        scene.sun((0.4, -1, -0.6), 0.8)
    scene.eye((0.9, 1.2, 1.6), (-0.2, 0.4, -0.3), 0.9)
    return scene


@row(7, "scene of 1e-4 m to 1e6 m")
def scales(case):
    base = case.render(steps_room(), (49, 37))
    exponents = range(-13, 21) if case.full else (-13, -5, 20)
    for k in exponents:
        view = case.render(case.save(steps_room(2.0 ** k), f"2^{k}"), (49, 37), layers=("depth",))
        case.same(view, base, 1e-6)


@row(32, "thresholds with a unit", "TNSI")
def thresholds(case):
    """Lengths in metres and radiances in cd/m^2 must not decide what is refined."""
    base = case.render(steps_room(), (49, 37))
    for scale, power in ((2.0 ** -10, 1.0), (2.0 ** 12, 1.0), (1.0, 2.0 ** 20), (1.0, 2.0 ** -20)):
        view = case.render(steps_room(scale, power), (49, 37))
        case.same(view, base, 1e-6, factor=power)


@row(8, "1e7 m off the origin")
def far_off(case):
    base = case.render(steps_room(), (49, 37))
    for offset in ((1e7, 0, 0), (-1e7, 1e7, 1e7)):
        view = case.render(steps_room(offset=offset), (49, 37))
        case.same(view, base, 1e-5, outliers=0.02)


@row(4, "cosines of noise in a plane far off", "ST")
def plane_far_off(case):
    from .senders import tilted_floor
    case.needs_indirect()
    view = case.render(tilted_floor((1e6, -1e6, 1e6)), (65, 65), settings={"brdf": None})
    case.expect(view.light("direct").max() > 0, view, "a lit floor", "no direct light")
    case.dark(view, "indirect")


@row(9, "lights of 1e-6 W and 1e9 W")
def powers(case):
    base = case.render(steps_room(), (33, 25))
    for power in (1e-6, 1e9):
        view = case.render(case.save(steps_room(power=power), f"{power:g}"), (33, 25))
        case.same(view, base, 2e-6, factor=power)
    _weak_beside_strong(case)


def _weak_beside_strong(case):
    """A wall parts the floor: one half is lit by 1e9 cd, the other by 1e-6 cd."""
    scene = Scene()
    grey = scene.grey()
    scene.floor(4, grey)
    for x, u in ((0.0, 1), (-1e-3, -1)):
        scene.quad((x, 4, 0), (0, 0, -5 * u), (0, 5, 0), grey)
    scene.lamp((-1, 1, 0), 1e9)
    scene.lamp((1, 1, 0), 1e-6)
    scene.probe((-1.5, 0, 0), UP, distance=0.5)
    scene.probe((1.5, 0, 0), UP, distance=0.5)
    path = case.save(scene, "both")
    for camera, power in ((0, 1e9), (1, 1e-6)):
        seen, noise, view = case.probe(path, camera, "direct")
        case.near(view, f"direct E under {power:g} cd", seen,
                  power * answers.lamp_over_floor(1, 0.5), case.technique.tolerance_direct, noise)


@row(55, "denormal numbers")
def denormals(case):
    """1e-6 cd at 1e6 m: E is 1e-18 of that of 1 cd at 1 m, its square below what 32 bits hold."""
    seen = {}
    for name, scale, power in (("usual", 1.0, 1.0), ("tiny", 1e6, 1e-18)):
        scene = Scene(scale, power)
        grey = scene.grey()
        scene.floor(2, grey)
        scene.ceiling(2, grey, 2)
        scene.lamp((0, 1, 0))
        for lateral in (0, 1):
            scene.probe((lateral, 0, 0), UP)
        path = case.save(scene, name)
        layers = ("direct", "indirect") if case.model.indirect_bounces else ("direct",)
        for key in [(layer, camera) for layer in layers for camera in (0, 1)]:
            e, noise, view = case.probe(path, key[1], key[0])
            if key not in seen:
                seen[key] = e
                case.expect(e > 0, view, f"{key[0]} light", "none")
            else:
                case.near(view, f"{key[0]} E after scaling", e / power, seen[key], 1e-5,
                          2 * noise / power)


@row(29, "near and far 1e7 apart")
def depths(case):
    scene = Scene()
    grey = scene.grey()
    scene.quad((1.2, 0, -1), (1.2, 0, 0), (0, 3, 0), grey)
    scene.quad((0, 0, -1e7), (2e7, 0, 0), (0, 2e7, 0), grey)
    scene.sun((0, 0, -1))
    scene.eye((0, 0, 0), (0, 0, -1), 1.0, near=0.5)
    view = case.render(scene, (8, 8), layers=("depth",))
    depth = view.plane("depth.Z").astype(float)
    wanted = np.where(np.arange(8) < 4, 1e7, 1.0) * np.ones((8, 1))
    worst = np.abs(depth / wanted - 1).max()
    case.expect(worst <= 1e-6, view, "depths of 1 m and 1e7 m within 1e-6", f"off by {worst:.3g}")


@row(37, "acne and gaps at every scale")
def no_acne(case):
    for s in (1e-4, 1.0, 1e6):
        scene = Scene(scale=s)
        scene.floor(1, scene.grey(), cells=7)
        scene.lamp((0, 0.9, 0))
        scene.window((0, 0, 0), UP, 1.0, distance=0.1)
        view = case.render(case.save(scene, f"{s:g}"), (33, 33))
        x = (np.arange(33) + 0.5) / 16.5 - 1
        wanted = answers.lamp_over_floor(0.9, np.hypot(*np.meshgrid(x, x)))
        case.flat(view, "direct E over its closed form",
                  view.irradiance("direct", 0.5) / wanted, 1.0, 1e-3)
