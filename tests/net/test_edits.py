"""Edits through the whole daemon: batches, conflicts, repeats, undo, transient changes, names, the log,
and what is left after the daemon died."""
import json
import resource
import signal
import sqlite3
import struct
import time

import bounced_pb2
import pytest
from conftest import ANSWER_S, SCENES, Daemon, Framed, blob_name, pack

pb = bounced_pb2


class Scene:
    """One scene of a daemon, spoken to over a framed connection."""

    def __init__(self, daemon, file="two_lights.glb", scene_id=None):
        self.daemon = daemon
        self.client = daemon.framed()
        self.id = scene_id or daemon.add_scene(file)

    def ask(self, payload=b"", **bodies):
        envelope = pb.Envelope()
        for name, body in bodies.items():
            getattr(envelope, name).CopyFrom(body)
        return self.client.ask(envelope, payload)[0]

    def edit(self, *ops, payload=b"", **fields):
        batch = pb.EditBatch(scene=self.id, ops=[pb.EditOp(**op) for op in ops], **fields)
        return self.ask(payload, edit_batch=batch)

    def dim(self, intensity, **fields):
        return self.edit({"set_light": {"light": 0, "intensity": intensity}}, **fields)

    def undo(self, **fields):
        return self.ask(edit_undo=pb.EditUndo(scene=self.id, **fields))

    def get(self):
        return self.ask(scene_get=pb.SceneGet(id=self.id, objects=True)).scene

    def object(self, kind, index):
        return next(o for o in self.get().objects if o.kind == kind and o.id == index)

    def intensity(self):
        return self.object("light", 0).light.intensity

    def log(self, **fields):
        return self.ask(scene_log=pb.SceneLog(scene=self.id, **fields)).scene_log_reply


@pytest.fixture
def scene(start):
    scene = Scene(start())
    yield scene
    scene.client.close()  # a daemon that ends waits for its clients


def fault_of(answer):
    assert answer.WhichOneof("body") == "error", answer
    return answer.error.code, answer.error.details.field


# --- batches ----------------------------------------------------------------------------------


def test_a_batch_makes_a_revision(scene):
    before = scene.get()
    reply = scene.dim(7, base_revision=1).edit_reply
    assert (reply.revision, list(reply.ids)) == (2, [-1])
    after = scene.get()
    assert after.revision == 2 and after.hash == reply.hash != before.hash
    assert scene.intensity() == 7


def test_what_a_batch_adds_is_named_by_later_operations(scene):
    reply = scene.edit({"add_light": {"kind": "spot", "intensity": 9, "cone_outer": .5}},
                       {"add_node": {"name": "lamp", "light": -2,
                                     "transform": {"translation": [0, 1, 2]}}}).edit_reply
    light, node = reply.ids
    assert light >= 0 and node >= 0
    lamp = scene.object("node", node)
    assert lamp.name == "lamp" and lamp.node.light == light
    assert list(lamp.world_from_node)[12:15] == [0, 1, 2]
    assert scene.get().counts.lights == 3


def test_a_batch_applies_wholly_or_not_at_all(scene):
    before = scene.get().hash
    answer = scene.edit({"set_light": {"light": 0, "intensity": 7}},
                        {"set_light": {"light": 1, "intensity": -1}})
    assert fault_of(answer) == ("usage", "ops[1].set_light.intensity")
    assert "\n" not in answer.error.message
    assert scene.get().hash == before and scene.get().revision == 1


@pytest.mark.parametrize("op, code, field", [
    ({"set_light": {"light": 99, "intensity": 1}}, "not_found", "ops[0].set_light.light"),
    ({"set_light": {"intensity": 1}}, "usage", "ops[0].set_light"),
    ({"set_light": {"light": 0, "kind": "laser"}}, "usage", "ops[0].set_light.kind"),
    ({"set_light": {"light": 0, "color": [1, 1]}}, "usage", "ops[0].set_light.color"),
    ({"add_light": {"light": 5}}, "usage", "ops[0].add_light"),
    ({"set_material": {"material": 0, "roughness": 2}}, "usage", "ops[0].set_material.roughness"),
    ({"set_transform": {"node": 0, "scale": [1, float("nan"), 1]}}, "usage",
     "ops[0].set_transform.scale"),
    ({"remove_light": {"id": 0}}, "conflict", "ops[0].remove_light"),
    ({"add_texture": {}}, "usage", "ops[0].add_texture.blob"),
    ({"add_texture": {"blob": "sha256:" + "0" * 64}}, "not_found", None),
    ({"add_mesh": {"primitives": [{}]}}, "usage", "ops[0].add_mesh.primitives[0].positions"),
    ({"set_environment": {"radiance": [1, 2]}}, "usage", "ops[0].set_environment.radiance"),
    ({}, "unsupported", "ops[0]"),
])
def test_refusals_name_the_field(scene, op, code, field):
    answer = scene.edit(op)
    got = fault_of(answer)
    assert got[0] == code and (field is None or got[1].startswith(field)), answer.error
    assert scene.get().revision == 1


