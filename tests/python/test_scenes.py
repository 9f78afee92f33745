"""Scenes and frames from a real daemon that renders gradients."""
import json
import struct
import warnings

import bounced
import numpy
import pytest
from conftest import SCENES


def test_add_list_get_remove(daemon):
    scene = daemon.scenes.add(SCENES / "cornell.glb", name="a box")
    info = scene.info()
    assert (info["name"], info["revision"], info["counts"]["lights"]) == ("a box", 1, 1)
    assert info["cameras"] == ["Camera"] and info["bounds_max"][1] == 2.0
    assert [entry["id"] for entry in daemon.scenes.list()] == [scene.id]
    assert [other.id for other in daemon.scenes] == [scene.id]
    assert daemon.scenes.get(scene.id).revision == 1
    scene.remove()
    assert daemon.scenes.list() == []
    with pytest.raises(bounced.NotFound):
        daemon.scenes.remove(scene.id)


def test_a_gltf_with_its_files(daemon, tmp_path):
    glb = (SCENES / "cornell.glb").read_bytes()
    size = struct.unpack_from("<I", glb, 12)[0]
    root = json.loads(glb[20:20 + size])
    root["buffers"][0]["uri"] = "the%20bytes.bin"
    (tmp_path / "the bytes.bin").write_bytes(glb[28 + size:])
    (tmp_path / "cornell.gltf").write_text(json.dumps(root))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        counts = daemon.scenes.add(tmp_path / "cornell.gltf").info()["counts"]
    assert counts == daemon.scenes.add(SCENES / "cornell.glb").info()["counts"]


def test_a_scene_that_cannot_be_read(daemon, tmp_path):
    (tmp_path / "bad.glb").write_bytes(struct.pack("<4sII", b"glTF", 2, 12) + b"nonsense")
    with pytest.raises(bounced.BadInput):
        daemon.scenes.add(tmp_path / "bad.glb")


def test_environments(daemon):
    plain = daemon.scenes.add(SCENES / "cornell.glb").info()["hash"]
    sky = bounced.Environment(radiance=(1, 2, 3))
    assert daemon.scenes.add(SCENES / "cornell.glb", environment=sky).info()["hash"] != plain
    assert daemon.render(SCENES / "cornell.glb", environment=sky, size=(4, 4)).width == 4


def expect_gradient(height, width):
    y, x = numpy.mgrid[:height, :width]
    return numpy.float32(0.01) * (x + y + 1).astype(numpy.float32)


def test_a_frame_is_floats(scene):
    frame = scene.render(size=(6, 4), layers=["direct", "normal", "depth"], aa=1)
    assert (frame.width, frame.height, frame.encoding) == (6, 4, "exr")
    assert frame.rgba.shape == (4, 6, 4) and frame.rgba.dtype == numpy.float32
    numpy.testing.assert_allclose(frame.rgba[..., 0], expect_gradient(4, 6), rtol=1e-6)
    assert (frame.rgba[..., 3] == 1).all()
    shapes = {name: layer.shape for name, layer in frame.layers.items()}
    assert shapes == {"beauty": (4, 6, 4), "direct": (4, 6, 3), "normal": (4, 6, 3),
                      "depth": (4, 6)}
    numpy.testing.assert_allclose(frame.layers["normal"][..., 2], expect_gradient(4, 6) + 0.02,
                                  rtol=1e-6)
    assert frame.report["stopped"] == "complete" and frame.report["passes"][0]["name"] == "gbuffer"
    assert frame.report["flags"] == ["default_lights"]
    assert frame.attributes  # the manifest


def test_pngs_and_jpegs_are_bytes_for_the_eye(scene, tmp_path):
    pytest.importorskip("PIL.Image")
    for encoding, head in (("png", b"\x89PNG"), ("jpeg", b"\xff\xd8")):
        frame = scene.render(size=(16, 8), encoding=encoding, exposure=1, tonemap="linear")
        assert frame.data.startswith(head) and frame.encoding == encoding
        assert frame.rgba.shape == (8, 16, 4) and frame.rgba.dtype == numpy.uint8
        assert frame.rgba[0, 0, 0] < frame.rgba[-1, -1, 0] and frame.rgba[0, 0, 3] == 255
        with pytest.raises(bounced.Error) as caught:
            frame.layers
        assert caught.value.code == "usage"
        frame.save(tmp_path / "picture")
        assert (tmp_path / "picture").read_bytes() == frame.data
    assert [path.name for path in tmp_path.iterdir() if "part" in path.name] == []


def test_the_report_alone_and_a_plan(scene):
    for options in ({"encoding": "none"}, {"plan_only": True}):
        frame = scene.render(size=(8, 8), **options)
        assert frame.encoding == "" and frame.data == b"" and frame.report["size"] == [8, 8]
        with pytest.raises(bounced.Error):
            frame.rgba


def test_options_arrive(scene):
    frame = scene.render(size=(8, 4), technique="hisr", parameters={"vpls": 64, "brdf": "lambert"},
                         camera=0, seed=9, aa=2)
    report = frame.report
    assert (report["technique"], report["seed"], report["aa"]) == ("hisr", 9, 2)
    assert report["parameters"] == {"vpls": 64, "brdf": "lambert"}


@pytest.mark.parametrize("options,field", [
    ({"size": (0, 4)}, "size"), ({"encoding": "tiff"}, "encoding"), ({"tonemap": "x"}, "tonemap"),
    ({"exposure": "bright"}, "exposure"), ({"technique": "x" * 40}, "technique")])
def test_options_that_the_daemon_refuses(scene, options, field):
    with pytest.raises(bounced.Error) as caught:
        scene.render(**options)
    assert caught.value.field.endswith(field)


def test_options_that_there_are_not(scene):
    with pytest.raises(TypeError, match="sise"):
        scene.render(sise=(4, 4))
    with pytest.raises(TypeError, match="not both"):
        scene.render(camera=0, pose=bounced.Pose((0, 0, 1), (0, 0, 0)))


def test_frames_of_a_file_that_is_not_kept(daemon):
    pending = [daemon.render_later(SCENES / "cornell.glb", size=(8, 8), seed=seed)
               for seed in range(3)]
    assert [frame.result(30).report["seed"] for frame in pending] == [0, 1, 2]
    assert daemon.scenes.list() == []


def test_techniques_devices_stats(daemon):
    techniques = {technique["name"]: technique for technique in daemon.techniques()}
    assert techniques["rsm"]["model"]["indirect_bounces"] == 1
    assert daemon.devices()[0]["in_use"] is True
    assert daemon.stats()["jobs_running"] == 0
