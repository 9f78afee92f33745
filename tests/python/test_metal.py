"""Metal that is no mirror lights a room where it reflects to, not evenly: first light of a lamp, and what other metal shows of it."""
import bounced
import numpy
import pytest
from glass_scenes import GREY, LIGHTS, add, pane, walls

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


MIRROR = {"pbrMetallicRoughness": {"metallicFactor": 1, "roughnessFactor": 0}}


def stripe(x, color):
    """Of a wall behind the viewer, whose front is towards the mirror."""
    places = [(x, -4, 3), (x + .5, -4, 3), (x + .5, 4, 3), (x, 4, 3)]
    material = {"pbrMetallicRoughness": {**GREY["pbrMetallicRoughness"], "baseColorFactor": [color] * 3 + [1]}}
    return (numpy.float32(places), numpy.float32([(0, 0, -1)] * 4), numpy.uint32([(2, 1, 0), (3, 2, 0)])), material


def test_a_mirror_shows_edges(client, tmp_path):
    """Nothing tells the filter of noise where they are: it leaves most of what a mirror shows to later sub-frames."""
    scene = add(client, tmp_path, [(pane(0, 4), MIRROR), *(stripe(-4 + i / 2, .02 if i % 2 else .9) for i in range(16))], sky=(1, 1, 1))

    def seen(seed, **parameters):
        return scene.render(size=(64, 64), technique="many_light", layers=["beauty"], pose=bounced.Pose((0, 0, 2), (0, 0, 0), yfov=.9), aa=16,
                            seed=seed, parameters=parameters).layers["beauty"][..., 0].astype(float)
    truth = (seen(0, far_rays=64, noise_filter="off") + seen(1, far_rays=64, noise_filter="off")) / 2
    off = [numpy.sqrt(((seen(seed) - truth) ** 2).mean()) / truth.mean() for seed in range(3)]
    print(off)
    assert numpy.mean(off) < .113


def test_a_mirror_shows_no_cells(client, tmp_path):
    """Of a cache of few cells it shows what lies between them."""
    scene = add(client, tmp_path, [*walls(), (pane(-.98, .8), MIRROR)], light=LIGHTS[2], at=(.4, .3, .3))

    def seen(seed, cells):
        return scene.render(size=(64, 64), technique="many_light", layers=["indirect"], pose=bounced.Pose((0, 0, .9), (0, 0, -1), yfov=1.1), fresh="all",
                            seed=seed, parameters={"far_rays": 16, "cache_cells": cells}).layers["indirect"][8:56, 8:56, 0].astype(float)
    truth = (seen(0, 16384) + seen(1, 16384)) / 2
    off = [numpy.sqrt(((seen(seed, 256) - truth) ** 2).mean()) / truth.mean() for seed in range(3)]
    print(off)
    assert numpy.mean(off) < .08


def test_cells_behind_a_thin_wall_have_no_say(client, tmp_path):
    """Over it, in the mirror, both of its sides are seen; a lamp is on one."""
    wall = [(0, -1, -1), (0, -1, 1), (0, .2, 1), (0, .2, -1)]
    front = [(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]
    sides = [(numpy.float32(wall), numpy.float32([(-1, 0, 0)] * 4), numpy.uint32([(0, 1, 2), (0, 2, 3)])),
             (numpy.float32(front), numpy.float32([(0, 0, -1)] * 4), numpy.uint32([(0, 2, 1), (0, 3, 2)]))]
    parts = [*walls(), *((mesh, {**GREY, "doubleSided": True}) for mesh in sides), (pane(-.98, .9), MIRROR)]
    scene = add(client, tmp_path, parts, light=LIGHTS[0], at=(.5, -.6, .3))

    def seen(seed, cells):
        return scene.render(size=(48, 48), technique="many_light", layers=["beauty"], pose=bounced.Pose((-.3, .7, -.3), (-.3, -.1, -1), yfov=.8),
                            fresh="all", seed=seed, parameters={"far_rays": 32, "cache_cells": cells}).layers["beauty"][..., 0].astype(float)
    truth, told = (sum(seen(seed, cells) for seed in range(3)) / 3 for cells in (16384, 256))
    dark = truth < numpy.median(truth)
    off = numpy.sqrt(((told - truth)[dark] ** 2).mean()) / truth[dark].mean()
    print(off)
    assert off < .2
