"""Edits: what is sent for what is said, against a made-up daemon."""
import bounced
import numpy
import pytest
from conftest import SCENES
from fake_peer import FakePeer


def answer_edits(peer, **fields):
    """Answers as a daemon would that has forty objects already."""
    def on_batch(made_up, envelope, _):
        ids = [40 + k if op.WhichOneof("op").startswith(("add_", "import")) else -1
               for k, op in enumerate(envelope.edit_batch.ops)]
        made_up.answer(envelope, edit_reply={"revision": 2, "ids": ids, "hash": "sha256:1",
                                             **fields})

    peer.on("edit_batch", on_batch)


@pytest.fixture
def scene(peer):
    answer_edits(peer)
    return bounced.Scene(peer.client._conn, "s1")


def sent(peer, count=1):
    return peer.wait_for("edit_batch", count)[-1]


def test_references_within_a_batch_and_behind_it(peer, scene):
    with scene.edit(message="a lamp") as edit:
        edit.set_node(3, shown=False)
        lamp = edit.add_light(kind="spot", intensity=5, color=(1, 0.5, 0))
        node = edit.add_node(light=lamp, translation=(0, 1, 0), parent=bounced.NONE, name="lamp")
        edit.set_node(node, scale=(2, 2, 2))
        with pytest.raises(ValueError):
            lamp.id
    batch, payload = sent(peer)
    assert payload == b"" and batch.scene == "s1" and batch.message == "a lamp"
    assert not batch.HasField("base_revision") and not batch.HasField("durability")
    hide, light, held, grown = batch.ops
    assert (hide.set_node.node, hide.set_node.shown) == (3, False)
    assert not hide.set_node.HasField("transform") and not hide.set_node.HasField("light")
    assert (light.add_light.kind, light.add_light.intensity) == ("spot", 5)
    assert list(light.add_light.color) == [1, 0.5, 0] and not light.add_light.HasField("light")
    assert (held.add_node.light, held.add_node.parent, held.add_node.name) == (-3, -1, "lamp")
    assert list(held.add_node.transform.translation) == [0, 1, 0]
    assert not held.add_node.transform.HasField("node") and not held.add_node.HasField("shown")
    assert grown.set_node.node == -4 and list(grown.set_node.transform.scale) == [2, 2, 2]
    assert (lamp.id, node.id) == (41, 42) and edit.result.revision == 2
    with scene.edit() as later:
        later.set_light(lamp, intensity=7)
        later.remove_node(node)
    batch, _ = sent(peer, 2)
    assert (batch.ops[0].set_light.light, batch.ops[1].remove_node.id) == (41, 42)


def test_nothing_is_sent_if_the_body_raises_or_is_empty(peer, scene):
    with pytest.raises(ZeroDivisionError):
        with scene.edit() as edit:
            edit.add_light(kind="point")
            edit.add_texture(image=b"not sent either")
            1 // 0
    with scene.edit() as edit:
        pass
    assert edit.result is None and peer.asked == []


def test_a_handle_of_a_batch_that_was_not_applied_means_nothing(scene):
    edit = scene.edit()
    lamp = edit.add_light(kind="point")
    with pytest.raises(ValueError, match="not applied"):
        scene.edit().add_node(light=lamp)


def test_what_is_wrong_is_said_at_once_and_leaves_the_batch_as_it_was(peer, scene):
    with scene.edit() as edit:
        for wrong, kind in (
                (lambda: edit.add_light(intensty=3), TypeError),
                (lambda: edit.add_light(intensity="bright"), TypeError),
                (lambda: edit.add_node(mesh=-2), ValueError),
                (lambda: edit.add_node(matrix=[[1, 0], [0, 1]]), ValueError),
                (lambda: edit.remove_mesh(-5), ValueError),
                (lambda: edit.add_mesh(bounced.Primitive([[0, 1]])), ValueError),
                (lambda: edit.add_mesh(bounced.Primitive([[0, 1, 2]], indices=[0, 1])), ValueError),
                (lambda: edit.add_mesh(bounced.Primitive([[0, 1, 2]], indices=[0, 1, 0.5])),
                 ValueError),
                (lambda: edit.add_mesh(bounced.Primitive([[0, 1, 2]], indices=[0, 0, 1])),
                 ValueError),
                (lambda: edit.add_mesh(bounced.Primitive([[0, 1, 2]], normals=[[0, 1, 0]] * 2)),
                 ValueError),
                (lambda: edit.set_mesh_vertices(0, [[1, 2]]), ValueError)):
            with pytest.raises(kind):
                wrong()
        edit.remove_light(0)
    batch, payload = sent(peer)
    assert [op.WhichOneof("op") for op in batch.ops] == ["remove_light"] and payload == b""


