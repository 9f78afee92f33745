"""scene_replay: revisions out of a journal, made again by another daemon; and bytes that are none."""
import random
import sqlite3
import struct
import zlib

import bounced_pb2
import pytest
from conftest import Daemon, blob_name
from test_edits import Scene

pb = bounced_pb2


class Journal:
    """What the journal of a stopped daemon holds of its one scene."""

    def __init__(self, path):
        with sqlite3.connect(path) as db:
            [self.index] = db.execute("SELECT bytes FROM snapshots WHERE revision=1").fetchone()
            self.deltas = dict(db.execute("SELECT revision, forward FROM edits WHERE revision>1"))
            self.hashes = {revision: "sha256:" + bytes(sha).hex() for revision, sha in
                           db.execute("SELECT revision, snapshot_sha256 FROM edits")}
            self.contents = [b"".join(part for [part] in db.execute(
                "SELECT bytes FROM parts WHERE content=? ORDER BY part", [content]))
                for [content] in db.execute("SELECT id FROM contents")]
        db.close()


@pytest.fixture(scope="module")
def journal(tmp_path_factory):
    folder = tmp_path_factory.mktemp("journal")
    daemon = Daemon(folder)
    scene = Scene(daemon)
    scene.dim(3, message="dim")
    scene.dim(4)
    scene.undo()
    scene.edit({"add_texture": {"blob": daemon.put_blob(PICTURE)}})
    scene.client.close()
    daemon.stop()
    return Journal(next(folder.rglob("journal.sqlite")))


def picture():
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(
            ">I", zlib.crc32(kind + data))

    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 2, 2, 8, 2, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(b"\0" + b"abcdef" + b"\0" + b"ghijkl")) +
            chunk(b"IEND", b""))


PICTURE = picture()


@pytest.fixture
def client(start):
    client = start().framed()
    yield client
    client.close()


def play(client, payload, **fields):
    return client.ask(pb.Envelope(scene_replay=pb.SceneReplay(**fields)), payload)[0]


def begin(client, journal, **fields):
    for content in journal.contents:
        client.put_blob(content)
    answer = play(client, journal.index, name="again", **{"revision": 1, **fields})
    assert answer.HasField("scene"), answer
    return answer.scene


def test_revision_by_revision(client, journal):
    scene = begin(client, journal)
    assert scene.hash == journal.hashes[1] and scene.name == "again"
    for revision, kind, of in ((2, "edit", 0), (3, "edit", 0), (4, "undo", 3), (5, "edit", 0)):
        answer = play(client, journal.deltas[revision], scene=scene.id, revision=revision,
                      kind=kind, of=of, message="played", client_edit_id=f"c{revision}",
                      time_ms=1000 * revision)
        assert answer.edit_reply.revision == revision
        assert answer.edit_reply.hash == journal.hashes[revision]
    log = client.ask(pb.Envelope(scene_log=pb.SceneLog(scene=scene.id)))[0].scene_log_reply.entries
    assert [(e.revision, e.kind, e.of, e.time_ms) for e in log][1:] == [
        (2, "edit", 0, 2000), (3, "edit", 0, 3000), (4, "undo", 3, 4000), (5, "edit", 0, 5000)]
    # Said again it gets its first answer, as every edit does.
    again = play(client, journal.deltas[2], scene=scene.id, revision=9, kind="edit",
                 client_edit_id="c2").edit_reply
    assert again.repeated_id and again.revision == 2


def test_a_scene_may_begin_late_and_bytes_may_be_a_blob(client, journal):
    for content in journal.contents:
        client.put_blob(content)
    client.put_blob(journal.index)
    answer = play(client, b"", name="late", revision=700, blob=blob_name(journal.index))
    scene = answer.scene
    assert (scene.revision, scene.hash) == (700, journal.hashes[1])
    client.put_blob(journal.deltas[2])
    answer = play(client, b"", scene=scene.id, revision=701, kind="edit",
                  blob=blob_name(journal.deltas[2]))
    assert (answer.edit_reply.revision, answer.edit_reply.hash) == (701, journal.hashes[2])


