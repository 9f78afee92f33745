"""Rows about materials and normals."""
import math

import numpy as np

from . import answers
from .row import row
from .scene import DOWN, UP, Scene
from .senders import sphere_room


def corner(floor_material, wall_material, materials):
    """A wall and a floor, lit; `materials(scene)` makes both from the two descriptions."""
    scene = Scene()
    scene.floor(1, materials(scene, floor_material))
    scene.quad((0, 1, -1), (1, 0, 0), (0, 1, 0), materials(scene, wall_material))
    scene.lamp((0.2, 1.2, 0.3))
    scene.eye((0.6, 1, 1.8), (0, 0.5, -0.5), 0.8)
    return scene


@row(13, "albedo 0")
def black(case):
    scene = corner(0.0, 0.0, lambda s, albedo: s.grey(albedo))
    view = case.render(scene, (33, 33))
    case.expect(view.covered().any(), view, "surfaces in the picture", "none")
    case.dark(view, "beauty")
    view = case.render(corner(0.0, 0.5, lambda s, albedo: s.grey(albedo)), (33, 33))
    case.expect(view.light("direct").max() > 0, view, "a lit wall", "no light")
    floor = view.covered() & (view.light("direct").max(axis=-1) == 0)
    case.dark(view, "indirect", floor)


@row(15, "albedo above 1 or negative")
def albedo_out_of_range(case):
    """As if it were 1, or 0; and it says so."""
    for given, meant in ((1.2, 1.0), (-0.3, 0.0)):
        base, odd = (case.render(case.save(corner(albedo, 0.5, lambda s, a: s.grey(a)),
                                           f"{albedo:g}"), (33, 33))
                     for albedo in (meant, given))
        case.same(odd, base, 0)
        case.flagged(odd, "clamped_factors")


@row(16, "roughness 0 and next to it")
def mirror_like(case):
    """Finite everywhere; and the GGX lobe of alpha 1e-3, where 1 - cos^2 has no digits left, keeps
    its shape."""
    for roughness in (0.0, 0.01):
        for metallic in (0.0, 1.0):
            scene = corner(roughness, 0.5, lambda s, r, m=metallic: s.grey(
                0.9, roughness=r, metallic=m))
            scene.sun((0.3, -1, -0.5))
            case.render(case.save(scene, f"corner-{roughness:g}-{metallic:g}"), (49, 49),
                        settings={"brdf": None})
    for alpha, angle in [(1e-3, k * 1e-3) for k in (0, 0.5, 1, 3)] + [(1e-2, 1e-2)]:
        roughness = math.sqrt(alpha)
        scene = Scene()
        scene.floor(1, scene.grey(1.0, roughness=roughness, metallic=1.0))
        scene.sun((-math.sin(2 * angle), -math.cos(2 * angle), 0))
        scene.probe((0, 0, 0), UP)
        view = case.render(case.save(scene, f"lobe-{alpha:g}-{angle:g}"), (1, 1),
                           settings={"brdf": None})
        wanted = answers.metal_lobe(roughness, angle, 2 * angle) * math.cos(2 * angle)
        case.near(view, f"direct L at {angle:g} rad off the mirror direction, alpha {alpha:g}",
                  float(view.light("direct")[0, 0, 0]), wanted, 1e-3)


# Material, and whether a factor of it is out of range.
SUMS = [({"metallic": 0.0, "roughness": 0.7}, False), ({"metallic": 0.5, "roughness": 1.0}, False),
        ({"metallic": 1.0, "roughness": 0.8}, False), ({"metallic": 1.7, "roughness": 1.4}, True),
        ({"metallic": -0.6, "roughness": 1.0}, True), ({"metallic": 0.3, "roughness": 0.9}, False)]


# White dielectrics whose two lobes, mixed as Appendix B has it, make 1.03 to 1.07 under these suns
# and a cosine of .1.
GRAZED = [{"metallic": 0.0, "roughness": roughness} for roughness in (0.5, 0.6, 0.7)]


