"""Spot checks and error targets as a user asks for them: figures, lines, exit codes."""
import json
import re

import pytest

from conftest import BOUNCE, HERE
from skips import skip_without_device

CORNELL = HERE / "../scenes/cornell.glb"
SIZE = ("--size", "40x40")


@pytest.fixture(scope="module", autouse=True)
def device(tmp_path_factory):
    """Skips the whole file where no device works: the only test that may."""
    skip_without_device(BOUNCE, tmp_path_factory)


def render(bounce, *words, scene=CORNELL, code=0):
    result = bounce("render", scene, "-o", "out.exr", "--report", "r.json", *SIZE, *words,
                    timeout=120)
    assert result.returncode == code, result.stderr
    return json.loads((bounce.folder / "r.json").read_text()), result


def test_a_check_is_reported(bounce):
    report, result = render(bounce, "--technique", "rsm", "--check", "100", "--set", "vpls=64")
    error, of_model = report["error"]
    assert error["metric"] == "rel_rmse" and error["against"] == "full" and error["samples"] == 100
    assert of_model["against"] == "model" and of_model["low"] <= of_model["value"]
    # One bounce through walls, for many bounces: far off, and not by an order of magnitude.
    assert 0.05 < error["low"] <= error["value"] <= error["high"] < 1
    assert report["stopped"] == "complete" and report["time_ms"]["check"] > 0
    line = re.search(r"^error ([\d.]+) % \(([\d.]+) - ([\d.]+) %\) against full, 100 pixels$",
                     result.stdout.decode(), re.M)
    assert line, result.stdout
    assert re.search(r"^error .* against model, 100 pixels$", result.stdout.decode(), re.M)
    assert [float(figure) / 100 for figure in line.groups()] == pytest.approx(
        [error["value"], error["low"], error["high"]], rel=0.01)


def test_a_frame_without_check_has_none(bounce):
    report, result = render(bounce, "--set", "vpls=64")
    assert report["error"] == [] and report["time_ms"]["check"] == 0
    assert b"error" not in result.stdout


def test_a_target_that_is_reached(bounce):
    report, result = render(bounce, "--target-error", "80", "--set", "vpls=16")
    assert report["stopped"] == "target" and report["error"][0]["high"] < 0.8
    assert b"stopped: target" in result.stdout
    assert (bounce.folder / "out.exr").stat().st_size > 0


def test_a_target_is_of_the_whole_equation_unless_the_model_is_named(bounce):
    """What a technique leaves out by design is an error that a user sees."""
    room = HERE / "../scenes/cube_room.glb"
    report, result = render(bounce, "--target-error", "5", "--technique", "direct", scene=room, code=5)
    assert report["stopped"] == "floor" and report["error"][0]["low"] > 0.4
    (floor,) = [flag for flag in report["flags"] if flag.startswith("error_floor: ")]
    assert re.search(r"% against full; 5 % reached by: reference spp=\d+", floor), floor
    assert floor in result.stderr
    report, result = render(bounce, "--target-error", "5:model", "--technique", "direct", scene=room)
    assert report["stopped"] == "target"
    assert [error["against"] for error in report["error"]] == ["model", "full"]
    assert report["error"][0]["high"] < 0.05 and report["error"][1]["low"] > 0.4


def test_a_floor_is_a_picture_and_exit_code_5(bounce):
    report, result = render(bounce, "--target-error", "1", "--technique", "direct", code=5)
    assert report["stopped"] == "floor"
    assert report["error"][0]["low"] > 0.1
    (floor,) = [flag for flag in report["flags"] if flag.startswith("error_floor: ")]
    assert "against full" in floor and "rsm" in floor
    assert "error_floor" in result.stderr
    assert (bounce.folder / "out.exr").stat().st_size > 0


def test_out_of_time_is_a_picture_and_exit_code_5(bounce):
    # The upper rungs of the ladder take far longer than that, at this size; on a busy machine the first one
    # may do so too, and then there is no picture yet.
    for deadline_ms in (3000, 12000, 48000):
        report, _ = render(bounce, "--target-error", "0.0001:model", "--deadline-ms", str(deadline_ms), "--size",
                           "300x300", scene=HERE / "../scenes/two_lights.glb", code=5)
        assert report["stopped"] == "deadline"
        if (bounce.folder / "out.exr").exists():
            break
    assert (bounce.folder / "out.exr").stat().st_size > 0


@pytest.mark.parametrize("words,says", [
    (("--technique", "reference", "--check", "64"), "checked against"),
    (("--technique", "reference", "--target-error", "5"), "checked against"),
    (("--check", "8"), "from 16 to 65536"),
    (("--target-error", "5:truth"), "full or model"),
])
def test_refusals(bounce, words, says):
    result = bounce("render", CORNELL, "-o", "out.exr", *SIZE, *words)
    assert result.returncode == 2 and says in result.stderr, result.stderr
    assert not (bounce.folder / "out.exr").exists()


