"""Connections: addresses, tokens, threads, and every way in which a peer can go away."""
import gc
import os
import threading
import time

import bounced
import pytest
from conftest import SCENES
from fake_peer import FakePeer


def test_private_daemon_tells_what_it_is_and_ends_with_its_client():
    with bounced.private(limits={"jobs_per_client": 7}) as client:
        assert client.limits["jobs_per_client"] == 7
        assert client.limits["reply_bytes"] == (1 << 32) - 1
        assert "render" in client.capabilities and client.build
        assert client.device["software"] is True
        pid = client._daemon.pid
        assert client.stats()["connections"] == 1
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)
    with pytest.raises(bounced.Unreachable):
        client.stats()
    client.close()


def test_a_private_daemon_that_refuses_its_options_says_so(monkeypatch):
    with pytest.raises(bounced.Error) as caught:
        bounced.private(limits={"jobs_per_client": 0})
    assert caught.value.code == "usage" and "code 2" in caught.value.message
    monkeypatch.setenv("BOUNCED", "/nowhere/bounced")
    with pytest.raises(bounced.Unreachable, match="/nowhere/bounced"):
        bounced.private()


def test_a_private_daemon_that_is_killed(daemon):
    os.kill(daemon._daemon.pid, 9)
    with pytest.raises(bounced.Unreachable, match="SIGKILL"):
        for _ in range(100):  # it may have sent an answer yet
            daemon.stats()
            time.sleep(0.01)


def test_unix_tcp_and_the_default_socket(serve, monkeypatch):
    served = serve()
    for address in ("unix:" + served.path, served.tcp):
        with bounced.connect(address) as client:
            assert list(client.scenes) == []
    monkeypatch.setenv("XDG_RUNTIME_DIR", os.path.dirname(served.path))
    os.symlink(served.path, os.path.join(os.path.dirname(served.path), "bounced.sock"))
    with bounced.connect() as client:
        assert client.scenes.list() == []


def test_tokens(serve):
    served = serve(token="correct-horse-battery")
    with bounced.connect(served.tcp, token="correct-horse-battery") as client:
        assert client.scenes.list() == []
    for token in (None, "wrong"):
        with pytest.raises(bounced.Error) as caught:
            bounced.connect(served.tcp, token)
        assert caught.value.code == "unauthorized"


@pytest.mark.parametrize("address,code", [
    ("unix:/nowhere/s.sock", "unreachable"), ("tcp:127.0.0.1:1", "unreachable"),
    ("tcp:127.0.0.1", "usage"), ("tcp::80", "usage"), ("tcp:h:99999", "usage"),
    ("nowhere", "usage"), ("unix:", "usage"), ("http://", "usage"),
])
def test_addresses_that_lead_nowhere(address, code):
    with pytest.raises(bounced.Error) as caught:
        bounced.connect(address, timeout_s=5)
    assert caught.value.code == code and caught.value.field == "server"


def test_no_default_socket_without_a_runtime_folder(monkeypatch):
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    with pytest.raises(bounced.Unreachable, match="XDG_RUNTIME_DIR"):
        bounced.connect()


def test_a_silent_client_is_not_forgotten(serve):
    served = serve(options=("--limit", "idle_seconds=1"))
    with bounced.connect(served.tcp) as client:
        time.sleep(2.5)
        assert client.stats()["connections"] == 1


def test_errors_carry_code_field_and_message(daemon):
    with pytest.raises(bounced.NotFound) as caught:
        daemon.scenes.get("nonsense")
    assert caught.value.code == "not_found" and "nonsense" in str(caught.value)
    assert caught.value.field == "scene" or caught.value.field


def test_answers_find_their_requests_in_whatever_order(peer):
    waiting = []

    def on_render(made_up, envelope, _):
        waiting.append(envelope)
        if len(waiting) == 3:
            for request in reversed(waiting):
                seed = request.render.frame.seed
                made_up.answer(request, render_reply={"report": {"seed": seed}})

    peer.on("render", on_render)
    scene = bounced.Scene(peer.client._conn, "s")
    frames = [scene.render_later(seed=seed) for seed in (5, 6, 7)]
    assert [frame.result(10).report["seed"] for frame in frames] == [5, 6, 7]