@pytest.mark.parametrize("path, body, field, hint", [
    ("edits", {"ops": [{"set_light": {"light": 0, "intensity": 5}},
                       {"set_node": {"node": 0, "translation": [1, 2, 3]}}]},
     "ops[1].set_node.translation", "transform.translation"),
    ("edits", {"ops": [{"set_light": {"light": 0, "intensty": 5}}]}, "ops[0].set_light.intensty", "intensity"),
    ("edits", {"ops": [{"set_lihgt": {"light": 0}}]}, "ops[0].set_lihgt", "set_light"),
    ("edits", {"ops": [{"add_mesh": {"primitives": [{"positons": {}}]}}]},
     "ops[0].add_mesh.primitives[0].positons", "positions"),
    ("edits", {"ops": [{"set_light": {"light": 0}}], "dry_rnu": True}, "dry_rnu", "dry_run"),
    ("edits", {"ops": [{"set_light": {"light": 0}}], "somewhere": {}}, "somewhere", None),
    ("undo", {"redo": True, "n": 1}, "n", None), ("revert", {"revison": 1}, "revison", "revision"),
    ("names", {"revision": 1, "nmae": "x"}, "nmae", "name"), ("commit", {"x": 1}, "x", None),
])
def test_a_name_that_is_not_there_moves_nothing(scene, path, body, field, hint):
    status, error = scene.daemon.json("POST", f"/v1/scenes/{scene.id}/{path}", body)
    assert (status, error["code"], error["details"]["field"]) == (400, "usage", field), error
    assert field in error["message"] and (f'did you mean "{hint}"?' in error["message"]) == bool(hint), error
    assert scene.get().revision == 1 and scene.intensity() != 5


# A number that no message of ours uses, with a text behind it.
UNKNOWN = b"\xfa\x3f\x03abc"  # field 1023


def with_unknown(message):
    return type(message).FromString(message.SerializeToString() + UNKNOWN)


def test_an_unknown_field_is_refused_within_an_operation_alone(scene):
    light = pb.LightEdit(light=0, intensity=5)
    mesh = pb.MeshEdit(primitives=[with_unknown(pb.PrimitiveEdit(positions=pb.Data(values=[0] * 9)))])
    for op, field in ((pb.EditOp(set_light=with_unknown(light)), "ops[0].set_light"),
                      (with_unknown(pb.EditOp(set_light=light)), "ops[0]"),
                      (pb.EditOp(add_mesh=mesh), "ops[0].add_mesh.primitives[0]")):
        batch = pb.EditBatch(scene=scene.id, ops=[op])
        answer = scene.ask(edit_batch=batch)
        assert fault_of(answer) == ("unsupported", field) and "1023" in answer.error.message
        status, _, text = scene.daemon.request(
            "POST", f"/v1/scenes/{scene.id}/edits", batch.SerializeToString(),
            {"Content-Type": "application/x-protobuf"})
        assert status == 400 and field in json.loads(text)["message"]
        assert scene.get().revision == 1
    batch = with_unknown(pb.EditBatch(scene=scene.id, ops=[pb.EditOp(set_light=light)]))
    assert scene.ask(edit_batch=batch).edit_reply.revision == 2


def test_an_empty_batch_and_a_missing_scene(scene):
    assert fault_of(scene.edit()) == ("usage", "ops")
    assert fault_of(scene.ask(edit_batch=pb.EditBatch(scene="nowhere"))) == ("not_found", "scene")
    assert fault_of(scene.edit({"set_light": {"light": 0}}, durability="maybe")) == (
        "usage", "durability")
    assert fault_of(scene.dim(1, client_edit_id="x" * 65)) == ("limit", "client_edit_id")


def test_a_stale_base_is_refused_with_the_current_revision(scene):
    scene.dim(2)
    answer = scene.dim(3, base_revision=1)
    assert fault_of(answer) == ("conflict", "base_revision")
    assert "at revision 2" in answer.error.message
    assert scene.intensity() == 2


def test_an_edit_id_said_again_gets_the_first_answer(scene):
    first = scene.edit({"add_light": {"intensity": 1}}, client_edit_id="e1").edit_reply
    scene.dim(5)
    again = scene.edit({"add_light": {"intensity": 1}}, client_edit_id="e1").edit_reply
    assert again.repeated_id and not first.repeated_id
    assert (again.revision, list(again.ids), again.hash) == (
        first.revision, list(first.ids), first.hash)
    assert scene.get().revision == 3


def test_an_edit_id_means_nothing_where_no_edit_is_made(scene):
    scene.dim(2, client_edit_id="e1")
    reply = scene.dim(3, client_edit_id="e1", dry_run=True).edit_reply
    assert not reply.repeated_id and not reply.revision
    assert fault_of(scene.dim(-3, client_edit_id="e1", dry_run=True))[0] == "usage"
    reply = scene.dim(4, client_edit_id="e1", durability="transient").edit_reply
    assert not reply.repeated_id and reply.transient == 1


