"""Caustics and windows made by hand: what comes of their light, how far off it is, and in what time.

usage: caustics.py BUILD_DIR -o RESULT.json [--side N] [--spp N] [--equal-spp N] [--only NAME]...

A floor under a point light, with a glass ball, a metal ring or a glass of water between them, and a room that the sun lights by a
window. Of each direct and indirect light: `total` of it by the reference's, over the floor's pixels that make up nine tenths of what
the caustic adds to the reference without glass and metal, or of all in the room; `off_percent` the mean difference there, in
hundredths of the mean. The reference's own rows: as many samples as take about a second, as they are and with every
pixel the mean of the 3 x 3 around it.
"""
import pathlib
import sys
import tempfile

import numpy

import by_hand
import live
import many_light

sys.path.append(str(by_hand.ROOT / "tests/python"))
import glass_scenes as made  # noqa: E402

METAL = {"pbrMetallicRoughness": {"metallicFactor": 1, "roughnessFactor": 0, "baseColorFactor": [.9, .9, .9, 1]}, "doubleSided": True}
WATER = {**made.GLASS, "extensions": {**made.GLASS["extensions"], "KHR_materials_ior": {"ior": 1.33}}}
ABOVE = {"eye": (2.2, 0, 1.2), "target": (.2, 0, 0), "up": (0, 0, 1), "yfov": .8}
WITHIN = {"eye": (0, 0, .9), "target": (0, 0, 0), "yfov": 1.5}


def cylinder(radius, low, high, inward=False, turns=192):
    """Its side, smooth."""
    angles = 2 * numpy.pi * numpy.arange(turns + 1) / turns
    around = numpy.stack([numpy.cos(angles), numpy.sin(angles), 0 * angles], 1)
    places = numpy.concatenate([radius * around + (0, 0, z) for z in (low, high)])
    corners = numpy.arange(turns)
    quads = numpy.stack([corners, corners + 1, corners + turns + 2, corners, corners + turns + 2, corners + turns + 1], 1).reshape(-1, 3)
    normals = numpy.concatenate([around, around])
    return numpy.float32(places), numpy.float32(-normals if inward else normals), numpy.uint32(quads[:, ::-1] if inward else quads)


def disc(radius, z, facing=1, turns=192):
    angles = 2 * numpy.pi * numpy.arange(turns) / turns
    places = numpy.concatenate([[(0, 0, z)], numpy.stack([radius * numpy.cos(angles), radius * numpy.sin(angles), 0 * angles + z], 1)])
    rim = numpy.arange(turns)
    fan = numpy.stack([0 * rim, rim + 1, (rim + 1) % turns + 1], 1)
    return numpy.float32(places), numpy.float32([(0, 0, facing)] * (turns + 1)), numpy.uint32(fan if facing > 0 else fan[:, ::-1])


def moved(mesh, scale, by):
    return numpy.float32(mesh[0] * scale + numpy.float32(by)), mesh[1], mesh[2]


def joined(*meshes):
    starts = numpy.cumsum([0] + [len(mesh[0]) for mesh in meshes])
    return (*(numpy.concatenate([mesh[i] for mesh in meshes]) for i in (0, 1)),
            numpy.concatenate([mesh[2] + numpy.uint32(start) for mesh, start in zip(meshes, starts)]))


def solid(radius, low, high, material):
    return [(joined(cylinder(radius, low, high), disc(radius, high), disc(radius, low, -1)), material)]


# Parts, the light, the pose, and the parts that light goes through or off.
FLOOR = [(made.pane(0, 9), made.GREY)]
LAMP, SUN = {"type": "point", "intensity": 100}, {"type": "directional", "intensity": 10}
SCENES = {
    "ball": (FLOOR, LAMP, ABOVE, [(moved(made.sphere(), .4, (0, 0, .6)), made.GLASS)]),
    "ring": (FLOOR, LAMP, ABOVE, [(cylinder(.6, 0, .4), METAL)]),
    "water": (FLOOR, LAMP, ABOVE, [*solid(.4, .01, .8, made.GLASS), *solid(.36, .05, .6, WATER)]),
    "window": (made.walls(), SUN, WITHIN, [(made.pane(1, 1), made.THIN)]),
}


