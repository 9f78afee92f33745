"""Rows about the picture itself: where the eye is, what it sees, how large and odd it is."""
import numpy as np

from ..daemon import RenderError
from .case import SAMPLES_FEW, SINGLE_PIXELS
from .ranges import steps_room
from .row import row
from .scene import DOWN, UP, Scene
from .senders import sphere_room

EXIT_BUDGET = 5  # of bounce, interface.md


@row(25, "eye in a wall")
def eye_in_wall(case):
    scene = Scene()
    scene.room(scene.grey())
    scene.lamp((0, 0.5, 0))
    scene.eye((1, 0, 0), (1, 1, 0), 1.2)     # in the wall's plane, along it
    scene.eye((1, 0, 0), (2, 0, 0), 1.2)     # away from the room
    scene.eye((1, 0, 0), (0, 0, 0), 1.2)     # into it
    scene.eye((0.5, 0, 0), (1, 0, 0), 1.2, near=0.8)  # the wall lies before the near plane
    path = case.save(scene)
    for camera in range(4):
        view = case.render(path, (33, 33), camera, settings={"brdf": None})
        if camera == 1:
            case.dark(view, "beauty")
        if camera == 2:
            case.expect(view.light()[16, 16].max() > 0, view, "light from the wall ahead", "none")


def _nothing():
    scene = Scene()
    scene.lamp()
    scene.eye((0, 0, 2), (0, 0, 0))
    return scene


def _dark_room():
    scene = Scene()
    scene.room(scene.grey())
    scene.lamp(intensity=0.0)
    scene.eye((0, 0, 0.5), (0, 0, -1))
    return scene


def _back_turned():
    scene = Scene()
    scene.floor(1, scene.grey())
    scene.lamp((0, 1, 0))
    scene.eye((0, 1, 0), (0, 2, 0.1))
    return scene


@row(26, "nothing to see, nothing to light")
def emptiness(case):
    for name, scene, covers in (("empty", _nothing(), False), ("dark", _dark_room(), True),
                                ("background", _back_turned(), False)):
        view = case.render(case.save(scene, name), (17, 9))
        case.dark(view, "beauty")
        alpha = view.plane("A")
        case.expect((alpha == (1 if covers else 0)).all(), view,
                    f"alpha {int(covers)} everywhere", f"{alpha.min():g} to {alpha.max():g}")
        case.flagged(view, "blank_frame")
    scene = Scene()
    scene.floor(1, scene.grey())
    view = case.render(case.save(scene, "bare"), (17, 9))
    case.expect(view.light().max() > 0, view, "light of the default rig", "none")
    case.flagged(view, "default_lights")


@row(27, "pictures of 1x1, 1xN and odd sides")
def smallest(case):
    """They are the middle of a larger one."""
    path = case.save(steps_room())
    large = case.render(path, (33, 33), settings=SINGLE_PIXELS)
    for size, part in (((1, 33), np.s_[:, 16:17]), ((33, 33), np.s_[:, :]),
                       ((3, 33), np.s_[:, 15:18]), ((2, 33), None), ((33, 1), None)):
        view = case.render(path, size, settings=SINGLE_PIXELS)
        case.expect(view.covered().any(), view, "surfaces in the picture", "none")
        if part is None:
            continue
        case.same(view, _Part(large, part), 1e-5, outliers=0.05)
    # One pixel does not tell its noise: many samples instead.
    sampled = case.technique.is_sampled
    one, nine = (case.render(path, size, settings=SINGLE_PIXELS, samples=1024, best=sampled)
                 for size in ((1, 1), (3, 3)))
    case.same(one, _Part(nine, np.s_[1:2, 1:2]), 0.02 if sampled else 1e-5)
    if not sampled:
        case.same(one, _Part(large, np.s_[16:17, 16:17]), 1e-5)


class _Part:
    """A crop of a view."""

    def __init__(self, view, part):
        self.view, self.part = view, part

    def light(self, layer="beauty"):
        return self.view.light(layer)[self.part]