@pytest.mark.parametrize("fields,code,field", [
    ({"revision": 0}, "usage", "revision"), ({"revision": 3}, "conflict", "revision"),
    ({"scene": None, "revision": 2 ** 53 + 1}, "usage", "revision"),
    ({"kind": "import"}, "usage", "kind"), ({"kind": ""}, "usage", "kind"),
    ({"of": 2}, "usage", "of"), ({"scene": "nonsense"}, "not_found", "scene"),
    ({"message": "x" * 257}, "limit", "message"),
    ({"client_edit_id": "x" * 65}, "limit", "client_edit_id"),
    ({"blob": "nonsense"}, "usage", "blob"), ({"blob": blob_name(b"?")}, "not_found", "blob"),
])
def test_refusals(client, journal, fields, code, field):
    scene = begin(client, journal)
    answer = play(client, journal.deltas[2], **{"scene": scene.id, "revision": 2, "kind": "edit",
                                                **fields})
    assert (answer.error.code, answer.error.details.field) == (code, field), answer
    assert client.ask(pb.Envelope(scene_get=pb.SceneGet(id=scene.id)))[0].scene.revision == 1


def test_content_that_is_missing_is_named(client, journal):
    answer = play(client, journal.index, revision=1)
    assert answer.error.code == "not_found", answer


def test_bytes_that_are_none(client, journal):
    """Cut short, made up, flipped: refused, or a scene that is one; and the daemon goes on."""
    rng, scene = random.Random(3), begin(client, journal)
    delta = journal.deltas[5]
    broken = [b"", b"\0" * 64, delta[:-1], delta + b"\0", journal.index, rng.randbytes(500)]
    for data in broken:
        answer = play(client, data, scene=scene.id, revision=2, kind="edit")
        assert answer.error.code in ("bad_input", "not_found"), (data, answer)
    for data in broken[:4]:
        assert play(client, data, revision=1).error.code in ("bad_input", "not_found")
    revision = 1
    for _ in range(200):
        source = rng.choice([journal.index, delta, journal.deltas[2]])
        data = bytearray(source)
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        if source is journal.index:
            answer = play(client, bytes(data), revision=1)
            if answer.HasField("scene"):
                client.ask(pb.Envelope(scene_remove=pb.SceneRemove(id=answer.scene.id)))
        else:
            answer = play(client, bytes(data), scene=scene.id, revision=revision + 1, kind="edit")
            revision += answer.HasField("edit_reply")
    assert client.ask(pb.Envelope(scene_get=pb.SceneGet(id=scene.id)))[0].scene.revision == revision


def test_an_id_far_beyond_the_scene_makes_no_slots(client, journal):
    """Wherever the delta of a light has its id, which is 0: the largest that there may be, instead."""
    scene, refused = begin(client, journal), []
    for at in range(len(journal.deltas[2]) - 4):
        data = bytearray(journal.deltas[2])
        if bytes(data[at:at + 4]) == b"\0\0\0\0":
            data[at:at + 4] = struct.pack("<I", (1 << 22) - 1)
            answer = play(client, bytes(data), scene=scene.id, revision=2, kind="edit")
            refused += [answer.error] if answer.error.details.field == "payload" else []
            if answer.HasField("edit_reply"):
                scene = begin(client, journal)
    assert refused and all(error.code == "limit" for error in refused)
    assert "passes over" in refused[0].message and "limit 65536" in refused[0].message


def test_only_an_admin_writes_a_past(start, journal):
    edit, admin = "edit-edit-edit-edit", "admin-admin-admin-0"
    daemon = start(token=f"{admin}\n{edit} role=edit")
    for token, code in ((edit, "forbidden"), (admin, "not_found")):
        client = daemon.framed(tcp=True, hello=False)
        client.hello(token)
        assert play(client, journal.index, revision=1).error.code == code
        client.close()
