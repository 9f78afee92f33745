"""Scenes whose light is known on paper, with what each asks of a model and what it must show.

A view is a camera that sees one plane or sphere; it knows the point behind each of its pixels. An
oracle says per view what each layer is there, in the model at hand. A layer that is not named is
not judged; one that is 0 is 0 exactly.
"""
import dataclasses
import math
from typing import Callable

import numpy as np

from . import oracles_forms as forms
from .gltf import Writer
from .shapes import add, box, disc, icosphere, quad

DOWN, UP = (0, -1, 0), (0, 1, 0)


@dataclasses.dataclass(frozen=True)
class View:
    """Orthographic with `half` its half side, or perspective where `yfov` is given: of a plane
    through `at` with the camera's own axis for normal, or of the sphere about 0 of radius `at`.
    Names of one oracle's views differ, or the daemon takes the first camera of the name for all."""
    name: str
    position: tuple
    look: tuple
    half: float = 1e-3
    yfov: float = None
    up: tuple = (0, 1, 0)
    at: object = (0, 0, 0)

    def place(self, writer):
        mag = None if self.yfov else (self.half, self.half)
        writer.camera(self.name, self.position, self.look, self.yfov, mag, self.up)

    def points(self, side):
        """side x side x 3: the world positions behind the pixels' centres."""
        z = np.asarray(self.look, float) / np.linalg.norm(self.look)
        x = np.cross(z, self.up)
        x = x / np.linalg.norm(x)
        y = np.cross(x, z)
        grid = (np.arange(side) + 0.5) / side * 2 - 1
        u, v = grid[None, :, None], -grid[:, None, None]
        position = np.asarray(self.position, float)
        if self.yfov is None:
            origin = position + self.half * (u * x + v * y)
            return origin + np.dot(np.asarray(self.at, float) - position, z) * z
        t = math.tan(self.yfov / 2)
        ray = z + t * (u * x + v * y)
        ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
        along = -(ray * position).sum(-1)
        reach = along + np.sqrt(along ** 2 - position @ position + self.at ** 2)
        return position + reach[..., None] * ray


@dataclasses.dataclass(frozen=True)
class Oracle:
    name: str
    needs: Callable    # of a Model: "" or why it does not apply
    build: Callable    # () -> Writer without cameras
    views: tuple
    expected: Callable  # (view, points, model) -> {layer: radiance, broadcast to the points}
    side: int = 16     # pixels
    whole: bool = False  # only the mean over the view is known
    settings: dict = dataclasses.field(default_factory=dict)
    asks: tuple = ()   # parameters without which it does not apply
    environment: tuple = None
    full_brdf: bool = False


def lit_by(*kinds, bounces=None, **flags):
    """A `needs` of light kinds, of a number of bounces (None: any), of flags of the model."""
    def reason(model):
        missing = [kind for kind in kinds if kind not in model.lights]
        if missing:
            return f"no {missing[0]} lights"
        if bounces is not None and model.indirect_bounces not in bounces:
            return "known for %s bounces" % " or ".join(
                "any number of" if count == forms.UNLIMITED else str(count) for count in bounces)
        for flag, wanted in flags.items():
            if getattr(model, flag) != wanted:
                return f"needs {flag.replace('_', ' ')}"
        return ""
    reason.kinds = frozenset(kinds)
    return reason


def _glowing():
    """A scene without lights would get the daemon's default ones; a dark one is a light."""
    w = Writer()
    w.light("Dark", "point", 0.0, (0, 0, 0.1))
    return w


def _radiance(rho, irradiance):
    return rho / math.pi * irradiance


def _room(w, half, rho, **material):
    """Six inward faces about the origin."""
    h = half
    wall = w.material("wall", (rho,) * 3, **material)
    for name, face in (("Floor", quad((0, -h, 0), (h, 0, 0), (0, 0, -h))),
                       ("Ceiling", quad((0, h, 0), (h, 0, 0), (0, 0, h))),
                       ("Back", quad((0, 0, -h), (h, 0, 0), (0, h, 0))),
                       ("Front", quad((0, 0, h), (-h, 0, 0), (0, h, 0))),
                       ("Left", quad((-h, 0, 0), (0, 0, -h), (0, h, 0))),
                       ("Right", quad((h, 0, 0), (0, 0, h), (0, h, 0)))):
        add(w, name, face, wall)
    return wall