def _facade(size, crops):
    """Steps seen straight on by a camera of `size` pixels, and cameras of parts of its picture:
    `crops` of (x, y, width, height) in pixels."""
    scene = Scene()
    grey, red = scene.grey(), scene.grey((0.7, 0.3, 0.2))
    pixel = 2 / max(size)
    half = (pixel * size[0] / 2, pixel * size[1] / 2)
    scene.quad((0, 0, 0), (1, 0, 0), (0, 1, 0), grey)
    rng = np.random.default_rng(28)
    for x in np.linspace(-0.9, 0.9, 7):
        scene.quad((x, rng.uniform(-0.1, 0.1) * half[1], 0.02), (0.06, 0.01, 0),
                   (-0.01, 0.7 * half[1], 0), red)
    scene.lamp((0.3, 0.4, 0.8))
    scene.window((0, 0, 0), (0, 0, 1), half, distance=0.5)
    for x, y, width, height in crops:
        at = (pixel * (x + width / 2) - half[0], half[1] - pixel * (y + height / 2), 0)
        scene.window(at, (0, 0, 1), (pixel * width / 2, pixel * height / 2), distance=0.5)
    return scene


def _if_it_fits(case, path, size, settings):
    """The picture, or None where the daemon says that its memory does not suffice."""
    try:
        return case.render(path, size, 0, settings=settings, samples=SAMPLES_FEW)
    except RenderError as fault:
        if fault.code != EXIT_BUDGET or max(size) <= 4096 and min(size) <= 16:
            raise
        case.note(f"{size[0]}x{size[1]} is refused: {fault}")
        return None


@row(28, "the largest pictures")
def largest(case):
    """No seam: parts rendered alone are those of the whole."""
    wholes = [((4096, 4), [(0, 0, 64, 4), (2016, 0, 64, 4), (4032, 0, 64, 4)]),
              ((3, 2048), [(0, 992, 3, 64)])]
    if case.full:
        wholes += [((16384, 16), [(8160, 0, 64, 16), (16320, 0, 64, 16)]),
                   ((2560, 2560), [(1216, 1216, 128, 128), (2432, 2432, 128, 128)]),
                   ((4096, 4096), [(x, y, 128, 128) for x in (0, 1984, 3968)
                                   for y in (0, 1984, 3968)])]
    for size, crops in wholes:
        cheap = {"vpls": 96, "bounces": 0} if case.full else {}
        few = {key: value for key, value in cheap.items() if case.technique.has(key)}
        path = case.save(_facade(size, crops), f"{size[0]}x{size[1]}")
        whole = _if_it_fits(case, path, size, few)
        if whole is None:
            continue
        for camera, (x, y, width, height) in enumerate(crops, 1):
            part = case.render(path, (width, height), camera, settings=few, samples=SAMPLES_FEW)
            case.same(part, _Part(whole, np.s_[y:y + height, x:x + width]), 1e-5, outliers=0.02)


@row(57, "coverage of odd sizes")
def odd_sizes(case):
    """From inside a sphere around its lamp every pixel is covered and equally lit."""
    path = case.save(sphere_room())
    sizes = ((67, 49), (31, 65)) + (((1023, 769),) if case.full else ())
    for size in sizes:
        view = case.render(path, size, samples=SAMPLES_FEW)
        case.expect(view.covered().all(), view, "every pixel covered",
                    f"{int((~view.covered()).sum())} are not")
        case.flat(view, "direct E", view.irradiance("direct", 0.5), 1.0,
                  case.technique.tolerance_direct + 1e-3)


@row(58, "what an earlier picture left behind")
def camera_cut(case):
    """After another camera, size and scene: the picture of a cold start, to the byte."""
    path = case.save(steps_room(), "scene")
    other = case.save(two_windows(), "other")
    case.render(other, (33, 17), 1)
    case.render(other, (33, 17), 0)
    case.render(path, (17, 33), 0)
    warm = case.render(path, (33, 25), 0)
    case.daemon.restart()
    cold = case.render(path, (33, 25), 0)
    for name in ("beauty", "direct", "indirect"):
        case.expect((warm.light(name) == cold.light(name)).all(), warm,
                    f"{name} as after a cold start, to the byte",
                    f"off by {np.abs(warm.light(name) - cold.light(name)).max():.3g}")


def two_windows():
    scene = Scene()
    grey = scene.grey()
    scene.floor(1, grey)
    scene.ceiling(1, grey, 2)
    scene.lamp((0, 1, 0), 5)
    scene.window((0, 0, 0), UP, 1.0, distance=0.5)
    scene.window((0, 2, 0), DOWN, 1.0, distance=0.5)
    return scene
