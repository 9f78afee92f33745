"""The data directory: what becomes of it when parts go missing, are damaged, or the disk fills up."""
import os
import re
import shutil
import signal
import subprocess
import time

import pytest

from conftest import ANSWER_S, BOUNCED, SCENES, Daemon, blob_name
from test_edits import Scene


def until(what, patience_s=ANSWER_S):
    end = time.time() + patience_s
    while not (found := what()):
        assert time.time() < end, "it did not come"
        time.sleep(0.02)
    return found


def message_of(answer):
    assert answer.WhichOneof("body") == "error", answer
    return answer.error.message


def refused_start(data, *options):
    """The one line that a start ends with."""
    end = subprocess.run([BOUNCED, "--http", "127.0.0.1:0", "--data", str(data), *options],
                         stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, timeout=30)
    assert end.returncode > 0, end
    line = end.stderr.decode().strip().splitlines()[-1]
    assert "error" in line
    return line


def contents_of(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


@pytest.fixture
def killed(tmp_path):
    """A daemon's folder and scene at revision 13, after a kill -9."""
    daemon = Daemon(tmp_path)
    scene = Scene(daemon)
    for i in range(12):
        scene.dim(1 + i)
    daemon.process.send_signal(signal.SIGKILL)
    daemon.process.wait(timeout=20)
    assert (daemon.data / "journal.sqlite-wal").stat().st_size > 0
    return daemon, scene


@pytest.mark.parametrize("gone", [["journal.sqlite"], ["journal.sqlite-wal"],
                                  ["journal.sqlite", "journal.sqlite-wal"]])
def test_a_start_without_its_journal_says_so_and_touches_nothing(killed, gone):
    daemon, scene = killed
    kept = daemon.folder / "kept"
    kept.mkdir()
    for name in gone:
        shutil.move(daemon.data / name, kept / name)
    before = contents_of(daemon.data)
    line = refused_start(daemon.data)
    assert "missing" in line and "journal.sqlite" in line and "--accept-journal" in line
    assert contents_of(daemon.data) == before
    for name in gone:
        shutil.move(kept / name, daemon.data / name)
    again = Daemon(daemon.folder)
    assert Scene(again, scene_id=scene.id).get().revision == 13
    again.stop()


def test_the_way_out_takes_what_is_there(killed):
    daemon, scene = killed
    (daemon.data / "journal.sqlite").unlink()
    refused_start(daemon.data)
    again = Daemon(daemon.folder, "--accept-journal")
    assert again.json("GET", "/v1/scenes")[1]["scenes"] == []
    assert "--accept-journal: taken as it is" in again.log_path.read_text()
    scene = Scene(again)
    again.stop()
    again = Daemon(daemon.folder)  # once was enough
    assert Scene(again, scene_id=scene.id).get().revision == 1
    again.stop()


def test_an_older_copy_is_not_taken_for_the_journal(tmp_path):
    daemon = Daemon(tmp_path)
    scene = Scene(daemon)
    daemon.stop()
    old = (daemon.data / "journal.sqlite").read_bytes()
    daemon = Daemon(tmp_path)
    Scene(daemon, scene_id=scene.id).dim(3)
    daemon.stop()
    (daemon.data / "journal.sqlite").write_bytes(old)
    assert "older copy" in refused_start(daemon.data)
    assert (daemon.data / "journal.sqlite").read_bytes() == old


def test_a_directory_of_before_gets_an_identity(killed):
    daemon, scene = killed
    (daemon.data / "identity").unlink()
    again = Daemon(daemon.folder)
    assert Scene(again, scene_id=scene.id).get().revision == 13
    assert "identity is missing" in again.log_path.read_text()
    again.stop()
    assert (daemon.data / "identity").exists()


def test_edits_are_refused_while_the_data_directory_is_gone(tmp_path):
    daemon = Daemon(tmp_path)
    scene = Scene(daemon)
    scene.dim(3)
    assert daemon.json("GET", "/readyz")[1]["journal"] == {"ok": True}
    elsewhere = tmp_path / "elsewhere"
    daemon.data.rename(elsewhere)
    assert "not where it was" in message_of(scene.dim(4))
    status, ready = until(lambda: (r := daemon.json("GET", "/readyz"))[0] != 200 and r)
    assert (status, ready["ready"], ready["journal"]["ok"]) == (503, False, False)
    assert "data directory" in ready["journal"]["reason"]
    assert scene.get().revision == 2 and daemon.healthy()  # it can still be looked at
    daemon.data.mkdir(mode=0o700)  # another one is not it
    assert "not where it was" in message_of(scene.dim(4))
    daemon.data.rmdir()
    elsewhere.rename(daemon.data)
    assert scene.dim(4).edit_reply.revision == 3
    until(lambda: daemon.json("GET", "/readyz")[0] == 200)
    daemon.stop()


# --- blobs ------------------------------------------------------------------------------------

CORNELL = (SCENES / "cornell.glb").read_bytes()


def file_of(daemon, data):
    return daemon.data / "blobs" / blob_name(data)[7:]


def has(daemon, data, headers=None):
    return daemon.request("HEAD", "/v1/blobs/" + blob_name(data), headers=headers)[0] == 200


def add_scene(daemon, data):
    return daemon.json("POST", "/v1/scenes", {"blob": blob_name(data), "name": "a"})


def damage(path, how):
    data = bytearray(path.read_bytes())
    if how == "bit":
        data[len(data) // 2] ^= 4
        path.write_bytes(data)
    elif how == "cut":
        os.truncate(path, len(data) // 2)
    elif how == "longer":
        path.write_bytes(data + b"\0" * 4096)
    else:
        path.unlink()
        os.mkfifo(path) if how == "fifo" else path.symlink_to("/etc/passwd")


@pytest.mark.parametrize("how", ["bit", "cut", "longer", "fifo", "link"])
@pytest.mark.parametrize("is_known", [False, True])
def test_a_damaged_blob_is_not_there_until_it_is_sent_again(shared, how, is_known):
    shared.put_blob(CORNELL)
    if is_known:  # it was whole once
        assert add_scene(shared, CORNELL)[0] == 201
    damage(file_of(shared, CORNELL), how)
    status, reply = add_scene(shared, CORNELL)
    assert status == 404 and "damaged" in str(reply)
    assert not has(shared, CORNELL)
    assert os.path.lexists(file_of(shared, CORNELL).with_name("damaged." + blob_name(CORNELL)[7:]))
    shared.put_blob(CORNELL)
    assert has(shared, CORNELL) and file_of(shared, CORNELL).read_bytes() == CORNELL
    assert add_scene(shared, CORNELL)[0] == 201


def test_sending_it_again_mends_a_damaged_blob_that_nobody_met(shared):
    shared.put_blob(CORNELL)
    damage(file_of(shared, CORNELL), "bit")
    shared.put_blob(CORNELL)
    assert file_of(shared, CORNELL).read_bytes() == CORNELL


TOKENS = """aaaaaaaaaaaaaaaaaaaa role=edit scenes=a/ name=ann max_bytes=100K
bbbbbbbbbbbbbbbbbbbb role=edit scenes=b/ name=bob
cccccccccccccccccccc role=edit name=all"""


@pytest.fixture
def asked(tmp_path):
    (tmp_path / "many").write_text(TOKENS)
    (tmp_path / "many").chmod(0o600)
    daemon = Daemon(tmp_path, "--token-file", str(tmp_path / "many"))
    yield daemon
    daemon.stop()


def bearer(letter):
    return {"Authorization": "Bearer " + letter * 20, "Content-Type": "application/octet-stream"}


def put(daemon, data, letter):
    status, _, text = daemon.request("PUT", "/v1/blobs/" + blob_name(data), data, bearer(letter))
    return status, text.decode()


def test_a_token_finds_its_own_blobs(asked):
    data = b"ann's" * 100
    assert put(asked, data, "a")[0] in (200, 201)
    assert [has(asked, data, bearer(who)) for who in "abc"] == [True, False, True]
    status, _, _ = asked.request("POST", "/v1/scenes", f'{{"blob": "{blob_name(data)}", "name": "b/x"}}',
                                 {**bearer("b"), "Content-Type": "application/json"})
    assert status == 404
    assert put(asked, data, "b")[0] in (200, 201)  # who has it may have it
    assert has(asked, data, bearer("b"))


def test_blobs_count_for_max_bytes(asked):
    answers = [put(asked, bytes([i]) * 30_000, "a") for i in range(5)]
    assert [status for status, _ in answers] == [201] * 3 + [413] * 2
    assert "max_bytes" in answers[-1][1]
    assert put(asked, bytes([0]) * 30_000, "b")[0] == 201  # and for nobody else
    data = os.urandom(60 << 20)
    assert put(asked, data, "a")[0] == 413  # early: not once all of it is there
    assert sum(f.stat().st_size for f in (asked.data / "blobs").iterdir()) < 1 << 20


def test_blobs_that_nobody_uses_are_collected(tmp_path):
    daemon = Daemon(tmp_path, "--limit", "blob_seconds=2")
    scene = Scene(daemon)
    daemon.put_blob(b"old")
    daemon.put_blob(b"asked for")
    file_of(daemon, b"x").with_name("damaged." + "0" * 64).write_bytes(b"x")
    until(lambda: has(daemon, b"asked for") and not file_of(daemon, b"old").exists()
          and not list((daemon.data / "blobs").glob("damaged.*")))
    assert has(daemon, b"asked for")
    assert scene.dim(4).edit_reply.revision == 2
    daemon.stop()
    daemon = Daemon(tmp_path)
    assert Scene(daemon, scene_id=scene.id).get().revision == 2  # revisions need no blobs
    daemon.stop()


# --- a disk that fills up ---------------------------------------------------------------------


def free_bytes(path):
    info = os.statvfs(path)
    return info.f_bavail * info.f_frsize


def test_uploads_are_refused_before_edits_are(tmp_path):
    """The reserve is more than the disk has free: uploads are refused, edits are not."""
    daemon = Daemon(tmp_path)
    scene = Scene(daemon)
    daemon.stop()
    daemon = Daemon(tmp_path, "--limit", "disk_reserve_bytes=1000G")
    assert free_bytes(tmp_path) < 1000 << 30
    status, _, text = daemon.request("PUT", "/v1/blobs/" + blob_name(b"a" * 9999), b"a" * 9999,
                                     {"Content-Type": "application/octet-stream"})
    assert status == 507 and b"disk_reserve_bytes" in text
    status, reply = daemon.json("POST", "/v1/scenes", {"blob": blob_name(CORNELL), "name": "b"})
    assert status == 507 and "disk_reserve_bytes" in str(reply)
    with pytest.raises(AssertionError, match="disk_reserve_bytes"):
        daemon.framed().put_blob(b"b" * 99)
    scene = Scene(daemon, scene_id=scene.id)
    assert scene.dim(5).edit_reply.revision == 2
    daemon.stop()