def test_edits_of_one_connection_keep_their_order(scene):
    envelopes = []
    for i in range(50):
        envelope = pb.Envelope()
        batch = envelope.edit_batch
        batch.scene = scene.id
        batch.ops.add().set_light.CopyFrom(pb.LightEdit(light=0, intensity=i + 1))
        envelopes.append(scene.client.send(envelope))
    replies = {}
    while len(replies) < 50:
        answer, _ = scene.client.receive()
        replies[answer.request_id] = answer.edit_reply.revision
    assert [replies[i] for i in envelopes] == list(range(2, 52))
    assert scene.intensity() == 50


# --- heavy ------------------------------------------------------------------------------------


TRIANGLE = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)


def test_meshes_from_the_payload(scene):
    reply = scene.edit(
        {"add_mesh": {"name": "t", "primitives": [
            {"positions": {"payload": True, "size_bytes": 36},
             "indices": {"payload": True, "offset": 36}, "material": 0}]}},
        {"add_node": {"mesh": -2}}, payload=TRIANGLE + struct.pack("<3I", 0, 1, 2)).edit_reply
    mesh = scene.object("mesh", reply.ids[0])
    assert mesh.name == "t" and list(mesh.bounds_max) == [1, 1, 0]


def test_vertices_move(scene):
    reply = scene.edit({"add_mesh": {"primitives": [{
        "positions": {"values": [0, 0, 0, 1, 0, 0, 0, 1, 0]},
        "normals": {"values": [0, 0, 1] * 3}}]}}, {"add_node": {"mesh": -2}}).edit_reply
    mesh = reply.ids[0]
    scene.edit({"set_mesh_vertices": {"mesh": mesh, "positions": {
        "values": [0, 0, 0, 2, 0, 0, 0, 3, 0]}}})
    assert list(scene.object("mesh", mesh).bounds_max) == [2, 3, 0]
    answer = scene.edit({"set_mesh_vertices": {"mesh": mesh, "positions": {"values": [0, 0, 0]}}})
    assert fault_of(answer)[0] in ("usage", "limit")
    answer = scene.edit({"set_mesh_vertices": {"mesh": mesh, "positions": {
        "payload": True, "offset": 8}}}, payload=b"1234")
    assert fault_of(answer) == ("usage", "ops[0].set_mesh_vertices.positions")


@pytest.mark.parametrize("primitive, field", [
    ({"positions": {"values": [0, 0, 0, 1, 0, 0, 0, 1, 0]}, "indices": {"values": [0, 1, 3]}},
     "indices"),
    ({"positions": {"values": [0, 0, 0, 1, 0, 0, 0, 1, 0]}, "indices": {"values": [0, 1]}},
     "indices"),
    ({"positions": {"values": [0, 0, 0, 1, 0, 0, 0, 1, 0]}, "indices": {"values": [0, 1, .5]}},
     "indices"),
    ({"positions": {"values": [0, 0, 0, 1, 0, 0, 0, 1]}}, "positions"),
    ({"positions": {"values": [0, 0, 0] * 3}, "normals": {"values": [0, 0, 1]}}, "normals"),
    ({"positions": {"values": [0, 0, 0] * 3, "payload": True}}, "positions"),
])
def test_broken_meshes(scene, primitive, field):
    code, path = fault_of(scene.edit({"add_mesh": {"primitives": [primitive]}}))
    assert (code, path) == ("usage", f"ops[0].add_mesh.primitives[0].{field}")


def test_a_file_under_a_node(scene):
    blob = scene.client.put_blob((SCENES / "checker.glb").read_bytes())
    before = scene.get().counts.triangles
    reply = scene.edit({"import": {"blob": blob, "name": "guest", "parent": 0}}).edit_reply
    guest = scene.object("node", reply.ids[0])
    assert guest.name == "guest" and guest.node.parent == 0
    assert scene.get().counts.triangles > before


# --- undo, revert, names, the log -------------------------------------------------------------


def test_undo_and_redo(scene):
    first = scene.get().hash
    scene.dim(2)
    second = scene.get().hash
    scene.dim(3)
    assert scene.undo().edit_reply.hash == second
    assert scene.undo().edit_reply.hash == first
    assert fault_of(scene.undo()) == ("conflict", "undo")
    assert scene.undo(redo=True).edit_reply.hash == second
    assert scene.get().revision == 6
    kinds = [(entry.kind, entry.of) for entry in scene.log().entries]
    assert kinds == [("import", 0), ("edit", 0), ("edit", 0), ("undo", 3), ("undo", 2), ("redo", 5)]


def test_names_and_reverts(scene):
    scene.dim(2)
    wanted = scene.get().hash
    assert scene.ask(revision_name=pb.RevisionName(scene=scene.id, name="good")).HasField("done")
    scene.dim(3)
    scene.edit({"add_light": {"intensity": 1}})
    reply = scene.ask(edit_revert=pb.EditRevert(scene=scene.id, name="good")).edit_reply
    assert reply.hash == wanted and reply.revision == 5
    assert scene.intensity() == 2
    log = scene.log()
    assert [list(entry.names) for entry in log.entries][1] == ["good"]
    assert log.entries[2].changes[0] == "light 0"
    assert scene.ask(edit_revert=pb.EditRevert(scene=scene.id, revision=1)).edit_reply.revision == 6
    answer = scene.ask(edit_revert=pb.EditRevert(scene=scene.id, name="bad"))
    assert fault_of(answer) == ("not_found", "name")
    answer = scene.ask(edit_revert=pb.EditRevert(scene=scene.id, revision=99))
    assert fault_of(answer)[0] == "not_found"


