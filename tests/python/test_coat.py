"""Plastic sends what grazes it on by its coat: forward, and not evenly."""
import bounced
import numpy
import pytest
from glass_scenes import add, walls

POSE = bounced.Pose((0, .5, .95), (0, .4, -1), yfov=.5)
# Along the floor, and not as far up as where the wall at its end begins.
SPOT = {"type": "spot", "intensity": 100, "spot": {"innerConeAngle": .2, "outerConeAngle": .3}}
PLASTIC = {"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": .4, "baseColorFactor": [.02, .02, .02, 1]}, "doubleSided": True}


def tiles(scene, technique, seed=0, **parameters):
    frame = scene.render(size=(32, 32), technique=technique, layers=["indirect"], fresh="all", seed=seed, parameters=parameters, pose=POSE)
    return frame.layers["indirect"][..., :3].mean(2).reshape(4, 8, 4, 8).mean((1, 3))


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    """A black floor and, above where its lamp shines, a grey wall."""
    with bounced.private() as client:
        _, _, _, (floor, _), ((places, *rest), grey) = walls()
        wall = numpy.maximum(places, numpy.float32((-1, -.1, -1))), *rest
        scene = add(client, tmp_path_factory.mktemp("coat"), [(floor, PLASTIC), (wall, grey)], light=SPOT, at=(0, -.8, .9))
        yield scene, tiles(scene, "reference", spp=256)


@pytest.mark.parametrize("technique, parameters", [("many_light", {}), ("many_light", {"executor": "device"}), ("ssbc", {})])
def test_a_floor_sends_on_what_grazes_it(room, technique, parameters):
    scene, truth = room
    told = sum(tiles(scene, technique, seed, **parameters) for seed in range(2)) / 2
    assert abs(told / truth - 1).mean() < .05  # sent evenly 2.9
