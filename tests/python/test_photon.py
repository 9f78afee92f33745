"""Technique `photon`, with the real renderer: against the reference and itself, in triangles and in environment maps."""
import bounced
import numpy
import pytest
from conftest import SCENES
from glass_scenes import GLASS, GREY, add, lamp, pane, sphere, walls

SIZE = (48, 48)
IMAGES = {"intersections": "images"}
FEW = {"photons": 16384, **IMAGES}


@pytest.fixture(scope="module")
def client():
    with bounced.private() as client:
        yield client


@pytest.fixture
def box(client):
    scene = client.scenes.add(SCENES / "cornell.glb")
    yield scene


def frame_of(scene, technique="photon", layer="indirect", fresh=None, **parameters):
    return scene.render(size=SIZE, technique=technique, layers=[layer], fresh=fresh, parameters=parameters)


def light(frame, layer="indirect"):
    return frame.layers[layer][..., :3].astype(float)


def off(picture, truth):
    """Mean over the picture, so that an edge's few pixels say no more than they are."""
    return float(numpy.abs(picture - truth).mean() / truth.mean())


def state(frame, name):
    return [entry["state"] for entry in frame.report["passes"] if entry["name"] == name]


def reason(frame, name):
    return [entry["reason"] for entry in frame.report["omitted"] if entry["pass"] == name]


@pytest.fixture(scope="module")
def truth(client):
    scene = client.scenes.add(SCENES / "cornell.glb")
    yield light(frame_of(scene, "reference", spp=512))


def test_it_goes_to_the_truth_as_photons_grow(box, truth):
    errors = [off(light(frame_of(box, photons=count, finest=1, coarsest=48, depth_threshold=0, normal_threshold=0)), truth)
              for count in (4096, 32768, 262144)]
    assert errors[0] > 1.4 * errors[1] > 1.4 ** 2 * errors[2] and errors[2] < .065, errors
    mean = light(frame_of(box, photons=262144)).mean()
    assert mean == pytest.approx(truth.mean(), rel=.02)


def test_maps_show_what_triangles_are(box, truth):
    rays, images = frame_of(box, photons=65536), frame_of(box, photons=65536, **IMAGES)
    printed = frame_of(box, photons=65536, paper_mode=1, light_rays=16)
    assert state(images, "env_maps") == ["ran"] and reason(rays, "env_maps") == ["intersections=rays"]
    assert any(flag.startswith("photons_lost: ") for flag in images.report["flags"])
    assert not any("photons_lost" in flag for flag in rays.report["flags"])
    assert light(images).mean() == pytest.approx(light(rays).mean(), rel=.03)
    assert off(light(images), truth) < off(light(printed), truth) and off(light(images), truth) < .1
    many = frame_of(box, photons=65536, env_maps=16, env_map_size=512, **IMAGES)
    assert abs(light(many).mean() / light(rays).mean() - 1) < .02


def test_no_structure_is_built_where_maps_answer(box):
    assert state(frame_of(box, light_rays=0, fresh="all", **FEW), "bvh") == []
    assert state(frame_of(box, light_rays=0, fresh="all"), "bvh") == ["ran"]


def test_what_changes_is_made_anew(box):
    """Pictures after edits are those of a daemon that saw nothing else, and maps stay where nothing moved."""
    first = frame_of(box, **FEW)
    with box.edit() as edit:
        edit.set_material(box.objects("material")[0]["id"], base_color=(.9, .2, .2, 1))
    coloured = frame_of(box, **FEW)
    assert state(coloured, "env_maps") == ["reused"] and state(coloured, "photons") == ["ran"]
    with box.edit() as edit:
        edit.set_node(box.objects("node")[0]["id"], translation=(.02, 0, 0))
    moved = frame_of(box, **FEW)
    assert state(moved, "env_maps") == ["ran"]
    for frame in (coloured, moved):
        assert not numpy.array_equal(light(first), light(frame))
    assert numpy.array_equal(light(moved), light(frame_of(box, fresh="all", **FEW)))


