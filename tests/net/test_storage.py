"""The data directory: what becomes of it when parts go missing, are damaged, or the disk fills up."""
import os
import re
import shutil
import signal
import subprocess
import time

import pytest

from conftest import ANSWER_S, BOUNCED, Daemon
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