def test_a_name_that_is_not_there_spoils_nobodys_edit(scene):
    bad = pb.Envelope(revision_name=pb.RevisionName(scene=scene.id, name="none", remove=True))
    good = pb.Envelope(edit_batch=pb.EditBatch(scene=scene.id, ops=[
        pb.EditOp(set_light=pb.LightEdit(light=0, intensity=6))]))
    ids = [scene.client.send(bad), scene.client.send(good)]
    answers = dict((a.request_id, a) for a in (scene.client.receive()[0] for _ in ids))
    assert answers[ids[0]].error.code == "not_found"
    assert answers[ids[1]].edit_reply.revision == 2
    assert scene.dim(7, base_revision=2).edit_reply.revision == 3  # and the next one stands on it
    assert scene.intensity() == 7


# --- transient --------------------------------------------------------------------------------


def test_a_drag_becomes_one_edit(scene):
    for i in range(1, 6):
        reply = scene.dim(i, durability="transient").edit_reply
        assert (reply.revision, reply.transient) == (1, i)
    assert scene.intensity() == 5 and scene.get().revision == 1
    reply = scene.ask(edit_commit=pb.EditCommit(scene=scene.id)).edit_reply
    assert reply.revision == 2 and not reply.transient
    assert len(scene.log().entries) == 2
    scene.undo()
    assert scene.intensity() not in (4, 5)


def test_quiet_commits(scene):
    scene.dim(4, durability="transient")
    until = time.time() + 5
    while scene.get().revision == 1 and time.time() < until:
        time.sleep(.1)
    assert scene.get().revision == 2 and scene.intensity() == 4


def test_a_scene_is_quiet_while_another_is_dragged(scene):
    other = Scene(scene.daemon)
    scene.dim(4, durability="transient")
    until = time.time() + 4
    while scene.get().revision == 1 and time.time() < until:
        other.dim(5, durability="transient")
        time.sleep(.05)
    assert scene.get().revision == 2 and scene.intensity() == 4
    assert (other.get().revision, other.intensity()) == (1, 5)
    other.client.close()


def test_a_commit_answers_for_what_is_on_its_way(scene):
    """Both arrive in one turn of the loop: nothing lies transient, and the edit is not on the disk."""
    bodies = [{"edit_batch": pb.EditBatch(scene=scene.id, ops=[
        pb.EditOp(set_light=pb.LightEdit(light=0, intensity=6))])},
        {"edit_commit": pb.EditCommit(scene=scene.id)}]
    envelopes = [pb.Envelope(request_id=100 + i, **body) for i, body in enumerate(bodies)]
    scene.client.sock.sendall(b"".join(pack(envelope) for envelope in envelopes))
    answers = [scene.client.receive()[0] for _ in envelopes]
    assert [(a.request_id, a.edit_reply.revision) for a in answers] == [(100, 2), (101, 2)]


def test_undo_in_a_drag_takes_the_drag_back(scene):
    before = scene.get().hash
    scene.dim(4, durability="transient")
    assert scene.undo().edit_reply.hash == before


# --- whose it is ------------------------------------------------------------------------------


def paint(scene, color, **fields):
    return scene.edit({"set_light": {"light": 0, "color": color}}, **fields)


def test_undo_takes_back_ones_own(scene):
    """Two on one scene, the other one last: what they did to the same light stays."""
    scene.dim(2, by="anna")
    scene.dim(3, by="anna")
    paint(scene, [0, 0.5, 1], by="bert")
    reply = scene.undo(by="anna").edit_reply
    assert (reply.author, reply.of) == ("local anna", 3)
    light = scene.object("light", 0).light
    assert (light.intensity, list(light.color)) == (2, [0, 0.5, 1])
    scene.undo(by="bert")
    light = scene.object("light", 0).light
    assert light.intensity == 2 and list(light.color) != [0, 0.5, 1]
    # Bert's undo has not ended Anna's redo, nor has it become hers.
    assert scene.undo(redo=True, by="anna").edit_reply.of == 5
    assert scene.intensity() == 3
    answer = scene.undo(redo=True, by="anna")
    assert fault_of(answer) == ("conflict", "redo") and "local bert" in answer.error.message
    log = [(entry.kind, entry.of, entry.author) for entry in scene.log().entries]
    assert log == [("import", 0, "local"), ("edit", 0, "local anna"), ("edit", 0, "local anna"),
                   ("edit", 0, "local bert"), ("undo", 3, "local anna"), ("undo", 4, "local bert"),
                   ("redo", 5, "local anna")]


