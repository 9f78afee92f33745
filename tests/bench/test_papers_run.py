"""One figure of a paper for real, small: 16 pixels, of a scene that the folder has and four it lacks."""
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from harness.bench import compare
from harness.bench.papers import errors
from harness.daemon import Daemon, NoDevice

SCENE = Path(__file__).resolve().parents[1] / "scenes" / "cornell.glb"
EXIT_FAILED, EXIT_DEVICE = 5, 6


def bench(folder, scenes, *more, figures="gather_or_splat", shrink=64):
    words = [sys.executable, "-m", "harness", "bench", "--figures", figures, "--scenes", str(scenes),
             "--shrink", str(shrink), "--runs", "2", "-o", str(folder / "out"), *more]
    return subprocess.run(words, capture_output=True, text=True, timeout=240, check=False,
                          env={**os.environ, "MPLCONFIGDIR": str(folder)})


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("papers")
    (folder / "scenes").mkdir()
    shutil.copyfile(SCENE, folder / "scenes" / "cornell_box_spot_side.glb")
    done = bench(folder, folder / "scenes")
    if done.returncode == EXIT_DEVICE:
        pytest.skip(done.stderr)
    assert done.returncode == 0, done.stderr
    return folder, done, json.loads((folder / "out" / "papers.json").read_text())


def test_what_is_there_is_measured_and_what_is_not_is_named(run):
    folder, done, result = run
    (group,) = result["groups"]
    assert (group["figure"], group["name"]) == ("gather_or_splat", "cornell_box_spot_side")
    assert group["build"] and group["machine"]["cpu"] and "--shrink 64" in group["command"]
    assert str(folder) not in json.dumps(result["groups"])
    for name in ("cornell_dragon_bunny", "sponza_dabrovic", "sibenik", "garden"):
        assert f"{name}.glb is not in {folder / 'scenes'}" in done.stderr
    assert len(result["notes"]) == 5  # the group of thresholds wants the dragon, too


def test_points_are_what_is_known_of_these_techniques(run):
    points = {p["label"]: p for p in run[2]["groups"][0]["points"]}
    assert [points[label]["time_ms"]["runs"] for label in ("full", "gather", "splat")] == [1, 2, 2]
    assert "gather" in points["gather"]["time_ms"]["passes"] and "splat" in points["splat"]["time_ms"]["passes"]
    for label in ("gather", "splat"):
        # A lamp without a cone has six faces, of 7x7 VPLs each.
        assert points[label]["size"] == 16 and points[label]["counts"]["vpls"] == 294
        # 16 pixels are fewer than a coarsest block has: all are lit, and nothing is off.
        assert points[label]["counts"]["fragments"] == 256
        assert 0 <= points[label]["error"]["full"]["rel_rmse"] < 1e-5


def test_the_page_and_the_table_hold_it(run):
    out = run[0] / "out"
    text = (out / "papers.html").read_text(encoding="utf-8")
    assert text.endswith("</html>\n") and "splatting over gathering, stage: cornell_box_spot_side" in text
    assert "sibenik.glb is not in" in text and (out / "gather_or_splat.svg").is_file()
    assert (out / "papers.csv").read_text().count("cornell_box_spot_side") >= 3


def test_nothing_is_measured_twice(run):
    folder, _, result = run
    again = bench(folder, folder / "scenes")
    assert again.returncode == 0 and "measured before" in again.stderr
    assert json.loads((folder / "out" / "papers.json").read_text())["groups"] == result["groups"]
    other = bench(folder, folder / "scenes", "--runs", "1")  # other points, by their key
    assert other.returncode == 0 and "measured before" not in other.stderr


def test_a_folder_without_any_of_the_scenes_is_a_mistake(tmp_path):
    done = bench(tmp_path, tmp_path)
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert f"--scenes {tmp_path}: has none of the scenes of these figures" in done.stderr


def test_a_scene_that_is_broken_fails_its_group_alone(run, tmp_path):
    folder = run[0]
    scenes = tmp_path / "scenes"
    shutil.copytree(folder / "scenes", scenes)
    (scenes / "sibenik.glb").write_bytes(b"glTF, but not really")
    done = bench(tmp_path, scenes)
    assert done.returncode == EXIT_FAILED and "sibenik: failed:" in done.stderr
    result = json.loads((tmp_path / "out" / "papers.json").read_text())
    assert [g["name"] for g in result["groups"]] == ["cornell_box_spot_side"]


def test_a_film_moves_as_its_light_does(run, tmp_path):
    done = bench(tmp_path, run[0] / "scenes", figures="films", shrink=8)
    assert done.returncode == 0, done.stderr
    (group,) = json.loads((tmp_path / "out" / "papers.json").read_text())["groups"]
    points = {p["label"]: p for p in group["points"]}
    assert "motion" not in points["truth"] and points["truth"]["time_ms"]["runs"] == 12
    still = points["4096 VPLs"]["motion"]
    # The light moves by less than a per cent from frame to frame; virtual lights on a grid jump.
    assert 0 < still["true"] < .1 and 0 < still["value"] < 1
    text = (tmp_path / "out" / "papers.html").read_text(encoding="utf-8")
    assert "flicker of hisr over that of 4,096 regular VPLs: " in text and "teapot_box.glb is not in" in text
    assert text.count("not measured") == 35  # of 38 claims; B5.3 is not redrawn, and B1.10 and B2.10 are told of


def test_errors_are_those_of_compare(tmp_path):
    try:
        with Daemon() as daemon:
            files = [tmp_path / "full.exr", tmp_path / "blocks.exr"]
            frames = [daemon.render(SCENE, technique, {"vpls": 16, "brdf": "lambert"}, size=(96, 96),
                                    layers=("beauty", "indirect"), keep=file)
                      for technique, file in zip(("rsm", "multires_gather"), files)]
            figures = compare.measured(daemon, *files)["indirect"]
    except NoDevice as fault:
        pytest.skip(str(fault))
    ours = errors.between(*(frame.layer("indirect") for frame in frames))
    assert figures["value"] > 1e-3  # else both could be anything
    assert ours["rel_rmse"] == pytest.approx(figures["value"], rel=1e-5)
    assert ours["rmse_max"] == pytest.approx(figures["figures"]["rmse_max"]["value"], rel=1e-5)
    assert ours["signed"] == pytest.approx(figures["signed"], rel=1e-3)
