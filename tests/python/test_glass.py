"""Glass that is looked into, with the real renderer: closed forms, and the reference."""
import json
import math

import bounced
import numpy
import pytest
from glass_scenes import BESIDE, GLASS, GREY, LIGHTS, LOOK_THROUGH, SIZE, THIN, TINTED, add, lamp, look, pane, sphere, walls


@pytest.fixture(scope="module")
def client():
    with bounced.private() as client:
        yield client


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
    seen = through(client, tmp_path, slab, yfov=.05, size=(16, 16), parameters={"far_rays": 256}).mean()
    print(seen, .96 / 1.04)
    assert seen == pytest.approx(.96 / 1.04, rel=3e-3)


def solid(ior, **volume):
    material = json.loads(json.dumps(GLASS))
    material["extensions"]["KHR_materials_ior"] = {"ior": ior}
    material["extensions"]["KHR_materials_volume"].update(volume)
    return material


def slab(front, back, material, half=9):
    """One mesh of two faces."""
    a, b = pane(front, half), pane(back, half, facing=-1)
    return (numpy.concatenate([a[0], b[0]]), numpy.concatenate([a[1], b[1]]), numpy.concatenate([a[2], b[2] + len(a[0])])), material


def behind_faces(*indices):
    """Of light to and fro between faces of clear media, the first and the last of which are air."""
    reflected = [((a - b) / (a + b)) ** 2 for a, b in zip(indices, indices[1:])]
    return 1 / (1 + sum(r / (1 - r) for r in reflected))


GLASS_SLAB = slab(1, -1, solid(1.5))
NESTED = {
    "water in glass": ([GLASS_SLAB, slab(.5, -.5, solid(1.33))], behind_faces(1, 1.5, 1.33, 1.5, 1)),
    "glasses that reach into water": ([slab(1.02, -1.02, solid(1.33), 8), slab(2, 1, solid(1.5)), slab(-1, -2, solid(1.5))],
                                      behind_faces(1, 1.5, 1.33, 1.5, 1)),
    "air in glass": ([GLASS_SLAB, slab(.5, -.5, solid(1))], behind_faces(1, 1.5, 1, 1.5, 1)),
    "glass in glass": ([GLASS_SLAB, slab(.5, -.5, solid(1.5))], behind_faces(1, 1.5, 1)),
    # Radiance is less by the index squared behind it, and the slab stands in air all the same.
    "a sheet that ends nowhere": ([(pane(3, 9), solid(1.5)), GLASS_SLAB], behind_faces(1, 1.5, 1, 1.5) / 1.5 ** 2),
    "ink in glass": ([GLASS_SLAB, slab(.5, -.5, solid(1.5, attenuationDistance=.5, attenuationColor=[.5, .5, .5]), 8)],
                     .96 ** 2 * .25 / (1 - .04 ** 2 * .25 ** 2)),
}


@pytest.mark.parametrize("technique, parameters", [("many_light", {"far_rays": 128}), ("direct", {"light_rays": 128}), ("reference", {"spp": 256})],
                         ids=["many_light", "direct", "reference"])
@pytest.mark.parametrize("nested", NESTED)
def test_solids_lie_within_each_other(client, tmp_path, nested, technique, parameters):
    """By Fresnel at each face between two media; the smaller solid is there where two are."""
    parts, expected = NESTED[nested]
    scene = add(client, tmp_path, [(pane(-5, 20), lamp(1)), *parts])
    seen = look(scene, technique, eye=(0, 0, 20), yfov=.01, size=(16, 16), parameters=parameters).mean()
    print(nested, technique, seen, expected)
    assert seen == pytest.approx(expected, rel=6e-3)


