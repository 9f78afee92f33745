"""Connections that break, over a proxy: the session goes on, and everything happens once."""
import struct
import threading
import time

import bounced
import pytest
from conftest import SCENES
from fake_peer import FakePeer
from proxy import Proxy
from stopwatch import Stopwatch


@pytest.fixture(params=["tcp", "http"])
def cuttable(request, serve):
    """(proxy, client): a framed stream, or a WebSocket."""
    if request.param == "http":
        pytest.importorskip("websockets")
    with Proxy(getattr(serve(), request.param)) as proxy, \
            bounced.connect(proxy.address) as client:
        yield proxy, client


@pytest.fixture
def slow(monkeypatch):
    monkeypatch.setenv("BD_FAKE_FRAME_MS", "400")


def wait_until(condition, timeout_s=20):
    until = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.01)


def move(scene, x):
    with scene.edit() as edit:
        edit.set_transform(0, translation=(x, 0, 0))
    return edit.result


def test_what_is_under_way_gets_its_answer(slow, cuttable):
    proxy, client = cuttable
    scene = client.scenes.add(SCENES / "cornell.glb")
    ends = client.stats()["jobs_done"]
    frames = [scene.render_later(size=(8, 8), seed=seed) for seed in (3, 4)]
    wait_until(lambda: client.stats()["jobs_running"])
    proxy.cut()
    assert [frame.result(20).report["seed"] for frame in frames] == [3, 4]
    assert client.stats()["jobs_done"] == ends + 2 and proxy.taken == 2


def test_an_answer_that_was_lost_comes_again(cuttable):
    proxy, client = cuttable
    scene = client.scenes.add(SCENES / "cornell.glb")
    proxy.mute = True
    threading.Timer(0.5, proxy.cut).start()
    assert move(scene, 1).revision == 2
    assert scene.info()["revision"] == 2


def test_a_request_that_was_lost_is_sent_again(cuttable):
    proxy, client = cuttable
    scene = client.scenes.add(SCENES / "cornell.glb")
    proxy.deaf = True
    threading.Timer(0.3, proxy.cut).start()
    assert move(scene, 1).revision == 2
    move(scene, 2)
    proxy.deaf = True
    threading.Timer(0.3, proxy.cut).start()
    assert scene.undo().revision == 4
    assert [entry["kind"] for entry in scene.log()] == ["import", "edit", "edit", "undo"]


def test_requests_that_begin_while_it_is_broken_wait(cuttable):
    proxy, client = cuttable
    scene = client.scenes.add(SCENES / "cornell.glb")
    proxy.is_shut = True
    proxy.cut()

    def heal():
        proxy.is_shut = False

    threading.Timer(0.5, heal).start()
    assert move(scene, 1).revision == 2


def test_views_and_watches_go_on(cuttable):
    proxy, client = cuttable
    scene = client.scenes.add(SCENES / "cornell.glb")
    with scene.view(size=(8, 6), refine=False) as view, scene.watch() as watch:
        assert view.next(20).final
        proxy.cut()
        assert view.next(20).report["revision"] == 1  # a first frame, once more
        move(scene, 1)
        while view.next(20).report["revision"] != 2:
            pass
        event = watch.next(20)
        while event["kind"] == "missed":
            event = watch.next(20)
        assert (event["kind"], event["revision"]) == ("edited", 2)
        sequence = view.update(size=(4, 4))
        while (frame := view.next(20)).sequence != sequence:
            pass
        assert frame.width == 4


def test_breaking_again_and_again(cuttable):
    proxy, client = cuttable
    scene = client.scenes.add(SCENES / "cornell.glb")
    done = threading.Event()

    def cut():
        while not done.wait(0.1):
            proxy.cut()

    cutter = threading.Thread(target=cut)
    cutter.start()
    revisions = []
    try:
        while proxy.taken < 5:
            revisions.append(move(scene, len(revisions)).revision)
    finally:
        done.set()
        cutter.join()
    assert revisions == list(range(2, 2 + len(revisions)))
    assert scene.info()["revision"] == revisions[-1]


def test_an_upload_begins_anew(serve, tmp_path):
    big = tmp_path / "big.glb"
    data = bytearray((SCENES / "cornell.glb").read_bytes())
    data += bytes(6 << 20)  # bytes behind the chunks are no scene: it is the upload that counts
    big.write_bytes(data)
    with Proxy(serve().tcp) as proxy, bounced.connect(proxy.address) as client:
        proxy.cut_after = 3 << 20
        assert client.scenes.add(big).info()["counts"]["triangles"] > 0
        assert proxy.taken == 2


