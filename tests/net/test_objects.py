"""What a scene says of its objects, its edits take: every object of every scene at hand."""
import pathlib

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


def test_the_nearest_of_a_parallel_camera_may_be_where_it_is(shared):
    """As in glTF; not so of one with a perspective."""
    client, scene = shared.framed(), shared.add_scene("orthographic.glb")
    for orthographic, body in ((True, "edit_reply"), (False, "error")):
        edit = pb.CameraEdit(camera=0, orthographic=orthographic, near=0, yfov=1)
        answer = client.ask(pb.Envelope(edit_batch=pb.EditBatch(scene=scene, ops=[pb.EditOp(set_camera=edit)])))[0]
        assert answer.WhichOneof("body") == body
    assert answer.error.details.field == "ops[0].set_camera.near"