def test_other_seeds_are_other_photons(box):
    pictures = [light(box.render(size=SIZE, technique="photon", layers=["indirect"], seed=seed, fresh="all")) for seed in (0, 0, 1)]
    assert numpy.array_equal(pictures[0], pictures[1]) and not numpy.array_equal(pictures[0], pictures[2])
    assert off(pictures[2], pictures[0]) < .1


def test_a_radius_smooths(box):
    """From one pixel to the next, over all of the picture."""
    steps = [numpy.abs(numpy.diff(light(frame_of(box, photons=65536, photon_radius=radius, finest=1)), axis=1)).mean() for radius in (.03, .3)]
    assert steps[0] > 2 * steps[1]


def test_a_wall_on_the_floor_keeps_light_out(box):
    """A thin wall across the box: what is behind it as dark as with the reference."""
    with box.edit() as edit:
        grey = edit.add_material(double_sided=True, base_color=(.5, .5, .5, 1))
        wall = numpy.array([[-2, -.1, -.3], [2, -.1, -.3], [2, 1.2, -.3], [-2, 1.2, -.3]], float)
        mesh = edit.add_mesh(bounced.Primitive(wall, [[0, 1, 2], [0, 2, 3]], material=grey))
        edit.add_node(mesh=mesh)
    own, reference = light(frame_of(box, photons=65536)), light(frame_of(box, "reference", spp=256))
    assert off(own, reference) < .12


def test_lights_of_all_kinds(box):
    """A sky and a bright material: as many_light has them, beside the lamp."""
    with box.edit() as edit:
        edit.set_environment(radiance=(.3, .4, .6))
        edit.set_material(box.objects("material")[1]["id"], emissive=(.5, .4, .1))
    own, other = (light(frame_of(box, technique, layer="beauty"), "beauty") for technique in ("photon", "many_light"))
    assert own.mean() == pytest.approx(other.mean(), rel=.03)


def test_glass_is_passed_once(box):
    """Caustic photons and the others share no path: with glass over the lamp's floor sums agree with many_light's."""
    with box.edit() as edit:
        glass = edit.add_material(base_color=(1, 1, 1, 1), roughness=0, metallic=0, transmission=1)
        pane = numpy.array([[-.6, .9, -.6], [-.6, .9, .6], [.6, .9, .6], [.6, .9, -.6]], float)
        mesh = edit.add_mesh(bounced.Primitive(pane, [[0, 1, 2], [0, 2, 3]], material=glass))
        edit.add_node(mesh=mesh)
    own, blurred, other = (light(frame_of(box, **asked)) for asked in
                           ({"photons": 262144}, {"photons": 262144, "caustics": "off"}, {"technique": "many_light", "photons": 262144}))
    assert own.mean() == pytest.approx(other.mean(), rel=.02)
    assert own.mean() == pytest.approx(blurred.mean(), rel=.07)


def test_mirrors_throw_light(box):
    """A metal pane beside the lamp: both techniques have what it throws, and metal that is rough is none."""
    with box.edit() as edit:
        metal = edit.add_material(base_color=(.9, .9, .9, 1), roughness=.1, metallic=1, double_sided=True)
        pane = numpy.array([[.3, .4, -.5], [.3, .4, .5], [.7, 1.2, .5], [.7, 1.2, -.5]], float)
        mesh = edit.add_mesh(bounced.Primitive(pane, [[0, 1, 2], [0, 2, 3]], material=metal))
        edit.add_node(mesh=mesh)
    own, other = (frame_of(box, technique, photons=262144) for technique in ("photon", "many_light"))
    assert state(own, "caustics") == state(other, "caustics") == ["ran"]
    assert light(own).mean() == pytest.approx(light(other).mean(), rel=.02)
    without = frame_of(box, "many_light", caustics="off")
    assert light(other).mean() > 1.03 * light(without).mean()
    with box.edit() as edit:
        edit.set_material(metal.id, roughness=.7)
    rough = frame_of(box, "many_light")
    assert reason(rough, "caustics") == ["no surface lets light through or is a mirror"]