def test_what_others_changed_since_is_not_undone(scene):
    scene.dim(2, by="anna")
    scene.dim(9, by="bert")
    paint(scene, [1, 0, 0], by="carl")
    answer = scene.undo(by="anna")
    assert fault_of(answer) == ("conflict", "undo")
    assert answer.error.message.startswith(
        "intensity of light 0 was changed since by local bert (revision 3)")
    assert (scene.get().revision, scene.intensity()) == (4, 9)
    for expected in 9, 2:  # carl's, then bert's: whatever was last
        scene.undo(by="anna", scope="all")
        assert scene.intensity() == expected
    scene.undo(by="anna")  # and now it stands as anna left it
    assert scene.intensity() not in (2, 9)
    assert fault_of(scene.undo(by="anna", scope="others")) == ("usage", "scope")


def test_what_others_build_on_is_not_undone(scene):
    lamp = scene.edit({"add_light": {"intensity": 3}}, by="anna").edit_reply.ids[0]
    scene.edit({"add_node": {"light": lamp}}, by="bert")
    before = scene.get().hash
    answer = scene.undo(by="anna")
    assert fault_of(answer) == ("conflict", "undo") and "revision 2" in answer.error.message
    assert scene.get().hash == before
    scene.undo(by="bert")
    assert scene.undo(by="anna").HasField("edit_reply")


def test_nobody_commits_or_takes_back_anothers_drag(scene):
    """Both drag the same light: each gets a revision of their own, and undoes that."""
    was = scene.object("light", 0).light
    for step in range(1, 4):
        scene.dim(10 + step, durability="transient", by="anna")
        paint(scene, [step / 4, 0, 0], durability="transient", by="bert")
    light = scene.object("light", 0).light
    assert (light.intensity, list(light.color)) == (13, [0.75, 0, 0])
    reply = scene.ask(edit_commit=pb.EditCommit(scene=scene.id, by="anna")).edit_reply
    assert (reply.revision, reply.author) == (2, "local anna")
    assert scene.get().transient == 3  # bert still drags
    reply = scene.undo(by="anna").edit_reply
    assert reply.revision == 3 and scene.intensity() == was.intensity
    reply = scene.ask(edit_commit=pb.EditCommit(scene=scene.id, by="bert")).edit_reply
    assert reply.author in ("local bert", "")


def test_two_drags_that_end_by_themselves_are_two_edits(scene):
    scene.dim(4, durability="transient", by="anna")
    scene.edit({"set_light": {"light": 1, "intensity": 5}}, durability="transient", by="bert")
    until = time.time() + 5
    while scene.get().revision < 3 and time.time() < until:
        time.sleep(.1)
    log = [(list(entry.changes), entry.author) for entry in scene.log().entries[1:]]
    assert log == [(["light 0"], "local anna"), (["light 1"], "local bert")]


def test_by_is_a_name(scene):
    for by, code in (("", "usage"), ("x" * 65, "limit"), ("a\nb", "usage"), (" a", "usage"),
                     ("a\u202eb", "usage"), ("\u0085", "usage")):
        assert fault_of(scene.dim(4, by=by)) == (code, "by")
        assert fault_of(scene.undo(by=by)) == (code, "by")
    assert scene.dim(4, by="Zoë 🦊").edit_reply.author == "local Zoë 🦊"


def test_watches_hear_who_did_it(scene):
    watcher = Scene(scene.daemon, scene_id=scene.id)
    watcher.ask(scene_watch=pb.SceneWatch(scene=scene.id))
    scene.dim(4, durability="transient", by="anna")
    scene.ask(edit_commit=pb.EditCommit(scene=scene.id, by="anna"))
    scene.undo(by="anna")
    told = []
    while len(told) < 3:
        envelope, _ = watcher.client.receive()
        if envelope.HasField("scene_event"):
            event = envelope.scene_event
            told.append((event.kind, event.author, event.batch, event.of))
    watcher.client.close()
    assert told == [("transient", "local anna", "", 0), ("edited", "local anna", "edit", 0),
                    ("edited", "local anna", "undo", 2)]


# --- dry runs ---------------------------------------------------------------------------------


def test_a_dry_run_tells_what_would_run_again(scene):
    reply = scene.dim(4, dry_run=True, frame=pb.FrameRequest(technique="rsm")).edit_reply
    assert {"direct", "vpl_grid", "gather"} <= set(reply.invalidates)
    assert {"gbuffer", "shadow_map", "rsm"} <= set(reply.keeps)
    assert scene.get().revision == 1
    answer = scene.edit({"set_light": {"light": 0, "intensity": -4}}, dry_run=True)
    assert fault_of(answer)[0] == "usage"


# --- what is left -----------------------------------------------------------------------------


def restart(daemon, how):
    daemon.process.send_signal(how)
    daemon.process.wait(timeout=20)
    return Daemon(daemon.folder)


