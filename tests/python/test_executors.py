"""Who does the arithmetic, with the real renderer: device and processor agree, and reports say which it was."""
import bounced
import numpy
import pytest
from conftest import SCENES

SIZE = (120, 88)
TECHNIQUES = ("rsm", "multires_gather", "isr", "hisr")


@pytest.fixture(scope="module")
def client():
    with bounced.private() as client:
        yield client


@pytest.fixture(scope="module")
def scene():
    with bounced.private() as client:
        yield client.scenes.add(SCENES / "cornell.glb")


@pytest.fixture(scope="module")
def glossy_scene():
    """Metal, a smooth dielectric, and what is left as it was: some receivers have a lobe worth its price."""
    with bounced.private() as client:
        scene = client.scenes.add(SCENES / "cornell.glb")
        materials = [o["id"] for o in scene.objects("material")]
        with scene.edit() as edit:
            edit.set_material(materials[0], metallic=.7, roughness=.3)
            edit.set_material(materials[1], roughness=.15)
        yield scene


@pytest.fixture(scope="module")
def round_scene():
    """A ball: blocks whose surface is not as it is shaded."""
    turns, heights = numpy.meshgrid(numpy.linspace(0, 2 * numpy.pi, 25), numpy.linspace(-1, 1, 13))
    across = numpy.sqrt(1 - heights ** 2)
    normals = numpy.stack([across * numpy.cos(turns), heights, across * numpy.sin(turns)], -1).reshape(-1, 3)
    corner = (numpy.arange(12)[:, None] * 25 + numpy.arange(24)).reshape(-1, 1)
    triangles = (corner + numpy.array([[0, 25, 1], [1, 25, 26]]).reshape(1, -1)).reshape(-1, 3)
    with bounced.private() as client:
        scene = client.scenes.add(SCENES / "cornell.glb")
        with scene.edit() as edit:
            edit.add_node(mesh=edit.add_mesh(bounced.Primitive(.3 * normals + (0, .9, .3), triangles, normals=normals)))
        yield scene


def indirect(scene, technique, executor, **asked):
    frame = scene.render(size=SIZE, technique=technique, layers=["indirect"],
                         parameters={"executor": executor, **asked})
    assert frame.report["executor"] == executor
    return frame.layers["indirect"].astype(float)


def assert_same(device, native):
    """Cuts of trees are hundreds of decisions a pixel: where one differs by rounding, light does by a part of `tau`."""
    differ = numpy.abs(native - device).max(axis=-1) > 1e-4 * device.mean()
    assert differ.mean() < 1e-3
    assert numpy.sqrt(((native - device)[~differ] ** 2).mean()) < 1e-5 * device.mean()


@pytest.mark.parametrize("technique", TECHNIQUES)
@pytest.mark.parametrize("asked", [{}, {"brdf": "lambert"}, {"vpl_kernel": "disk", "brdf": "lambert"}],
                         ids=["whole", "lambert", "disk"])
def test_both_give_the_same_light(scene, technique, asked):
    device, native = (indirect(scene, technique, executor, **asked) for executor in ("device", "native"))
    assert device.mean() > 0
    assert_same(device, native)
    assert native.mean() == pytest.approx(device.mean(), rel=1e-5)


@pytest.mark.parametrize("technique", TECHNIQUES)
def test_round_surfaces(round_scene, technique):
    assert_same(*(indirect(round_scene, technique, executor, brdf="lambert") for executor in ("device", "native")))


@pytest.mark.parametrize("technique", ("rsm", "multires_gather"))
@pytest.mark.parametrize("asked", [{}, {"vpl_kernel": "disk"}, {"vpls": 5000}, {"indirect_visibility": "rays", "vpls": 64, "rays": 64},
                                   {"indirect_visibility": "rays", "vpls": 64, "rays": 64, "vpl_kernel": "disk"}],
                         ids=["whole", "disk", "many", "all seen", "all seen, disk"])