ROOM_VIEWS = tuple(View(name, (0, 0, 0), look, 1.0, up=up, at=look) for name, look, up in (
    ("Floor view", (0, -1, 0), (0, 0, -1)), ("Ceiling view", (0, 1, 0), (0, 0, 1)),
    ("Back view", (0, 0, -1), UP), ("Front view", (0, 0, 1), UP),
    ("Left view", (-1, 0, 0), UP), ("Right view", (1, 0, 0), UP)))


# --- D1: white furnace ------------------------------------------------------------------------


def furnace_room():
    w = _glowing()
    _room(w, 1.0, 0.5, emissiveFactor=[0.5] * 3)
    return w


def furnace_room_with_block():
    w = furnace_room()
    block = w.material("block", (0.5,) * 3, emissiveFactor=[0.5] * 3)
    add(w, "Block", box((0.3, 0.31, 0.29)), block, translation=[0.2, -0.5, 0.1])
    return w


def furnace_expected(_view, _points, model):
    """L = 1 - rho^(n+1) after n scattering events; rho = 1/2."""
    rho = 0.5
    return {"emission": 1 - rho, "direct": rho * (1 - rho),
            "indirect": (1 - rho) * rho * forms.bounce_sum(rho, model.indirect_bounces)}


def lone_block():
    w = Writer()
    add(w, "Block", box((0.5, 0.5, 0.5)), w.material("grey", (0.6,) * 3))
    return w


# --- D2, D8: rooms with a point light ---------------------------------------------------------

FLUX_LIGHT = (0.31, -0.22, 0.17)


def flux_room(rho=0.5):
    w = Writer()
    _room(w, 1.0, rho)
    w.light("Light", "point", 1.0, FLUX_LIGHT)
    return w


def flux_expected(_view, _points, model):
    """Mean radiance over all six walls, 24 m^2: the flux 4 pi lands on them, then rho of it."""
    rho, area = 0.5, 24.0
    mean = 4 * math.pi / area
    return {"direct": _radiance(rho, mean),
            "indirect": _radiance(rho, mean * forms.bounce_sum(rho, model.indirect_bounces))}


def cube_room(rho):
    def build():
        w = Writer()
        _room(w, 1.0, rho)
        w.light("Light", "point", 1.0)
        return w
    return build


def cube_views():
    return tuple(View(f"At {u:g} {v:g}", (u, 0.5, v), DOWN, 1e-3, up=(0, 0, -1), at=(0, -1, 0))
                 for u, v in forms.CUBE_POINTS)


def cube_expected(rho):
    def expected(view, points, model):
        index = [v.name for v in cube_views()].index(view.name)
        direct = forms.cube_direct(points[..., 0], points[..., 2])
        found = {"direct": _radiance(rho, direct)}
        if model.indirect_bounces == 1:
            found["indirect"] = _radiance(rho, rho * forms.CUBE_FIRST[index])
        elif model.indirect_bounces == forms.UNLIMITED:
            u, v = forms.CUBE_POINTS[index]
            found["indirect"] = _radiance(rho, forms.CUBE_TOTAL[rho][index]
                                          - forms.cube_direct(u, v))
        return found
    return expected


# --- D3: integrating sphere --------------------------------------------------------------------

SPHERE_RADIUS, SPHERE_RHO = 2.0, 0.5


def sphere(position):
    def build():
        w = Writer()
        points, faces = icosphere(20480)
        grey = w.material("wall", (SPHERE_RHO,) * 3)
        add(w, "Sphere", (SPHERE_RADIUS * points, -points, faces[:, ::-1], None), grey)
        w.light("Light", "point", 1.0, position)
        return w
    return build


