"""What is passed wrongly is refused here, before anything is sent, by its parameter's name, with what is due
and what came."""
import numpy
import pytest

import bounced
from bounced.frame import FrameOptions
from bounced.messages import pb
from conftest import SCENES


@pytest.mark.parametrize("options,kind,says", [
    ({"size": "64x48"}, TypeError, "size: a sequence of 2 numbers is due, not '64x48' (str)"),
    ({"size": 64}, TypeError, "size: a sequence of 2 numbers is due, not 64 (int)"),
    ({"size": (64,)}, ValueError, "size: a sequence of 2 numbers is due, not 1"),
    ({"size": (64, 48.5)}, TypeError, "size[1]: a whole number is due, not 48.5 (float)"),
    ({"size": (64, -1)}, ValueError, "size[1]: a whole number from 0 to 4294967295 is due, not -1"),
    ({"size": {64: 48}}, TypeError, "size: "),
    ({"technique": 3}, TypeError, "technique: a text is due, not 3 (int)"),
    ({"technique": b"rsm"}, TypeError, "technique: a text is due, not b'rsm' (bytes)"),
    ({"parameters": "vpls=64"}, TypeError, "parameters: a dictionary"),
    ({"parameters": [("vpls", 64)]}, TypeError, "parameters: a dictionary"),
    ({"parameters": {1: 64}}, TypeError, "a key of parameters: a text is due, not 1 (int)"),
    ({"camera": 1.5}, TypeError, "camera: a name or an index is due, not 1.5 (float)"),
    ({"camera": True}, TypeError, "camera: a name or an index is due, not True (bool)"),
    ({"pose": ((0, 0, 1), (0, 0, 0))}, TypeError, "pose: a bounced.Pose is due"),
    ({"pose": bounced.Pose(1, (0, 0, 0))}, TypeError, "pose.eye: a sequence of 3 numbers is due, not 1 (int)"),
    ({"pose": bounced.Pose((0, 0), (0, 0, 0))}, ValueError, "pose.eye: a sequence of 3 numbers is due, not 2"),
    ({"pose": bounced.Pose((0, 0, 1), (0, 0, "a"))}, TypeError, "pose.target[2]: a number is due, not 'a' (str)"),
    ({"pose": bounced.Pose((0, 0, 1), (0, 0, 0), yfov="1")}, TypeError, "pose.yfov: a number is due"),
    ({"layers": "depth"}, TypeError, "layers: a sequence of names is due, not 'depth' (str)"),
    ({"layers": ["depth", 3]}, TypeError, "layers[1]: a text is due, not 3 (int)"),
    ({"aa": 2.0}, TypeError, "aa: a whole number is due, not 2.0 (float)"),
    ({"aa": "4"}, TypeError, "aa: a whole number is due, not '4' (str)"),
    ({"aa": True}, TypeError, "aa: a whole number is due, not True (bool)"),
    ({"seed": 1 << 64}, ValueError, "seed: a whole number from 0 to 18446744073709551615 is due"),
    ({"exposure": [1]}, TypeError, 'exposure: "auto" or stops is due, not [1] (list)'),
    ({"exr_half": "yes"}, TypeError, "exr_half: True or False is due, not 'yes' (str)"),
    ({"target_error": "5"}, TypeError, "target_error: a number is due, not '5' (str)"),
    ({"region": (0, 0, 4)}, ValueError, "region: a sequence of 4 numbers is due, not 3"),
])
def test_options_of_frames(daemon, scene, options, kind, says):
    for ask in (scene.render, scene.render_later, scene.view,
                lambda **more: daemon.render(SCENES / "cornell.glb", **more),
                lambda **more: scene.edit(dry_run=True, frame=more)):
        with pytest.raises(kind) as caught:
            ask(**options)
        assert says in str(caught.value)


