"""Where light is hard to find: error of `auto`, of `many_light` at its defaults and of its fifth rung, and what each frame says of itself.

usage: hard_cases.py BUILD_DIR -o RESULT.json [--cases NAME,NAME] [--spp 256] [--pictures FOLDER]

Made-up rooms, 128x96, `brdf=full`: a corridor lit around a corner; twelve boxes in a world of 42 m; a lamp in a neighbouring room; a slit
under a door; 64 lamps of which one is not shut in; a mirror that faces a lamp with a size; a glossy floor; leaves with holes; a figure that
was bent and turned by an edit of its vertices, after a frame of it upright. By pixel
relative RMSE of the indirect layer and of beauty against the reference, its own noise taken out by two halves (and told: where it is large,
no figure is good), the sum's error, the frame's own estimate, and its flags. PICTURES gets what was rendered beside the truth.
"""
import pathlib
import sys

import numpy
from PIL import Image

import by_hand
import live
import many_light

sys.path.insert(0, str(by_hand.ROOT / "clients"))
from harness import gltf, shapes  # noqa: E402

SIZE = (128, 96)
RUNG = 4


class Room(gltf.Writer):
    """Quads by centre and half-edges, boxes, lamps: enough for a stage."""

    def __init__(self):
        super().__init__()
        self.grey = self.material("grey", (.6, .6, .6))
        self.red = self.material("red", (.7, .2, .15))

    def quad(self, centre, u, v, material=None, uv=False):
        positions, normals, indices, flat = shapes.quad(centre, u, v)
        self.node("quad", mesh=self.mesh("quad", positions, normals, indices, self.grey if material is None else material, flat if uv else None))

    def walls(self, low, high, material=None, leave=()):
        """A room seen from inside, but for the sides that are left out: x- x+ y- y+ z- z+."""
        low, high = numpy.array(low, float), numpy.array(high, float)
        middle, half = (low + high) / 2, (high - low) / 2
        for axis in range(3):
            for side, end in ((-1, low), (1, high)):
                if ("-" if side < 0 else "+") + "xyz"[axis] in leave:
                    continue
                centre, a, b = middle.copy(), numpy.zeros(3), numpy.zeros(3)
                centre[axis] = end[axis]
                first, second = (axis + 1) % 3, (axis + 2) % 3
                a[first], b[second] = half[first], half[second] * -side
                self.quad(centre, a, b, material)

    def box(self, centre, half, material=None):
        positions, normals, indices, _ = shapes.box(half)
        self.node("box", mesh=self.mesh("box", positions, normals, indices, self.grey if material is None else material), translation=list(centre))

    def wall_with_hole(self, x, low, high, hole, material=None):
        """Both sides of a thick wall across x: `low`, `high`, `hole` are (y, z) corners; the hole starts at the wall's foot."""
        (y0, z0), (y1, z1), (top, h0, h1) = low, high, hole
        for (a0, b0), (a1, b1) in (((y0, z0), (y1, h0)), ((y0, h1), (y1, z1)), ((top, h0), (y1, h1))):
            self.box((x, (a0 + a1) / 2, (b0 + b1) / 2), (.1, (a1 - a0) / 2, (b1 - b0) / 2), material)


def corridor():
    w = Room()
    w.walls((0, 0, -8), (2, 2.5, 0), leave=("+x",))
    w.quad((2, 1.25, -5), (0, 0, 3), (0, 1.25, 0))
    w.walls((2, 0, -2), (7, 2.5, 0), w.red, leave=("-x",))
    w.light("lamp", "point", 80, position=(5.5, 1.8, -1))
    w.camera("camera", (1, 1.4, -7.5), (0, -.1, 1), yfov=1)
    return w


