"""Views and watches of a real daemon that renders gradients: over a socket pair and a WebSocket."""
import threading
import time

import bounced
import numpy
import pytest
from conftest import SCENES


@pytest.fixture(params=["private", "websocket"])
def scene(request):
    if request.param == "private":
        with bounced.private() as client:
            yield client.scenes.add(SCENES / "cornell.glb")
        return
    pytest.importorskip("websockets")
    with bounced.connect(request.getfixturevalue("serve")().http) as client:
        yield client.scenes.add(SCENES / "cornell.glb")


def pose_at(angle):
    return bounced.Pose(eye=(3 * numpy.sin(angle), 1, 3 * numpy.cos(angle)), target=(0, 1, 0),
                        yfov=0.8)


def final_of(view):
    """The frames up to one that is final."""
    frames = []
    while not frames or not frames[-1].final:
        frames.append(view.next(20))
    return frames


def test_a_still_picture_gets_better_and_then_final(scene):
    with scene.view(size=(8, 6), encoding="half") as view:
        frames = final_of(view)
        assert [frame.number for frame in frames] == list(range(1, len(frames) + 1))
        assert [frame.final for frame in frames] == [False] * (len(frames) - 1) + [True]
        assert frames[0].step == 0 and frames[-1].step == len(frames) - 1 > 0
        assert frames[-1].rgba.shape == (6, 8, 4) and frames[-1].rgba.dtype == numpy.float32
        assert frames[-1].report["revision"] == 1 and frames[-1].age_ms >= 0
        with pytest.raises(TimeoutError):
            view.next(0.1)


def test_updates_are_seen_by_their_sequence(scene):
    with scene.view(size=(8, 6), refine=False, credits=1) as view:
        assert final_of(view)[-1].sequence == 0
        for angle in (1.0, 2.0):
            sequence = view.update(pose=pose_at(angle))
            assert final_of(view)[-1].sequence == sequence
        sequence = view.update(size=(10, 4), encoding="exr")
        frame = final_of(view)[-1]
        assert frame.sequence == sequence and frame.rgba.shape == (4, 10, 4)
        with pytest.raises(bounced.Error) as caught:
            view.update(technique="x" * 40)
        assert "technique" in caught.value.field
        view.update(size=(6, 6))
        assert (final_of(view)[-1].width, view._options.get("technique")) == (6, None)


def test_who_is_slow_gets_the_newest(scene):
    with scene.view(size=(4, 4), refine=False, credits=1) as view:
        view.next(20)  # its credit is not back yet
        last = [view.update(pose=pose_at(angle)) for angle in numpy.linspace(0, 1, 20)][-1]
        frame = view.latest(20)
        while frame.sequence != last:
            frame = view.next(20)
        assert frame.final and frame.number < 20


def test_a_loop_over_a_view_that_another_thread_closes(scene):
    view = scene.view(size=(4, 4))
    threading.Timer(0.5, view.close).start()
    assert len(list(view)) >= 1


def test_removing_the_scene_ends_its_views_and_is_seen(scene):
    with scene.view(size=(4, 4), refine=False) as view, scene.watch() as watch:
        final_of(view)
        scene.remove()
        with pytest.raises(bounced.NotFound):
            while view.next(20):
                pass
        event = watch.next(20)
        assert (event["kind"], event["scene"]) == ("removed", scene.id)


def test_views_that_are_refused(scene):
    for options, field in (({"size": (0, 4)}, "size"), ({"check": 64}, "check"),
                           ({"pose": bounced.Pose((0, 0, 0), (0, 0, 0))}, "pose")):
        with pytest.raises(bounced.Error) as caught:
            scene.view(**options)
        assert field in caught.value.field
    with pytest.raises(bounced.NotFound):
        bounced.Scene(scene._conn, "nonsense").view()


def test_watching_everything(daemon):
    with daemon.watch() as watch:
        first = daemon.scenes.add(SCENES / "cornell.glb")
        first.remove()
        events = [watch.next(20) for _ in range(2)]
    assert [(event["kind"], event["scene"]) for event in events] == [
        ("added", first.id), ("removed", first.id)]


def test_half_is_the_picture_in_sixteen_bits(scene):
    half, full = (scene.render(size=(7, 5), encoding=encoding) for encoding in ("half", "exr"))
    assert half.encoding == "half" and len(half.data) == 7 * 5 * 8
    numpy.testing.assert_allclose(half.rgba, full.rgba, rtol=1e-3)
    assert list(half.layers) == ["beauty"]


def test_a_watch_outlives_idleness(serve):
    served = serve(options=("--limit", "idle_seconds=1"))
    with bounced.connect(served.tcp) as client, client.watch() as watch:
        time.sleep(2)
        client.scenes.add(SCENES / "cornell.glb")
        assert watch.next(20)["kind"] == "added"