def sphere_expected(position):
    def expected(_view, points, model):
        away = np.asarray(position) - points
        distance = np.linalg.norm(away, axis=-1)
        cosine = (away * -points).sum(-1) / (distance * SPHERE_RADIUS)
        mean = 1 / SPHERE_RADIUS ** 2
        return {"direct": _radiance(SPHERE_RHO, cosine / distance ** 2),
                "indirect": _radiance(SPHERE_RHO, mean * forms.bounce_sum(
                    SPHERE_RHO, model.indirect_bounces))}
    return expected


# --- D4: floor and ceiling ----------------------------------------------------------------------

FLOOR_REACH, CEILING_RHO = 3.0, 0.1


def lit_floor():
    w = Writer()
    add(w, "Floor", quad((0, 0, 0), (4, 0, 0), (0, 0, -4)), w.material("grey", (0.5,) * 3))
    w.light("Light", "point", 1.0, (0, 1, 0))
    return w


def floor_expected(_view, points, _model):
    x = np.hypot(points[..., 0], points[..., 2])
    return {"direct": _radiance(0.5, forms.floor_irradiance(1.0, 1.0, x))}


def floor_and_ceiling(height):
    """A small, dark ceiling at 1 m: what it sends back is below 1e-3 of what it gets."""
    def build():
        w = Writer()
        add(w, "Floor", disc(FLOOR_REACH, 0, 256, True), w.material("grey", (0.5,) * 3))
        add(w, "Ceiling", quad((0, 1, 0), (0.1, 0, 0), (0, 0, 0.1)),
            w.material("dark", (CEILING_RHO,) * 3))
        w.light("Light", "point", 1.0, (0, height, 0))
        return w
    return build


def ceiling_expected(height):
    def expected(_view, _points, model):
        if model.indirect_bounces == 0:
            return {}
        return {"indirect": _radiance(CEILING_RHO, 0.5 * forms.disc_to_ceiling(height,
                                                                              FLOOR_REACH))}
    return expected


# --- D6, D7: sunlit patches -----------------------------------------------------------------------

WALL_HEIGHT, WALL_HALF, DARK = 1.0, 10.0, 0.05
TILT = math.radians(60)


def sunlit_wall():
    """1 lx straight onto a long wall that stands on a narrow, dark strip of floor."""
    w = Writer()
    add(w, "Wall", quad((0, WALL_HEIGHT / 2, 0), (0, 0, -WALL_HALF), (0, WALL_HEIGHT / 2, 0)),
        w.material("grey", (0.5,) * 3))
    add(w, "Floor", quad((1.0, 0, 0), (1.0, 0, 0), (0, 0, -0.1)), w.material("dark", (DARK,) * 3))
    w.light("Sun", "directional", 1.0, (3, 1, 0), (-1, 0, 0))
    return w


def sunlit_wall_expected(_view, points, model):
    if model.indirect_bounces == 0:
        return {"direct": 0.0}
    factor = forms.wall(WALL_HEIGHT, WALL_HALF, points[..., 0], points[..., 2])
    return {"direct": 0.0, "indirect": _radiance(DARK, 0.5 * factor)}


def sunlit_disc():
    """The sun comes in at 60 degrees, past the small dark plate whose underside looks down."""
    w = Writer()
    add(w, "Disc", disc(1.0, 0, 256, True), w.material("grey", (0.5,) * 3))
    add(w, "Plate", quad((0, 1, 0), (0.15, 0, 0), (0, 0, 0.15)), w.material("dark", (DARK,) * 3))
    w.light("Sun", "directional", 1.0, (0, 3, 0), (math.sin(TILT), -math.cos(TILT), 0))
    return w


def sunlit_disc_expected(_view, points, model):
    if model.indirect_bounces == 0:
        return {}
    aside = np.hypot(points[..., 0], points[..., 2])
    return {"indirect": _radiance(DARK, 0.5 * math.cos(TILT) * forms.offset_disc(1, 1, aside))}


