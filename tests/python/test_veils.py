"""What blends, with the real renderer: cameras and lights see through it as far as it is not opaque."""
import bounced
import numpy
import pytest
from glass_scenes import BESIDE, GREY, LIGHTS, LOOK_THROUGH, SIZE, add, lamp, pane, walls


@pytest.fixture(scope="module")
def client():
    with bounced.private() as client:
        yield client


def veil(alpha, grey=0, mode="BLEND", **more):
    return {"pbrMetallicRoughness": {"baseColorFactor": [grey, grey, grey, alpha], "roughnessFactor": 1, "metallicFactor": 0},
            "alphaMode": mode, "doubleSided": True, **more}


@pytest.mark.parametrize("alphas", [(.25,), (.5, .5), (.3, .7), (.2, .2, .2)], ids=str)
def test_what_blends_is_as_often_there_as_it_is_opaque(client, tmp_path, alphas):
    """Veils before a wall of 1 cd/m^2: in one picture there or not, in the mean of sub-frames what all alphas leave."""
    scene = add(client, tmp_path, [(pane(-3, 9), lamp(1))] + [(pane(-.5 * i, 9), veil(alpha)) for i, alpha in enumerate(alphas)])

    def seen(aa, drawing, **more):
        return scene.render(size=(16, 16), technique="direct", layers=["beauty"], aa=aa, pose=bounced.Pose((0, 0, 6), (0, 0, 0), yfov=.2),
                            parameters={"drawing": drawing}, **more).layers["beauty"][..., 0].astype(float)
    assert seen(1, "raster").mean() == (max(alphas) < .5)
    for aa, within in ((16, .07), (64, .03)):  # the latter goes on where the former ended
        drawn = seen(aa, "raster")
        print(alphas, aa, drawn.mean(), numpy.prod(1 - numpy.array(alphas)))
        assert drawn.mean() == pytest.approx(numpy.prod(1 - numpy.array(alphas)), abs=within)
        assert numpy.array_equal(drawn, seen(aa, "rays")) and numpy.array_equal(drawn, seen(aa, "raster", fresh="all"))


def floor(client, folder, parts, technique="direct", layers=("direct",), shines=None, parameters=None, **asked):
    """What a camera beside the floor at z = 0 sees of it, below everything else."""
    scene = add(client, folder, [(pane(0, 9), GREY), *parts], **(shines or {}))
    frame = scene.render(size=SIZE, technique=technique, layers=list(layers), pose=bounced.Pose(**BESIDE), parameters=parameters or {}, **asked)
    return sum(frame.layers[layer][..., 0].astype(float) for layer in layers), frame.report["flags"]


@pytest.mark.parametrize("light", LIGHTS, ids=lambda light: light["type"])
@pytest.mark.parametrize("technique", LOOK_THROUGH)
def test_lamps_shine_through_what_blends(client, tmp_path, light, technique):
    """Direct light at each pixel, without noise; not where it is asked for as a mask."""
    asked = {"technique": technique, "shines": {"light": light}, "parameters": LOOK_THROUGH[technique]}
    veils = [(pane(2, 9), veil(.3)), (pane(1.5, 9), veil(.6)), (pane(1.2, 9), veil(.9, mode="OPAQUE")), (pane(1.1, 9), veil(0))]
    bare, _ = floor(client, tmp_path, [], **asked)
    behind, flags = floor(client, tmp_path, veils[:2] + veils[3:], **asked)
    lit = bare > 0
    assert lit.sum() > 100
    assert numpy.abs(behind[lit] / bare[lit] - .7 * .4).max() < 1e-4
    assert "blend_as_mask: as it is seen" in flags
    assert not floor(client, tmp_path, veils, **asked)[0].any()
    if technique == "direct":
        return
    asked["parameters"] = {**LOOK_THROUGH[technique], "alpha": "mask"}
    masked, flags = floor(client, tmp_path, veils[:1], **asked)
    assert numpy.abs(masked[lit] / bare[lit] - 1).max() < 1e-3 and "blend_as_mask" in flags


LAMP = {"emissiveFactor": [1, 1, 1], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 10}}}


@pytest.mark.parametrize("technique", ["reference", "direct", "photon"])
def test_what_shines_does_so_as_far_as_it_is_there(client, tmp_path, technique):
    """A lamp that blends, and one that a mask cuts out, beside one that is whole."""
    asked = {"technique": technique, "shines": {"sky": (.01, .01, .01)},
             "parameters": {"spp": 64} if technique == "reference" else {"light_rays": 64}}
    dark, whole, part, gone = (floor(client, tmp_path, [(pane(3, 2, facing=-1), material)], **asked)[0].mean()
                               for material in (veil(0), veil(1, **LAMP), veil(.3, **LAMP), veil(.3, mode="MASK", **LAMP)))
    print(dark, whole, part, gone)
    assert (part - dark) / (whole - dark) == pytest.approx(.3, rel=.02)
    assert gone == pytest.approx(dark, rel=.02)


@pytest.mark.parametrize("technique", ["many_light", "photon", "ssbc", "rsm"])
def test_a_room_with_a_veil_has_its_light(client, tmp_path, technique):
    """White on both sides, and half there: seen beside it, and through it by sub-frames that take light over."""
    room = [*walls(), (pane(1, 1), {**GREY, "doubleSided": True}), (pane(0, 1), veil(.5, grey=.8))]
    scene = add(client, tmp_path, room, light={"type": "point", "intensity": 5}, at=(.2, .3, .4))
    more = {"indirect_visibility": "rays", "indirect_bounces": 30} if technique == "rsm" else {}

    def seen(pose, technique, aa=1, **parameters):
        return scene.render(size=SIZE, technique=technique, layers=["indirect"], aa=aa, pose=pose,
                            parameters=parameters).layers["indirect"][..., 0].astype(float).mean()
    beside, through = bounced.Pose((0, .7, .5), (0, -1, .5), up=(0, 0, 1), yfov=.6), bounced.Pose((0, 0, .7), (0, -.3, -1), yfov=1.4)
    for pose in (beside, through):
        truth, ours = seen(pose, "reference", spp=512, filter="box"), seen(pose, technique, 16, **more)
        print(technique, ours / truth)
        assert ours == pytest.approx(truth, rel=.04 if technique != "rsm" else .06)
