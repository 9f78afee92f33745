"""Scenes of many lamps for the scripts here: a hall with niches, made anew, and any .glb with spots among its surfaces."""
import numpy

from harness.glb import Glb
from harness.gltf import Writer, facing
from harness.shapes import add, box, quad


def _places(count, low, high, heights, seed):
    """Of so many spots: near a grid over a floor, at one of two heights, and where each looks."""
    rng = numpy.random.default_rng(seed)
    wide, deep = high[0] - low[0], high[1] - low[1]
    columns = max(1, round(numpy.sqrt(count * wide / deep)))
    rows = -(-count // columns)
    for i in range(count):
        x = low[0] + wide * (i % columns + .5 + rng.uniform(-.3, .3)) / columns
        z = low[1] + deep * (i // columns + .5 + rng.uniform(-.3, .3)) / rows
        look = [rng.uniform(-.6, .6), -1, rng.uniform(-.6, .6)]
        outer = rng.uniform(.45, .8)
        color = [float(v) for v in 1 - .4 * rng.uniform(size=3)]
        yield (x, heights[i % 2], z), look, (.7 * outer, outer), color


def _add_room(w, white):
    """60 x 30 x 8 m with 40 pillars."""
    for center, u, v in (((0, 0, 0), (30, 0, 0), (0, 0, -15)), ((0, 8, 0), (30, 0, 0), (0, 0, 15)),
                         ((0, 4, -15), (30, 0, 0), (0, 4, 0)), ((0, 4, 15), (-30, 0, 0), (0, 4, 0)),
                         ((-30, 4, 0), (0, 0, -15), (0, 4, 0)), ((30, 4, 0), (0, 0, 15), (0, 4, 0))):
        add(w, "wall", quad(center, u, v), white)
    for i in range(40):
        add(w, "pillar", box((.4, 4, .4)), white, translation=[-27 + 6 * (i % 10), 4, -9 + 6 * (i // 10)])


def hall(count, candela=400.0):
    """60 x 30 x 8 m, 40 pillars, 60 crates, `count` spots below its ceiling."""
    w = Writer()
    white, brown = w.material("white", (.7, .7, .7)), w.material("brown", (.5, .35, .2), roughness=.4)
    _add_room(w, white)
    rng = numpy.random.default_rng(5)
    for i in range(60):
        half = rng.uniform(.3, .9)
        add(w, "crate", box((half, half, half)), brown,
            translation=[float(rng.uniform(-28, 28)), float(half), float(rng.uniform(-13, 13))])
    for i, (place, look, cone, color) in enumerate(_places(count, (-29, -14), (29, 14), (7.5, 5.5), 7)):
        w.light(f"spot{i}", "spot", candela, place, look, color, cone)
    w.camera("Camera", (-26, 5, 12), (20, -3.2, -9), yfov=1.0)
    return w.glb()


def with_spots(path, count, low, high, heights, candela=60.0):
    """The scene at `path` with `count` spots instead of its lights."""
    glb = Glb.load(path)
    lights = []
    for node in glb.doc["nodes"]:
        node.get("extensions", {}).pop("KHR_lights_punctual", None)
    for i, (place, look, cone, color) in enumerate(_places(count, low, high, heights, 7)):
        lights.append({"type": "spot", "intensity": candela, "color": color,
                       "spot": {"innerConeAngle": cone[0], "outerConeAngle": cone[1]}})
        glb.doc["nodes"].append({"name": f"spot{i}", "translation": list(place), "rotation": facing(look),
                                 "extensions": {"KHR_lights_punctual": {"light": i}}})
        glb.doc["scenes"][glb.doc.get("scene", 0)]["nodes"].append(len(glb.doc["nodes"]) - 1)
    glb.doc.setdefault("extensions", {})["KHR_lights_punctual"] = {"lights": lights}
    used = set(glb.doc.get("extensionsUsed", [])) | {"KHR_lights_punctual"}
    glb.doc["extensionsUsed"] = sorted(used)
    return glb.dumps()


# What lies where spots are wanted in Sponza (Dabrovic): the yard, and the arcades around it.
SPONZA = {"low": (-14, -6), "high": (14, 6), "heights": (3.2, 7.5)}


def screens(count):
    """The hall without its spots, under `count` triangles that emit, in all as much."""
    w = Writer()
    w.extensions.add("KHR_materials_emissive_strength")
    white = w.material("white", (.7, .7, .7))
    glow = w.material("glow", (.2, .2, .2), emissiveFactor=[1, .9, .8],
                      extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 300}})
    _add_room(w, white)
    half = 3 / numpy.sqrt(count)
    screen = quad((0, 0, 0), (half, 0, 0), (0, 0, half))
    for place, *_ in _places(count // 2, (-29, -14), (29, 14), (7.5, 5.5), 7):
        add(w, "screen", screen, glow, translation=[float(v) for v in place])
    w.camera("Camera", (-26, 5, 12), (20, -3.2, -9), yfov=1.0)
    return w.glb()


def panels(count):
    """The hall under one ceiling that a texture lights: `count` bright texels, in all as much."""
    w = Writer()
    w.extensions.add("KHR_materials_emissive_strength")
    side = int(numpy.ceil(numpy.sqrt(count / 2 * 8)))
    texels = numpy.zeros((side, 2 * side, 4), numpy.uint8)
    texels[..., 3] = 255
    at = numpy.random.default_rng(7).choice(side * 2 * side, count, replace=False)
    texels.reshape(-1, 4)[at, :3] = (255, 242, 231)
    area = 58 * 28 / (side * 2 * side) * count
    map_ = {"index": w.texture(texels, True)}
    glow = w.material("glow", (.2, .2, .2), emissiveFactor=[1, 1, 1], emissiveTexture=map_,
                      extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 300 * 18 / area}})
    _add_room(w, w.material("white", (.7, .7, .7)))
    add(w, "panel", quad((0, 7.6, 0), (29, 0, 0), (0, 0, 14)), glow, with_uv=True)
    w.camera("Camera", (-26, 5, 12), (20, -3.2, -9), yfov=1.0)
    return w.glb()