def test_a_ball_in_a_ball_throws_its_light(client, tmp_path):
    """Coloured water in glass: what photons bring to the floor, and what is seen through both, is the reference's."""
    outer, inner = sphere(48), sphere(48)
    inner[0][:] *= .7
    tea = solid(1.33, attenuationDistance=1, attenuationColor=[.9, .5, .2])
    for mesh in (outer, inner):
        mesh[0][:, 2] += 1.5
    scene = add(client, tmp_path, [(pane(0, 9), GREY), (outer, solid(1.5)), (inner, tea)], light={"type": "point", "intensity": 100}, at=(0, 0, 6))
    pose = bounced.Pose((5, 0, 3), (0, 0, .8), up=(0, 0, 1), yfov=.6)

    def seen(technique, **parameters):
        frame = scene.render(size=(64, 64), technique=technique, layers=["direct", "indirect"], pose=pose, parameters=parameters)
        return sum(frame.layers[layer][..., :3].astype(float) for layer in ("direct", "indirect"))
    truth, ours = seen("reference", spp=512), seen("many_light", far_rays=16)
    ratio = ours.mean((0, 1)) / truth.mean((0, 1))
    print(ratio, truth.mean((0, 1)))
    assert ratio == pytest.approx(numpy.ones(3), rel=.03)


WITHOUT_PHOTONS = ("direct", "rsm", "isr", "hisr", "multires_gather")


@pytest.mark.parametrize("technique", WITHOUT_PHOTONS)
def test_who_has_no_rays_of_its_own_shows_what_is_behind_glass(client, tmp_path, technique):
    """An emitter by Fresnel and tint, an absorbing solid by its thickness."""
    seen = through(client, tmp_path, [(pane(0, 9), TINTED)], technique=technique, yfov=.05).mean((0, 1))
    assert seen == pytest.approx(numpy.array([.5, .8, 1]) * .96, rel=2e-3)
    amber = json.loads(json.dumps(GLASS))
    amber["extensions"]["KHR_materials_volume"].update(attenuationDistance=.5, attenuationColor=[.9, .5, .1])
    slab = [(pane(.5, 9), amber), (pane(-.5, 9, facing=-1), amber)]
    seen = through(client, tmp_path, slab, technique=technique, yfov=.05, parameters={"light_rays": 64}).mean((0, 1))
    assert seen == pytest.approx(numpy.array([.9, .5, .1]) ** 2 * .96 ** 2, rel=.03)


ALL_WAYS = [*((name, {}) for name in (*WITHOUT_PHOTONS, "many_light", "photon")),
            *((name, more) for name in WITHOUT_PHOTONS[1:] for more in ({"indirect_visibility": "rays"}, {"lamps": "maps"}))]


@pytest.mark.parametrize("technique, more", ALL_WAYS, ids=[f"{name}{''.join(more.values())}" for name, more in ALL_WAYS])
def test_a_room_is_seen_through_a_small_pane_as_without(client, tmp_path, technique, more):
    """Reflected light, too: a pane that hides nothing takes its four hundredths of everything."""
    seen = [look(add(client, tmp_path, [*walls(), *glass], light={"type": "point", "intensity": 5}, at=(.3, .4, .2)), technique,
                 eye=(0, 0, .9), yfov=.9, aa=4, parameters=more).mean() for glass in ([], [(pane(.85, .05), THIN)])]
    print(seen[1] / seen[0])
    assert seen[1] == pytest.approx(.96 * seen[0], rel=.01)


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


@pytest.mark.parametrize("half", [{"extensions": {"KHR_materials_transmission": {"transmissionFactor": .6}}, "roughness": .5},
                                  {"metallicFactor": .6, "roughness": .2}], ids=["glass", "metal"])
def test_what_is_glass_or_mirror_in_part_sends_on_by_the_rest(client, tmp_path, half):
    """A wall of a closed room: rays and photons go on at it as often as it is either, and what ends there is all of the rest's."""
    material = {"pbrMetallicRoughness": {"metallicFactor": half.get("metallicFactor", 0), "roughnessFactor": half["roughness"],
                                         "baseColorFactor": [.6, .6, .6, 1]}, "extensions": half.get("extensions", {}), "doubleSided": True}
    scene = add(client, tmp_path, [*walls(), (pane(1, 1), material)], light={"type": "point", "intensity": 5}, at=(.2, .3, .4))
    def sums(technique, **parameters):
        floor = bounced.Pose((0, .5, 0), (0, -1, .4), up=(0, 0, 1), yfov=.8)
        frame = scene.render(size=SIZE, technique=technique, layers=["direct", "indirect"], pose=floor, parameters=parameters)
        return sum(frame.layers[layer][..., :3].astype(float) for layer in ("direct", "indirect")).mean()
    truth = sums("reference", spp=256, lamp_radius=.05)
    for technique, more in (("many_light", {"far_rays": 32}), ("photon", {})):
        seen = sums(technique, **more)
        print(technique, seen / truth)
        assert seen == pytest.approx(truth, rel=.02)