def test_whose_it_is_outlives_the_daemon(tmp_path):
    scene = Scene(Daemon(tmp_path))
    scene.dim(2, by="anna")
    scene.edit({"set_light": {"light": 1, "intensity": 3}}, by="bert")
    scene.undo(by="anna")
    scene.client.close()
    daemon = restart(scene.daemon, signal.SIGKILL)
    try:
        again = Scene(daemon, scene_id=scene.id)
        assert [entry.author for entry in again.log().entries] == [
            "local", "local anna", "local bert", "local anna"]
        assert fault_of(again.undo(by="anna")) == ("conflict", "undo")
        assert again.undo(redo=True, by="anna").edit_reply.of == 4
        assert again.undo(by="bert").edit_reply.of == 3
        again.client.close()
    finally:
        daemon.stop()


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGKILL])
def test_acknowledged_means_durable(tmp_path, how):
    daemon = Daemon(tmp_path)
    scene = Scene(daemon)
    gone = Scene(daemon, "checker.glb")
    scene.dim(7, client_edit_id="e1")
    scene.edit({"add_mesh": {"primitives": [{"positions": {"payload": True}}]}},
               {"add_node": {"mesh": -2}}, payload=TRIANGLE)
    gone.ask(scene_remove=pb.SceneRemove(id=gone.id))
    before = scene.get()
    daemon = restart(daemon, how)
    try:
        scene = Scene(daemon, scene_id=scene.id)
        after = scene.get()
        assert (after.revision, after.hash, after.name) == (3, before.hash, before.name)
        listed = scene.ask(scene_list=pb.SceneList()).scene_list_reply.scenes
        assert [s.id for s in listed] == [scene.id]
        assert scene.dim(1, client_edit_id="e1").edit_reply.revision == 2  # said again
        scene.undo()
        assert scene.undo().edit_reply.revision == 5
    finally:
        daemon.stop()


def test_a_drag_that_was_never_committed_is_committed_at_the_end(tmp_path):
    daemon = Daemon(tmp_path)
    scene = Scene(daemon)
    scene.dim(7, durability="transient")
    daemon = restart(daemon, signal.SIGTERM)
    try:
        assert Scene(daemon, scene_id=scene.id).intensity() == 7
    finally:
        daemon.stop()


def test_a_drag_behind_a_file_is_committed_at_the_end_too(tmp_path):
    """When the daemon is asked to end it has not been laid yet: the file before it is being read."""
    daemon = Daemon(tmp_path)
    scene = Scene(daemon)
    blob = scene.client.put_blob((SCENES / "checker.glb").read_bytes())
    asked = []
    for op, durability in (({"import": {"blob": blob}}, "durable"),
                           ({"set_light": {"light": 0, "intensity": 7}}, "transient")):
        batch = pb.EditBatch(scene=scene.id, ops=[pb.EditOp(**op)], durability=durability)
        asked.append(scene.client.send(pb.Envelope(edit_batch=batch)))
    scene.client.send(pb.Envelope(stats=pb.Stats()))
    assert scene.client.receive()[0].HasField("stats_reply")  # it has read all three
    daemon.process.send_signal(signal.SIGTERM)
    answers = dict((a.request_id, a.edit_reply) for a in (scene.client.receive()[0] for _ in asked))
    assert (answers[asked[0]].revision, answers[asked[1]].transient) == (2, 1)
    scene.client.close()  # at once: it does not lie there for long enough to be committed by itself
    assert daemon.process.wait(timeout=20) == 0
    daemon = Daemon(tmp_path)
    try:
        scene = Scene(daemon, scene_id=scene.id)
        assert scene.intensity() == 7 and scene.get().revision == 3
    finally:
        daemon.stop()


def test_many_edits_are_compacted_and_replayed(tmp_path):
    daemon = Daemon(tmp_path)
    scene = Scene(daemon)
    for i in range(600):
        reply = scene.dim(1 + i).edit_reply
    assert reply.revision == 601
    daemon = restart(daemon, signal.SIGKILL)
    try:
        assert Scene(daemon, scene_id=scene.id).get().hash == reply.hash
    finally:
        daemon.stop()


def test_scenes_that_are_due_at_once_are_both_looked_after(tmp_path):
    daemon = Daemon(tmp_path)
    scenes = [Scene(daemon), Scene(daemon)]
    client = scenes[0].client
    for i in range(255):
        for scene in scenes:  # both in one commit
            envelope = pb.Envelope()
            envelope.edit_batch.scene = scene.id
            envelope.edit_batch.ops.add().set_light.CopyFrom(pb.LightEdit(light=0, intensity=i + 1))
            client.send(envelope)
        for _ in scenes:
            assert client.receive()[0].HasField("edit_reply")
    time.sleep(ANSWER_S / 10)  # nobody else may read the journal while the daemon has it
    for scene in scenes:
        scene.client.close()
    daemon.stop()
    with sqlite3.connect(next(tmp_path.rglob("journal.sqlite"))) as db:
        assert db.execute("SELECT count(*) FROM snapshots WHERE revision=256").fetchone() == (2,)
    db.close()


# --- when the disk is full ----------------------------------------------------------------------


@pytest.fixture
def full(scene):
    """A scene of a daemon whose journal can be kept from growing, and be let grow again."""

    def limit(on):
        most = 1 if on else resource.RLIM_INFINITY
        hard = resource.prlimit(scene.daemon.process.pid, resource.RLIMIT_FSIZE)[1]
        resource.prlimit(scene.daemon.process.pid, resource.RLIMIT_FSIZE, (most, hard))

    scene.limit = limit
    yield scene
    if scene.daemon.process.poll() is None:
        limit(False)


