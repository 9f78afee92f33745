"""`bench` itself, small: the bundled Cornell box at 32 pixels, two rungs each."""
import csv
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SCENE = Path(__file__).resolve().parents[1] / "scenes" / "cornell.glb"
SETTINGS = ("--size", "32x32", "--runs", "2", "--technique", "rsm", "--technique", "reference",
            "--ladder", "rsm:vpls=16,256", "--ladder", "reference:spp=2,8", "--reference-spp", "64",
            "--seed", "1", "--seed", "2")
EXIT_DEVICE = 6


def bench(folder, *more, scenes=(SCENE,), **environment):
    words = [sys.executable, "-m", "harness", "bench", *map(str, scenes), *SETTINGS, "--cache",
             str(folder / "cache"), "-o", str(folder / "out"), *more]
    return subprocess.run(words, capture_output=True, text=True, timeout=240, check=False,
                          env={**os.environ, "MPLCONFIGDIR": str(folder), **environment})


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bench")
    done = bench(folder)
    if done.returncode == EXIT_DEVICE:
        pytest.skip(done.stderr)
    assert done.returncode == 0, done.stderr
    result = json.loads((folder / "out" / "bench.json").read_text())
    return folder, done, result


def of(result, technique):
    return [p for p in result["points"] if p["technique"] == technique]


def test_every_rung_is_a_point(run):
    result = run[2]
    assert [p["settings"] for p in of(result, "rsm")] == [{"vpls": "16"}, {"vpls": "256"}]
    assert [p["settings"] for p in of(result, "reference")] == [{"spp": "2"}, {"spp": "8"}]
    assert all(p["state"] == "done" for p in result["points"])
    assert result["device"]["name"] and result["machine"]["cpu"] and result["build"]


def test_times_are_of_frames_that_were_made(run):
    for p in run[2]["points"]:
        time = p["time_ms"]
        assert time["runs"] == 2
        assert 0 < time["frame"]["q1"] <= time["frame"]["median"] <= time["frame"]["q3"]
    for p in of(run[2], "rsm"):
        assert {"shadow_map", "rsm", "vpl_grid", "gbuffer", "gather"} <= set(p["time_ms"]["passes"])


def test_seeds_count_where_they_change_the_picture(run):
    assert [p["seeds"] for p in of(run[2], "rsm")] == [[1], [1]]
    assert [p["seeds"] for p in of(run[2], "reference")] == [[1, 2], [1, 2]]


def test_errors_are_what_is_known_of_these_techniques(run):
    def error(point, against):
        return point["error"][against]["beauty"]["value"]

    coarse, fine = of(run[2], "rsm")
    assert error(fine, "model") < error(coarse, "model")
    assert error(fine, "full") > error(fine, "model")  # one bounce is not all of the light
    few, many = of(run[2], "reference")
    assert error(few, "full") == error(few, "model")
    # Four times the samples, half the error: two seeds of noise stay well within a factor of 1.6.
    assert 2 / 1.6 < error(few, "full") / error(many, "full") < 2 * 1.6


def test_steps_lead_from_the_full_reference_to_the_best_picture(run):
    result = run[2]
    item = next(d for d in result["decomposition"] if d["layer"] == "beauty")
    assert item["technique"] == "rsm" and item["steps"][-1]["name"] == "settings: vpls=256"
    gram = item["gram"]
    assert sum(map(sum, gram)) == pytest.approx(item["total"] ** 2)
    # The same by another way: bounce compare's figure for the best picture.
    best = of(result, "rsm")[1]["error"]["full"]["beauty"]["value"]
    assert item["total"] == pytest.approx(best, rel=1e-4)
    model = of(result, "rsm")[1]["error"]["model"]["beauty"]
    reference = model["figures"]["mean_reference"]["value"]
    assert item["steps"][-1]["rel_rmse"] * item["mean"] == \
        pytest.approx(model["value"] * reference, rel=1e-4)


def test_the_table_holds_the_same(run):
    folder, _, result = run
    with open(folder / "out" / "bench.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 4 * len(result["points"])
    assert float(rows[0]["frame_ms"]) == result["points"][0]["time_ms"]["frame"]["median"]


def test_the_page_is_there_and_answers(run):
    folder, done, result = run
    page = (folder / "out" / "bench.html").read_text(encoding="utf-8")
    assert page.endswith("</html>\n") and "<script" not in page
    assert page.count("data:image/jpeg") >= 4 and page.count("data:image/png") >= 2
    answer = result["summary"]["cornell"]["advice"]
    assert "2 % error" in answer and f"cornell: {answer}" in done.stderr


def test_nothing_is_measured_twice_and_the_cache_is_used(run):
    folder, _, result = run
    again = bench(folder)
    assert again.returncode == 0, again.stderr
    assert "samples a pixel" not in again.stderr
    later = json.loads((folder / "out" / "bench.json").read_text())
    assert [p["time_ms"] for p in later["points"]] == [p["time_ms"] for p in result["points"]]
    assert all(r["seconds"] == 0 for r in later["references"])


def test_a_file_of_the_cache_that_is_not_what_its_name_says_is_made_anew(run):
    folder, _, result = run
    names = [folder / "cache" / r["file"] for r in result["references"]]
    full = next(n for n, r in zip(names, result["references"]) if not r["settings"])
    full.write_bytes(next(n for n in names if n != full).read_bytes())
    again = bench(folder, "--technique", "reference", "-o", str(folder / "other"))
    assert again.returncode == 0, again.stderr
    assert "samples a pixel" in again.stderr


def test_a_program_that_was_built_anew_has_references_of_its_own(run):
    """What it traces may differ, though it calls itself the same."""
    folder, _, result = run
    anew = folder / "bounced"
    anew.write_bytes(Path(os.environ.get("BOUNCED") or shutil.which("bounced")).read_bytes() + bytes(1))
    anew.chmod(0o755)
    again = bench(folder, "--technique", "reference", "-o", str(folder / "anew"), BOUNCED=str(anew))
    assert again.returncode == 0, again.stderr
    later = json.loads((folder / "anew" / "bench.json").read_text())
    assert {r["file"] for r in later["references"]}.isdisjoint(r["file"] for r in result["references"])


def test_a_failing_point_does_not_stop_the_rest(run):
    folder = run[0]
    broken = folder / "broken.glb"
    broken.write_bytes(b"glTF, but not really")
    done = bench(folder, "--ladder", "rsm:vpls=0,16", "-o", str(folder / "partly"),
                 scenes=(broken, SCENE))
    assert done.returncode == 5, done.stderr
    result = json.loads((folder / "partly" / "bench.json").read_text())
    states = [(p["scene"], p["technique"], p["state"]) for p in result["points"]]
    assert states == [("broken", "", "failed"), ("cornell", "rsm", "failed"),
                      ("cornell", "rsm", "done"), ("cornell", "reference", "done"),
                      ("cornell", "reference", "done")]
    assert "vpls" in result["points"][1]["fault"]
    assert (folder / "partly" / "bench.html").is_file()