@pytest.mark.parametrize("shines", [{"sky": (1, 1, 1)}, {"light": {"type": "directional", "intensity": 10}}], ids=["sky", "sun"])
def test_a_room_behind_a_window_is_lit(client, tmp_path, shines):
    """By what comes in through a pane alone, as the reference has it: diffuse walls look out, and light each other."""
    scene = add(client, tmp_path, [*walls(), (pane(1, 1), THIN)], **shines)
    truth = look(scene, "reference", eye=(0, 0, .9), yfov=1.5, parameters={"spp": 256}).mean()
    for technique, more in (("many_light", {"far_rays": 32}), ("many_light", {"far_rays": 32, "caustics": "off"}), ("photon", {})):
        ours = look(scene, technique, eye=(0, 0, .9), yfov=1.5, parameters=more).mean()
        print(technique, more, ours, truth)
        assert ours == pytest.approx(truth, rel=.03)


def test_who_does_not_know_glass_says_so(client, tmp_path):
    scene = add(client, tmp_path, [(sphere(16), GLASS), (pane(-3, 9), lamp(1))])
    for technique, knows, bends in (("many_light", True, True), ("ssbc", True, True), ("direct", True, False), ("hisr", True, False),
                                     ("multires_splat", False, True)):
        flags = scene.render(size=(8, 8), technique=technique).report["flags"]
        assert any("transmission_as_opaque" in flag for flag in flags) != knows
        assert ("transmission_shadow" in flags) != bends
    flags = scene.render(size=(8, 8), technique="many_light", parameters={"brdf": "lambert"}).report["flags"]
    assert any("transmission_as_opaque" in flag for flag in flags)


def floor_seen(size):
    """Where pixels see the floor at z = 0, and the area of each there, as a camera beside it does."""
    eye = numpy.array(BESIDE["eye"])
    ahead = -eye / numpy.linalg.norm(eye)
    right = numpy.cross(ahead, (0, 0, 1)) / numpy.linalg.norm(numpy.cross(ahead, (0, 0, 1)))
    half = math.tan(BESIDE["yfov"] / 2)
    y, x = numpy.mgrid[0:size[1], 0:size[0]]
    rays = ahead + half * (((x + .5) / size[0] * 2 - 1)[..., None] * right + (1 - (y + .5) / size[1] * 2)[..., None] * numpy.cross(right, ahead))
    place = eye - rays * (eye[2] / rays[..., 2:])
    area = (2 * half / size[1]) ** 2 * numpy.linalg.norm(place - eye, axis=-1) ** 3 / numpy.linalg.norm(rays, axis=-1) ** 3 / eye[2]
    return place, area, (rays[..., 2] < 0) & (numpy.hypot(place[..., 0], place[..., 1]) < 1.3)


def floor_light(scene, size=(64, 64), technique="many_light", layers=("direct", "indirect"), channel=0, **parameters):
    """Irradiance of the floor, and as above."""
    frame = scene.render(size=size, technique=technique, layers=list(layers), pose=bounced.Pose(**BESIDE), parameters=parameters)
    lit = sum(frame.layers[layer].astype(float) for layer in layers)[..., channel] * math.pi / .5
    return lit, *floor_seen(size)[1:]