def test_nobody_comes_back(slow, serve):
    served = serve(options=("--limit", "resume_seconds=1"))
    with Proxy(served.tcp) as proxy, bounced.connect(served.tcp) as direct:
        scene = direct.scenes.add(SCENES / "cornell.glb")
        for options, least_s in (({"resume_s": 0}, 0), ({"resume_s": 0.3}, 0.2), ({}, 0.9)):
            with bounced.connect(proxy.address, **options) as client:
                frame = client.scenes.get(scene.id).render_later(size=(8, 8))
                proxy.is_shut = True
                began = time.monotonic()
                proxy.cut()
                with pytest.raises(bounced.Unreachable):
                    frame.result(20)
                assert time.monotonic() - began >= least_s
                with pytest.raises(bounced.Unreachable):
                    client.stats()
            proxy.is_shut = False


def test_a_daemon_that_forgot_the_session_is_no_help(slow, serve):
    served = serve(options=("--limit", "resume_seconds=1"))
    with Proxy(served.tcp) as proxy, bounced.connect(proxy.address, resume_s=20) as client:
        frame = client.scenes.add(SCENES / "cornell.glb").render_later(size=(8, 8))
        client._conn._resumer._patience_s = 20  # longer than the daemon's
        proxy.is_shut = True
        proxy.cut()
        time.sleep(2.5)
        proxy.is_shut = False
        with pytest.raises(bounced.Unreachable):
            frame.result(5)


def test_a_daemon_that_ends_is_not_waited_for(serve, slow):
    served = serve()
    client = bounced.connect("unix:" + served.path)
    client.scenes.add(SCENES / "cornell.glb")
    watch = Stopwatch()
    served.process.kill()
    with pytest.raises(bounced.Unreachable):
        while True:
            client.stats()
    assert watch.own_s() < 3
    client.close()
    served.process.wait()
    served.stop = lambda: None


def test_closing_leaves_nothing_under_way(monkeypatch, serve):
    """The end of a framed stream is no goodbye when it may be resumed."""
    monkeypatch.setenv("BD_FAKE_FRAME_MS", "20000")
    served = serve()
    with bounced.connect(served.tcp) as watcher:
        client = bounced.connect(served.tcp)
        scene = client.scenes.add(SCENES / "cornell.glb")
        view = scene.view(size=(4, 4))
        scene.render_later(size=(8, 8))
        wait_until(lambda: watcher.stats()["jobs_running"])
        watch = Stopwatch()
        client.close()
        wait_until(lambda: watcher.stats()["jobs_cancelled"] >= 1)
        wait_until(lambda: not watcher.stats()["jobs_running"])
        assert watch.own_s() < 5
        with pytest.raises(bounced.Unreachable):
            view.next(5)


class Lives:
    """One session of `client` at made-up daemons, one after the other: each takes up what the one
    before left, and knows of nothing that was asked of it."""

    def __init__(self, count):
        self.peers = [FakePeer(session="s", resume_seconds=10) for _ in range(count)]
        for peer in self.peers:
            peer.on("cancel", lambda made_up, envelope, _: made_up.answer(envelope, done={}))
        first, *self._others = self.peers
        self.client = bounced.Client(first.transport, timeout_s=10, reopen=self._reopen)
        self.scene = bounced.scene.Scene(self.client._conn, "s1")

    def _reopen(self, _):
        return self._others.pop(0).transport

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.client.close()
        for peer in self.peers:
            peer.end()


def change_made(made_up, envelope, _):
    made_up.answer(envelope, edit_reply={"revision": 2})


@pytest.mark.parametrize("body,change", [
    ("edit_batch", lambda scene: move(scene, 1)), ("edit_undo", bounced.scene.Scene.undo),
    ("edit_undo", bounced.scene.Scene.redo), ("edit_commit", bounced.scene.Scene.commit),
    ("edit_revert", lambda scene: scene.revert(1))])
def test_a_change_that_is_sent_again_is_known_by_its_id(body, change):
    """The daemon may have carried it out and have had no room for the answer."""
    with Lives(2) as lives:
        before, after = lives.peers
        before.on(body, lambda made_up, *_: made_up.hang_up())
        after.on(body, change_made)
        change(lives.scene)
        change(lives.scene)
        [(first, _)], [(again, _), (another, _)] = before.wait_for(body), after.wait_for(body, 2)
        assert first.client_edit_id == again.client_edit_id != ""
        assert another.client_edit_id not in ("", first.client_edit_id)


@pytest.mark.parametrize("answer", [struct.pack("<II", 8, 4) + b"\xff" * 4, b"half a un"])
def test_nonsense_instead_of_the_session_is_not_the_end(answer):
    def say_nonsense(made_up, *_):
        made_up.raw(answer)
        made_up.hang_up()

    with Lives(3) as lives:
        before, confused, after = lives.peers
        before.on("edit_undo", lambda made_up, *_: made_up.hang_up())
        confused.on("hello", say_nonsense)
        after.on("edit_undo", change_made)
        undo = threading.Thread(target=lives.scene.undo, daemon=True)
        undo.start()
        undo.join(20)
        assert not undo.is_alive()
        assert confused.transport._sock.fileno() == -1