def floats(payload, data):
    assert data.payload and data.offset % 4 == 0 and not data.values
    return numpy.frombuffer(payload[data.offset:data.offset + data.size_bytes], "<f4")


def test_arrays_travel_in_the_payload(peer, scene):
    positions = numpy.arange(12, dtype=numpy.float32).reshape(4, 3)
    with scene.edit() as edit:
        white = edit.add_material(base_color=(1, 1, 1, 1), roughness=0.5)
        mesh = edit.add_mesh(
            bounced.Primitive(positions, indices=[[0, 1, 2], [0, 2, 3]], uv0=numpy.ones((4, 2)),
                              material=white),
            bounced.Primitive(positions[:3] + 1), name="two")
        edit.set_mesh_vertices(7, positions.T.reshape(4, 3), primitive=1,
                               normals=numpy.ones((4, 3)))
        positions[:] = 0  # what was given has been taken
        edit.add_node(mesh=mesh)
    batch, payload = sent(peer)
    first, second = batch.ops[1].add_mesh.primitives
    assert first.material == -2 and not second.HasField("material")
    assert (floats(payload, first.positions) == numpy.arange(12)).all()
    indices = payload[first.indices.offset:first.indices.offset + first.indices.size_bytes]
    assert numpy.frombuffer(indices, "<u4").tolist() == [0, 1, 2, 0, 2, 3]
    assert (floats(payload, first.uv0) == 1).all() and first.uv0.size_bytes == 32
    assert (floats(payload, second.positions) == numpy.arange(9) + 1).all()
    assert not second.HasField("indices") and not first.HasField("normals")
    vertices = batch.ops[2].set_mesh_vertices
    assert (vertices.mesh, vertices.primitive) == (7, 1)
    assert floats(payload, vertices.positions).tolist() == numpy.arange(
        12.0).reshape(4, 3).T.reshape(4, 3).ravel().tolist()
    assert (floats(payload, vertices.normals) == 1).all()
    assert batch.ops[3].add_node.mesh == -3


def test_arrays_beyond_the_message_travel_as_blobs():
    with FakePeer(message_bytes=8192) as peer:
        answer_edits(peer)
        scene = bounced.Scene(peer.client._conn, "s1")
        large = numpy.arange(3000, dtype=numpy.float32).reshape(1000, 3)
        with scene.edit() as edit:
            edit.add_mesh(bounced.Primitive(large, indices=numpy.arange(999)))
            edit.set_mesh_vertices(0, large[:10])
        batch, payload = sent(peer)
        assert len(payload) + batch.ByteSize() < 8192
        primitive = batch.ops[0].add_mesh.primitives[0]
        assert not primitive.positions.payload
        assert peer.blobs[primitive.positions.blob] == large.tobytes()
        few = floats(payload, batch.ops[1].set_mesh_vertices.positions)
        assert (few == large[:10].ravel()).all()


def test_matrices_go_out_in_columns(peer, scene):
    matrix = numpy.eye(4)
    matrix[:3, 3] = (7, 8, 9)
    with scene.edit() as edit:
        edit.set_transform(3, matrix=matrix)
    batch, _ = sent(peer)
    columns = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1]
    assert list(batch.ops[0].set_transform.matrix) == columns
    assert batch.ops[0].set_transform.node == 3


def test_pictures_skies_and_files_are_uploaded_first(peer, scene, tmp_path):
    (tmp_path / "a.png").write_bytes(b"png")
    (tmp_path / "sky.exr").write_bytes(b"exr")
    with scene.edit() as edit:
        one = edit.add_texture(image=tmp_path / "a.png", wrap_s="clamp")
        edit.set_texture(3, image=b"other", nearest=True)
        edit.set_material(0, base_color_texture=one)
        edit.set_environment(radiance=(1, 1, 1), map=tmp_path / "sky.exr")
        edit.import_file(SCENES / "bare.gltf", parent=bounced.NONE)
        assert peer.asked == []
    bodies = [body for body, _, _ in peer.asked]
    assert bodies[0] == "blob_have" and bodies[-1] == "edit_batch"
    batch, _ = sent(peer)
    texture, other, material, sky, imported = batch.ops
    assert peer.blobs[texture.add_texture.blob] == b"png" and texture.add_texture.wrap_s == "clamp"
    assert peer.blobs[other.set_texture.blob] == b"other" and other.set_texture.nearest
    assert material.set_material.base_color_texture == -2
    assert peer.blobs[sky.set_environment.map] == b"exr"
    message = getattr(imported, "import")
    assert message.parent == -1 and message.name == "bare.gltf"
    assert peer.blobs[message.blob] == (SCENES / "bare.gltf").read_bytes()
    assert {pair.key: peer.blobs[pair.value] for pair in message.files} == {
        "bare.bin": (SCENES / "bare.bin").read_bytes()}