def test_glossy_receivers(glossy_scene, technique, asked):
    device, native = (indirect(glossy_scene, technique, executor, **asked) for executor in ("device", "native"))
    lambert = indirect(glossy_scene, technique, "native", brdf="lambert", **asked)
    assert numpy.sqrt(((native - lambert) ** 2).mean()) > 0.05 * device.mean()
    differ = numpy.abs(native - device).max(axis=-1) > 1e-3 * device.mean()
    assert differ.mean() < (1e-3 if "rays" in asked else 1e-9)  # by a ray that grazes
    assert numpy.sqrt(((native - device)[~differ] ** 2).mean()) < 1e-5 * device.mean()


@pytest.mark.parametrize("asked", [{"clamp": 2}, {"paper_mode": 1}], ids=["exact", "as printed"])
def test_lobes_of_the_screen(glossy_scene, asked):
    asked = {"residual": "screen", "iterations": 2, **asked}
    device, native = (indirect(glossy_scene, "ssbc", executor, **asked) for executor in ("device", "native"))
    clamped = indirect(glossy_scene, "ssbc", "native", **{**asked, "iterations": 0})
    assert native.mean() > 1.005 * clamped.mean()
    assert_same(device, native)


@pytest.mark.parametrize("asked", [{"tau": 0, "vpls": 4096}, {"tree_cut": "bound", "tau": 0.001}, {"tree_cut": "level", "tau": 0.01},
                                   {"vpls": 256, "tree_roots": 256}, {"vpls": 65536, "tree_roots": 1, "vpl_kernel": "disk"}],
                         ids=["leaves", "bound", "level", "roots", "one root"])
def test_cuts_of_trees(scene, asked):
    device, native = (indirect(scene, "hisr", executor, **asked) for executor in ("device", "native"))
    assert_same(device, native)


@pytest.mark.parametrize("asked", [{"rays": 6}, {"rays": 6, "noise_filter": "off"}, {"rays": 17, "vpls": 4000, "vpl_kernel": "disk"},
                                   {"vpls": 64, "rays": 64}, {"vpls": 64, "rays": 64, "indirect_visibility": "ism"},
                                   {"rays": 6, "indirect_visibility": "ism", "ism_holes": "open", "ism_size": 16, "ism_points": 700}],
                         ids=["few", "noisy", "many", "all", "maps", "few of coarse maps"])
@pytest.mark.parametrize("technique", ("rsm", "multires_gather", "isr"))
def test_rays(scene, technique, asked):
    """The same virtual lights are asked about: noise is the same, too."""
    if technique == "isr":
        asked = {name: value for name, value in asked.items() if name != "vpls"}
    asked = {"indirect_visibility": "rays", "brdf": "lambert", **asked}
    device, native = (indirect(scene, technique, executor, **asked) for executor in ("device", "native"))
    assert device.mean() > 0
    differ = numpy.abs(native - device).max(axis=-1) > 1e-3 * device.mean()
    assert differ.mean() < 1e-3
    assert numpy.sqrt(((native - device)[~differ] ** 2).mean()) < 3e-5 * device.mean()


def assert_same_direct_light(scene, asked, **how):
    """But where a segment passes a triangle's edge by rounding."""
    device, native = (scene.render(size=SIZE, technique="direct", layers=["direct"], parameters={"executor": executor, **asked}, **how)
                      .layers["direct"].astype(float) for executor in ("device", "native"))
    assert device.mean() > 0
    differ = numpy.abs(native - device).max(axis=-1) > 1e-3 * device.mean()
    assert differ.mean() <= 1e-4
    assert numpy.sqrt(((native - device)[~differ] ** 2).mean()) < 1e-5 * device.mean()


@pytest.mark.parametrize("name", ("cube_room", "two_lights", "checker", "orthographic"))
@pytest.mark.parametrize("asked", [{}, {"brdf": "lambert"}, {"shadow_size": 64}], ids=["whole", "lambert", "coarse"])
def test_direct_light(client, name, asked):
    """Of a point light; a spot and a sun; through a mask; to an orthographic camera."""
    scene = client.scenes.add(SCENES / f"{name}.glb")
    for camera in range(len(scene.objects("camera"))):
        assert_same_direct_light(scene, asked, camera=camera)


def test_direct_light_of_metal_and_sub_frames(glossy_scene):
    """A spot as wide as a point light's faces."""
    assert_same_direct_light(glossy_scene, {})
    assert_same_direct_light(glossy_scene, {}, aa=3)


