"""Caustics of the reference, with the real renderer: they are there, whatever was traced before and of which region."""
import bounced
import numpy
import pytest
from conftest import SCENES

SIZE = (48, 48)


@pytest.fixture(scope="module")
def scene():
    """The Cornell box with walls as mirrors are: every material but the floor's."""
    with bounced.private() as client:
        scene = client.scenes.add(SCENES / "cornell.glb")
        with scene.edit() as edit:
            for material in scene.objects("material")[1:]:
                edit.set_material(material["id"], metallic=1, roughness=0)
        yield scene


def indirect(scene, spp=16, fresh="all", **asked):
    parameters = {"spp": spp, **asked.pop("parameters", {})}
    return scene.render(size=SIZE, technique="reference", layers=["indirect"], fresh=fresh, parameters=parameters, **asked).layers["indirect"]


def test_paths_from_lights_bring_what_no_others_do(scene):
    with_paths, without = (indirect(scene, parameters={"light_vertices": on}).astype(float) for on in ("on", "off"))
    assert with_paths.mean() > 1.1 * without.mean()


def test_what_was_traced_goes_on(scene):
    indirect(scene, spp=6)
    assert numpy.array_equal(indirect(scene, spp=20, fresh=None), indirect(scene, spp=20))


def test_a_region_is_a_crop(scene):
    x, y, width, height = 5, 9, 21, 30
    whole, part = indirect(scene), indirect(scene, region=(x, y, width, height))
    assert numpy.array_equal(part[y:y + height, x:x + width], whole[y:y + height, x:x + width])


def test_what_points_throw_in_mirrors_is_missing_and_said(scene):
    """Pixels whose paths met a mirror before what is lit: some, and not the floor's alone; none with a radius, and none without mirrors."""
    def unseen(**parameters):
        flags = scene.render(size=SIZE, technique="reference", layers=["indirect"], fresh="all", parameters={"spp": 8, **parameters}).report["flags"]
        return [int(flag.split()[1]) for flag in flags if flag.startswith("caustics_unseen: ")]
    count, = unseen()
    assert 0 < count <= SIZE[0] * SIZE[1]
    assert unseen(lamp_radius=.01) == unseen(light_vertices="off") == unseen(brdf="lambert") == []
    with bounced.private() as client:
        plain = client.scenes.add(SCENES / "cornell.glb")
        assert not any("caustics" in flag for flag in plain.render(size=SIZE, technique="reference", parameters={"spp": 2}).report["flags"])