def test_a_full_disk_refuses_edits_and_nothing_else(full):
    full.dim(2)
    before = full.get()
    full.limit(True)
    for _ in range(3):
        answer = full.dim(3)
        assert fault_of(answer)[0] in ("io", "limit"), answer.error
        assert answer.error.message and "\n" not in answer.error.message
        assert full.get().SerializeToString() == before.SerializeToString()
    assert fault_of(full.ask(revision_name=pb.RevisionName(scene=full.id, name="n")))
    assert fault_of(full.ask(scene_remove=pb.SceneRemove(id=full.id)))
    assert fault_of(full.undo())
    assert full.daemon.healthy()
    assert full.daemon.request("GET", f"/v1/scenes/{full.id}/frame.png?size=16x16")[0] == 200
    full.limit(False)
    assert full.dim(4, base_revision=2).edit_reply.revision == 3
    assert full.intensity() == 4
    assert [entry.revision for entry in full.log().entries] == [1, 2, 3]


def test_all_edits_of_a_burst_are_refused_and_the_next_one_stands(full):
    other = full.daemon.add_scene("checker.glb")
    full.limit(True)
    asked = []
    for i in range(20):
        envelope = pb.Envelope()
        op = {"set_environment": {"radiance": [i, i, i]}}
        envelope.edit_batch.CopyFrom(pb.EditBatch(scene=other if i % 2 else full.id,
                                                  ops=[pb.EditOp(**op)]))
        asked.append(full.client.send(envelope))
    answers = [full.client.receive()[0] for _ in asked]
    assert {a.WhichOneof("body") for a in answers} == {"error"}
    full.limit(False)
    for scene_id in (full.id, other):
        full.id = scene_id
        op = {"set_environment": {"radiance": [1, 2, 3]}}
        assert full.edit(op, base_revision=1).edit_reply.revision == 2


def test_what_lies_transient_outlives_a_full_disk(full):
    full.dim(4, durability="transient")
    full.limit(True)
    assert fault_of(full.ask(edit_commit=pb.EditCommit(scene=full.id)))
    assert full.intensity() == 4 and full.get().revision == 1
    assert full.dim(5, durability="transient").edit_reply.revision == 1
    time.sleep(1.5)  # left alone, it tries by itself, and again
    assert full.intensity() == 5 and full.get().revision == 1
    full.limit(False)
    until = time.time() + 10
    while full.get().revision == 1 and time.time() < until:
        time.sleep(.1)
    assert full.get().revision == 2 and full.intensity() == 5


@pytest.mark.parametrize("body", [
    {"edit_undo": {}}, {"edit_undo": {"redo": True}}, {"edit_revert": {"revision": 1}}])
def test_nothing_is_taken_back_from_beneath_a_drag_that_a_full_disk_refuses(full, body):
    full.dim(2)
    full.dim(4, durability="transient")
    full.limit(True)
    (name, fields), = body.items()
    answer = full.client.ask(pb.Envelope(**{name: {"scene": full.id, **fields}}))[0]
    assert fault_of(answer)[0] in ("io", "limit"), answer.error
    assert (full.get().revision, full.intensity()) == (2, 4)
    full.limit(False)
    assert full.undo().edit_reply.revision == 4  # of the drag, which is revision 3
    assert full.intensity() == 2


def test_a_daemon_with_a_full_disk_still_ends(full):
    full.dim(4, durability="transient")
    full.limit(True)
    full.client.close()
    full.daemon.stop()


# --- scenes that go, clients that go ------------------------------------------------------------


def test_edits_behind_a_removal_find_no_scene(scene):
    """A heavy edit is being read while the scene goes; others wait behind it."""
    blob = scene.client.put_blob((SCENES / "checker.glb").read_bytes())
    heavy, light, remove = pb.Envelope(), pb.Envelope(), pb.Envelope()
    heavy.edit_batch.CopyFrom(pb.EditBatch(scene=scene.id, ops=[
        pb.EditOp(**{"import": {"blob": blob}})]))
    light.edit_batch.CopyFrom(pb.EditBatch(scene=scene.id, ops=[
        pb.EditOp(set_light=pb.LightEdit(light=0, intensity=6))]))
    remove.scene_remove.id = scene.id
    late = pb.Envelope(edit_batch=light.edit_batch)
    ids = [scene.client.send(envelope) for envelope in (heavy, light, remove, late)]
    answers = dict((a.request_id, a) for a in (scene.client.receive()[0] for _ in ids))
    assert answers[ids[2]].HasField("done")
    for request in (ids[0], ids[1], ids[3]):
        assert fault_of(answers[request]) == ("not_found", "scene")
    assert scene.daemon.healthy()