def test_cubes_of_texels_show_what_is_behind_glass(client, tmp_path):
    """One in the middle of a ball shows its walls to rays within: the room behind it, and the caustic below; as printed, too."""
    parts = [*walls(), (pane(1, 1), {**GREY, "doubleSided": True}), (moved_ball(), GLASS)]
    scene = add(client, tmp_path, parts, light={"type": "point", "intensity": 5}, at=(.3, .8, .2))
    pose = bounced.Pose((0, .1, .9), (0, -.3, 0), yfov=.7)

    def seen(**parameters):
        frame = scene.render(size=SIZE, technique="photon", layers=["direct", "indirect"], pose=pose, parameters={"photons": 32768, **parameters})
        assert not any("opaque" in flag for flag in frame.report["flags"])
        return light(frame, "direct") + light(frame)
    rays, images, printed = seen(), seen(**IMAGES), seen(paper_mode=1, light_rays=16)
    print(images.mean() / rays.mean(), off(images, rays), printed.mean() / rays.mean(), off(printed, rays))
    assert images.mean() == pytest.approx(rays.mean(), rel=.06) and off(images, rays) < .12
    assert off(images, rays) < off(printed, rays)


def folded(mesh):
    """As the mirror below shows it, which turns z to x."""
    places, normals, triangles = mesh
    swap = numpy.float32([[0, 0, -1], [0, 1, 0], [-1, 0, 0]])
    return numpy.ascontiguousarray(places @ swap), numpy.ascontiguousarray(normals @ swap), numpy.ascontiguousarray(triangles[:, ::-1])


def leaning(mesh, normal):
    return mesh[0], numpy.float32([numpy.array(normal) / numpy.linalg.norm(normal)] * len(mesh[0])), mesh[2]


MIRROR = {"pbrMetallicRoughness": {"metallicFactor": 1, "roughnessFactor": 0}, "doubleSided": True}
RECEIVERS = {"matt": (GREY, (0, 0, 1)), "normals that lean": (GREY, (.5, .3, 1)),
             "rough plastic": ({"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": .7, "baseColorFactor": [.05, .05, .05, 1]}}, (0, 0, 1)),
             "rough metal": ({"pbrMetallicRoughness": {"metallicFactor": 1, "roughnessFactor": .4, "baseColorFactor": [.9, .6, .3, 1]}}, (0, 0, 1)),
             "gloss that leans": ({"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": .45, "baseColorFactor": [.2, .2, .2, 1]}}, (.2, 0, 1))}


def tilted_mirror():
    """That sends what comes along -z on along +x."""
    turn = numpy.float32([[.5 ** .5, 0, -.5 ** .5], [0, 1, 0], [.5 ** .5, 0, .5 ** .5]])
    return tuple(pane(0, .5)[i] @ turn for i in (0, 1)) + (pane(0, .5)[2],)


@pytest.mark.parametrize("technique, sub_frames", [("photon", 1), ("photon", 4), ("many_light", 1), ("many_light", 4)])
@pytest.mark.parametrize("receiver", RECEIVERS)
def test_a_wall_is_lit_by_a_mirror_as_by_the_lamp(client, tmp_path, receiver, technique, sub_frames):
    """What the photons of a spot's beam do by way of a mirror, the spot does by itself where the mirror shows it."""
    material, normal = RECEIVERS[receiver]
    wall = leaning(pane(-2, .6), normal)
    spot = {"type": "spot", "intensity": 100, "spot": {"innerConeAngle": .05, "outerConeAngle": .06}}
    straight = add(client, tmp_path, [(wall, material)], light=spot)
    by_mirror = add(client, tmp_path, [(folded(wall), material), (tilted_mirror(), MIRROR)], light=spot)
    wanted = light(straight.render(size=SIZE, technique="direct", layers=["direct"], pose=bounced.Pose((0, 1.2, 0), (0, 0, -2), yfov=.3)), "direct")
    got = light(by_mirror.render(size=SIZE, technique=technique, layers=["indirect"], aa=sub_frames, parameters={"photons": 131072},
                                 pose=bounced.Pose((0, 1.2, 0), (2, 0, 0), yfov=.3)))
    print(got.sum((0, 1)) / wanted.sum((0, 1)))
    assert got.sum((0, 1)) == pytest.approx(wanted.sum((0, 1)), rel=.01)