@pytest.mark.parametrize("call,kind,says", [
    (lambda e: e.add_light(intensity="bright"), TypeError, "intensity: a number is due, not 'bright' (str)"),
    (lambda e: e.add_light(color="red"), TypeError, "color: a sequence of 3 numbers is due, not 'red' (str)"),
    (lambda e: e.add_light(color=(1, 1)), ValueError, "color: a sequence of 3 numbers is due, not 2"),
    (lambda e: e.add_light(kind=1), TypeError, "kind: a text is due, not 1 (int)"),
    (lambda e: e.add_node(translation=3), TypeError, "translation: a sequence of 3 numbers is due"),
    (lambda e: e.add_node(rotation=(0, 0, 1)), ValueError, "rotation: a sequence of 4 numbers is due, not 3"),
    (lambda e: e.add_node(matrix=5), TypeError, "matrix: a table of 4 x 4 numbers is due, not 5 (int)"),
    (lambda e: e.add_node(matrix=[[1, 0, 0, "x"]] * 4), TypeError, "matrix[0][3]: a number is due"),
    (lambda e: e.add_node(light="lamp"), TypeError, "light: an object's id, NONE, or what an operation returned"),
    (lambda e: e.add_node(mesh=1.0), TypeError, "mesh: an object's id"),
    (lambda e: e.add_node(shown=1), TypeError, "shown: True or False is due, not 1 (int)"),
    (lambda e: e.remove_node("0"), TypeError, "node: an object's id"),
    (lambda e: e.add_material(roughness=None, metallic="0.5"), TypeError, "metallic: a number is due"),
    (lambda e: e.add_texture(image=5), TypeError, "image: a path, or the bytes of a picture, is due, not 5"),
    (lambda e: e.add_mesh("cube"), TypeError, "primitives: a bounced.Primitive is due, not 'cube' (str)"),
    (lambda e: e.add_mesh(bounced.Primitive("abc")), TypeError, "positions: an array of n x 3 numbers is due"),
    (lambda e: e.set_environment((1, 2)), ValueError, "radiance: a sequence of 3 numbers is due, not 2"),
    (lambda e: e.import_file(7), TypeError, "file: a path is due, not 7 (int)"),
])
def test_edits(daemon, scene, call, kind, says):
    edit = scene.edit()
    with pytest.raises(kind) as caught:
        call(edit)
    assert says in str(caught.value)
    assert edit.apply() is None  # nothing was written down


@pytest.mark.parametrize("call,kind,says", [
    (lambda d, s: bounced.connect(7480), TypeError, "address: a text is due, not 7480 (int)"),
    (lambda d, s: d.scenes.add(5), TypeError, "file: a path is due, not 5 (int)"),
    (lambda d, s: d.scenes.add(SCENES / "cornell.glb", name=3), TypeError, "name: a text is due, not 3 (int)"),
    (lambda d, s: d.scenes.add(SCENES / "cornell.glb", environment=(1, 1, 1)), TypeError,
     "environment: a bounced.Environment is due, not (1, 1, 1) (tuple)"),
    (lambda d, s: bounced.Environment("white"), TypeError, "radiance: a sequence of 3 numbers is due"),
    (lambda d, s: d.scenes.get(4), TypeError, "scene_id: a text is due, not 4 (int)"),
    (lambda d, s: s.revert(1.0), TypeError, "to: a whole number is due, not 1.0 (float)"),
    (lambda d, s: s.revert(None), TypeError, "to: a revision"),
    (lambda d, s: s.revert(1, base_revision="1"), TypeError, "base_revision: a whole number is due"),
    (lambda d, s: s.undo("1"), TypeError, "base_revision: a whole number is due, not '1' (str)"),
    (lambda d, s: s.undo(scope=True), TypeError, "scope: a text is due, not True (bool)"),
    (lambda d, s: setattr(d, "by", 3), TypeError, "by: a text is due, not 3 (int)"),
    (lambda d, s: s.export(revision=[1]), TypeError, "revision: a whole number is due, not [1] (list)"),
    (lambda d, s: s.export(5), TypeError, "path: a path is due, not 5 (int)"),
    (lambda d, s: s.log(limit="3"), TypeError, "limit: a whole number is due, not '3' (str)"),
    (lambda d, s: s.log(after=-1), ValueError, "after: a whole number from 0"),
    (lambda d, s: s.name_revision(3), TypeError, "name: a text is due, not 3 (int)"),
    (lambda d, s: s.edit(message=3), TypeError, "message: a text is due, not 3 (int)"),
    (lambda d, s: s.view(credits="2"), TypeError, "credits: a whole number is due, not '2' (str)"),
    (lambda d, s: s.view(frames_per_second="2"), TypeError, "frames_per_second: a number is due"),
])
def test_everything_else(daemon, scene, call, kind, says):
    with pytest.raises(kind) as caught:
        call(daemon, scene)
    assert says in str(caught.value)


def test_numbers_of_numpy_are_numbers(scene):
    frame = scene.render(size=numpy.array([8, 4]), aa=numpy.int64(1), seed=numpy.uint8(3), exr_half=numpy.True_,
                         parameters={"vpls": numpy.int32(64)}, camera=numpy.int64(0))
    assert frame.report["size"] == [8, 4] and frame.report["seed"] == 3
    with scene.edit() as edit:
        lamp = edit.add_light(kind="point", intensity=numpy.float32(2), color=numpy.ones(3))
        edit.add_node(light=lamp, matrix=numpy.eye(4), name="lamp")
    assert edit.result.revision == 2