def test_direct_light_is_its_executors(scene):
    """Of every technique that shows it: what was asked before must not show in a picture."""
    states = []
    for technique, executor in (("direct", "device"), ("direct", "native"), ("rsm_splat", "device"), ("multires_splat", "native")):
        frame = scene.render(size=(64, 48), technique=technique, parameters={"executor": executor})
        states += [p["state"] for p in frame.report["passes"] if p["name"] == "direct"]
    assert states == ["ran", "ran", "reused", "reused"]


def test_a_tree_is_its_executors(scene):
    """Its last bits differ: what was asked before must not show in a picture."""
    built = []
    for executor in ("device", "native", "device"):
        frame = scene.render(size=SIZE, technique="hisr", fresh="camera", parameters={"executor": executor, "tree_roots": 77})
        built += [p["state"] for p in frame.report["passes"] if p["name"] == "vpl_tree"]
    assert built == ["ran", "ran", "reused"]


def test_without_surface_detail(scene):
    """Blocks without irradiance vectors."""
    asked = {"surface_detail": "off", "light_threshold": "inf"}
    device, native = (indirect(scene, "multires_gather", executor, **asked) for executor in ("device", "native"))
    assert numpy.sqrt(((native - device) ** 2).mean()) < 1e-5 * device.mean()


def test_it_is_the_processor_on_a_software_device(scene):
    frame = scene.render(size=(16, 16))
    assert frame.report["device"]["software"] and frame.report["executor"] == "native"
    assert scene.render(size=(16, 16), technique="rsm", plan_only=True).report["executor"] == "native"
    assert "executor" not in scene.render(size=(16, 16), technique="reference", parameters={"spp": 2}).report


def test_tests_run_with_either(monkeypatch):
    monkeypatch.setenv("BD_EXECUTOR", "device")
    with bounced.private() as client:
        scene = client.scenes.add(SCENES / "cornell.glb")
        by_itself = scene.render(size=(16, 16), technique="rsm").report["executor"]
        told = scene.render(size=(16, 16), technique="rsm", parameters={"executor": "native"}).report["executor"]
    assert (by_itself, told) == ("device", "native")


@pytest.mark.parametrize("asked", [{"technique": "direct"}, {"technique": "rsm"}, {"technique": "hisr"},
                                   {"technique": "multires_gather", "parameters": {"indirect_visibility": "rays", "rays": 5}}],
                         ids=["direct", "list", "tree", "choice"])
def test_no_width_changes_a_byte(scene, asked, monkeypatch):
    """A daemon that has the narrowest instructions alone."""
    asked = {"parameters": {"brdf": "lambert", **asked.get("parameters", {})}, "technique": asked["technique"]}
    here = scene.render(size=SIZE, **asked).rgba
    monkeypatch.setenv("BD_NATIVE_WIDTH", "baseline")
    with bounced.private() as client:
        narrow = client.scenes.add(SCENES / "cornell.glb").render(size=SIZE, **asked).rgba
    assert (here == narrow).all()


POINTS = {"points": 16384, "clusters": 64, "cache_cells": 512, "exploit": 256, "microbuffer": 16}


@pytest.mark.parametrize("asked", [{}, {"exploit": 5000, "microbuffer": 18}, {"projection": "uniform", "brdf": "lambert"}, {"projection": "all"}],
                         ids=["few", "more than slots", "uniform", "all"])
def test_points(scene, asked):
    """The same points are drawn, but where a share is rounded to the other side: of what another seed changes next to nothing."""
    def light(executor, seed):
        return scene.render(size=(48, 36), technique="point_projection", layers=["indirect"], seed=seed,
                            parameters={"executor": executor, **POINTS, **asked}).layers["indirect"].astype(float)
    device, native, other = light("device", 1), light("native", 1), light("native", 2)
    assert device.mean() > 0 and not (device == native).all()
    assert numpy.sqrt(((native - device) ** 2).mean()) < 0.02 * numpy.sqrt(((native - other) ** 2).mean())
    assert (light("device", 1) == device).all()