@pytest.mark.parametrize("receiver", ["rough metal", "rough plastic"])
def test_lobes_reflect_what_a_mirror_throws_of_an_emitter(client, tmp_path, receiver):
    """Told by photons, which a lobe's few rays would hardly find; screens keep all but the beam away."""
    material, _ = RECEIVERS[receiver]
    black = {"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]}, "extensions": {"KHR_materials_ior": {"ior": 1}}, "doubleSided": True}
    tube = [(tuple(numpy.ascontiguousarray(numpy.roll(a, axis, 1)) if a.dtype == numpy.float32 else a for a in pane(side * .3, .3)), black)
            for axis in (1, 2) for side in (-1, 1)]
    tube = [((mesh[0] + numpy.float32((0, 0, 3.6)), mesh[1], mesh[2]), black) for mesh, black in tube]
    parts = [*tube, (moved(pane(0, .05, -1), (0, 0, 3.8)), lamp(1e5))]
    straight = add(client, tmp_path, [*parts, (pane(-2, .6), material)])
    by_mirror = add(client, tmp_path, [*parts, (folded(pane(-2, .6)), material), (tilted_mirror(), MIRROR)])
    wanted = light(straight.render(size=SIZE, technique="direct", layers=["direct"], parameters={"light_rays": 64},
                                   pose=bounced.Pose((0, 1.2, 0), (0, 0, -2), yfov=.15)), "direct")
    got = light(by_mirror.render(size=SIZE, technique="many_light", layers=["indirect"], pose=bounced.Pose((0, 1.2, 0), (2, 0, 0), yfov=.15)))
    print(got.sum((0, 1)) / wanted.sum((0, 1)))
    assert got.sum((0, 1)) == pytest.approx(wanted.sum((0, 1)), rel=.02)


def moved(mesh, by):
    return mesh[0] + numpy.float32(by), mesh[1], mesh[2]


@pytest.mark.parametrize("technique", ["photon", "many_light"])
@pytest.mark.parametrize("receiver", RECEIVERS)
def test_a_mirror_shows_what_stands_before_it(client, tmp_path, receiver, technique):
    """A lit floor, lobes and all, as who stands behind the mirror would see it."""
    material, normal = RECEIVERS[receiver]
    floor = leaning(pane(-1, .6), normal)
    spot = {"type": "spot", "intensity": 100, "spot": {"innerConeAngle": .05, "outerConeAngle": .06}}
    places, _, triangles = pane(0, 2)
    mirror = (numpy.float32([(-1.5, y, -x) for x, y, _ in places]), numpy.float32([(1, 0, 0)] * 4), triangles)
    bare, mirrored = add(client, tmp_path, [(floor, material)], light=spot), add(client, tmp_path, [(floor, material), (mirror, MIRROR)], light=spot)
    wanted = light(bare.render(size=SIZE, technique="direct", layers=["direct"], pose=bounced.Pose((-2.5, 0, 1), (0, 0, -1), up=(0, 0, 1), yfov=.2)), "direct")
    got = light(mirrored.render(size=SIZE, technique=technique, layers=["indirect"], parameters={"photons": 1024, "far_rays": 8},
                                pose=bounced.Pose((-.5, 0, 1), (-3, 0, -1), up=(0, 0, 1), yfov=.2)))[:, ::-1]
    print(got.sum((0, 1)) / wanted.sum((0, 1)), off(got, wanted))
    assert got.sum((0, 1)) == pytest.approx(wanted.sum((0, 1)), rel=.02) and off(got, wanted) < .05


def moved_ball(radius=.4, at=(0, -.45, 0)):
    places, normals, triangles = sphere(32)
    return numpy.float32(radius * places + numpy.float32(at)), normals, triangles
