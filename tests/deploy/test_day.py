"""deploy/gpu_day: legs that end in time and say what they did not do, and figures made of them."""
import json
import pathlib
import subprocess
import sys
import tarfile
import time

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "deploy/day"), str(ROOT / "clients")]
import collect  # noqa: E402
import host  # noqa: E402
import legs  # noqa: E402
import pack  # noqa: E402
import run  # noqa: E402
import steps  # noqa: E402


def step(name, script, seconds=30, alone=False, **more):
    return {"name": name, "suite": "made_up", "words": ["/bin/sh", "-c", script], "environment": {},
            "seconds": seconds, "alone": alone, **more}


def results(tmp_path, todo, seconds=30, width=2):
    outcomes = steps.Runner(todo, tmp_path, {"PATH": "/usr/bin:/bin"}, seconds, width).run()
    return {outcome["name"]: outcome for outcome in outcomes}


# --- steps ----------------------------------------------------------------------------------------

def test_what_steps_end_with(tmp_path):
    got = results(tmp_path, [
        step("good", "echo fine"), step("bad", "echo why; exit 3"), step("skips", "exit 77"),
        step("ends", "exit 2", ends=(2,)), step("slow", "echo begun; sleep 30", seconds=.3),
        step("killed", "kill -9 $$"), {**step("lost", ""), "words": ["/nowhere/program"]}])
    assert {name: outcome["result"] for name, outcome in got.items()} == {
        "good": "passed", "bad": "failed", "skips": "skipped", "ends": "passed", "slow": "late",
        "killed": "failed", "lost": "failed"}
    assert got["bad"]["said"] == "why\n" and "said" not in got["good"]
    assert "/nowhere/program" in got["lost"]["said"]
    assert (tmp_path / "good.txt").read_text() == "fine\n"


def test_the_legs_end_is_kept(tmp_path):
    start = time.monotonic()
    got = results(tmp_path, [step("runs", "sleep 30"), step("waits", "true", alone=True)], seconds=.4)
    assert time.monotonic() - start < 10
    assert got["runs"]["result"] == "cut" and got["waits"]["result"] == "not run"


def test_what_goes_on_keeps_what_it_has(tmp_path):
    script = f"trap 'echo kept >{tmp_path}/kept; exit 130' INT; echo begun; while :; do sleep .05; done"
    got = results(tmp_path, [step("bench", script, goes_on=True)], seconds=.6)
    assert got["bench"]["result"] == "cut" and (tmp_path / "kept").read_text() == "kept\n"


def test_nothing_is_left_behind(tmp_path):
    """A test's daemon outlives neither the test nor the leg."""
    results(tmp_path, [step("leaves", f"sleep 60 & echo $! >{tmp_path}/pid")])
    pid = (tmp_path / "pid").read_text().strip()
    for _ in range(100):
        status = pathlib.Path(f"/proc/{pid}/stat")
        if not status.exists() or status.read_text().split()[2] == "Z":
            return
        time.sleep(.02)
    pytest.fail(f"process {pid} is still there")


def test_those_that_measure_are_alone(tmp_path):
    log = tmp_path / "order"
    script = f"echo begin >>{log}; sleep .1; echo end >>{log}"
    results(tmp_path, [step(f"alone{i}", script, alone=True) for i in range(3)])
    assert log.read_text().split() == ["begin", "end"] * 3


# --- what is packed -------------------------------------------------------------------------------

def test_places_are_named_by_words(tmp_path):
    places = pack.Places(ROOT / "build-x")
    test = {"name": "t", "suite": ["bounced:golden"], "timeout": 60, "is_parallel": False,
            "cmd": ["/usr/bin/python3", f"{ROOT}/tests/golden/t.py", f"{ROOT}/build-x/server/bounced"],
            "env": {"BD_SHARED_DIR": f"{ROOT}/../shared", "BD_BUILD_DIR": f"{ROOT}/build-x"}}
    entry = pack.entry(test, places)
    assert entry["words"] == ["@PYTHON@", "@SOURCE@/tests/golden/t.py", "@BUILD@/server/bounced"]
    assert entry["environment"] == {"BD_SHARED_DIR": "@SCENES@", "BD_BUILD_DIR": "@BUILD@"}
    assert entry["suite"] == "golden" and entry["alone"]
    there = run.places(tmp_path)
    assert run.placed(entry["words"][2], there) == str(run.ROOT / "build/server/bounced")


def test_legs_fit_their_time():
    assert legs.LEG_SECONDS + steps.INTERRUPT_S + 15 <= 9 * 60
    for name, leg in legs.LEGS.items():
        assert leg.suites or leg.benches, name
        assert sum(bench.seconds for bench in leg.benches) <= leg.seconds <= legs.LEG_SECONDS, name
    for path in legs.scene_files():
        assert path.startswith(("scenes/", "references/"))