def twelve_boxes():
    w, random = Room(), numpy.random.default_rng(5)
    w.quad((0, 0, 0), (21, 0, 0), (0, 0, -21))
    for i in range(12):
        w.box((8 * (i % 4) - 12, 1, 7 * (i // 4) - 10), (.5 + random.random(), 1, .5 + random.random()), w.red if i % 3 == 0 else w.grey)
    w.light("lamp", "spot", 20000, position=(-14, 9, 8), look=(.8, -.6, -.5), cone=(.3, .6))
    w.camera("camera", (0, 5, 17), (0, -.3, -1), yfov=.9)
    return w


def next_room(top, width, candela):
    """Two rooms with a wall between, a hole in it, and the lamp in the farther one."""
    w = Room()
    w.walls((0, 0, 0), (8, 2.5, 4))
    w.wall_with_hole(4, (0, 0), (2.5, 4), (top, 2 - width / 2, 2 + width / 2))
    w.light("lamp", "point", candela, position=(6.5, 2, 1))
    w.camera("camera", (.3, 1.3, 3.4), (1, -.2, -.35), yfov=1.1)
    return w


def lamps_64():
    w = Room()
    w.walls((0, 0, 0), (6, 2.5, 4))
    w.box((4, .6, 2), (.5, .6, .5), w.red)
    for i in range(63):
        place = (10 + 2 * (i % 8), 1, 2 * (i // 8))
        w.box(place, (.6, .6, .6))
        w.light(f"shut in {i}", "point", 100, position=place)
    w.light("lamp", "spot", 90, position=(3, 2.3, 2), look=(.4, -1, .3), cone=(.4, .7))
    w.camera("camera", (.3, 1.4, 3.6), (1, -.25, -.5), yfov=1)
    return w


def mirror():
    w = Room()
    w.walls((0, 0, 0), (4, 2.5, 4), leave=("-z",))
    w.quad((2, 1.25, 0), (2, 0, 0), (0, 1.25, 0), w.material("mirror", (.95, .95, .95), roughness=0, metallic=1))
    w.quad((2, 2.2, 2.2), (.4, 0, 0), (0, .12, .12), w.material("lamp", (0, 0, 0), emissiveFactor=[1, 1, 1], extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 30}}))
    w.extensions.add("KHR_materials_emissive_strength")
    w.box((1, .5, 1.5), (.3, .5, .3), w.red)
    w.camera("camera", (3.4, 1.4, 3.7), (-.6, -.15, -1), yfov=1)
    return w


def glossy_floor():
    w = Room()
    w.walls((0, 0, 0), (5, 2.5, 5), leave=("-y",))
    w.quad((2.5, 0, 2.5), (2.5, 0, 0), (0, 0, -2.5), w.material("floor", (.3, .3, .35), roughness=.25))
    w.box((3.4, .7, 1.4), (.4, .7, .4), w.red)
    w.light("lamp", "spot", 120, position=(1, 2.2, 1), look=(.6, -.3, -.4), cone=(.3, .7))
    w.camera("camera", (1.2, 1, 4.7), (.25, -.25, -1), yfov=1)
    return w


def leaves():
    w, random = Room(), numpy.random.default_rng(3)
    x, y = numpy.meshgrid(*[numpy.linspace(-1, 1, 64)] * 2)
    rgba = numpy.zeros((64, 64, 4), numpy.uint8)
    rgba[..., :3], rgba[..., 3] = (70, 130, 40), 255 * (x ** 2 + (y * 1.8) ** 2 < .8)
    leaf = w.material("leaf", alphaMode="MASK", doubleSided=True, pbr={"baseColorTexture": {"index": w.texture(rgba)}})
    w.walls((-3, 0, -3), (3, 4, 3))
    for _ in range(400):
        u, v = random.normal(size=(2, 3))
        u /= numpy.linalg.norm(u) * 8
        v = numpy.cross(u, v)
        v /= numpy.linalg.norm(v) * 8
        w.quad(random.normal(size=3) * (.6, .5, .6) + (0, 1.8, 0), u, v, leaf, uv=True)
    w.light("lamp", "point", 60, position=(1.8, 3.4, 1.2))
    w.camera("camera", (0, 1.7, 2.9), (0, 0, -1), yfov=1)
    return w


def figure():
    w = Room()
    w.walls((0, 0, 0), (4, 2.5, 4))
    w.node("figure", mesh=w.mesh("figure", *upright()[:3], w.red), translation=[2.2, 0, 1.6])
    w.light("lamp", "spot", 90, position=(.6, 2.2, 3), look=(1.5, -.7, -1.2), cone=(.25, .5))
    w.camera("camera", (2.2, 1.3, 3.9), (0, -.12, -1), yfov=1)
    return w


def upright(around=48, along=96):
    """A body of 9,216 triangles: thick, thin, thick again, closed at its ends."""
    v, u = numpy.meshgrid(numpy.linspace(0, 1, along + 1), numpy.linspace(0, 2 * numpy.pi, around, endpoint=False), indexing="ij")
    radius = numpy.maximum(numpy.sin(numpy.pi * v), 1e-4) ** .35 * (.22 + .1 * numpy.cos(4 * numpy.pi * v))
    positions = numpy.stack([radius * numpy.cos(u), .02 + 1.8 * v, -radius * numpy.sin(u)], -1)
    i, j = numpy.meshgrid(numpy.arange(along), numpy.arange(around), indexing="ij")
    a, b = i * around + j, i * around + (j + 1) % around
    indices = numpy.stack([a, b, b + around, a, b + around, a + around], -1).reshape(-1, 3)
    return positions.reshape(-1, 3), smooth_normals(positions.reshape(-1, 3), indices), indices


def smooth_normals(positions, indices):
    normals = numpy.zeros_like(positions)
    corners = positions[indices]
    across = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    for corner in range(3):
        numpy.add.at(normals, indices[:, corner], across)
    return normals / numpy.maximum(numpy.linalg.norm(normals, axis=1, keepdims=True), 1e-12)


def bend(scene):
    """Leans over and turns about itself."""
    positions, _, indices = upright()
    up = positions[:, 1:2]
    turn, lean = 1.2 * up[:, 0], .45 * up[:, 0] ** 2
    x, z = positions[:, 0], positions[:, 2]
    bent = numpy.stack([x * numpy.cos(turn) - z * numpy.sin(turn) - lean, positions[:, 1] * (1 - .12 * up[:, 0]), x * numpy.sin(turn) + z * numpy.cos(turn)], -1)
    scene.render(size=SIZE)  # what was, which nothing of may be left
    mesh = next(one["id"] for one in scene.objects("mesh") if one.get("name") == "figure")
    with scene.edit() as edit:
        edit.set_mesh_vertices(mesh, bent, smooth_normals(bent, indices))


EDITS = {"figure": bend}
CASES = {"corridor": corridor, "twelve_boxes": twelve_boxes, "next_room": lambda: next_room(2, 1, 120), "slit": lambda: next_room(.03, 1, 3000),
         "lamps_64": lamps_64, "mirror": mirror, "glossy_floor": glossy_floor, "leaves": leaves, "figure": figure}


def frames_of(scene, ladder):
    rung = dict(word.split("=") for word in ladder[RUNG].split())
    yield "auto", scene.render(size=SIZE, layers=["indirect"], fresh="all")
    yield "many_light", scene.render(size=SIZE, technique="many_light", layers=["indirect"], fresh="all")
    yield f"many_light, rung {RUNG}", scene.render(size=SIZE, technique="many_light", layers=["indirect"], fresh="all", parameters=rung)


def row_of(frame, truth):
    both = {layer: (a + b) / 2 for layer, (a, b) in truth.items()}
    report = frame.report
    return {"ms": round(report["time_ms"]["total"] - report["time_ms"].get("compile", 0)), "rays": report["parameters"].get("rays"),
            **{f"{layer}_percent": round(many_light.error_percent(many_light.picture(frame, layer), truth[layer]), 2) for layer in truth},
            "indirect_8x8_percent": round(many_light.error_percent(many_light.blocks(many_light.picture(frame, "indirect")), tuple(many_light.blocks(half) for half in truth["indirect"])), 2),
            "sum_percent": round(100 * float(many_light.picture(frame, "indirect").mean() / both["indirect"].mean() - 1), 2),
            "own_estimate_percent": round(100 * report.get("own_estimate", 0), 2), "flags": report.get("flags", [])}


def truth_of(scene, spp):
    halves = [scene.render(size=SIZE, technique="reference", layers=["indirect"], seed=seed, parameters={"spp": spp, "alpha": "mask"}) for seed in many_light.TRUTH_SEEDS]
    return {layer: tuple(many_light.picture(half, layer) for half in halves) for layer in many_light.LAYERS}


def save_beside(folder, case, frame, truth):
    both = sum(truth["beauty"]) / 2
    shown = numpy.hstack([many_light.picture(frame, "beauty"), both]) / (4 * numpy.median(both[both > 0]))
    Image.fromarray((255 * numpy.clip(shown, 0, 1) ** (1 / 2.2)).astype(numpy.uint8)).save(folder / f"{case}.png")


def rows_of(daemon, case, options):
    path = options.output.with_suffix(".case.glb")
    path.write_bytes(CASES[case]().glb())
    scene = daemon.scenes.add(path)
    path.unlink()
    EDITS.get(case, lambda _: None)(scene)
    truth = truth_of(scene, options.spp)
    noise = numpy.sqrt(((truth["indirect"][0] - truth["indirect"][1]) ** 2).mean() / 4) / numpy.mean(truth["indirect"])
    for name, frame in frames_of(scene, options.ladder):
        if name == "auto" and options.pictures:
            save_beside(options.pictures, case, frame, truth)
        yield {"case": case, "by": name, "truth_noise_percent": round(100 * float(noise), 1), **row_of(frame, truth)}


def main(words=None):
    made = by_hand.parser(__doc__, has_scenes=False)
    made.add_argument("--cases", default=",".join(CASES))
    made.add_argument("--spp", type=by_hand.count, default=256)
    made.add_argument("--pictures", type=pathlib.Path)
    options = by_hand.parse(made, words)
    result = {"command": f"hard_cases.py BUILD -o RESULT --cases {options.cases} --spp {options.spp}", "machine": live.machine(options.build), "rows": []}
    with live.package(options.build).private() as daemon:
        options.ladder = next(one["ladder"] for one in daemon.techniques() if one["name"] == "many_light")
        for case in options.cases.split(","):
            for row in rows_of(daemon, case, options):
                result["rows"].append(row)
                by_hand.say(str(row))
    by_hand.write(result, options.output)


if __name__ == "__main__":
    sys.exit(main())