def test_transient_dry_run_and_ids(peer, scene):
    with scene.edit(transient=True, base_revision=4, client_edit_id="drag") as edit:
        edit.set_light(0, intensity=2)
    batch, _ = sent(peer)
    assert (batch.durability, batch.base_revision, batch.client_edit_id) == ("transient", 4, "drag")
    answer_edits(peer, invalidates=["shadow_map"], keeps=["gbuffer"])
    with scene.edit(dry_run=True, frame={"size": (8, 8), "technique": "rsm"}) as edit:
        lamp = edit.add_light(kind="point")
    batch, _ = sent(peer, 2)
    assert not batch.HasField("client_edit_id")  # what is not kept needs none
    assert batch.dry_run and list(batch.frame.size) == [8, 8] and batch.frame.technique == "rsm"
    assert (edit.result.invalidates, edit.result.keeps) == (["shadow_map"], ["gbuffer"])
    with pytest.raises(ValueError):
        lamp.id  # it was not added
    with pytest.raises(TypeError):
        scene.edit(frame={"size": (8, 8)})


def test_a_refused_batch_can_be_told_apart_and_tried_again(peer, scene):
    peer.on("edit_batch", lambda made_up, envelope, _: made_up.refuse(
        envelope, "bad_input", "intensity is -1", "ops[0].set_light.intensity"))
    edit = scene.edit()
    edit.set_light(0, intensity=-1)
    with pytest.raises(bounced.BadInput) as caught:
        edit.apply()
    assert caught.value.field == "ops[0].set_light.intensity" and edit.result is None
    peer.on("edit_batch", lambda made_up, envelope, _: made_up.refuse(
        envelope, "conflict", "the revision is 5, not 4", "base_revision"))
    with pytest.raises(bounced.Conflict):
        edit.apply()
    answer_edits(peer)
    assert edit.apply().revision == 2
    with pytest.raises(ValueError, match="already"):
        edit.apply()


def test_history(peer, scene, tmp_path):
    def on_edit(made_up, envelope, _):
        made_up.answer(envelope, edit_reply={"revision": 9})

    for body in ("edit_undo", "edit_revert", "edit_commit"):
        peer.on(body, on_edit)
    peer.on("revision_name", lambda made_up, envelope, _: made_up.answer(envelope, done={}))
    peer.on("scene_log", lambda made_up, envelope, _: made_up.answer(envelope, scene_log_reply={
        "entries": [{"revision": 1, "kind": "import"}, {"revision": 2, "changes": ["light 0"]}]}))
    peer.on("scene_export", lambda made_up, envelope, _: made_up.answer(
        envelope, b"glTF", scene_export_reply={"revision": 9}))
    assert scene.undo().revision == 9 and scene.redo(base_revision=3).revision == 9
    assert scene.revert(4).revision == 9 and scene.revert("before lunch").revision == 9
    assert scene.commit(client_edit_id="c").revision == 9
    scene.name_revision("before lunch", 4)
    scene.forget_name("before lunch")
    assert [entry["revision"] for entry in scene.log(after=0, limit=5)] == [1, 2]
    assert scene.export(tmp_path / "out.glb") == b"glTF"
    assert (tmp_path / "out.glb").read_bytes() == b"glTF"
    asked = [message for _, message, _ in peer.asked]
    undo, redo, revert, named, commit, name, forget, log, _ = asked
    assert not undo.redo and redo.redo and redo.base_revision == 3
    assert revert.revision == 4 and not revert.HasField("name")
    assert named.name == "before lunch" and not named.HasField("revision")
    assert commit.client_edit_id == "c"
    assert (name.name, name.revision, name.remove) == ("before lunch", 4, False)
    assert forget.remove and (log.after, log.limit) == (0, 5)


def test_objects(peer, scene):
    peer.on("scene_get", lambda made_up, envelope, _: made_up.answer(envelope, scene={
        "id": "s1", "objects": [
            {"kind": "light", "id": 0, "light": {"kind": "spot", "intensity": 3}},
            {"kind": "node", "id": 4, "node": {"light": 0}}]}))
    assert [item["id"] for item in scene.objects()] == [0, 4]
    [light] = scene.objects("light")
    assert light["light"]["intensity"] == 3
    assert peer.asked[0][1].objects
