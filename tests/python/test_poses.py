"""Poses, with the real renderer: what a camera sees is seen by a pose in its place, drawn, traced and checked."""
import bounced
import numpy
import pytest
from conftest import SCENES

SIZE = (96, 72)
# In the place of cornell.glb's camera, whose angle is a 32 bit float, and beside it.
IN_PLACE = bounced.Pose(eye=(0, 1, 3.95), target=(0, 1, 0), yfov=float(numpy.float32(0.66)))
BESIDE = bounced.Pose(eye=(0.5, 1.3, 3.5), target=(0, 1, 0), yfov=0.66)
REFERENCE = {"technique": "reference", "parameters": {"spp": 8}}


@pytest.fixture(scope="module")
def scene():
    with bounced.private() as client:
        yield client.scenes.add(SCENES / "cornell.glb")


def beauty(scene, **asked):
    return scene.render(size=SIZE, **asked).rgba[..., :3].astype(float)


def difference(picture, other):
    return numpy.sqrt(((picture - other) ** 2).mean()) / other.mean()


@pytest.mark.parametrize("asked", [{}, REFERENCE], ids=["drawn", "traced"])
def test_a_pose_in_the_cameras_place_sees_what_it_sees(scene, asked):
    by_camera = beauty(scene, camera=0, **asked)
    assert difference(beauty(scene, pose=IN_PLACE, **asked), by_camera) < 1e-3
    assert difference(beauty(scene, pose=BESIDE, **asked), by_camera) > 0.1


def test_what_is_traced_beside_is_what_is_drawn_there(scene):
    """Direct light of punctual lamps is the same for both, but at the edges of shadows."""
    layers = {"layers": ["direct"], "pose": BESIDE}
    drawn = scene.render(size=SIZE, technique="direct", **layers).layers["direct"]
    traced = scene.render(size=SIZE, technique="reference", parameters={"spp": 2}, **layers).layers["direct"]
    lit = (drawn.max(axis=-1) > 0) | (traced.max(axis=-1) > 0)
    assert lit.mean() > 0.1
    assert numpy.median(numpy.abs(drawn - traced)[lit]) < 1e-3 * traced[lit].mean()


def test_samples_of_a_pose_go_on(scene):
    whole = beauty(scene, pose=BESIDE, fresh="all", **REFERENCE)
    few = {"technique": "reference", "parameters": {"spp": 4}}
    assert (beauty(scene, pose=BESIDE, fresh="all", **few) != whole).any()
    beauty(scene, pose=IN_PLACE, fresh="all", **few)
    assert (beauty(scene, pose=BESIDE, **REFERENCE) == whole).all()


def test_a_check_through_a_pose_finds_the_cameras_error(scene):
    asked = {"size": SIZE, "encoding": "none", "check": 128}
    errors = [scene.render(**asked, **look).report["error"][0] for look in ({"camera": 0}, {"pose": IN_PLACE}, {"pose": BESIDE})]
    assert errors[1]["value"] == pytest.approx(errors[0]["value"], rel=0.02)
    # Beside, other things are seen, and as well as there.
    assert errors[2]["value"] != pytest.approx(errors[0]["value"], rel=1e-6)
    assert errors[2]["value"] < 1.5 * errors[0]["value"]


def test_a_view_that_moves_shows_the_reference(scene):
    with scene.view(size=SIZE, encoding="half", refine=False, pose=IN_PLACE, **REFERENCE) as view:
        view.next(timeout_s=60)
        last = view.update(pose=BESIDE)
        frame = view.next(timeout_s=60)
        while frame.sequence != last:
            frame = view.next(timeout_s=60)
    shown = frame.rgba[..., :3].astype(float)
    assert difference(shown, beauty(scene, pose=BESIDE, **REFERENCE)) < 1e-3
    assert difference(shown, beauty(scene, pose=IN_PLACE, **REFERENCE)) > 0.1