def white_under_suns(case, materials, eye, name):
    """Light of L = 1 from the whole half space, by 96 suns, on white squares seen from `eye`."""
    scene = Scene()
    for i, material in enumerate(materials):
        scene.quad((2 * i, 0, 0), (1, 0, 0), (0, 0, -1), scene.grey(1.0, **material))
    count = 96
    for i in range(count):  # evenly over the half sphere, on a spiral
        height, turn = (i + 0.5) / count, i * math.pi * (3 - math.sqrt(5))
        side = math.sqrt(1 - height * height)
        scene.sun((side * math.cos(turn), -height, side * math.sin(turn)), 2 * math.pi / count)
    scene.window((len(materials) - 1, 0, 0), eye, (len(materials) - 0.5, 0.4 * eye[1]), distance=6)
    small = {key: case.technique.parameters[key]["minimum"]
             for key in ("vpls", "rsm_size", "shadow_size") if case.technique.has(key)}
    small = {key: f"{value:g}" for key, value in small.items()}
    return case.render(case.save(scene, name), (len(materials) * 8, 4),
                       settings={**small, "brdf": None}, samples=4096)  # the brightest of 96 pixels is judged


def white_room_of_gloss(case):
    """In a white sphere every bounce brings E = 1 evenly from all sides; no more goes to the eye.
    Fresnel's term takes from the diffuse lobe what the specular one gives."""
    scene = Scene()
    scene.sphere(scene.grey(1.0, metallic=0.0, roughness=0.3), 1.0, 20480)
    scene.lamp((0, 0, 0))
    scene.eye((0, 0, 0), (0.3, -0.2, -1), yfov=1.4)
    view = case.render(case.save(scene, "sphere"), (9, 9), best=True, settings={"brdf": None})
    most = case.model.indirect_bounces * (1 + case.technique.tolerance_indirect)
    e = view.irradiance("indirect", 1.0).mean()
    case.expect(0.9 < e <= most, view, f"pi times mean indirect L from 0.9 to {most:.4g}",
                f"{e:.4g}")


@row(18, "more reflected than comes")
def furnace_of_suns(case):
    """No white surface returns more than L = 1, straight on and at a grazing angle."""
    for materials, eye, name in (([material for material, _ in SUMS], (0.2, 1, 0.4), "above"),
                                 (GRAZED, (0, 0.1, 1), "grazing")):
        view = white_under_suns(case, materials, eye, name)
        out = view.light()[view.covered()]
        case.expect(out.min() > 0.3, view, "light from every surface", f"{out.min():.4g}")
        case.expect(out.max() <= 1.02, view, "L <= 1 (and 2 % for 96 suns)", f"{out.max():.4g}")
        if name == "above":
            case.flagged(view, "clamped_factors")
    if 0 < case.model.indirect_bounces <= 64:  # white without end has no answer
        white_room_of_gloss(case)


@row(22, "lit from behind")
def from_behind(case):
    for double_sided in (False, True):
        scene = Scene()
        scene.floor(1, scene.grey(doubleSided=double_sided))
        scene.lamp((0.2, -0.5, 0.1))
        scene.sun(UP)
        scene.spot((-0.4, -0.7, 0.2), UP)
        scene.eye((0.3, 1.5, 0.8), (0, 0, 0), 1.2)
        view = case.render(case.save(scene, "double" if double_sided else "single"), (65, 65),
                           settings={"brdf": None})
        case.expect(view.covered().any(), view, "a surface in the picture", "none")
        case.dark(view, "beauty")


@row(47, "hairlines")
def hairlines(case):
    """A hundred hairs thinner than a pixel before a wall, all lit from the eye: whatever is
    interpolated finds no weight there. Shadow maps may lose light in gaps below their texel."""
    rng = np.random.default_rng(47)
    scene = Scene()
    grey = scene.grey()
    scene.quad((0, 0, -1), (1.5, 0, 0), (0, 1.5, 0), grey)
    scene.quad((0, -1, 0), (1.5, 0, 0), (0, 0, -1), grey)
    for _ in range(100):
        angle, x, y = rng.uniform(0, np.pi), *rng.uniform(-0.7, 0.7, 2)
        along = np.array([math.cos(angle), math.sin(angle), 0])
        across = np.array([-along[1], along[0], 0])
        scene.quad((x, y, -0.8), 0.5 * along, 10 ** rng.uniform(-5, -2) * across, grey)
    scene.lamp((0, 0, 1))
    scene.eye((0, 0, 1), (0, 0, -1), 0.7)
    view = case.render(scene, (49, 49), samples=128)
    e = view.irradiance("direct", 0.5)
    case.expect(view.covered().all() and e.max() < 0.32, view,
                "every pixel covered, direct E below 0.31, that of the nearest hair",
                f"{e.max():.3g}")
    shadowed = int((e == 0).sum())
    case.expect(shadowed < 0.01 * e.size, view, "direct light in 99 % of the pixels",
                f"none in {shadowed} of {e.size}")
    if shadowed:
        case.note(f"false shadow in {shadowed} of {e.size} pixels")
    if case.model.indirect_bounces:
        dark = int((view.light("indirect")[..., 0] == 0).sum())
        case.expect(dark == 0, view, "indirect light in every pixel", f"none in {dark} of them")