def unit_squares():
    """1 lx straight onto a square; another, dark one shares its lower edge."""
    w = Writer()
    add(w, "Lit", quad((0, 0.5, 0), (0, 0, -0.5), (0, 0.5, 0)), w.material("grey", (0.5,) * 3))
    add(w, "Floor", quad((0.5, 0, 0), (0.5, 0, 0), (0, 0, -0.5)),
        w.material("dark", (DARK,) * 3))
    w.light("Sun", "directional", 1.0, (3, 1, 0), (-1, 0, 0))
    return w


def unit_squares_expected(_view, _points, model):
    if model.indirect_bounces == 0:
        return {}
    # What goes back to the lit square and comes again: 0.05 x 0.5 x 0.2^2 of it.
    return {"indirect": _radiance(DARK, 0.5 * forms.UNIT_SQUARES["sharing an edge"])}


# --- D5: the same wall under a bound on cos cos / r^2 --------------------------------------------

BOUNDED_AT = 0.2  # m from the wall's foot; the bound is 1 per m^2


def bounded_wall():
    w = Writer()
    add(w, "Wall", quad((0, 10, 0), (0, 0, -40), (0, 10, 0)), w.material("grey", (0.5,) * 3))
    add(w, "Floor", quad((0.2, 0, 0), (0.19, 0, 0), (0, 0, -0.05)),
        w.material("dark", (DARK,) * 3))
    w.light("Sun", "directional", 1.0, (3, 1, 0), (-1, 0, 0))
    return w


def bounded_wall_expected(_view, _points, model):
    if model.indirect_bounces == 0:
        return {}
    bounded = forms.wall(20.0, 40.0, BOUNDED_AT) - forms.WALL_RESIDUAL[BOUNDED_AT]
    return {"indirect": _radiance(DARK, 0.5 * bounded)}


# --- D10, D11: mirrors, glass, highlights ---------------------------------------------------------


def mirror():
    """A glowing panel behind the camera, seen in a metal mirror of reflectance 0.8."""
    w = _glowing()
    metal = w.material("mirror", (0.8,) * 3, roughness=0.0, metallic=1.0)
    add(w, "Mirror", quad((0, 0, 0), (1, 0, 0), (0, 1, 0)), metal)
    glow = w.material("panel", (0, 0, 0), emissiveFactor=[1, 0.5, 0.25])
    add(w, "Panel", quad((0, 0, 4), (-3, 0, 0), (0, 3, 0)), glow)
    return w


def mirror_expected(_view, _points, _model):
    return {"beauty": 0.8 * np.array([1, 0.5, 0.25])}


def glass_slab():
    """The panel through a slab of glass, square on."""
    w = _glowing()
    glass = w.material("glass", roughness=0.0, extensions={
        "KHR_materials_transmission": {"transmissionFactor": 1.0},
        "KHR_materials_volume": {"thicknessFactor": 0.1}, "KHR_materials_ior": {"ior": 1.5}})
    w.extensions |= {"KHR_materials_transmission", "KHR_materials_volume", "KHR_materials_ior"}
    add(w, "Slab", box((2, 2, 0.05)), glass)
    glow = w.material("panel", (0, 0, 0), emissiveFactor=[1, 0.5, 0.25])
    add(w, "Panel", quad((0, 0, -1), (2, 0, 0), (0, 2, 0)), glow)
    return w


def glass_slab_expected(_view, _points, _model):
    return {"beauty": forms.slab_transmittance(1.5) * np.array([1, 0.5, 0.25])}


def white_metal(alpha):
    def build():
        w = Writer()
        metal = w.material("metal", (1, 1, 1), roughness=math.sqrt(alpha), metallic=1.0)
        add(w, "Plate", quad((0, 0, 0), (1, 0, 0), (0, 0, -1)), metal)
        return w
    return build


def white_metal_views():
    slant = (-math.sqrt(0.75), -0.5, 0.0)
    return (View("Above", (0, 1, 0), DOWN, up=(0, 0, -1)),
            View("Slanting", tuple(-v for v in slant), slant))


