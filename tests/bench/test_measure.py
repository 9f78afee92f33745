"""Frames, timed and kept: against a daemon that is made up, and dies when it is told to."""
import types
from pathlib import Path

import numpy
import pytest

from harness.bench.measure import Stage, pictures, timed, times_of, whole_frame_ms
from harness.daemon import DaemonDied

SCENE = Path("box.glb")
QUICK = types.SimpleNamespace(asked="quick", keeps_nothing=False)
EXACT = types.SimpleNamespace(asked="exact", keeps_nothing=True)


def frame(total, gather, state="ran"):
    return {"time_ms": {"total": total, "load": 5, "compile": 7, "encode": 1, "gpu": gather + 1},
            "passes": [{"name": "gather", "ms": gather, "state": state},
                       {"name": "rsm", "ms": 9, "state": "reused"}]}


def test_times_leave_out_what_a_new_frame_does_not_do_again():
    assert whole_frame_ms(frame(20, 4)) == 7
    times = times_of([frame(20, 4), frame(22, 6), frame(30, 5)])
    assert times["frame"] == {"median": 9, "q1": 8, "q3": 13}
    assert times["passes"] == {"gather": {"median": 5, "q1": 4.5, "q3": 5.5}}
    assert times["runs"] == 3


class FakeDaemon:
    """Counts; `dies` is the number of the frame in which it ends. Pictures follow the seed of
    technique "exact" alone."""

    def __init__(self, dies=None):
        self.held, self.asked, self.dies = 0, [], dies

    def hold(self, path):
        self.held += 1
        return {"id": f"{path.stem}-{self.held}", "hash": "sha256:0"}

    def report(self, scene, technique, settings, extra=(), **more):
        self.asked.append((scene, *extra[1:]))
        if len(self.asked) == self.dies:
            raise DaemonDied("gone", "bounce render")
        return frame(20 + len(self.asked), 4)

    def render(self, scene, technique, settings, seed=0, keep=None, **more):
        keep.touch()
        value = seed if technique == "exact" else 7
        return types.SimpleNamespace(planes={"R": numpy.full((2, 2), value)})


def test_new_frames_and_moved_cameras_take_turns_after_a_warm_up():
    daemon = FakeDaemon()
    time, last = timed(Stage(daemon, (8, 8), None), SCENE, QUICK, {}, 2, 1)
    assert [kind for _, kind in daemon.asked] == ["all", "camera"] * 3
    assert daemon.held == 1
    # The third frame is the first that counts: 23 ms, of which 13 are not the frame's own.
    assert time["frame"]["median"] == (10 + 12) / 2 and time["camera_moved"]["median"] == 12
    assert last["time_ms"]["total"] == 25


def test_a_reference_has_one_kind_of_frame():
    daemon = FakeDaemon()
    time, _ = timed(Stage(daemon, (8, 8), None), SCENE, EXACT, {}, 2, 1)
    assert [kind for _, kind in daemon.asked] == ["all"] * 3
    assert time["camera_moved"] == time["frame"]


def test_the_daemon_that_follows_a_dead_one_is_given_the_scene_again():
    daemon = FakeDaemon(dies=2)
    stage = Stage(daemon, (8, 8), None)
    with pytest.raises(DaemonDied):
        timed(stage, SCENE, QUICK, {}, 1, 1)
    timed(stage, SCENE, QUICK, {}, 1, 1)
    assert [scene for scene, _ in daemon.asked] == ["scene:box-1"] * 2 + ["scene:box-2"] * 4


def test_seeds_end_where_they_change_nothing(tmp_path):
    stage = Stage(FakeDaemon(), (8, 8), None)

    def seeds_of(technique):
        return pictures(stage, SCENE, technique.asked, {}, [3, 5, 8],
                        lambda seed: tmp_path / f"{technique.asked}-{seed}")

    assert seeds_of(QUICK) == [3] and seeds_of(EXACT) == [3, 5, 8]
    names = sorted(p.name for p in tmp_path.iterdir())
    assert names == ["exact-3", "exact-5", "exact-8", "quick-3"]
