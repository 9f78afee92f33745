"""Exports over the faces: the shown scene, its past, limits; files through a strict check."""
import struct

import bounced_pb2
import glb_check
import pytest
from conftest import SCENES
from stopwatch import Stopwatch
from test_edits import Scene, fault_of

pb = bounced_pb2
BUNDLED = sorted(path.name for path in SCENES.glob("*.glb"))


def export(scene, **fields):
    """(reply, file)"""
    answer, file = scene.client.ask(pb.Envelope(
        scene_export=pb.SceneExport(scene=scene.id, **fields)))
    return answer, file


@pytest.fixture
def scene(start):
    scene = Scene(start())
    yield scene
    scene.client.close()


@pytest.fixture
def opened(shared):
    """Scenes of the shared daemon; they go with the test."""
    scenes = []

    def add(file):
        scenes.append(Scene(shared, file))
        return scenes[-1]

    yield add
    for scene in scenes:
        scene.ask(scene_remove=pb.SceneRemove(id=scene.id))
        scene.client.close()


@pytest.mark.parametrize("file", BUNDLED)
def test_every_bundled_scene_comes_back(opened, shared, file):
    scene = opened(file)
    answer, exported = export(scene)
    reply = answer.scene_export_reply
    before = scene.get()
    assert (reply.revision, reply.hash, list(reply.flags)) == (1, before.hash, [])
    glb_check.check(exported)
    status, again = shared.json("POST", "/v1/scenes", {"blob": shared.put_blob(exported)})
    assert status == 201
    second = shared.request("GET", f"/v1/scenes/{again['id']}/export")[2]
    assert second == exported and again["counts"]["triangles"] == before.counts.triangles
    if not before.flags or "default" in before.flags[0]:
        assert again["hash"] == before.hash
    assert shared.json("DELETE", "/v1/scenes/" + again["id"])[0] == 204


def test_what_is_shown_is_what_is_exported(scene):
    scene.dim(7)
    scene.dim(8, durability="transient")
    answer, file = export(scene)
    lights = glb_check.check(file)["extensions"]["KHR_lights_punctual"]["lights"]
    assert (answer.scene_export_reply.revision, answer.scene_export_reply.transient) == (2, 1)
    assert lights[0]["intensity"] == 8


def test_the_past_can_be_exported(scene):
    first = export(scene)[1]
    hash_of_first = scene.get().hash
    assert scene.ask(revision_name=pb.RevisionName(scene=scene.id, name="as it & came")).HasField(
        "done")
    scene.dim(7)
    for fields in ({"revision": 1}, {"name": "as it & came"}):
        answer, file = export(scene, **fields)
        assert file == first
        assert (answer.scene_export_reply.revision, answer.scene_export_reply.hash) == (
            1, hash_of_first)
    get = scene.daemon.request
    path = f"/v1/scenes/{scene.id}/export"
    for query in ("?revision=1", "?name=as+it%20%26+came"):
        status, head, body = get("GET", path + query)
        assert (status, head["Bounced-Revision"], body) == (200, "1", first), query
    status, head, body = get("GET", path)
    assert (status, head["Bounced-Revision"]) == (200, "2") and body != first
    assert head["Content-Type"] == "model/gltf-binary"
    assert head["Bounced-Scene"] == scene.get().hash


def test_refusals_name_the_field(scene):
    assert fault_of(export(scene, revision=9)[0])[0] == "not_found"
    assert fault_of(export(scene, name="none")[0]) == ("not_found", "name")
    assert fault_of(export(scene, revision=1, name="n")[0]) == ("usage", "revision")
    assert fault_of(export(scene, revision=0)[0]) == ("usage", "revision")
    scene.id = "0" * 16
    assert fault_of(export(scene)[0])[0] == "not_found"


@pytest.mark.parametrize("query, status", [
    ("revision=x", 400), ("revision=", 400), ("rev=1", 400), ("name=%zz", 400), ("name", 400),
    ("revision=1&name=n", 400), ("revision=77", 404), ("name=nobody", 404)])
def test_http_refuses_by_name(shared, opened, query, status):
    scene = opened("two_lights.glb")
    got, fault = shared.json("GET", f"/v1/scenes/{scene.id}/export?{query}")
    assert got == status and "\n" not in fault["message"], fault
    assert shared.json("POST", f"/v1/scenes/{scene.id}/export", {})[0] == 405


def test_what_is_above_the_limit_is_refused(start):
    daemon = start("--limit", "reply_bytes=4096")
    scene = Scene(daemon, "cornell.glb")
    assert fault_of(export(scene)[0]) == ("limit", "reply_bytes")
    status, fault = daemon.json("GET", f"/v1/scenes/{scene.id}/export")
    assert status == 413 and "\n" not in fault["message"]
    scene.client.close()


def grid(side):
    """Positions and indices of a square of side x side vertices."""
    positions = b"".join(struct.pack("<3f", x, y, 0) for y in range(side) for x in range(side))
    corners = ((0, 1, side + 1), (0, side + 1, side))
    indices = b"".join(struct.pack("<3I", *(y * side + x + c for c in corner))
                       for y in range(side - 1) for x in range(side - 1) for corner in corners)
    return positions, indices


def test_a_large_export_does_not_hold_up_the_loop(scene):
    """While a picture is compressed, the daemon answers others; 32-bit indices are told on the way."""
    positions, indices = grid(300)
    primitive = {"positions": {"payload": True, "offset": 0, "size_bytes": len(positions)},
                 "indices": {"payload": True, "offset": len(positions),
                             "size_bytes": len(indices)}}
    answer = scene.edit({"add_mesh": {"name": "grid", "primitives": [primitive]}},
                        {"add_node": {"mesh": -2}}, payload=positions + indices)
    assert answer.WhichOneof("body") == "edit_reply", answer
    request = pb.Envelope(scene_export=pb.SceneExport(scene=scene.id))
    scene.client.send(request)
    slowest = 0
    for _ in range(5):
        watch = Stopwatch()
        assert scene.daemon.healthy()
        slowest = max(slowest, watch.own_s())
    assert slowest < 2
    answer, file = scene.client.receive()
    while answer.WhichOneof("body") == "progress":
        answer, file = scene.client.receive()
    assert answer.WhichOneof("body") == "scene_export_reply"
    document = glb_check.check(file)
    kinds = {accessor["componentType"] for accessor in document["accessors"]}
    assert kinds == {5123, 5125, 5126}


def test_one_that_is_cancelled_ends(scene):
    envelope = pb.Envelope(scene_export=pb.SceneExport(scene=scene.id))
    wanted = scene.client.send(envelope)
    scene.client.send(pb.Envelope(cancel=pb.Cancel(request_id=wanted)))
    answer = scene.client.receive()[0]
    while answer.request_id != wanted or answer.WhichOneof("body") == "progress":
        answer = scene.client.receive()[0]
    assert answer.WhichOneof("body") in ("error", "scene_export_reply")
    assert scene.daemon.healthy()
