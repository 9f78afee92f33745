"""Rows about the maps of a light: their faces, edges and cones."""
import numpy as np

from . import answers
from .case import SAMPLES_FEW
from .row import row
from .scene import DOWN, UP, Scene
from .senders import sphere_room


def cube_room(albedo=0.5):
    """Its edges are those between the faces of its lamp's map (D8)."""
    scene = Scene()
    scene.room(scene.grey(albedo))
    scene.lamp()
    return scene


@row(59, "edges between a light's faces")
def face_edges(case):
    scene = cube_room()
    for eye, corner in (((0.2, 0.1, 0.3), (1, 1, 1)), ((-0.4, 0.6, 0.1), (-1, -1, 1)),
                        ((0.5, -0.3, -0.6), (1, -1, -1))):
        scene.eye(eye, corner, 1.6)
    path = case.save(scene, "corners")
    slack = case.technique.tolerance_direct
    for camera in range(3):
        view = case.render(path, (97, 97), camera, samples=SAMPLES_FEW)
        e = view.irradiance("direct", 0.5)
        low, high = (1 - slack) * 3 ** -1.5, 1 + slack
        case.expect(((e >= low) & (e <= high)).all(), view,
                    f"direct E from {low:.4f} to {high:.4f}", f"{e.min():.4f} to {e.max():.4f}")
    if case.model.indirect_bounces > 0:
        hold_cube_room(case)


def hold_cube_room(case):
    """The first bounce at the points of D8."""
    settings = case.bounces(1)
    scene = cube_room()
    for x, z in answers.CUBE_ROOM:
        scene.probe((x, -1, z), UP)
    path = case.save(scene, "bounce")
    for camera, (point, (_, bounce)) in enumerate(answers.CUBE_ROOM.items()):
        seen, noise, view = case.probe(path, camera, "indirect", settings=settings, best=True)
        case.near(view, f"first bounce at {point}", seen, 0.5 * bounce,
                  case.technique.tolerance_indirect, noise)


@row(35, "seams of cube maps", "NP")
def seams(case):
    """In a sphere around the lamp nothing tells one face from the next."""
    scene = sphere_room(triangles=81920)
    scene.eye((0, 0, 0), (1, 1, 0), 1.2)
    scene.eye((0, 0, 0), (1, 1, 1), 1.2)
    path = case.save(scene)
    for camera in (1, 2):
        view = case.render(path, (65, 65), camera, samples=SAMPLES_FEW)
        case.flat(view, "direct E", view.irradiance("direct", 0.5), 1.0,
                  case.technique.tolerance_direct + 5e-4)
        if case.model.indirect_bounces == 1:
            e = view.irradiance("indirect", 0.5)
            case.flat(view, "indirect E over its mean", e / e.mean(), 1.0,
                      max(0.03, 3 * case.technique.tolerance_indirect))


@row(60, "texels on the edge of a cone")
def cone_edge(case):
    """All flux of a spot lands on the floor; all of it comes back to a ceiling far above."""
    inner, outer = 0.3, 0.5
    scene = Scene()
    grey = scene.grey()
    scene.floor(1, grey)
    scene.quad((0, 4, 0), (0.1, 0, 0), (0, 0, 0.1), grey)
    scene.spot((0, 1, 0), DOWN, 1.0, (inner, outer))
    scene.window((0, 0, 0), UP, 1.0, distance=0.1)
    scene.probe((0, 4, 0), DOWN)
    path = case.save(scene)
    view = case.render(path, (129, 129), 0)
    e = view.irradiance("direct", 0.5)
    flux = answers.cone_flux(inner, outer)
    case.near(view, "flux on the floor", 4 * e.mean(), flux,
              case.technique.tolerance_direct + 3e-3, 4 * case.noise(e))
    if case.model.indirect_bounces == 0:
        return

    def direct(x, z):
        r2 = 1 + x * x + z * z
        return answers.cone(1 / np.sqrt(r2), inner, outer) / r2 ** 1.5

    wanted = answers.bounce_off_floor((0, 4, 0), DOWN, 1, 0.5, direct)
    seen, noise, view = case.probe(path, 1, "indirect", best=True)
    case.near(view, "E on the ceiling", seen, wanted, case.technique.tolerance_indirect + 1e-3,
              noise)
