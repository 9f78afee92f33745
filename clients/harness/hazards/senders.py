"""Rows about what sends indirect light: singular kernels, many terms, lights along and on surfaces,
walls in between."""
import numpy as np

from . import answers
from .case import SINGLE_PIXELS
from .row import row
from .scene import DOWN, UP, Scene


def sphere_room(albedo=0.5, radius=1.0, triangles=20480, lamp=(0, 0, 0)):
    scene = Scene()
    scene.sphere(scene.grey(albedo), radius, triangles)
    scene.lamp(lamp)
    scene.eye((0, 0, 0), (0.3, -0.2, -1), yfov=1.4)
    return scene


@row(1, "1/r^2 beside a virtual light", "")
def bare_kernel(case):
    """Any set of virtual lights gives the same E in a sphere, but those within 0.04 of a flat
    triangle, whose share may be off by a few times itself."""
    case.needs_indirect()
    case.needs_choice("vpl_kernel", "point")
    triangles, tolerance = (327680, 1e-4) if case.full else (81920, 4e-4)
    path = case.save(sphere_room(triangles=triangles))
    for count in (294, 24576):
        view = case.render(path, settings={"vpl_kernel": "point", "vpls": count, **SINGLE_PIXELS})
        error = np.abs(view.irradiance("indirect", 0.5) / 0.5 - 1)
        share = (error <= tolerance).mean()
        case.expect(share > 0.9, view, f"E = 0.5 within {tolerance:g} in 90 % of the pixels",
                    f"in {100 * share:.3g} %")
        case.expect(error.max() <= tolerance + 3 / count, view, f"E = 0.5 within {3 / count:.2g} "
                    "beside a virtual light", f"off by {error.max():.3g}")
    _disk_kernel(case, path)


def _disk_kernel(case, path):
    if "disk" not in case.technique.parameters["vpl_kernel"]["choices"]:
        return
    every_light = {"tau": 0} if case.technique.has("tau") else {}
    for count in (294, 4056):
        view = case.render(path, settings={"vpl_kernel": "disk", "vpls": count, **every_light,
                                            **SINGLE_PIXELS})
        mean = view.irradiance("indirect", 0.5).mean() / 0.5
        lack = 1 - answers.disk_kernel_factor(view.report["counts"]["vpls"])
        case.expect(abs((1 - mean) / lack - 1) < 0.2, view, f"mean E low by {100 * lack:.3g} %",
                    f"by {100 * (1 - mean):.3g} %")


@row(2, "receiver on a virtual light", "")
def coincident(case):
    """A floor and a ramp through each other; no E above what a half space of the brightest surface
    gives."""
    settings = case.bounces(1)
    scene = Scene()
    grey = scene.grey()
    scene.floor(1, grey)
    scene.quad((0, 0, 0), (1, 0.4, 0), (0, 0, -1), grey)
    scene.lamp((0, 1, 0))
    scene.eye((0, 2, 0), (0, 0, -1e-6), 0.9)
    path = case.save(scene)
    for kernel in case.technique.parameters.get("vpl_kernel", {}).get("choices", [None]):
        odd = {"vpls": 1350, "rsm_size": 255} if case.technique.has("rsm_size") else {}
        view = case.render(path, (65, 65), settings={**settings, **odd, "vpl_kernel": kernel})
        most = view.irradiance("indirect", 0.5).max()
        case.expect(most > 0.005, view, "light between the two", f"at most {most:.3g}")
        if kernel != "point":
            case.expect(most <= 0.5, view, "E <= 0.5, the radiosity of the brightest point",
                        f"{most:.6g}")


def tilted_floor(offset=None):
    scene = Scene(offset=offset)
    grey = scene.grey(0.8)
    scene.quad((-0.1, 0.3, 0.03), (1.15, 0.3, 0.05), (-0.1, 0.2, -1.05), grey)
    scene.spot((0.3, 1.4, 0.1), (-0.1, -1, 0), 2.0)
    scene.lamp((-0.4, 1.2, 0.3), 0.3)
    scene.eye((0.4, 1.7, 1), (0, 0.2, 0), 1.0)
    return scene


@row(3, "receiver in the virtual light's plane")
def one_plane(case):
    case.needs_indirect()
    view = case.render(tilted_floor(), (65, 65), settings={"brdf": None})
    case.expect(view.light("direct").max() > 0, view, "a lit floor", "no direct light")
    case.dark(view, "indirect")


