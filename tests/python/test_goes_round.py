"""Light that goes round many times between surfaces next to each other, where virtual lights are few and leave much of it out."""
import bounced
import numpy
import pytest
from glass_scenes import GREY, LIGHTS, add, walls

WHITE = {**GREY, "pbrMetallicRoughness": {**GREY["pbrMetallicRoughness"], "baseColorFactor": [.92, .92, .92, 1]}, "doubleSided": True}
POSE = bounced.Pose((0, 0, .95), (.2, .2, -1), yfov=1.2)


def shelves(count, depth=.4):
    """As many boards upright and lying, across each other, on the back wall."""
    for i in range(count):
        at = 2 * (i + .5) / count - 1
        for normal, corners in (((1, 0, 0), [(at, y, z) for y, z in ((-1, -1), (1, -1), (1, depth - 1), (-1, depth - 1))]),
                                ((0, 1, 0), [(x, at, z) for x, z in ((-1, -1), (1, -1), (1, depth - 1), (-1, depth - 1))])):
            yield (numpy.float32(corners), numpy.float32([normal] * 4), numpy.uint32([(0, 1, 2), (0, 2, 3)])), WHITE


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    with bounced.private() as client:
        parts = [(mesh, WHITE) for mesh, _ in walls()] + list(shelves(8))
        scene = add(client, tmp_path_factory.mktemp("shelves"), parts, light=LIGHTS[0], at=(.3, .2, .6))
        yield scene, mean(scene, "reference", spp=128)


def mean(scene, technique, seed=0, **parameters):
    frame = scene.render(size=(32, 32), technique=technique, layers=["indirect"], fresh="all", seed=seed, parameters=parameters, pose=POSE)
    return float(frame.layers["indirect"][..., :3].mean())


@pytest.mark.parametrize("technique", ["many_light", "ssbc"])
def test_few_virtual_lights_bring_all_of_it(room, technique):
    scene, truth = room
    told = numpy.mean([mean(scene, technique, seed, walk_vpls=64) for seed in range(3)])
    assert told == pytest.approx(truth, rel=.1)  # .77 and .86 of it while photons alone told what falls where rays of the cache end


METAL = {"pbrMetallicRoughness": {"metallicFactor": 1, "roughnessFactor": .3, "baseColorFactor": [.9, .9, .9, 1]}, "doubleSided": True}


@pytest.mark.parametrize("technique, back, parameters", [
    ("many_light", WHITE, {}), ("many_light", METAL, {"caustics": "off"}), ("ssbc", WHITE, {}), ("photon", METAL, {"caustics": "off"}),
    ("point_projection", METAL, {})])
def test_nothing_goes_through_a_wall_that_both_sides_of_are_seen(tmp_path, technique, back, parameters):
    """A box that is open in front, and a wall without thickness between its halves, one of which is lit: not a photon gets to the other.
    What is smoothed goes over the picture, where such a wall is none."""
    middle = numpy.float32([(0, -1, -1), (0, -1, 1), (0, 1, 1), (0, 1, -1)]), numpy.float32([(1, 0, 0)] * 4), numpy.uint32([(0, 1, 2), (0, 2, 3)])
    with bounced.private() as client:
        *sides, behind = [mesh for mesh, _ in walls()]
        parts = [(mesh, WHITE) for mesh in (*sides, middle)] + [(behind, back)]
        scene = add(client, tmp_path, parts, light={"type": "point", "intensity": 5}, at=(-.5, .5, 0))
        seen = scene.render(size=(96, 96), technique=technique, layers=["indirect"], parameters={"noise_filter": "off", **parameters},
                            pose=bounced.Pose((.05, 0, 4.2), (0, 0, 0), yfov=.62)).layers["indirect"]
    lit, dark = seen[:, :46, :3], seen[:, 49:, :3]
    assert lit.mean() > .1
    assert dark.max() == 0  # of many_light 1.2 where a cell of its cache lay on both sides, of point_projection's lobes 7