def light_of(scene, pose, side, technique, **parameters):
    frame = scene.render(size=(side, side), technique=technique, layers=["direct", "indirect"], fresh="all", pose=pose, parameters=parameters)
    picture = sum(many_light.picture(frame, layer).astype(float) for layer in ("direct", "indirect")).mean(2)
    return picture, round(sum(p.get("ms") or 0 for p in frame.report["passes"] if p["name"] not in many_light.NOT_TIMED), 1)


def blurred(picture):
    wide = numpy.pad(picture, 1, mode="edge")
    return sum(wide[y:y + len(picture), x:x + len(picture[0])] for y in range(3) for x in range(3)) / 9


def brightest(extra):
    """Pixels that hold nine tenths of it."""
    order = numpy.sort(extra[extra > 0])[::-1]
    return extra >= order[numpy.searchsorted(numpy.cumsum(order), .9 * order.sum())]


def depth_of(scene, pose, side):
    return scene.render(size=(side, side), technique="direct", layers=["depth"], pose=pose).layers["depth"].astype(float).reshape(side, side, -1)[..., 0]


def rows_of(client, package, name, options, folder):
    parts, light, pose, specular = SCENES[name]
    scenes = []
    for which in (parts, parts + specular):
        (folder / "scene.gltf").write_text(made.gltf(which, light))
        scenes.append(client.scenes.add(folder / "scene.gltf"))
    pose, side = package.Pose(**pose), options.side
    bare = light_of(scenes[0], pose, side, "reference", spp=64)[0]
    truth = light_of(scenes[1], pose, side, "reference", spp=options.spp)[0]
    is_beside = numpy.isclose(depth_of(scenes[0], pose, side), depth_of(scenes[1], pose, side), rtol=1e-5)
    where = brightest((blurred(truth) - bare) * is_beside) if name != "window" else truth > 0

    def row(what, picture, ms):
        return {"settings": what, "total": round(float(picture[where].sum() / truth[where].sum()), 4), "ms": ms,
                "off_percent": round(100 * float(numpy.abs(picture - truth)[where].mean() / truth[where].mean()), 2)}

    for technique, parameters in (("many_light", {}), ("many_light", {"photons": 1 << 18}), ("photon", {}), ("photon", {"photons": 1 << 18})):
        yield row(f"{technique} {parameters or ''}".strip(), *light_of(scenes[1], pose, side, technique, **parameters))
    picture, ms = light_of(scenes[1], pose, side, "reference", spp=options.equal_spp)
    yield row(f"reference {options.equal_spp} spp", picture, ms)
    yield row(f"reference {options.equal_spp} spp, 3 x 3", blurred(picture), ms)


def main(words=None):
    parser = by_hand.parser(__doc__, has_scenes=False)
    parser.add_argument("--only", metavar="NAME", action="append", choices=tuple(SCENES))
    parser.add_argument("--side", type=by_hand.count, default=512)
    parser.add_argument("--spp", type=by_hand.count, default=256)
    parser.add_argument("--equal-spp", type=by_hand.count, default=4)
    options = by_hand.parse(parser, words)
    result = {"command": f"caustics.py BUILD -o RESULT --side {options.side} --spp {options.spp} --equal-spp {options.equal_spp}",
              "machine": live.machine(options.build), "rows": []}
    package = live.package(options.build)
    with package.private() as client, tempfile.TemporaryDirectory() as folder:
        for name in options.only or SCENES:
            for row in rows_of(client, package, name, options, pathlib.Path(folder)):
                result["rows"].append({"scene": name, **row})
                by_hand.say(result["rows"][-1])
    by_hand.write(result, options.output)


if __name__ == "__main__":
    sys.exit(main())