@row(11, "a million terms")
def million_terms(case):
    """Naive sums of equal terms in 32 bits are off by per cents."""
    case.needs_indirect()
    case.needs_range("vpls", 1 << 20)
    settings = {**case.bounces(1), "vpls": 1 << 20, "vpl_kernel": None}
    if "point" in case.technique.parameters.get("vpl_kernel", {}).get("choices", []):
        settings["vpl_kernel"] = "point"
    if case.technique.has("rsm_size"):
        settings["rsm_size"] = 512
    view = case.render(sphere_room(triangles=81920), (2, 2), settings=settings)
    case.flat(view, "E", view.irradiance("indirect", 0.5), 0.5, 5e-4)


@row(24, "light on a surface")
def on_the_floor(case):
    """All that goes down lands under the lamp, which is then a point source."""
    height = 1e-3
    scene = Scene()
    grey = scene.grey()
    scene.floor(3, grey)
    scene.quad((0, 1, 0), (0.05, 0, 0), (0, 0, 0.05), grey)
    scene.lamp((0, height, 0))
    for lateral in (0.002, 0.05):
        scene.probe((lateral, 0, 0), UP, distance=0.3)
    scene.probe((0, 1, 0), DOWN)
    path = case.save(scene)
    for camera, lateral in enumerate((0.002, 0.05)):
        seen, noise, view = case.probe(path, camera, "direct")
        # the probe's own width is a tenth of the distance to the light
        case.near(view, f"direct E at {lateral} m", seen, answers.lamp_over_floor(height, lateral),
                  case.technique.tolerance_direct + 2e-3, noise)
    if case.model.indirect_bounces == 0:
        return
    seen, noise, view = case.probe(path, 2, "indirect", best=True)
    case.near(view, "E on the ceiling", seen, 0.5 * answers.floor_bounce(height),
              case.technique.tolerance_indirect, noise)


def two_rooms():
    """Room 2 lies behind an opaque wall at x = 0; the light is in room 1."""
    scene = Scene()
    grey = scene.grey()
    for center in ((-1, 0, 0), (1, 0, 0)):
        scene.room(grey, 1, center)
    scene.lamp((-1, 0.4, 0.2))
    for x in (1, -1):
        scene.window((x, -1, 0), UP, 0.9, distance=0.5)
    return scene


@row(36, "leaks through walls")
def leak(case):
    path = case.save(two_rooms())
    dark, lit = (case.render(path, (17, 17), camera) for camera in (0, 1))
    case.expect(lit.light("direct").max() > 0, lit, "light in room 1", "none")
    case.dark(dark, "direct")
    if case.model.indirect_visibility or case.model.indirect_bounces == 0:
        case.dark(dark, "indirect")
        return
    ratio = dark.light("indirect").mean() / lit.light("indirect").mean()
    case.note(f"leak ratio {ratio:.2f}, the model ignores walls")


@row(23, "light in a closed box")
def closed_box(case):
    """A technique without visibility between surfaces gets a box that is black inside."""
    for number, lamp in enumerate([(0, 1, 0), (0.39, 1.39, 0.39), (-0.2, 0.61, 0.1),
                                   (0.399, 1, 0)]):
        scene = Scene()
        grey = scene.grey()
        inside = grey if case.model.indirect_visibility else scene.grey(0.0)
        scene.room(inside, 0.4, (0, 1, 0))
        scene.block(grey, 0.42, (0, 1, 0))
        scene.floor(6, grey)
        scene.lamp(lamp)
        scene.eye((3, 3, 4), (0, 0, 0), 1.3)
        view = case.render(case.save(scene, str(number)), (65, 65))
        case.dark(view, "beauty")


@row(54, "visibility after filtering")
def filtered_visibility(case):
    """What stands between can take light away, never add some."""
    case.needs(case.model.indirect_visibility, "ignores what stands between surfaces")
    settings = case.bounces(1)
    views = []
    for has_blocker in (False, True):
        scene = Scene()
        grey = scene.grey()
        scene.floor(2, grey)
        scene.ceiling(2, grey, 2)
        scene.spot((0, 1.5, 0), DOWN)
        if has_blocker:
            scene.ceiling(0.5, scene.grey(0.0), 1.8)
        scene.window((0, 2, 0), DOWN, 1.5, distance=0.1)
        views.append(case.render(case.save(scene, "blocked" if has_blocker else "open"), (17, 17),
                                 settings=settings))
    seen, free = (view.irradiance("indirect", 0.5) for view in reversed(views))
    allowed = case.technique.tolerance_indirect * free.max() + 4 * (seen.std() + free.std()
                                                                    if case.technique.is_sampled
                                                                    else 0)
    case.expect((seen <= free + allowed).all(), views[1], "E no larger than without the blocker",
                f"larger by {(seen - free).max():.3g}")
    case.expect(seen[8, 8] < 0.5 * free[8, 8], views[1], "a shadow in the middle",
                f"{seen[8, 8] / free[8, 8]:.3g} of the unblocked E")