@pytest.mark.parametrize("light", LIGHTS, ids=lambda light: light["type"])
@pytest.mark.parametrize("technique", LOOK_THROUGH)
def test_lamps_shine_straight_through_panes(client, tmp_path, light, technique):
    """Direct light, at each pixel: by what Schlick has two panes reflect, and by the colour of one of them."""
    floor, seen = (pane(0, 9), GREY), {}
    panes = {"bare": [], "glazed": [(pane(2, 9), TINTED), (pane(1.5, 9, facing=-1), THIN)]}
    for name, between in panes.items():
        scene = add(client, tmp_path, [floor, *between], light=light)
        seen[name] = floor_light(scene, size=(32, 32), technique=technique, layers=["direct"], channel=1, **LOOK_THROUGH[technique])[0]
    place, _, disc = floor_seen((32, 32))
    cosine = 1 if light["type"] == "directional" else 4 / numpy.hypot(4, numpy.hypot(place[..., 0], place[..., 1]))
    passed = .8 * (1 - (.04 + .96 * (1 - cosine) ** 5)) ** 2
    lit = disc & (seen["bare"] > 0)
    assert lit.sum() > 40
    assert numpy.abs(seen["glazed"][lit] / (seen["bare"] * passed)[lit] - 1).max() < 2e-3


def test_virtual_lights_shine_through_panes(client, tmp_path):
    """A ceiling that a floor lights by way of a pane, as the reference has it: techniques without rays of their own."""
    ceiling = (pane(5, 9, facing=-1), GREY)
    still = {**THIN, "extensions": {**THIN["extensions"], "KHR_materials_ior": {"ior": 1}}}  # next to no mirror of the lamp
    scene = add(client, tmp_path, [(pane(0, 9), GREY), ceiling, (pane(2, 9), still), (pane(4, .5, facing=-1), lamp(10))])
    up = {"size": SIZE, "layers": ["indirect"], "pose": bounced.Pose((3, 0, 3), (0, 0, 5), yfov=.7)}
    def lit(technique, **parameters):
        return scene.render(technique=technique, parameters=parameters, **up).layers["indirect"][..., :3].astype(float).mean((0, 1))
    truth, hidden = lit("reference", spp=512), {"indirect_visibility": "rays", "indirect_bounces": 8}
    for technique, more in (("rsm", hidden), ("multires_gather", hidden), ("hisr", hidden), ("rsm", {**hidden, "indirect_visibility": "ism"})):
        seen = lit(technique, **more)
        print(technique, more, seen / truth)
        assert seen.mean() == pytest.approx(truth.mean(), rel=.06)


SHINES = {"point": {"light": LIGHTS[0]}, "lamp": {"lamp": True}, "sky": {"sky": (1, 1, 1)}}


@pytest.mark.parametrize("shines", SHINES)
def test_light_through_panes_is_counted_once(client, tmp_path, shines):
    """All of it, as the reference has it."""
    asked = dict(SHINES[shines])
    lamps = [(pane(4, 1, facing=-1), lamp(10))] if asked.pop("lamp", False) else []
    scene = add(client, tmp_path, [(pane(0, 9), GREY), *lamps, (pane(2, 9), TINTED), (pane(1.5, 9), THIN)], **asked)
    truth = floor_light(scene, (32, 32), "reference", spp=256)[0].mean()
    for technique, more in (("many_light", {}), ("many_light", {"caustics": "off", "far_rays": 64}), ("photon", {})):
        seen = floor_light(scene, (32, 32), technique, **more)[0].mean()
        print(shines, technique, more, seen / truth)
        assert seen == pytest.approx(truth, rel=.02)


def focused_lm(ior, candela=100, radius=.7, distance=2):
    """What a ball lets through of a point's light, by way of two walls: Fresnel's equations along meridians."""
    def reflected(cosine, eta):
        beyond = numpy.sqrt(1 - (1 - cosine ** 2) / eta ** 2)
        return .5 * (((eta * cosine - beyond) / (eta * cosine + beyond)) ** 2 + ((cosine - eta * beyond) / (cosine + eta * beyond)) ** 2)
    narrow = math.sqrt(1 - (radius / distance) ** 2)
    sine = numpy.sqrt(1 - (1 - (numpy.arange(4096) + .5) / 4096 * (1 - narrow)) ** 2)
    back = reflected(numpy.sqrt(1 - (distance * sine / radius) ** 2), ior)  # the same at both walls
    return candela * 2 * math.pi * (1 - narrow) * ((1 - back) ** 2).mean()


