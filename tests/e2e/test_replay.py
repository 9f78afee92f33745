"""`bounce replay`, and what it is for: a session of edits, whichever way its scene comes about, gives
the same hashes and the same frames, byte by byte, on one device.

BD_REPLAY_EDITS: how many edits the session has (default 40, and frames of `hisr`; the suite `long`
makes 500, and frames of `rsm` too).
"""
import ctypes
import fcntl
import json
import os
import shutil
import signal
import sqlite3
import struct
import subprocess
import sys
import time

import pytest
from conftest import BUILD

sys.path.insert(0, os.environ["BD_PB2_DIR"])
import bounced  # noqa: E402
import edit_session  # noqa: E402

EDITS = int(os.environ.get("BD_REPLAY_EDITS", "40"))
IS_LONG = EDITS >= 500
FRAMES = 5 if IS_LONG else 2  # of each technique, spread over the session
LOOKS = ["rsm", "hisr"] if IS_LONG else ["hisr"]
SIZE = ["--size", "64x64"]


@pytest.fixture(scope="module", autouse=True)
def shader_cache(tmp_path_factory):
    """Programs are compiled once for all of these daemons."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path_factory.mktemp("shaders")))
        yield


class Daemon:
    """A daemon with a data directory and a socket of its own."""

    def __init__(self, folder):
        folder.mkdir(exist_ok=True)
        self.data = folder / "data"
        self.address = f"unix:{folder}/s.sock"
        words = [BUILD / "server/bounced", "--http", "none", "--listen", self.address,
                 "--data", self.data]
        self.log = open(folder / "log", "ab")
        self.process = subprocess.Popen(words, stderr=self.log)
        until = time.monotonic() + 120
        while not (client := self.reach()) and time.monotonic() < until:
            assert self.process.poll() is None, (folder / "log").read_text()
            time.sleep(0.02)
        self.client = client

    def reach(self):
        """None before it listens: its socket is there a moment earlier."""
        try:
            return bounced.connect(self.address, resume_s=0)
        except bounced.Unreachable:
            return None

    def end(self, how=signal.SIGTERM):
        self.client.close()
        self.process.send_signal(how)
        self.process.wait(timeout=60)
        self.log.close()


def render(bounce, daemon, scene_id, look, path):
    result = bounce("render", "scene:" + scene_id, "-o", path, *SIZE, "--technique", look, "--server",
                    daemon.address, "--quiet", timeout=240)
    assert result.returncode == 0, result.stderr


def replay(bounce, journal, *words):
    """(lines, standard error) of one that works."""
    result = bounce("replay", journal, "--json", *words, timeout=1200)
    assert result.returncode == 0, result.stderr
    return [json.loads(line) for line in result.stdout.splitlines()], result.stderr


class Lived:
    """A session that a daemon lived through until it was killed: its folder, hashes and frames."""

    def __init__(self, bounce, folder):
        self.bounce, self.folder = bounce, folder
        daemon = Daemon(folder / "live")
        scene = daemon.client.scenes.add(edit_session.SCENES / "cornell.glb", name="box")
        self.id = scene.id
        self.every = max(1, EDITS // FRAMES)
        session = edit_session.Session(scene, seed=7)

        def look(revision):
            if len(session.hashes) % self.every == 0:
                for name in LOOKS:
                    render(bounce, daemon, scene.id, name, self.frame(name, revision))

        session.run(EDITS, look)
        self.session, self.last = session, scene.revision
        self.log = scene.log(limit=10000)
        for name in LOOKS:
            if not self.frame(name, self.last).exists():
                render(bounce, daemon, scene.id, name, self.frame(name, self.last))
        # With a write-ahead log that nobody copied into the file.
        daemon.end(signal.SIGKILL)
        self.data = daemon.data

    def frame(self, look, revision):
        return self.folder / f"{look}-{revision:06}.exr"

    def revisions(self):
        return sorted(int(path.stem.split("-")[1]) for path in self.folder.glob("hisr-*.exr"))


@pytest.fixture(scope="module")
def lived(tmp_path_factory, shader_cache):
    from conftest import Bounce
    folder = tmp_path_factory.mktemp("lived")
    return Lived(Bounce(folder), folder)


def test_the_session_is_worth_the_name(lived):
    kinds = {entry["kind"] for entry in lived.log}
    assert kinds == {"import", "edit", "undo", "redo", "revert"}
    assert len(lived.log) > EDITS and len(set(lived.session.hashes)) > EDITS // 2
    if IS_LONG:
        assert set(lived.session.done) == {step.__name__ for step, _ in edit_session.STEPS
                                           if step is not edit_session.Session.name}


@pytest.mark.parametrize("look", LOOKS)
def test_a_replay_gives_the_same_frames(lived, bounce, look):
    """A fresh data directory, of a private daemon."""
    before = {path: path.read_bytes() for path in lived.data.iterdir() if path.is_file()}
    out = bounce.folder / "frames"
    lines, said = replay(bounce, lived.data, "--check", "--frames", out, "--format", "exr",
                         *(word for at in lived.revisions() for word in ("--at", at)),
                         *SIZE, "--technique", look)
    assert [line["revision"] for line in lines] == [entry["revision"] for entry in lived.log]
    assert [line["hash"] for line in lines] == [entry["hash"] for entry in lived.log]
    assert all(line["same"] for line in lines) and "every hash is the journal's" in said
    frames = {line["revision"]: line["frame"] for line in lines if "frame" in line}
    assert sorted(frames) == lived.revisions() and len(frames) >= FRAMES
    for revision, path in frames.items():
        live = lived.frame(look, revision).read_bytes()
        assert open(bounce.folder / path, "rb").read() == live, (look, revision)
    # The journal was only read.
    assert {path: path.read_bytes() for path in lived.data.iterdir() if path.is_file()} == before


def test_a_restart_gives_the_same_frames(lived, bounce):
    shutil.copytree(lived.data, bounce.folder / "again/data")
    os.chmod(bounce.folder / "again/data", 0o700)
    daemon = Daemon(bounce.folder / "again")
    try:
        scene = daemon.client.scenes.get(lived.id)
        assert (scene.revision, scene.info()["hash"]) == (lived.last, lived.session.hashes[-1])
        assert [entry["hash"] for entry in scene.log(limit=10000)] == [
            entry["hash"] for entry in lived.log]
        for look in LOOKS:
            path = bounce.folder / f"{look}.exr"
            render(bounce, daemon, lived.id, look, path)
            assert path.read_bytes() == lived.frame(look, lived.last).read_bytes(), look
    finally:
        daemon.end()


def test_the_same_requests_make_the_same_scenes(lived, bounce):
    """Not from the journal: asked for anew, of a daemon that knows nothing."""
    for attempt in range(3):
        daemon = Daemon(bounce.folder / f"anew{attempt}")
        try:
            scene = daemon.client.scenes.add(edit_session.SCENES / "cornell.glb", name="box")
            session = edit_session.Session(scene, seed=7)
            hashes = session.run(EDITS)
            log = scene.log(limit=10000)
        finally:
            daemon.end()
        # A drag that the machine held up for a second was committed in the middle, here or there.
        if len(log) == len(lived.log):
            break
    assert hashes == lived.session.hashes


# --- the command -----------------------------------------------------------------------------

@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """The data directory of two scenes, of which one has five revisions and a name."""
    folder = tmp_path_factory.mktemp("small")
    daemon = Daemon(folder / "live")
    box = daemon.client.scenes.add(edit_session.SCENES / "cornell.glb", name="box")
    other = daemon.client.scenes.add(edit_session.SCENES / "checker.glb", name="other")
    for x in range(3):
        with box.edit(message=f"move {x}", client_edit_id=f"m{x}") as edit:
            edit.set_transform(0, translation=(x, 0, 0))
    box.name_revision("good", 3)
    box.undo()
    daemon.end()
    daemon.ids = box.id, other.id
    return daemon


def test_lines_for_people(small, bounce):
    result = bounce("replay", small.data / "journal.sqlite", "--scene", small.ids[0], "--check")
    assert result.returncode == 0, result.stderr
    head, *lines = result.stdout.decode().splitlines()
    assert head.startswith(f'{small.ids[0]} "box" is played into ')
    assert len(lines) == 5 and lines[1].startswith("2      edit    sha256:")
    assert "  same  move 0  (node 0)" in lines[1] and "undo" in lines[4] and "of 4" in lines[4]
    assert "5 revisions played" in result.stderr


def test_into_a_running_daemon_and_up_to_a_revision(small, bounce):
    daemon = Daemon(bounce.folder / "there")
    try:
        both, _ = replay(bounce, small.data, "--server", daemon.address)
        assert [line["scene"] for line in both] == [small.ids[0]] * 5 + [small.ids[1]]
        assert sorted(info["name"] for info in daemon.client.scenes.list()) == ["box", "other"]
        copy = daemon.client.scenes.get(both[0]["into"])
        log = copy.log()
        assert [(entry["kind"], entry.get("message", "")) for entry in log] == [
            ("import", ""), ("edit", "move 0"), ("edit", "move 1"), ("edit", "move 2"),
            ("undo", "")]
        assert log[2]["names"] == ["good"] and log[3]["client_edit_id"] == "m2"
        # Its past is a past: what was undone can be done again, and ids are known.
        assert copy.redo().revision == 6
        part, _ = replay(bounce, small.data, "--scene", small.ids[0], "--to", 3, "--server",
                         daemon.address)
        assert [line["revision"] for line in part] == [1, 2, 3]
        assert daemon.client.scenes.get(part[0]["into"]).info()["hash"] == log[2]["hash"]
    finally:
        daemon.end()


def refused(bounce, *words):
    result = bounce("replay", *words)
    [line] = result.stderr.splitlines()
    return result.returncode, line


@pytest.mark.parametrize("words,says", [
    ([], "no JOURNAL"), (["a", "b"], "one word too many"), (["a", "--every", "2"], "--frames"),
    (["a", "--size", "8x8"], "--render FILE or --frames DIR"), (["a", "--render", "-"], "--render -"),
    (["a", "--render", "x.bmp"], ".png"), (["a", "--frames", "d", "--format", "gif"], "png, jpg"),
    (["a", "--format", "png"], "--format"), (["a", "--to", "0"], "--to"),
    (["a", "--at", "3"], "--frames"), (["a", "--frames", "d", "--at", "3", "--every", "3"], "--at"),
])
def test_usage(bounce, words, says):
    code, line = refused(bounce, *words)
    assert code == 2 and says in line


def test_what_is_no_journal(small, bounce):
    missing, folder = bounce.folder / "none.sqlite", bounce.folder / "folder"
    folder.mkdir()
    (bounce.folder / "empty").touch()
    (bounce.folder / "short").write_bytes(b"SQLite format 3\0")
    (bounce.folder / "text").write_bytes(b"no journal at all\n" * 1000)
    assert refused(bounce, missing)[0] == 4
    assert refused(bounce, folder)[0] == 4
    for name in ("empty", "short", "text"):
        code, line = refused(bounce, bounce.folder / name)
        assert code == 4 and name in line
    newer = bounce.folder / "newer.sqlite"
    shutil.copy(small.data / "journal.sqlite", newer)
    with sqlite3.connect(newer) as db:
        db.execute("PRAGMA user_version=99")
    db.close()
    code, line = refused(bounce, newer)
    assert code == 4 and "format 99" in line and "newer" in line
    code, line = refused(bounce, small.data, "--scene", "nonsense")
    assert code == 4 and "nonsense" in line
    code, line = refused(bounce, small.data, "--to", "3")
    assert code == 2 and "--scene" in line
    code, line = refused(bounce, small.data, "--scene", small.ids[0], "--to", "9")
    assert code == 4 and "--to 9" in line and "is 5" in line
    frames = ["--frames", bounce.folder / "frames", "--at"]
    for words in (["9"], ["5", "--to", "4"], ["1", "--at", "6"]):
        code, line = refused(bounce, small.data, "--scene", small.ids[0], *frames, *words)
        assert code == 4 and "--at " in line and "no scene has this revision" in line


def scene_sum(*fields):
    """The journal's sum over a scene's row (bd_check_scene), which is no secret."""
    hash64 = ctypes.CDLL("libxxhash.so.0").XXH3_64bits_withSeed
    hash64.argtypes = ctypes.c_char_p, ctypes.c_size_t, ctypes.c_uint64
    hash64.restype = ctypes.c_uint64
    total = 0
    for field in ("scene", *fields):
        text = field.encode() if isinstance(field, str) else None
        total = hash64(struct.pack("<Q", field if text is None else len(text)), 8, total)
        total = total if text is None else hash64(text, len(text), total)
    return ctypes.c_int64(total).value


def test_a_scene_whose_id_is_a_path(small, bounce):
    evil = bounce.folder / "evil.sqlite"
    shutil.copy(small.data / "journal.sqlite", evil)
    with sqlite3.connect(evil) as db:
        columns = "SELECT scene, name, owner, added_ms, revision, chk FROM scenes WHERE scene=?"
        *row, check = db.execute(columns, small.ids[:1]).fetchone()
        assert check == scene_sum(*row)
        db.execute("UPDATE scenes SET scene='../../up', chk=? WHERE scene=?",
                   (scene_sum("../../up", *row[1:]), row[0]))
    db.close()
    code, line = refused(bounce, evil, "--frames", bounce.folder / "frames", "--size", "8x8")
    assert code == 4 and "../../up" in line and "an id is" in line


def test_damage_is_said_and_not_mended(small, bounce):
    damaged = bounce.folder / "damaged.sqlite"
    shutil.copy(small.data / "journal.sqlite", damaged)
    with sqlite3.connect(damaged) as db:
        db.execute("UPDATE edits SET forward=zeroblob(length(forward)) WHERE revision=3")
    db.close()
    before = damaged.read_bytes()
    code, line = refused(bounce, damaged)
    assert code == 4 and "damaged" in line and str(damaged) in line
    assert damaged.read_bytes() == before


def test_a_directory_that_a_daemon_holds_is_left_alone(small, bounce):
    held = bounce.folder / "held"
    held.mkdir()
    shutil.copy(small.data / "journal.sqlite", held)
    with open(held / "lock", "w", encoding="ascii") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        code, line = refused(bounce, held)
        assert code == 4 and "a daemon holds" in line


def test_hashes_that_differ_and_a_daemon_that_is_busy(small, fake):
    result = fake("replay", small.data, "--scene", small.ids[0], "--check")
    assert result.returncode == 1
    assert f"5 of 5 revisions differ from the journal's, the first is revision 1 of {small.ids[0]}" \
        in result.stderr
    assert result.stdout.decode().count("DIFFERS") == 5
    sent = [entry["scene_replay"] for entry in fake.asked("scene_replay")[1::2]]
    assert [int(one["revision"]) for one in sent] == [1, 2, 3, 4, 5]
    assert sent[0]["name"] == "box" and "scene" not in sent[0] and sent[1]["scene"] == "s9"
    assert (sent[4]["kind"], sent[4]["of"], sent[1]["client_edit_id"]) == ("undo", "4", "m0")
    assert [entry["revision_name"]["name"] for entry in fake.asked("revision_name")] == ["good"]
    # Content goes as blobs, whole.
    assert fake.asked("blob_put") and all(entry["right"] for entry in fake.asked() if "right" in entry)


def test_a_daemon_that_cannot_go_on(small, fake):
    fake.mode("full")
    result = fake("replay", small.data, "--json")
    assert result.returncode == 5 and json.loads(result.stdout)["message"] == "the disk is full"
