"""Glass that is looked into, with the real renderer: closed forms, and the reference."""
import base64
import json
import math

import bounced
import numpy
import pytest

SIZE = (32, 32)
GLASS = {"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0},
         "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_volume": {"thicknessFactor": 1}}}
THIN = {**GLASS, "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}}


def sphere(rings=48):
    """Positions, which are its normals too, and triangles of the unit sphere."""
    turns = 2 * rings
    places = [(math.sin(a) * math.cos(b), math.cos(a), -math.sin(a) * math.sin(b))
              for a in (math.pi * i / rings for i in range(rings + 1)) for b in (2 * math.pi * k / turns for k in range(turns + 1))]
    corners = [i * (turns + 1) + k for i in range(rings) for k in range(turns)]
    triangles = [t for c in corners for t in ((c, c + turns + 1, c + turns + 2), (c, c + turns + 2, c + 1))]
    return numpy.float32(places), numpy.float32(places), numpy.uint32(triangles)


def pane(z, half, facing=1):
    """A square across z, whose front is towards the viewer at +z, or away from it."""
    places = [(-half, -half, z), (half, -half, z), (half, half, z), (-half, half, z)]
    triangles = [(0, 1, 2), (0, 2, 3)] if facing > 0 else [(2, 1, 0), (3, 2, 0)]
    return numpy.float32(places), numpy.float32([(0, 0, facing)] * 4), numpy.uint32(triangles)


def gltf(parts):
    """A scene of (mesh, material) pairs."""
    data, views, accessors, meshes = b"", [], [], []
    for m, (mesh, _) in enumerate(parts):
        for array, kind, component in zip(mesh, ("VEC3", "VEC3", "SCALAR"), (5126, 5126, 5125)):
            views.append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes})
            accessors.append({"bufferView": len(views) - 1, "componentType": component, "type": kind,
                              "count": array.size if kind == "SCALAR" else len(array),
                              **({} if kind == "SCALAR" else {"min": array.min(0).tolist(), "max": array.max(0).tolist()})})
            data += array.tobytes()
        meshes.append({"primitives": [{"attributes": {"POSITION": 3 * m, "NORMAL": 3 * m + 1}, "indices": 3 * m + 2, "material": m}]})
    used = {name for _, material in parts for name in material.get("extensions", {})}
    return json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(parts)))}],
        "nodes": [{"mesh": m} for m in range(len(parts))], "meshes": meshes, "materials": [material for _, material in parts],
        "accessors": accessors, "bufferViews": views, "extensionsUsed": sorted(used),
        "buffers": [{"byteLength": len(data), "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}]})


@pytest.fixture(scope="module")
def client():
    with bounced.private() as client:
        yield client


def add(client, folder, parts, sky=None):
    (folder / "scene.gltf").write_text(gltf(parts))
    return client.scenes.add(folder / "scene.gltf", **({"environment": bounced.Environment(radiance=sky)} if sky else {}))


def look(scene, technique="many_light", eye=(0, 0, 6), yfov=.3, size=SIZE, **asked):
    """Radiance, of the middle alone where that is all of one kind."""
    return scene.render(size=size, technique=technique, layers=["beauty"], pose=bounced.Pose(eye, (0, 0, 0), yfov=yfov),
                        **asked).layers["beauty"][..., :3].astype(float)


def lamp(strength):
    return {"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "roughnessFactor": 1, "metallicFactor": 0},
            "emissiveFactor": [1, 1, 1], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": strength}}}


def test_glass_in_even_light_is_not_seen(client, tmp_path):
    """Furnace: what glass takes from a ray by reflection it gives back by passing on another."""
    scene = add(client, tmp_path, [(sphere(), GLASS)], sky=(1, 1, 1))
    seen = look(scene, parameters={"far_rays": 64, "light_rays": 64})
    print(seen.mean(), seen.min(), seen.max())
    assert seen.mean() == pytest.approx(1, rel=.01)
    assert numpy.abs(seen - 1).max() < .1


def through(client, folder, panes, **asked):
    """What comes straight through panes, of a wall of 1 cd/m^2 behind them: black all around."""
    wall = (pane(-3, 9), lamp(1))
    return look(add(client, folder, [wall, *panes]), **asked)


def test_a_pane_lets_through_what_fresnel_leaves(client, tmp_path):
    """A thin wall reflects four hundredths once; between a solid's two faces light goes to and fro."""
    tinted = {**THIN, "pbrMetallicRoughness": {**THIN["pbrMetallicRoughness"], "baseColorFactor": [.5, .8, 1, 1]}}
    seen = through(client, tmp_path, [(pane(0, 9), tinted)], yfov=.05).mean((0, 1))
    assert seen == pytest.approx(numpy.array([.5, .8, 1]) * .96, rel=2e-3)
    slab = [(pane(.5, 9), GLASS), (pane(-.5, 9, facing=-1), GLASS)]
    seen = through(client, tmp_path, slab, yfov=.05, parameters={"far_rays": 256}).mean()
    print(seen, .96 / 1.04)
    assert seen == pytest.approx(.96 / 1.04, rel=3e-3)


def test_a_solid_absorbs_by_its_thickness(client, tmp_path):
    amber = json.loads(json.dumps(GLASS))
    amber["extensions"]["KHR_materials_volume"].update(attenuationDistance=.5, attenuationColor=[.9, .5, .1])
    seen = through(client, tmp_path, [(pane(.5, 9), amber), (pane(-.5, 9, facing=-1), amber)], yfov=.05, parameters={"far_rays": 64})
    once = numpy.array([.9, .5, .1]) ** 2
    expected = .96 ** 2 * once / (1 - .04 ** 2 * once ** 2)
    assert seen.mean((0, 1)) == pytest.approx(expected, rel=5e-3)


def test_half_a_surface_is_glass(client, tmp_path):
    """The other half is what it was: opaque, lit, here by the wall alone."""
    half = {"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0, "baseColorFactor": [.5, .5, .5, 1]},
            "extensions": {"KHR_materials_transmission": {"transmissionFactor": .5}}}
    seen = through(client, tmp_path, [(pane(0, 9), half)], yfov=.05).mean()
    assert seen == pytest.approx(.96 * .5 * .5, rel=5e-3)


def test_a_ball_turns_what_is_behind_it(client, tmp_path):
    """Upside down: the bright half of the wall, above, is seen below, as the reference has it."""
    bright, dim = (pane(-3, 3), lamp(4)), (pane(-3, 3), lamp(1))
    for mesh, up in ((bright[0], 3), (dim[0], -3)):
        mesh[0][:, 1] += up
    scene = add(client, tmp_path, [(sphere(), GLASS), bright, dim])
    ours, truth = (look(scene, technique, **more).mean(2) for technique, more in
                   (("many_light", {"parameters": {"far_rays": 32}, "aa": 4}), ("reference", {"parameters": {"spp": 64}})))
    disc = numpy.hypot(*numpy.mgrid[-15.5:16, -15.5:16]) < 10
    assert ours[:16][disc[:16]].mean() < .5 * ours[16:][disc[16:]].mean()
    print(ours[disc].mean(), truth[disc].mean(), numpy.sqrt(((ours - truth)[disc] ** 2).mean()))
    assert ours[disc].mean() == pytest.approx(truth[disc].mean(), rel=.01)
    assert numpy.sqrt(((ours - truth)[disc] ** 2).mean()) < .1 * truth[disc].mean()


def test_a_room_behind_a_window_is_lit(client, tmp_path):
    """Of a sky that comes in through a pane alone, the reference's light: diffuse walls look out."""
    white = {"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 1, "baseColorFactor": [.5, .5, .5, 1]}, "doubleSided": True}
    side = numpy.array([(-1, -1, -1), (-1, -1, 1), (-1, 1, 1), (-1, 1, -1)], numpy.float32)
    walls = [(numpy.roll(s * side, axis, 1), numpy.float32([numpy.roll((-s, 0, 0), axis)] * 4), numpy.uint32([(0, 1, 2), (0, 2, 3)]))
             for axis in range(3) for s in (-1, 1) if (axis, s) != (2, -1)]
    scene = add(client, tmp_path, [(mesh, white) for mesh in walls] + [(pane(1, 1), THIN)], sky=(1, 1, 1))
    ours, truth = (look(scene, technique, eye=(0, 0, .9), yfov=1.5, parameters=more).mean() for technique, more in
                   (("many_light", {"far_rays": 32}), ("reference", {"spp": 64})))
    print(ours, truth)
    assert ours == pytest.approx(truth, rel=.03)


def test_who_does_not_know_glass_says_so(client, tmp_path):
    scene = add(client, tmp_path, [(sphere(16), GLASS), (pane(-3, 9), lamp(1))])
    for technique, knows in (("many_light", True), ("ssbc", True), ("direct", True), ("hisr", False)):
        flags = scene.render(size=(8, 8), technique=technique).report["flags"]
        assert any("transmission_as_opaque" in flag for flag in flags) != knows
    flags = scene.render(size=(8, 8), technique="many_light", parameters={"brdf": "lambert"}).report["flags"]
    assert any("transmission_as_opaque" in flag for flag in flags)
