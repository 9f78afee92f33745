"""Watches and views, against a made-up daemon."""
import threading

import bounced
import pytest


@pytest.fixture
def scene(peer):
    def on_open(made_up, envelope, _):
        made_up.opened = envelope
        made_up.answer(envelope, view_reply={"view": 7})

    def on_done(made_up, envelope, _):
        made_up.answer(envelope, done={})

    peer.on("view_open", on_open)
    for body in ("view_update", "view_close", "cancel"):
        peer.on(body, on_done)
    return bounced.Scene(peer.client._conn, "s1")


def send_frame(peer, number, **fields):
    peer.answer(peer.opened, b"picture %d" % number, view_frame={
        "view": 7, "number": number, "encoding": "jpg",
        "report": {"size": [4, 4], "revision": number}, **fields})


def test_events_of_a_watch(peer):
    def on_watch(made_up, envelope, _):
        made_up.answer(envelope, done={})
        for revision in (2, 3, 4):
            made_up.answer(envelope, scene_event={"scene": "s1", "kind": "edited",
                                                  "revision": revision, "changes": ["light 0"]})

    peer.on("scene_watch", on_watch)
    peer.on("cancel", lambda made_up, envelope, _: made_up.answer(envelope, done={}))
    seen = []
    for event in bounced.Scene(peer.client._conn, "s1").watch():
        seen.append((event["kind"], event["revision"], event["changes"]))
        if event["revision"] == 3:
            break
    assert seen == [("edited", 2, ["light 0"]), ("edited", 3, ["light 0"])]
    [(watch, _)] = peer.wait_for("scene_watch")
    [(cancel, _)] = peer.wait_for("cancel")  # leaving the loop ended it
    assert watch.scene == "s1" and cancel.request_id == 2
    with peer.client.watch() as everything:
        assert everything.next(5)["revision"] == 2
    assert not peer.wait_for("scene_watch", 2)[1][0].HasField("scene")


def test_a_refused_watch(peer):
    peer.on("scene_watch", lambda made_up, envelope, _: made_up.refuse(
        envelope, "not_found", "no such scene", "scene"))
    with pytest.raises(bounced.NotFound):
        bounced.Scene(peer.client._conn, "s9").watch()


def test_frames_and_credits(peer, scene):
    with scene.view(size=(4, 4), technique="rsm", credits=3, frames_per_second=20) as view:
        opened = peer.wait_for("view_open")[0][0]
        assert (opened.scene, opened.credits, opened.frames_per_second) == ("s1", 3, 20)
        assert opened.frame.encoding == "jpeg" and list(opened.frame.size) == [4, 4]
        assert opened.refine
        send_frame(peer, 1, step=0, age_ms=3.5)
        frame = view.next(5)
        assert (frame.number, frame.encoding, frame.data, frame.age_ms) == (
            1, "jpeg", b"picture 1", 3.5)
        assert frame.report["revision"] == 1 and not frame.final
        assert not [body for body, _, _ in peer.asked if body == "view_credit"]
        send_frame(peer, 2, final=True, step=1)
        assert view.next(5).final
        [(credit, _)] = peer.wait_for("view_credit")
        assert (credit.view, credit.count) == (7, 1)
        with pytest.raises(TimeoutError):
            view.next(0.01)
        assert len(peer.wait_for("view_credit", 2)) == 2  # asking gave the second one back
    assert peer.wait_for("view_close")[0][0].view == 7
    assert view.next() is None


def test_latest_passes_over_what_has_been_followed(peer, scene):
    with scene.view() as view:
        for number in (1, 2, 3):
            send_frame(peer, number)
        view.next(5)
        deadline = threading.Event()
        while view._news.qsize() < 2:
            deadline.wait(0.01)
        assert view.latest(5).number == 3
        credits = peer.wait_for("view_credit", 2)
        assert sum(credit.count for credit, _ in credits) == 2


def test_leaving_a_loop_closes_the_view_and_a_with_keeps_it(peer, scene):
    view = scene.view()
    send_frame(peer, 1)
    for frame in view:
        break
    peer.wait_for("view_close")
    with scene.view() as view:
        send_frame(peer, 1)
        for frame in view:
            break
        send_frame(peer, 2)
        for frame in view:
            assert frame.number == 2
            break
        assert len(peer.wait_for("view_close")) == 1
    peer.wait_for("view_close", 2)


def test_update(peer, scene):
    pose = bounced.Pose((0, 1, 2), (0, 0, 0), yfov=0.8)
    with scene.view(size=(8, 4), camera="Camera", technique="rsm") as view:
        assert view.update(pose=pose) == 1
        assert view.update(size=(16, 8)) == 2
        assert view.update(camera=1) == 3
        assert view.update(refine=False, frames_per_second=5) == 4
        send_frame(peer, 1, sequence=4)
        assert view.next(5).sequence == 4
    moved, resized, back, calmed = [message for message, _ in peer.wait_for("view_update", 4)]
    assert list(moved.pose.eye) == [0, 1, 2] and moved.pose.yfov == 0.8
    assert not moved.pose.up and not moved.HasField("frame") and moved.sequence == 1
    # A frame replaces the whole request: what was said before is said again.
    assert not resized.HasField("pose") and list(resized.frame.size) == [16, 8]
    assert resized.frame.technique == "rsm" and list(resized.frame.pose.eye) == [0, 1, 2]
    assert not resized.frame.HasField("camera")
    assert back.frame.camera == "1" and not back.frame.HasField("pose")
    assert not calmed.HasField("frame") and calmed.refine is False
    assert calmed.HasField("refine") and calmed.frames_per_second == 5


def test_a_refused_update_changes_nothing_here(peer, scene):
    with scene.view(size=(8, 4)) as view:
        peer.on("view_update", lambda made_up, envelope, _: made_up.refuse(
            envelope, "usage", "no such technique", "frame.technique"))
        with pytest.raises(bounced.Error):
            view.update(technique="nonsense")
        peer.on("view_update", lambda made_up, envelope, _: made_up.answer(envelope, done={}))
        view.update(seed=3)
        assert not peer.wait_for("view_update", 2)[1][0].frame.HasField("technique")


def test_a_view_that_the_daemon_ends(peer, scene):
    view = scene.view()
    peer.answer(peer.opened, view_end={"view": 7, "error": {"code": "not_found",
                                                            "message": "the scene was removed"}})
    with pytest.raises(bounced.NotFound, match="removed"):
        view.next(5)
    with pytest.raises(bounced.NotFound):
        view.next(5)
    view = scene.view()
    peer.answer(peer.opened, view_end={"view": 7})
    assert list(view) == []


def test_an_error_behind_the_answer_ends_it(peer, scene):
    view = scene.view()
    peer.refuse(peer.opened, "cancelled", "cancelled")
    with pytest.raises(bounced.Cancelled):
        view.next(5)


def test_closing_wakes_who_waits(peer, scene):
    view = scene.view()
    threading.Timer(0.05, view.close).start()
    assert view.next(10) is None
    view.close()
    assert len(peer.wait_for("view_close")) == 1