def test_a_ball_gathers_what_falls_on_it(client, tmp_path):
    """D9: all of its light arrives, in a smaller disc; what shines there is no other light's."""
    weak = json.loads(json.dumps(GLASS))
    weak["extensions"]["KHR_materials_ior"] = {"ior": 1.2}
    places, normals, triangles = sphere()
    ball = (.7 * places + numpy.float32([0, 0, 2]), normals, triangles)
    scene = add(client, tmp_path, [(pane(0, 9), GREY), (ball, weak)], light=LIGHTS[0])
    lit, area, disc = floor_light(scene)
    print((lit * area)[disc].sum(), focused_lm(1.2))
    assert (lit * area)[disc].sum() == pytest.approx(focused_lm(1.2), rel=.03)
    without = floor_light(scene, caustics="off")[0]
    assert (without * area)[disc].sum() < .01 * focused_lm(1.2)


def test_a_lamp_behind_glass_is_counted_once(client, tmp_path):
    """By photons, or by the gather's rays where those are off; and by the reference."""
    places, normals, triangles = sphere()
    ball = (.7 * places + numpy.float32([0, 0, 2]), normals, triangles)
    scene = add(client, tmp_path, [(pane(0, 9), GREY), (ball, GLASS), (pane(4, 1, facing=-1), lamp(10))])
    sums = {}
    for name, asked in (("photons", {"photons": 1 << 18}), ("rays", {"caustics": "off", "far_rays": 256}), ("reference", {"technique": "reference", "spp": 256})):
        lit, area, disc = floor_light(scene, size=(32, 32), **asked)
        sums[name] = (lit * area)[disc].sum()
    print(sums)
    assert sums["photons"] == pytest.approx(sums["reference"], rel=.03)
    assert sums["rays"] == pytest.approx(sums["reference"], rel=.03)


def test_a_focus_shines_back_through_its_ball(client, tmp_path):
    """A spot's light in a focus under a ball, and most of what that sends on through the ball to the ceiling: few of a place's rays would find it."""
    places, normals, triangles = sphere()
    ball = (.7 * places + numpy.float32([0, 0, .8]), normals, triangles)
    spot = {"type": "spot", "intensity": 100, "spot": {"innerConeAngle": .15, "outerConeAngle": .2}}
    scene = add(client, tmp_path, [(pane(0, 3), GREY), (ball, GLASS), (pane(4.2, 3, facing=-1), GREY)], light=spot)

    def seen(technique, seed=0, eye=(0, 0, 2.2), target=(0, 0, 4.2), **parameters):
        return scene.render(size=(24, 24), technique=technique, layers=["indirect"], pose=bounced.Pose(eye, target, up=(0, 1, 0), yfov=.9),
                            fresh="all", seed=seed, parameters=parameters).layers["indirect"][..., 0].astype(float)
    traced, dense = seen("reference", spp=2048, lamp_radius=.1).mean(), seen("photon").mean()
    told = [seen("many_light", seed) for seed in range(3)]
    apart = numpy.std(told, axis=0).mean() / dense
    print(numpy.mean(told), dense, traced, apart)
    assert numpy.mean(told) == pytest.approx(dense, rel=.04)
    assert numpy.mean(told) == pytest.approx(traced, rel=.2)
    assert apart < .15
    # And from there on to the floor.
    beside = {"eye": (2, 2, 2), "target": (2, 2, 0)}
    told, dense = (numpy.mean([seen(technique, seed, **beside).mean() for seed in range(3)]) for technique in ("many_light", "photon"))
    print(told, dense)
    assert told == pytest.approx(dense, rel=.1)