def white_metal_expected(alpha):
    def expected(view, _points, _model):
        return {"direct": forms.GGX_ALBEDO[alpha, 1.0 if view.name == "Above" else 0.5]}
    return expected


# --- D12: occlusion ----------------------------------------------------------------------------


def _ball(w, name, radius, material, inward=False, **placing):
    points, faces = icosphere(5120)
    sign = -1 if inward else 1
    return add(w, name, (radius * points, sign * points, faces[:, ::-1] if inward else faces,
                         None), material, **placing)


def nested_spheres():
    w = _glowing()
    shining = [1 / math.pi] * 3
    _ball(w, "Outer", 2.0, w.material("outer", (0.5,) * 3, emissiveFactor=shining), inward=True)
    _ball(w, "Inner", 1.0, w.material("inner", (0.8,) * 3))
    return w


def nested_expected(view, _points, _model):
    inner, outer = forms.concentric_spheres(1.0, 2.0, 0.8, 0.5, 1.0)
    return {"beauty": (inner if view.name == "Inner view" else outer) / math.pi}


def ball_over_floor():
    w = Writer()
    add(w, "Floor", quad((0, 0, 0), (4, 0, 0), (0, 0, -4)), w.material("grey", (0.5,) * 3))
    _ball(w, "Ball", 1.0, w.material("black", (0, 0, 0)), translation=[0, 2, 0])
    return w


def ball_expected(_view, points, _model):
    aside = np.hypot(points[..., 0], points[..., 2])
    return {"direct": 0.5 * forms.floor_under_a_ball(1.0, 2.0, aside)}


def two_rooms():
    """A lamp in the left room; the wall between them is one sheet. Floor and ceiling of the right
    one are the left one's."""
    w = Writer()
    white = w.material("white", (0.8,) * 3, doubleSided=True)
    for name, face in (("Floor", quad((0, -1, 0), (2, 0, 0), (0, 0, -1))),
                       ("Ceiling", quad((0, 1, 0), (2, 0, 0), (0, 0, 1))),
                       ("Back", quad((0, 0, -1), (2, 0, 0), (0, 1, 0))),
                       ("Front", quad((0, 0, 1), (-2, 0, 0), (0, 1, 0))),
                       ("Left", quad((-2, 0, 0), (0, 0, -1), (0, 1, 0))),
                       ("Right", quad((2, 0, 0), (0, 0, 1), (0, 1, 0))),
                       ("Wall", quad((0, 0, 0), (0, 0, 1), (0, 1, 0)))):
        add(w, name, face, white)
    w.light("Lamp", "point", 100.0, (-0.7, 0.1, 0.2))
    return w


def two_rooms_expected(_view, _points, model):
    dark = {"direct": 0.0, "emission": 0.0}
    if model.indirect_visibility or model.indirect_bounces == 0:
        dark["indirect"] = 0.0
    return dark


# --- the list -----------------------------------------------------------------------------------


def _from_above(half, x=0.0, height=0.5):
    return View(f"Above {x:g}", (x, height, 0), DOWN, half, up=(0, 0, -1))


def _inside(radius):
    return View("Inside", (0.2 * radius, 0.1 * radius, 0.4 * radius), (0, 0, -1), yfov=1.4,
                at=radius)


CONVEX = (View("Back view", (0, 0, 0), (0, 0, -1), 0.9, at=(0, 0, -1)),
          View("Floor view", (0, 0, 0), DOWN, 0.9, up=(0, 0, -1), at=(0, -1, 0)))
OFF_CENTRE = (0.7, -0.4, 0.5)

