"""Techniques that render wrongly must not pass: pictures are spoilt on their way to the checks."""
import os
import signal
import threading

import numpy as np
import pytest

from conftest import IS_SANITIZED
from harness import stability, techniques
from harness.daemon import Daemon
from harness.hazards import ROWS
from harness.hazards.case import LIGHT, Case
from harness.hazards.row import run


class Liar(Daemon):
    """Passes every picture through `spoil(planes of light, serial number)`."""
    spoil = None

    def render(self, *arguments, **keywords):
        frame = super().render(*arguments, **keywords)
        self.rendered = getattr(self, "rendered", 0) + 1
        if self.spoil:
            light = {name: plane for name, plane in frame.planes.items()
                     if name in "RGB" or name.split(".")[0] in LIGHT}
            self.spoil(light, self.rendered)
        return frame


@pytest.fixture(scope="module")
def liar():
    with Liar(timeout_s=120) as daemon:
        yield daemon


def outcome(daemon, number, spoil, name="rsm", codes="TNSIP"):
    technique = techniques.chosen(daemon, [name])[0]
    daemon.spoil = spoil
    folder = daemon.folder / "scenes"
    folder.mkdir(exist_ok=True)
    return run(ROWS[number], Case(daemon, technique, ROWS[number], folder), codes)


def one_nan(light, _):
    light["indirect.G"][0, -1] = np.nan


def one_infinity(light, _):
    light["R"][0, 0] = np.inf


def one_negative(light, _):
    light["direct.B"][-1, 0] = -1e-30


@pytest.mark.parametrize("spoil,says", [
    (one_nan, "nan in indirect"), (one_infinity, "inf in beauty"), (one_negative, "in direct")])
def test_what_no_picture_may_hold(liar, spoil, says):
    result = outcome(liar, 13, spoil)
    assert result.status == "FAIL" and says in result.seen, result
    assert "row13.glb" in result.command and result.command.startswith("bounce render DIR/")


def scaled(factor):
    def spoil(light, _):
        for plane in light.values():
            plane *= np.float32(factor)
    return spoil


ONCE = pytest.mark.skipif(IS_SANITIZED, reason="Python is the same in both builds")


@ONCE
@pytest.mark.parametrize("number", [1, 5, 11, 24, 37, 48, 51, 53, 57, 59, 60])
def test_a_missing_pi(liar, number):
    assert outcome(liar, number, scaled(np.pi)).status == "FAIL"
    assert outcome(liar, number, scaled(1 / np.pi)).status == "FAIL"


def black(light, _):
    for plane in light.values():
        plane[:] = 0


def grey(light, _):
    """Light where there is none."""
    for plane in light.values():
        plane += np.float32(0.05)


def drifting(light, serial):
    """Each picture brighter than the one before."""
    for plane in light.values():
        plane *= np.float32(1 + 0.01 * (serial % 50))


def mottled(light, serial):
    rng = np.random.default_rng(serial)
    for plane in light.values():
        plane *= rng.uniform(0.5, 1.5, plane.shape).astype(np.float32)


# What these rows hold beside the absence of NaN is told below, or is no light at all.
NOT_ABOUT_LIGHT = {29: "depth", 34: "that something comes at all"}


@ONCE
def test_no_row_believes_everything(liar):
    """Each row is failed by at least one kind of wrong picture."""
    believing = []
    for number, row in ROWS.items():
        if row.check is None or number in NOT_ABOUT_LIGHT:
            continue
        statuses = []
        for spoil in (mottled, grey, black, drifting):  # what catches most first
            statuses.append(outcome(liar, number, spoil).status)
            if statuses[-1] in ("FAIL", "-"):
                break
        if not {"FAIL", "-"} & set(statuses):
            believing.append(number)
    assert not believing


def test_depth_is_looked_at(liar, monkeypatch):
    render = Liar.render

    def off(self, *arguments, **keywords):
        frame = render(self, *arguments, **keywords)
        frame.planes["depth.Z"] = frame.planes["depth.Z"] * np.float32(1.00001)
        return frame

    monkeypatch.setattr(Liar, "render", off)
    assert outcome(liar, 29, None).status == "FAIL"


def test_flags_are_looked_for(liar, monkeypatch):
    render = Liar.render

    def silent(self, *arguments, **keywords):
        frame = render(self, *arguments, **keywords)
        frame.report["flags"] = []
        return frame

    monkeypatch.setattr(Liar, "render", silent)
    for number in (15, 18, 19, 20, 21, 26):
        result = outcome(liar, number, None)
        assert result.status == "FAIL" and "flag" in result.expected, number


def test_a_count_of_bad_pixels_is_looked_at(liar, monkeypatch):
    render = Liar.render

    def counting(self, *arguments, **keywords):
        frame = render(self, *arguments, **keywords)
        frame.report["nonfinite_pixels"] = 3
        return frame

    monkeypatch.setattr(Liar, "render", counting)
    assert outcome(liar, 22, None).status == "FAIL"


class Hanging(Liar):
    """Stops at its second picture."""

    def render(self, *arguments, **keywords):
        self.asked = getattr(self, "asked", 0) + 1
        if self.asked != 2:
            return super().render(*arguments, **keywords)
        os.kill(self._process.pid, signal.SIGSTOP)
        return super().render(*arguments, **{**keywords, "timeout_s": 2})


def test_after_a_hang_the_matrix_goes_on(capsys):
    code = stability.main(["--technique", "direct", "--row", "22", "--row", "62", "--row", "13"],
                          make_daemon=Hanging)
    out = capsys.readouterr().out
    assert code == 1 and "no picture within" in out and "2 pass, 0 flag, 1 FAIL" in out, out
    assert "bounce stability --technique direct --row " in out


def test_a_crash_is_a_failure(liar):
    """The daemon dies with the request in hand."""
    class Crashing(Liar):
        def _run(self, words, shown, timeout_s):
            os.kill(self._process.pid, signal.SIGSTOP)
            killer = threading.Timer(0.3, self._process.kill)
            killer.start()
            try:
                return super()._run(words, shown, timeout_s)
            finally:
                killer.join()

    with Crashing() as daemon:
        technique = techniques.chosen(daemon, ["direct"])[0]
        result = run(ROWS[22], Case(daemon, technique, ROWS[22], daemon.folder))
        assert result.status == "FAIL" and "SIGKILL" in result.seen, result
        assert daemon.deaths == 1
        daemon._run = super(Crashing, daemon)._run
        result = run(ROWS[22], Case(daemon, technique, ROWS[22], daemon.folder))
        assert result.status == "pass", "with the daemon started anew"