@row(53, "roulette with probability 0 or 1")
def colours_of_chance(case):
    """Flux is kept channel by channel where albedos are 0, 1/2 and nearly 1."""
    case.needs_indirect()
    unlimited = case.model.indirect_bounces > 64
    albedo = np.array([0.9 if unlimited else 1.0, 0.0, 0.5])
    view = case.render(sphere_room(tuple(albedo)), (9, 9), best=True, samples=128)
    count = None if unlimited else case.model.indirect_bounces
    for channel in range(3):
        e = answers.bounces_in_sphere(albedo[channel], count, 1.0)
        wanted = albedo[channel] / np.pi * e
        light = view.light("indirect")[..., channel]
        if wanted == 0:
            case.dark(view, "indirect", np.s_[..., channel:channel + 1])
            continue
        # flat triangles lie up to 3e-4 under their sphere
        case.near(view, f"mean indirect L of albedo {albedo[channel]:g}", light.mean(), wanted,
                  case.technique.tolerance_indirect + 1e-3, case.noise(light))


@row(61, "shading normal off the surface")
def leaning_normals(case):
    """No light from below the surface, however the normals lean, nor from the floor to itself."""
    cells = 16
    at = np.linspace(-1, 1, cells + 1)
    x, z = (a.ravel() for a in np.meshgrid(at, at[::-1]))
    i = np.arange(len(x))
    positions = np.stack([x, 0 * x, z], 1)
    first = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    indices = np.stack([first, first + 1, first + cells + 2, first, first + cells + 2,
                        first + cells + 1], 1)
    for lean in (0.45, 2.0):
        normals = np.stack([lean * np.sin(2.1 * i), np.ones(len(i)), lean * np.cos(3.7 * i)], 1)
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        for side in (1, -1):
            scene = Scene()
            scene.add((positions, normals, indices, None), scene.grey(0.8, doubleSided=True))
            scene.lamp((0.9, 0.3 * side, 0.1))
            scene.sun((0.9, -0.2 * side, 0.1))
            scene.eye((0.4, 1.6, 1), (0, 0, 0), 0.9)
            name = f"{lean:g}-{'above' if side > 0 else 'below'}"
            view = case.render(case.save(scene, name), (65, 65), settings={"brdf": None})
            case.dark(view, "indirect")
            if side < 0:
                case.dark(view, "direct")
            else:
                case.expect(view.light("direct").max() > 0, view, "a lit floor", "no light")


@row(62, "cut-outs")
def cut_outs(case):
    """Under a checkerboard of holes every second square of the floor is lit, and half of it all."""
    cells = 8
    rgba = np.full((cells, cells, 4), 255, np.uint8)
    rgba[np.add.outer(np.arange(cells), np.arange(cells)) % 2 == 0, 3] = 0
    scene = Scene()
    grey = scene.grey()
    scene.floor(1, grey)
    texture = scene.texture(rgba, nearest=True)
    mask = scene.material("mask", (1, 1, 1), alphaMode="MASK", alphaCutoff=0.5,
                          pbr={"baseColorTexture": {"index": texture}}, doubleSided=True)
    scene.quad((0, 1, 0), (1, 0, 0), (0, 0, -1), mask, with_uv=True)
    scene.sun(DOWN)
    scene.window((0, 0, 0), UP, 1.0, distance=0.5)
    view = case.render(scene, (64, 64))
    e = view.irradiance("direct", 0.5)
    case.near(view, "mean direct E under the holes", e.mean(), 0.5,
              case.technique.tolerance_direct + 0.01, case.noise(e))
    middle = e.reshape(cells, 8, cells, 8)[:, 2:6, :, 2:6].mean(axis=(1, 3))
    wanted = np.add.outer(np.arange(cells), np.arange(cells)) % 2 == 0
    case.expect((np.abs(middle - wanted) < 0.01).all(), view, "E = 1 under holes, 0 under cells",
                f"off by {np.abs(middle - wanted).max():.3g} in the middle of one")