# D9 and D16 wait for a technique that has such stages; D13 needs a sensor in space, D15 a spectrum. D14
# is the reading with one bounce, two, ... (oracles.py, BOUNCES).
ORACLES = (
    Oracle("D1 furnace", lit_by("emissive"), furnace_room, CONVEX, furnace_expected),
    Oracle("D1 with a block", lit_by("emissive", indirect_visibility=True),
           furnace_room_with_block, CONVEX[:1], furnace_expected),
    Oracle("D1 block in the sky", lit_by("environment"), lone_block,
           (View("View", (0, 0, 2), (0, 0, -1), 0.4),),
           lambda *_: {"direct": 0.6, "indirect": 0.0}, environment=(1, 1, 1)),
    Oracle("D2 flux", lit_by("punctual"), flux_room, ROOM_VIEWS, flux_expected, side=48,
           whole=True),
    Oracle("D3 sphere", lit_by("punctual"), sphere((0, 0, 0)), (_inside(SPHERE_RADIUS),),
           sphere_expected((0, 0, 0)), side=32),
    Oracle("D3 off centre", lit_by("punctual"), sphere(OFF_CENTRE), (_inside(SPHERE_RADIUS),),
           sphere_expected(OFF_CENTRE), side=32),
    Oracle("D4 floor", lit_by("punctual"), lit_floor, (_from_above(2.5),), floor_expected, side=32),
    *(Oracle(f"D4 ceiling, a = {a:g}", lit_by("punctual"), floor_and_ceiling(a),
             (View("From below", (0, a + (1 - a) / 2, 0), UP, up=(0, 0, 1), at=(0, 1, 0)),),
             ceiling_expected(a), side=4) for a in (0.25, 0.5, 0.75)),
    Oracle("D5 bounded wall", lit_by("punctual", bounces=(1,)), bounded_wall,
           (_from_above(1e-3, BOUNDED_AT),), bounded_wall_expected, side=4,
           settings={"clamp": 1}, asks=("clamp",)),
    Oracle("D6 wall", lit_by("punctual"), sunlit_wall, (_from_above(0.08, 0.2),
                                                        _from_above(0.08, 1.0)),
           sunlit_wall_expected),
    Oracle("D6 disc", lit_by("punctual"), sunlit_disc,
           (View("From below", (0, 0.5, 0), UP, 0.12, up=(0, 0, 1), at=(0, 1, 0)),),
           sunlit_disc_expected),
    Oracle("D7 squares", lit_by("punctual"), unit_squares, (_from_above(0.5, 0.5),),
           unit_squares_expected, side=64, whole=True),
    *(Oracle(f"D8 cube, rho = {rho:g}", lit_by("punctual", bounces=(0, 1, forms.UNLIMITED)),
             cube_room(rho), cube_views(), cube_expected(rho), side=4) for rho in (0.5, 0.8)),
    Oracle("D10 mirror", lit_by("emissive", glossy_receivers=True), mirror,
           (View("View", (0, 0, 3), (0, 0, -1), 0.2),), mirror_expected, side=8, full_brdf=True),
    Oracle("D10 slab", lit_by("emissive", transmission=True), glass_slab,
           (View("View", (0, 0, 2), (0, 0, -1), 0.2),), glass_slab_expected, side=8,
           full_brdf=True, whole=True),  # by chance of the ways between its faces, whoever looks
    *(Oracle(f"D11 GGX {alpha:g}", lit_by("environment", glossy_receivers=True),
             white_metal(alpha), white_metal_views(), white_metal_expected(alpha), side=8,
             environment=(1, 1, 1), full_brdf=True) for alpha in (0.1, 0.5, 1.0)),
    Oracle("D12 nested spheres", lit_by("emissive", bounces=(forms.UNLIMITED,),
                                        indirect_visibility=True), nested_spheres,
           (View("Inner view", (0, 0, 1.5), (0, 0, -1), 0.5),
            View("Outer view", (0, 0, 1.5), (0, 0, 1), 0.5)), nested_expected),
    Oracle("D12 ball", lit_by("environment"), ball_over_floor,
           (View("From above", (2.2, 0.5, 0), DOWN, 1.1, up=(0, 0, -1)),), ball_expected,
           environment=(1, 1, 1)),
    Oracle("D12 two rooms", lit_by("punctual"), two_rooms,
           (View("Right room", (1, 0, 0.9), (0.1, -0.1, -1), yfov=1.2, at=9.0),),
           two_rooms_expected, side=32),
)