def test_one_connection_serves_many_threads(scene):
    seeds, errors = [], []

    def work(first):
        try:
            for seed in range(first, first + 10):
                seeds.append((seed, scene.render(size=(8, 8), seed=seed).report["seed"]))
        except Exception as error:  # shown by the assertion below
            errors.append(error)

    threads = [threading.Thread(target=work, args=(10 * n,)) for n in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert not errors and len(seeds) == 80 and all(asked == got for asked, got in seeds)


def test_cancel_and_timeout(peer):
    def on_cancel(made_up, envelope, _):
        made_up.answer(envelope, done={})
        made_up.send(pb_error(envelope.cancel.request_id, "cancelled"))

    peer.on("cancel", on_cancel)
    pending = bounced.Scene(peer.client._conn, "s").render_later()
    with pytest.raises(TimeoutError):
        pending.result(0.01)
    assert not pending.done()
    pending.cancel()
    with pytest.raises(bounced.Cancelled):
        pending.result(10)
    [(cancel, _)] = peer.wait_for("cancel")
    assert cancel.request_id == pending.request_id
    pending.cancel()  # of what has ended: nothing
    assert len(peer.wait_for("cancel")) == 1


def pb_error(request_id, code):
    import bounced_pb2 as pb
    envelope = pb.Envelope(request_id=request_id)
    envelope.error.code, envelope.error.message = code, "because of a test"
    return envelope


def test_an_interrupted_wait_cancels(peer, monkeypatch):
    pending = bounced.Scene(peer.client._conn, "s").render_later()

    def interrupted(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(pending._future, "result", interrupted)
    with pytest.raises(KeyboardInterrupt):
        pending.wait()
    peer.wait_for("cancel")


def test_a_frame_that_a_deadline_stopped_has_its_report(peer):
    peer.on("render", lambda made_up, envelope, _: made_up.answer(envelope, error={
        "code": "deadline", "message": "late",
        "details": {"report": {"stopped": "deadline", "passes": [{"name": "rsm"}]}}}))
    with pytest.raises(bounced.Deadline) as caught:
        bounced.Scene(peer.client._conn, "s").render()
    assert caught.value.report["passes"] == [{"name": "rsm"}]


def test_progress_is_passed_on_and_its_faults_are_the_frames(peer):
    def on_render(made_up, envelope, _):
        if envelope.render.progress:
            made_up.answer(envelope, progress={"stage": "import"})
            made_up.answer(envelope, progress={"stage": "render", "share": 0.5})
        made_up.answer(envelope, render_reply={})

    peer.on("render", on_render)
    scene, seen = bounced.Scene(peer.client._conn, "s"), []
    scene.render(progress=lambda *news: seen.append(news))
    assert seen == [("import", None), ("render", 0.5)]
    with pytest.raises(ZeroDivisionError):
        scene.render(progress=lambda *_: 1 // 0)
    assert scene.render().encoding == ""  # and the connection goes on


@pytest.mark.parametrize("last_words", [
    b"", b"\x01", b"\xff" * 64, b"\x04\0\0\0\xff\0\0\0", b"\x08\0\0\0\4\0\0\0\xff\xff\xff\xff",
    b"\xff\xff\xff\xff\x04\0\0\0abcd"])
def test_nonsense_and_silence_end_whatever_waits(peer, last_words):
    scene = bounced.Scene(peer.client._conn, "s")
    pending = [scene.render_later() for _ in range(3)]
    watch = []
    peer.on("scene_watch", lambda made_up, envelope, _: made_up.answer(envelope, done={}))
    watch = scene.watch()
    peer.raw(last_words)
    peer.hang_up()
    for frame in pending:
        with pytest.raises(bounced.Unreachable):
            frame.result(10)
    with pytest.raises(bounced.Unreachable):
        watch.next(10)
    with pytest.raises(bounced.Unreachable):
        scene.info()


def test_the_reason_that_a_server_gives_before_it_closes_is_told(peer):
    def on_stats(made_up, *_):
        made_up.send(pb_error(0, "busy"))
        made_up.hang_up()

    peer.on("stats", on_stats)
    with pytest.raises(bounced.Error, match="because of a test") as caught:
        peer.client.stats()
    assert caught.value.code == "busy"


def test_an_answer_of_another_kind_is_no_answer(peer):
    peer.on("scene_list", lambda made_up, envelope, _: made_up.answer(envelope, done={}))
    with pytest.raises(bounced.Unreachable, match="scene_list was answered by done"):
        peer.client.scenes.list()


def test_closing_ends_what_waits_in_another_thread(peer):
    pending = bounced.Scene(peer.client._conn, "s").render_later()
    threading.Timer(0.05, peer.client.close).start()
    with pytest.raises(bounced.Unreachable, match="closed"):
        pending.result(10)


def test_nothing_is_left_of_closed_connections():
    def count():
        gc.collect()
        return len(os.listdir("/proc/self/fd")), threading.active_count()

    counts = []
    for _ in range(5):
        with FakePeer() as made_up:
            made_up.on("stats", lambda peer, envelope, _: peer.answer(envelope, stats_reply={}))
            made_up.client.stats()
        made_up._sock.close()
        with bounced.private() as client:
            client.scenes.add(SCENES / "cornell.glb").render(size=(4, 4))
        counts.append(count())
    assert len(set(counts)) == 1, counts


def test_words_of_others_do_not_command_a_terminal():
    assert bounced.plain("K\u00fcche \u20ac \u2764\ufe0f") == "K\u00fcche \u20ac \u2764\ufe0f"
    assert bounced.plain("a\u202eb\u200bc\x1b[2J\n\u2066\ud800\u3164\U000e0041") == "a?b?c?[2J?????"
    assert str(bounced.NotFound("no \u202e here", "x\u200by")) == "not_found: no ? here (x?y)"