@pytest.mark.parametrize("far_rays", [4, 8])  # of eight and more rough lobes have light of their own
def test_later_sub_frames_ask_no_caustics_of_rough_surfaces(client, tmp_path, far_rays):
    """A floor that shows no glass has its light from the first one, photons and all."""
    scene = add(client, tmp_path, [(pane(0, 9), GREY), (sphere(16), GLASS)], light=LIGHTS[0])
    first, four = (scene.render(size=(64, 64), technique="many_light", layers=["indirect"], pose=bounced.Pose((1.5, 0, .9), (1.5, 0, 0), yfov=.7),
                                fresh="all", aa=aa, parameters={"far_rays": far_rays, "photons": 16384}) for aa in (1, 4))
    rays = [answer.report["counts"]["rays"] for answer in (first, four)]
    means = [answer.layers["indirect"].mean() for answer in (first, four)]
    print(rays, means)
    assert rays[1] < 1.2 * rays[0]
    assert means[1] == pytest.approx(means[0], rel=.03)


def test_the_same_photons_twice(client, tmp_path):
    scene = add(client, tmp_path, [(pane(0, 9), GREY), (sphere(16), GLASS)], light=LIGHTS[0])
    first = floor_light(scene)[0]
    floor_light(scene, photons=2048)
    assert numpy.array_equal(scene.render(size=(64, 64), technique="many_light", layers=["indirect"], pose=bounced.Pose(**BESIDE), fresh="all").layers["indirect"],
                             scene.render(size=(64, 64), technique="many_light", layers=["indirect"], pose=bounced.Pose(**BESIDE)).layers["indirect"])
    assert numpy.array_equal(first, floor_light(scene)[0])


def test_scenes_without_glass_send_no_photons(client, tmp_path):
    report = add(client, tmp_path, [(pane(0, 9), GREY)], light=LIGHTS[0]).render(size=(8, 8), technique="many_light").report
    assert {"pass": "caustics", "reason": "no surface lets light through or is a mirror"} in report["omitted"]
    report = add(client, tmp_path, [(pane(0, 9), GREY), (sphere(16), GLASS)], light=LIGHTS[0]).render(size=(8, 8), technique="many_light").report
    assert [entry["state"] for entry in report["passes"] if entry["name"] == "caustics"] == ["ran"]


EXTREMES = {"mirror": {"ior": {"ior": 0}}, "dense": {"ior": {"ior": 1e6}}, "air": {"ior": {"ior": 1}}, "black": {"color": [0, 0, 0, 1]},
            "ink": {"volume": {"attenuationDistance": 1e-30, "attenuationColor": [0, 0, 0]}}, "rough": {"roughness": 1}, "satin": {"roughness": 1e-3},
            "fog": {"volume": {"thicknessFactor": 1e6, "attenuationDistance": 1e30, "attenuationColor": [1, .5, 0]}}}


@pytest.mark.parametrize("case", EXTREMES)
@pytest.mark.parametrize("scale", [1e-4, 1, 1e4])
def test_extreme_glass_has_numbers(client, tmp_path, case, scale):
    """No pixel without a number, none brighter than the lamp that it may show, at any scale."""
    glass, extreme = json.loads(json.dumps(GLASS)), EXTREMES[case]
    glass["extensions"].setdefault("KHR_materials_ior", {}).update(extreme.get("ior", {}))
    glass["extensions"]["KHR_materials_volume"].update(extreme.get("volume", {}))
    glass["pbrMetallicRoughness"].update(roughnessFactor=extreme.get("roughness", 0), baseColorFactor=extreme.get("color", [1, 1, 1, 1]))
    parts = [(pane(0, 9), GREY), (sphere(16), glass), (pane(4, 1, facing=-1), lamp(10))]
    for mesh, _ in parts:
        mesh[0][:] *= scale
    frame = add(client, tmp_path, parts).render(size=(24, 24), technique="many_light", layers=["beauty"],
                                                pose=bounced.Pose((3 * scale, 0, 2 * scale), (0, 0, scale), yfov=.9))
    assert frame.report["nonfinite_pixels"] == 0
    picture = frame.layers["beauty"][..., :3]
    assert numpy.isfinite(picture).all() and picture.min() >= 0 and picture.max() < 60


