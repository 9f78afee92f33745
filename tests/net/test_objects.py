"""What a scene says of its objects, its edits take: every object of every scene at hand."""
import json

import pytest
from conftest import SCENES, blob_name, bounced_pb2 as pb

SHARED = SCENES.parents[1].parent / "shared/scenes/conformance"
FILES = sorted(SCENES.glob("*.glb")) + sorted(SHARED.glob("*.glb"))
SAID_KINDS = {"node", "material", "texture", "light", "camera"}  # a mesh has its name alone


def set_of(said):
    """The operation that sets the object to what is said of it."""
    operation = pb.EditOp()
    message = getattr(operation, "set_" + said.kind)
    message.CopyFrom(getattr(said, said.kind))
    setattr(message, said.kind, said.id)
    return operation


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_an_edit_takes_what_is_said_of_every_object(shared, file):
    client = shared.framed()
    shared.put_blob(file.read_bytes())
    scene = client.ask(pb.Envelope(scene_add=pb.SceneAdd(blob=blob_name(file.read_bytes()), name=file.stem)))[0].scene
    get = pb.Envelope(scene_get=pb.SceneGet(id=scene.id, objects=True))
    before = [said for said in client.ask(get)[0].scene.objects if said.kind in SAID_KINDS]
    assert before
    for said in before:
        answer = client.ask(pb.Envelope(edit_batch=pb.EditBatch(scene=scene.id, ops=[set_of(said)])))[0]
        assert answer.WhichOneof("body") == "edit_reply", (said, answer.error)
    after = [said for said in client.ask(get)[0].scene.objects if said.kind in SAID_KINDS]
    assert after == before


# Numbers at the ends of their ranges and beyond, which an import clamps: what it then says, edits take.
EXTREMES = {
    "asset": {"version": "2.0"}, "scenes": [{"nodes": [0, 1, 2, 3]}],
    "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_emissive_strength", "KHR_materials_ior", "KHR_materials_volume"],
    "nodes": [{"camera": 0}, {"camera": 1}, {"extensions": {"KHR_lights_punctual": {"light": 0}}}, {"extensions": {"KHR_lights_punctual": {"light": 1}}}],
    "cameras": [{"type": "perspective", "perspective": {"yfov": 9, "znear": 1e-60, "zfar": 1e30}},
                {"type": "orthographic", "orthographic": {"xmag": -1e30, "ymag": 1e-12, "znear": 1e30, "zfar": 1e31}}],
    "extensions": {"KHR_lights_punctual": {"lights": [
        {"type": "spot", "color": [1e30, 1e38, -1], "intensity": 1e300, "range": 1e15, "spot": {"outerConeAngle": 1.5707963267948966, "innerConeAngle": 1.5707963}},
        {"type": "spot", "intensity": -5, "range": 1e-38, "spot": {"outerConeAngle": 1e-9, "innerConeAngle": 0}}]}},
    "materials": [
        {"emissiveFactor": [1, 2, -1], "alphaCutoff": 1e30, "alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorFactor": [1.5, -1, 0, 1], "metallicFactor": 7},
         "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 1e38}, "KHR_materials_ior": {"ior": 0.5},
                        "KHR_materials_volume": {"thicknessFactor": 1e20, "attenuationDistance": 3.4e38, "attenuationColor": [2, 0, 0]}}},
        {"extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 1e30}, "KHR_materials_ior": {"ior": 1e9}}, "emissiveFactor": [1, 1, 1]}],
}


def test_what_an_import_clamps_is_taken(shared, tmp_path):
    file = tmp_path / "extremes.gltf"
    file.write_text(json.dumps(EXTREMES))
    test_an_edit_takes_what_is_said_of_every_object(shared, file)


def test_the_nearest_of_a_parallel_camera_may_be_where_it_is(shared):
    """As in glTF; not so of one with a perspective."""
    client, scene = shared.framed(), shared.add_scene("orthographic.glb")
    for orthographic, body in ((True, "edit_reply"), (False, "error")):
        edit = pb.CameraEdit(camera=0, orthographic=orthographic, near=0, yfov=1)
        answer = client.ask(pb.Envelope(edit_batch=pb.EditBatch(scene=scene, ops=[pb.EditOp(set_camera=edit)])))[0]
        assert answer.WhichOneof("body") == body
    assert answer.error.details.field == "ops[0].set_camera.near"
