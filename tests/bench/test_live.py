"""Figures of live scenes, without a daemon: their arithmetic on frames made here, and the slow link."""
import argparse
import dataclasses
import os
import socket
import threading
import time

import numpy
import pytest

import by_hand
import edit_latency
import frame_age
import import_stall
import live
import machine_speed
import many_views


@dataclasses.dataclass
class Frame:
    report: dict
    transient: int = 0
    sequence: int = 0
    age_ms: float = 0
    replaced: int = 0


def report(revision=1, total=0, encode=0, passes=()):
    return {"revision": revision, "time_ms": {"total": total, "encode": encode}, "parameters": {},
            "passes": [{"name": name, "state": state, "ms": ms} for name, state, ms in passes]}


def test_percentiles_of_what_is_known():
    found = live.percentiles(range(101))
    assert (found["count"], found["p50"], found["p95"], found["p99"], found["max"]) == (
        101, 50, 95, 99, 100)
    assert live.percentiles([]) == {"count": 0}


def test_an_interval_holds_what_the_values_come_from():
    values = numpy.random.default_rng(3).normal(10, 2, 400)

    def mean(series, picked):
        return series[picked].mean()
    low, high = live.bootstrap(values, mean)
    assert low < values.mean() < high and .2 < high - low < .6  # 4 sigma / sqrt(400) is .4
    # Values that hang together say less than their number promises.
    wide = numpy.subtract(*live.bootstrap(numpy.repeat(values[:40], 10), mean, block=40)[::-1])
    assert wide > 2 * (high - low)


def test_a_state_is_shown_by_later_frames_too():
    shows = edit_latency.shows
    assert shows(Frame(report(3)), (3, 0)) and shows(Frame(report(4)), (3, 7))
    assert not shows(Frame(report(2), transient=9), (3, 0))
    assert shows(Frame(report(3), transient=2), (3, 2))
    assert not shows(Frame(report(3), transient=1), (3, 2))
    assert shows(Frame(report(), sequence=5), 5) and not shows(Frame(report(), sequence=4), 5)


def test_a_latency_is_the_sum_of_its_shares():
    frame = Frame(report(total=30, encode=4), age_ms=40)
    shares = edit_latency.shares_ms(52, frame)
    assert shares == {"accept": 12, "wait": 6, "render": 30, "encode": 4}
    assert sum(shares.values()) == 52


def test_passes_that_ran_and_that_did_not():
    frames = [Frame(report(passes=[("rsm", "ran", 4), ("gbuffer", "reused", 0)])),
              Frame(report(passes=[("rsm", "ran", 6), ("gbuffer", "ran", 3)]))]
    found = edit_latency.passes_of(frames)
    assert found == {"rsm": {"ran": 1, "ms": 5}, "gbuffer": {"ran": .5, "ms": 3}}
    row = {"technique": "hisr", "refine": False, "kind": "light moved", "durability": "durable",
           **edit_latency.row_of([(10 + i, frames[i % 2]) for i in range(20)])}
    line = edit_latency.line_of(row)
    assert "| light moved | durable, refine=off | 20 |" in line and line.endswith("| rsm |")
    assert line.count("|") == edit_latency.HEAD.split("\n")[0].count("|")


def test_the_goal_is_told_as_measured_and_as_the_machine_allows():
    row = {"technique": "hisr", "kind": "light moved", "durability": "durable", "refine": True,
           "latency_ms": {"p50": 200, "p99": 700}}
    lines = list(edit_latency.verdict({"machine": {"times_slower": 2.5}, "scene": "cornell", "rows": [row]}))
    assert "p50 200 ms, goal 90 ms" in lines[0] and lines[0].endswith("225 ms here: met")
    assert list(edit_latency.verdict({"machine": {"times_slower": 2.5}, "scene": "duck", "rows": [row]})) == []
    assert "2.50 times slower" in lines[1] and lines[1].endswith("missed")


@pytest.mark.parametrize("slower, budget", [(.5, 1), (2, 2), (9, 3)])
def test_the_machine_is_told_by_work_that_is_not_ours(slower, budget, tmp_path):
    """And by no frame: of this build there is nothing that could render one."""
    program = tmp_path / "tests/tools/machine_speed"
    program.parent.mkdir(parents=True)
    program.write_text(f"#!/bin/sh\necho {slower * machine_speed.USUAL_MS}\n")
    program.chmod(0o755)
    found = live.machine(tmp_path)
    assert found["times_slower"] == pytest.approx(slower)
    assert found["budget_factor"] == pytest.approx(budget)


def test_main_rows_get_more_samples():
    plan = edit_latency.plan_of(("hisr",), tuple(edit_latency.KINDS), 200, 50)
    assert len(plan) == len({one[:4] for one in plan}) == 15
    assert ("hisr", True, "light moved", "durable", 200) in plan
    assert ("hisr", True, "material colour", "transient", 50) in plan
    assert {one[3] for one in plan if one[2] == "undo, redo"} == {"durable"}
    assert {one[3] for one in plan if one[2] == "camera moved"} == {"view"}