FEW = {"photons": 1024, "vpls": 64, "walk_vpls": 64}
EDITED = {"many_light": FEW, "ssbc": FEW, "direct": {}, "hisr": {}, "rsm": {"indirect_visibility": "rays"}, "isr": {"indirect_visibility": "ism"}}


@pytest.mark.parametrize("shines", [{"light": LIGHTS[0]}, {"sky": (1, 1, 1)}], ids=["lamp", "sky"])
def test_glass_that_is_edited_is_as_if_made_so(client, tmp_path, shines):
    """Whatever a frame keeps of earlier ones, of techniques that know glass and of others."""
    scene = add(client, tmp_path, [(pane(0, 9), GREY), (sphere(16), GLASS)], **shines)
    asked = {"size": (16, 16), "layers": ["beauty"], "pose": bounced.Pose(**BESIDE)}
    glass, before = scene.objects("material")[1]["id"], None
    for turn, fields in enumerate(({}, {"transmission": .5}, {"ior": 1.2}, {"attenuation_distance": .3, "attenuation_color": (.5, .2, .1)},
                                   {"thickness": 0}, {"roughness": .3}, {"transmission": 0})):
        with scene.edit() as edit:
            if fields:
                edit.set_material(glass, **fields)
        shown = {"many_light": EDITED["many_light"], **dict(list(EDITED.items())[turn % 3::3])}  # others every third time, of older frames
        kept = {name: scene.render(technique=name, parameters=more, **asked).layers["beauty"] for name, more in shown.items()}
        for name, picture in kept.items():
            assert numpy.array_equal(picture, scene.render(technique=name, parameters=EDITED[name], fresh="all", **asked).layers["beauty"]), (fields, name)
        assert before is None or not numpy.array_equal(kept["many_light"], before), fields
        before = kept["many_light"]


@pytest.mark.parametrize("technique, roughness", [("many_light", 1), ("photon", 1), ("many_light", .7), ("photon", .7)])
def test_a_room_of_rough_metal_is_lit_as_it_is(client, tmp_path, technique, roughness):
    """Lobes look at what such metal sends on, and not at its colour."""
    metal = {"pbrMetallicRoughness": {"metallicFactor": 1, "roughnessFactor": roughness, "baseColorFactor": [.5, .5, .5, 1]},
             "doubleSided": True}
    scene = add(client, tmp_path, [(mesh, metal) for mesh, _ in walls()], light=LIGHTS[0], at=(.2, .3, 0))

    def mean(technique, **parameters):
        frame = scene.render(size=(24, 24), technique=technique, layers=["indirect"], pose=bounced.Pose((0, 0, .95), (0, 0, -1), yfov=1.4),
                             parameters=parameters)
        return float(frame.layers["indirect"][..., :3].mean())

    assert mean(technique, far_rays=16) == pytest.approx(mean("reference", spp=1024), rel=.09)


@pytest.mark.parametrize("technique", ["many_light", "photon", "point_projection"])
def test_a_dark_rough_wall_reflects_by_its_lobe(client, tmp_path, technique):
    """It is black: what is seen of it is its lobe's, which shows the window ahead. Without rays of its own it has what light that is
    the same from all sides would give to who looks, and not to all who do in the mean, which is 1.4 times as much."""
    black = {"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": .7, "baseColorFactor": [0, 0, 0, 1]}, "doubleSided": True}
    room = walls()
    scene = add(client, tmp_path, [*room[:4], (room[4][0], black)], light=LIGHTS[0], at=(.2, .3, 0))

    def mean(technique, **parameters):
        frame = scene.render(size=(24, 24), technique=technique, layers=["indirect"], parameters=parameters,
                             pose=bounced.Pose((0, 0, .9), (0, 0, -1), yfov=.5))
        return float(frame.layers["indirect"][..., :3].mean())

    truth = mean("reference", spp=1024)
    assert mean(technique, far_rays=4) == pytest.approx(truth, rel=.12)
    assert mean(technique, far_rays=16) == pytest.approx(truth, rel=.03)