def test_clients_that_leave_in_the_middle_of_edits(scene):
    blob = scene.client.put_blob((SCENES / "checker.glb").read_bytes())
    ops = [{"set_light": {"light": 0, "intensity": 3}}, {"import": {"blob": blob}},
           {"set_light": {"light": 0, "intensity": 4}}]
    for _ in range(10):
        client = scene.daemon.framed()
        for op in ops:
            envelope = pb.Envelope()
            envelope.edit_batch.CopyFrom(pb.EditBatch(scene=scene.id, ops=[pb.EditOp(**op)]))
            client.send(envelope)
        client.send(pb.Envelope(edit_undo=pb.EditUndo(scene=scene.id)))
        client.close()
    revision = scene.dim(9).edit_reply.revision
    log = scene.log(limit=10000).entries
    assert [entry.revision for entry in log] == list(range(1, len(log) + 1))
    assert len(log) >= revision and scene.daemon.healthy()


def test_edits_that_are_cancelled_at_any_step(scene):
    blob = scene.client.put_blob((SCENES / "checker.glb").read_bytes())
    ids = []
    for op in [{"import": {"blob": blob}}] + [{"set_light": {"light": 0, "intensity": i}}
                                              for i in range(1, 9)]:
        envelope = pb.Envelope()
        envelope.edit_batch.CopyFrom(pb.EditBatch(scene=scene.id, ops=[pb.EditOp(**op)]))
        ids.append(scene.client.send(envelope))
    for request in ids[::2]:
        scene.client.send(pb.Envelope(cancel=pb.Cancel(request_id=request)))
    answers = {}
    while len(answers) < len(ids):
        answer = scene.client.receive()[0]
        if answer.request_id in ids:
            answers.setdefault(answer.request_id, answer)
    done = [answers[i] for i in ids if answers[i].HasField("edit_reply")]
    assert all(answers[i].error.code == "cancelled" for i in ids
               if answers[i].HasField("error"))
    assert {ids[i] for i in range(1, len(ids), 2)} <= {a.request_id for a in done}
    assert [a.edit_reply.revision for a in done] == list(range(2, 2 + len(done)))
    assert scene.get().revision == 1 + len(done)


def test_a_cancel_comes_too_late_for_what_is_staged(scene):
    """Behind its edit in one message's bytes: whoever hears `cancelled` finds nothing changed."""
    done = 0
    for number in range(60):
        edit = pb.Envelope(request_id=1000 + number, edit_batch=pb.EditBatch(
            scene=scene.id, ops=[pb.EditOp(set_light=pb.LightEdit(light=0, intensity=1 + number))]))
        cancel = pb.Envelope(request_id=2000 + number, cancel=pb.Cancel(request_id=1000 + number))
        scene.client.sock.sendall(pack(edit) + pack(cancel))
        answers = {answer.request_id: answer for answer, _ in (scene.client.receive(), scene.client.receive())}
        done += answers[1000 + number].WhichOneof("body") == "edit_reply"
        assert scene.get().revision == 1 + done, answers
    assert done > 0


def test_two_scenes_edits_in_one_turn(scene):
    other = scene.daemon.add_scene("checker.glb")
    asked = {}
    for i in range(20):
        envelope = pb.Envelope()
        envelope.edit_batch.CopyFrom(pb.EditBatch(
            scene=other if i % 2 else scene.id,
            ops=[pb.EditOp(set_environment=pb.Environment(radiance=[i, i, i]))]))
        asked[scene.client.send(envelope)] = i
    replies = {}
    for _ in asked:
        answer = scene.client.receive()[0]
        replies[asked[answer.request_id]] = answer.edit_reply.revision
    assert [replies[i] for i in range(20)] == [2 + i // 2 for i in range(20)]


# --- over HTTP --------------------------------------------------------------------------------


def test_curl_can_do_all_of_it(start):
    daemon = start()
    scene = daemon.add_scene("two_lights.glb")
    at = "/v1/scenes/" + scene
    op = {"set_light": {"light": 0, "intensity": 5}}
    status, reply = daemon.json("POST", at + "/edits", {"base_revision": 1, "ops": [op]})
    assert status == 200 and reply["revision"] == 2, reply
    status, reply = daemon.json("POST", at + "/edits", {"base_revision": 1, "ops": [op]})
    assert status == 409 and "revision 2" in reply["message"]
    assert daemon.json("POST", at + "/undo", {})[1]["revision"] == 3
    assert daemon.json("POST", at + "/undo", {"redo": True})[1]["revision"] == 4
    assert daemon.json("POST", at + "/names", {"name": "good"})[0] == 204
    assert daemon.json("POST", at + "/revert", {"revision": 1})[1]["revision"] == 5
    assert daemon.json("POST", at + "/commit", {})[1]["revision"] == 5
    status, log = daemon.json("GET", at + "/log?limit=2&after=1")
    assert status == 200 and [e["kind"] for e in log["entries"]] == ["redo", "revert"]
    status, objects = daemon.json("GET", at + "?objects=1")
    assert {o["kind"] for o in objects["objects"]} >= {"node", "light", "mesh", "material"}
    assert daemon.json("POST", at + "/edits", {"ops": [{"warp": {}}]})[0] == 400
    for query in ("limt=2", "after=-1", "after=99999999999999999999", "limit=4294967296"):
        assert daemon.json("GET", at + "/log?" + query)[0] == 400, query
    assert daemon.json("GET", at + "/export?revision=99999999999999999999")[0] == 400
