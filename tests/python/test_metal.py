"""Metal that is no mirror lights a room where it reflects to, not evenly: first light of a lamp, and what other metal shows of it."""
import bounced
import pytest
from glass_scenes import LIGHTS, add, walls

POSE = bounced.Pose((0, 0, .95), (.3, 0, -1), yfov=1.2)
ASIDE = bounced.Pose((-.8, 0, .6), (1, 0, -.3), yfov=1.2)
WALL = [(-.95, -1, -1), (-.95, 1, -1), (-.95, 1, 1), (-.95, -1, 1)]
BACK = [(-1, -1, -.9), (1, -1, -.9), (1, 1, -.9), (-1, 1, -.9)]


@pytest.fixture(scope="module")
def client():
    with bounced.private() as client:
        yield client


def hang(scene, corners, roughness):
    with scene.edit() as edit:
        metal = edit.add_material(base_color=(.9, .9, .9, 1), roughness=roughness, metallic=1)
        mesh = edit.add_mesh(bounced.Primitive(corners, [[0, 1, 2], [0, 2, 3]], material=metal))
        edit.add_node(mesh=mesh)


def tiles(scene, technique, pose=POSE, **parameters):
    frame = scene.render(size=(32, 32), technique=technique, layers=["indirect"], fresh="all", parameters=parameters, pose=pose)
    return frame.layers["indirect"][..., :3].mean(2).reshape(4, 8, 4, 8).mean((1, 3))


def off(scene, technique, truth, pose=POSE, **parameters):
    return abs(tiles(scene, technique, pose, **parameters) / truth - 1)


@pytest.fixture(scope="module")
def room(client, tmp_path_factory):
    scene = add(client, tmp_path_factory.mktemp("metal"), walls(), light=LIGHTS[2], at=(.4, .3, .3))
    hang(scene, BACK, .4)
    return scene, tiles(scene, "reference", ASIDE, spp=192)


@pytest.mark.parametrize("technique, parameters", [
    ("many_light", {}), ("ssbc", {}), ("photon", {}),
    ("point_projection", {"points": 65536}), ("point_projection", {"points": 65536, "executor": "device"})])
def test_a_wall_sends_where_it_reflects_to(room, technique, parameters):
    scene, truth = room
    assert off(scene, technique, truth, ASIDE, **parameters).mean() < .055  # sent evenly .09 to .12


@pytest.mark.parametrize("technique", ["many_light", "photon", "point_projection"])
def test_a_wall_shows_what_another_sends(client, tmp_path, technique):
    """All light, seen in a back wall of it, too."""
    scene = add(client, tmp_path, walls(), light=LIGHTS[0], at=(.6, .5, .1))
    hang(scene, WALL, .4)
    hang(scene, BACK, .4)
    truth = tiles(scene, "reference", spp=192)
    assert off(scene, technique, truth).max() < .09  # .98 to 1.1 before walls looked at each other


def test_a_mirror_sends_what_is_lit_before_it(client, tmp_path):
    """A map of points shows a mirror, which sends nothing of its own: rays through it go on from there."""
    scene = add(client, tmp_path, walls(), light=LIGHTS[0], at=(.6, .5, .1))
    hang(scene, WALL, 0)
    truth = tiles(scene, "reference", ASIDE, spp=192)
    assert off(scene, "point_projection", truth, ASIDE, points=65536, map_rays=0).mean() > .1
    assert off(scene, "point_projection", truth, ASIDE, points=65536).mean() < .025