def test_a_waving_sheet_keeps_its_triangles():
    triangles = edit_latency.grid_triangles(4)
    assert triangles.shape == (18, 3) and triangles.max() == 15
    a, b, c = (edit_latency.grid(4, 0)[triangles[:, i]] for i in range(3))
    assert (numpy.cross(b - a, c - a)[:, 1] > 0).all()  # all face up


def test_ages_are_of_frames_whose_change_is_known():
    taken = [(10.0, 9.95, 20, 0), (10.05, None, 30, 2), (10.1, 10.04, 40, 1)]
    row = frame_age.row_of(taken, 2 + frame_age.WARM_S)
    assert row["age_ms"]["p50"] == pytest.approx(55) and row["age_ms"]["count"] == 2
    assert row["of_unknown_change"] == 1 and row["replaced"] == 3
    assert row["frames_per_second"] == 1.5


def test_a_slow_link_is_as_slow_as_it_says(tmp_path):
    data = os.urandom(40960)
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(str(tmp_path / "far"))
    listener.listen()

    def serve():
        peer, _ = listener.accept()
        peer.sendall(peer.recv(100) + data)
        peer.close()
    threading.Thread(target=serve, daemon=True).start()
    with frame_age.Pipe(tmp_path, f"unix:{tmp_path}/far", 4 * len(data)) as pipe:
        with socket.socket(socket.AF_UNIX) as near:
            near.connect(pipe.url.removeprefix("unix:"))
            near.sendall(b"hello")
            start, got = time.monotonic(), b""
            while len(got) < len(data) + 5:
                got += near.recv(65536)
    assert got == b"hello" + data and .2 < time.monotonic() - start < 2
    listener.close()


def test_growth_is_seen_and_noise_is_not():
    noise = numpy.random.default_rng(5).normal(0, 40, 600)
    def rows(slope):
        return [(100.0 + s, 9000 + slope * s / 60 + noise[s], {"gpu_memory_mib": 1, "unsent_bytes": s})
                for s in range(600)]
    flat, grows = (many_views.memory_of(rows(slope), 100, 700) for slope in (0, 100))
    low, high = flat["slope"]["whole"]["interval"]
    assert low < 0 < high
    low, high = grows["slope"]["whole"]["interval"]
    assert low < 100 < high and low > 50
    assert grows["slope"]["second_half"]["from_s"] == 299.5
    assert grows["unsent_bytes"]["max"] == 599 and grows["rss_kib_max"] > 9900


def test_ages_and_rates_of_a_phase():
    asked = {(0, 1, 0): 5.0, (1, 2, 3): 6.0}
    frames = [[(5.1, 0, 1, 0, 50.0), (5.9, 0, 9, 9, 70.0), (9.0, 0, 1, 0, 1.0)], [(6.3, 1, 2, 3, 90.0)]]
    found = many_views.phase_of(frames, asked, 5.0, 7.0)
    assert found["age_ms"]["max"] == pytest.approx(300) and found["age_ms"]["count"] == 2
    assert found["frames"] == 3 and found["age_when_sent_ms"]["count"] == 3
    assert found["frames_per_second_a_view"] == {"least": .5, "median": .75, "most": 1.0}


class Gone:
    """A client whose daemon does not answer."""

    def stats(self):
        raise ConnectionError("gone")

    def view(self, **_):
        raise ConnectionError("gone")

    @property
    def scenes(self):
        return self

    def add(self, *_):
        return self


@dataclasses.dataclass
class Place:
    """A daemon as far as a client needs one to connect."""
    url: str = ""
    socket_path: str = ""
    pid: int = os.getpid()
    is_stopped: bool = False

    def stop(self):
        self.is_stopped = True

    def connect(self, _):
        return Gone()


def test_a_meter_that_stops_says_why():
    meter = many_views.Meter(Place(), Place())
    meter.start()
    meter.join()
    with pytest.raises(ConnectionError, match="gone"):
        meter.latest()


def test_a_view_that_ends_is_not_waited_for(monkeypatch):
    place = Place()
    monkeypatch.setattr(import_stall, "Daemon", lambda *_: place)
    monkeypatch.setenv("BOUNCED", "bounced")
    with pytest.raises(ConnectionError, match="gone"):
        import_stall.Watched(place, argparse.Namespace(device=None), "")
    assert place.is_stopped


@pytest.mark.parametrize("script", [edit_latency, frame_age, import_stall, many_views])
def test_a_build_without_the_client_is_named_at_once(script, tmp_path, monkeypatch, capsys):
    for variable, place in by_hand.PROGRAMS.items():
        monkeypatch.delenv(variable, raising=False)
        (tmp_path / place).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / place).touch()
    with pytest.raises(SystemExit) as ended:
        script.main([str(tmp_path), "-o", str(tmp_path / "result.json")])
    assert ended.value.code == 2
    assert "bounced_pb2.py" in capsys.readouterr().err.splitlines()[-1]
    for variable in by_hand.PROGRAMS:
        os.environ.pop(variable, None)