def test_the_hosts_driver_is_found(tmp_path, monkeypatch):
    described = tmp_path / "egl"
    described.mkdir()
    (described / "10_nvidia.json").write_text("{}")
    monkeypatch.setattr(host, "MOUNTED_FOLDERS", (str(described),))
    monkeypatch.setattr(host, "MOUNTED_LIBRARIES", ())
    monkeypatch.setattr(host, "VENDOR_FOLDERS", (str(tmp_path / "no"),))
    variable = "__EGL_VENDOR_LIBRARY_FILENAMES"
    assert host.driver_environment(tmp_path, {}) == {variable: str(described / "10_nvidia.json")}
    assert host.driver_environment(tmp_path, {variable: "mine"}) == {}
    # Where glvnd finds one by itself, nothing is said.
    monkeypatch.setattr(host, "VENDOR_FOLDERS", (str(described),))
    assert host.driver_environment(tmp_path, {}) == {}
    # A mounted library and no description of it.
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / host.VENDOR_LIBRARY).write_text("")
    monkeypatch.setattr(host, "VENDOR_FOLDERS", ())
    monkeypatch.setattr(host, "MOUNTED_FOLDERS", ())
    monkeypatch.setattr(host, "MOUNTED_LIBRARIES", (str(tmp_path / "lib"),))
    found = host.driver_environment(tmp_path, {"LD_LIBRARY_PATH": "/before"})
    assert found["LD_LIBRARY_PATH"] == f"/before:{tmp_path / 'lib'}"
    assert host.VENDOR_LIBRARY in pathlib.Path(found[variable]).read_text()


# --- what is made of it ---------------------------------------------------------------------------

NVIDIA = {"device": "egl:0", "name": "NVIDIA H200/PCIe/SSE2", "class": "nvidia-h200", "software": False}
LLVMPIPE = {"device": "egl:1", "name": "llvmpipe", "class": "llvmpipe", "software": True}


def leave(folder, leg, outcomes, devices=(NVIDIA, LLVMPIPE), files=None):
    place = folder / leg
    place.mkdir(parents=True)
    (place / "result.json").write_text(json.dumps({
        "format": 1, "leg": leg, "what": "", "build": "bounced 1", "driver": None, "nvidia_smi": None,
        "machine": {"cpu": "c", "cores": 16, "system": "s"}, "devices": list(devices),
        "steps": [{"name": f"{leg}_{i}", "suite": "x", "words": [], "took_s": 1.0, **outcome}
                  for i, outcome in enumerate(outcomes)]}))
    with tarfile.open(place / "files.tar.gz", "w:gz") as tar:
        for name, text in (files or {}).items():
            path = folder / "file"
            path.write_text(text)
            tar.add(path, arcname=name)


def collected(folder, out):
    out.mkdir()
    return subprocess.run([sys.executable, ROOT / "deploy/day/collect.py", folder, "-o", out],
                          capture_output=True, text=True, check=False, timeout=60)


def test_a_day_becomes_files(tmp_path):
    day = tmp_path / "day"
    leave(day, "device", [{"result": "passed"}, {"result": "failed", "said": "first\nlast words\n"}])
    leave(day, "bench", [{"result": "passed"}, {"result": "cut", "said": ""}],
          files={"first_light.json": '{"figures": 1}', "logs/slice_overhead.sponza.txt": "16 ms\n",
                 "logs/first_light.txt": "noise\n", "../../escaped": "no"})
    ran = collected(day, tmp_path / "out")
    assert ran.returncode == 1, ran.stderr  # one failed
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "nvidia.json", "nvidia.txt", "nvidia.first_light.json", "nvidia.slice_overhead.sponza.txt"}
    text = (tmp_path / "out/nvidia.txt").read_text()
    assert "NVIDIA H200" in text and "device    1 passed, 1 failed" in text and "last words" in text
    kept = json.loads((tmp_path / "out/nvidia.json").read_text())
    assert [leg["leg"] for leg in kept["legs"]] == ["bench", "device"]
    assert not list(tmp_path.rglob("escaped"))


def test_a_software_day_bears_no_other_name(tmp_path):
    leave(tmp_path / "day", "device", [{"result": "passed"}], devices=[LLVMPIPE])
    assert collected(tmp_path / "day", tmp_path / "out").returncode == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"software.json", "software.txt"}


def test_a_leg_that_was_ended_from_outside_counts(tmp_path):
    leave(tmp_path / "day", "device", [{"result": "passed"}, {"result": "not run"}])
    (tmp_path / "day/device/files.tar.gz").unlink()
    assert collected(tmp_path / "day", tmp_path / "out").returncode == 0
    assert "1 passed, 1 not run" in (tmp_path / "out/nvidia.txt").read_text()


@pytest.mark.parametrize("spoil,says", [
    (lambda day: leave(day / "again", "device", [{"result": "passed"}]), "more than once"),
    (lambda day: leave(day, "bench", [{"result": "passed"}], devices=[LLVMPIPE]), "different devices"),
    (lambda day: (day / "device/result.json").write_text("{"), "result.json"),
    (lambda day: (day / "device/result.json").write_text("{}"), "format"),
    (lambda day: (day / "device/result.json").unlink(), "no result.json")])
def test_what_is_no_day_is_refused(tmp_path, spoil, says):
    leave(tmp_path / "day", "device", [{"result": "passed"}])
    spoil(tmp_path / "day")
    ran = collected(tmp_path / "day", tmp_path / "out")
    assert ran.returncode == 1 and says in ran.stderr and "Traceback" not in ran.stderr
    assert not list((tmp_path / "out").iterdir())
