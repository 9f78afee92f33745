"""bounce stability as a user runs it, and what it says of itself."""
import dataclasses
import json
import os
import signal
import subprocess
import time
import types

from conftest import BOUNCE, SOURCE
from harness.hazards import ROWS, row


def failures(results):
    return "\n".join(f"{o['technique']} row {o['row']}: expected {o['expected']}, saw {o['seen']}\n"
                     f"    {o['command']}" for o in results if o["status"] == "FAIL")


# What is rendered where nobody says; the one with the most stages. `rsm` has the rows of stages below;
# `multires_splat`, which has the others, takes twice as long. The suite `long` has them all (BD_LONG).
TECHNIQUES = [] if os.environ.get("BD_LONG") else ["many_light", "hisr"]


def test_every_technique_and_every_hazard(bounce):
    words = [word for name in TECHNIQUES for word in ("--technique", name)]
    result = bounce("stability", "--json", *words)
    assert result.stdout, result.stderr
    results = json.loads(result.stdout)["results"]
    assert result.returncode == 0, failures(results)
    techniques = {o["technique"] for o in results}
    assert set(TECHNIQUES or ["direct", "rsm"]) <= techniques
    assert sorted((o["technique"], o["row"]) for o in results) == sorted(
        (technique, row) for technique in techniques for row in range(1, 63))
    assert all(o["note"] for o in results if o["status"] in ("-", "flag")), "a reason for each"
    assert techniques == {o["technique"] for o in results if o["status"] == "pass"}
    flagged = {o["row"] for o in results if o["status"] == "flag"}
    assert {15, 18, 19, 20, 21, 26} <= flagged


def test_rows_of_stages_hold_where_nothing_is_approximated(bounce):
    """`rsm` gathers at every pixel: what later techniques may get wrong, it gets right."""
    rows = [number for number, of in ROWS.items() if of.check and of.codes]
    words = [word for number in rows for word in ("--row", number)]
    result = bounce("stability", "--json", "--technique", "rsm", "--codes", "TNSIP", *words)
    results = json.loads(result.stdout)["results"]
    assert result.returncode == 0, failures(results)
    assert sum(o["status"] == "pass" for o in results) >= 17


def test_a_stage_without_its_unit_test_fails():
    """All have theirs: one of them is taken away."""
    technique = types.SimpleNamespace(name="anew", hazard_codes="I", is_reference=False)
    case = types.SimpleNamespace(technique=technique)
    named = next(row_ for row_ in ROWS.values() if not row_.check and row_.concerns(technique))
    assert row.run(named, case).status == "-"
    outcome = row.run(dataclasses.replace(named, unit_test=None), case)
    assert outcome.status == "FAIL" and "a unit test, named in" in outcome.expected


def test_unit_tests_that_rows_name_exist():
    for named in ROWS.values():
        assert named.check or named.codes or named.unit_test, f"row {named.number} holds nothing"
        if named.unit_test:
            path, name = named.unit_test.split(":")
            assert f"cmocka_unit_test({name})" in (SOURCE / path).read_text(), named


def test_a_table_for_people(bounce):
    result = bounce("stability", "--row", 22, "--row", 36, "--row", 4, "--keep", "kept")
    assert result.returncode == 0, result.stdout + result.stderr
    lines = result.stdout.splitlines()
    assert lines[0].split()[:2] == ["direct", "rsm"]
    assert any(line.startswith(" 22  lit from behind") and line.count("pass") >= 2
               for line in lines)
    assert "leak ratio" in result.stdout
    assert "- direct 4: concerns S, T alone" in lines
    assert ", 0 FAIL, " in lines[-1]


def test_kept_scenes_show_it_again(bounce, tmp_path):
    result = bounce("stability", "--technique", "direct", "--row", 22, "--keep", "kept")
    assert result.returncode == 0, result.stderr
    assert sorted(path.name for path in (tmp_path / "kept").iterdir()) == [
        "row22-double.glb", "row22-single.glb"]
    assert bounce("render", "kept/row22-double.glb", "-o", "again.exr", "--technique", "direct",
                  "--fail-on", "none").returncode == 0


def test_mistakes_are_one_line(bounce):
    for words, code, says in ((["--row", 63], 2, "rows are 1 to 62"),
                              (["--codes", "X"], 2, "letters of TNSIP"),
                              (["--technique", "no"], 2, "no technique no"),
                              (["--size", "huge"], 2, "huge")):
        result = bounce("stability", *words)
        assert result.returncode == code and says in result.stderr, (words, result.stderr)
        assert "Traceback" not in result.stderr


def test_what_it_needs_is_named(bounce, tmp_path):
    result = bounce("stability", env={"BOUNCE_HARNESS": "/nowhere"})
    assert result.returncode == 4 and "BOUNCE_HARNESS, /nowhere" in result.stderr
    result = bounce("stability", env={"BOUNCE_PYTHON": "/nowhere/python3"})
    assert result.returncode == 4 and "/nowhere/python3: No such file" in result.stderr
    result = bounce("stability", env={"BOUNCED": "/nowhere"})
    assert result.returncode == 7 and "/nowhere" in result.stderr
    (tmp_path / "numpy").mkdir()
    (tmp_path / "numpy/__init__.py").write_text("raise ModuleNotFoundError(name='numpy')\n")
    result = bounce("stability", env={"PYTHONPATH": str(tmp_path)})
    assert result.returncode == 4 and result.stderr.count("\n") == 1, result.stderr
    assert "python3-numpy" in result.stderr


def children(pid):
    """Processes started by `pid`, and by those."""
    found = []
    for entry in os.listdir("/proc"):
        try:
            fields = open(f"/proc/{entry}/stat", encoding="utf-8").read().rsplit(")", 1)[1].split()
        except (OSError, IndexError):
            continue
        if int(fields[1]) == pid:
            found += [int(entry), *children(int(entry))]
    return found


def test_ctrl_c_ends_the_daemon_too(tmp_path):
    env = {**os.environ, "TMPDIR": str(tmp_path)}
    with subprocess.Popen([BOUNCE, "stability"], env=env, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE) as process:
        process.stdout.readline()  # a row has been through
        started = children(process.pid)
        assert started
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=60) == 130
    # It is told to end, and first finishes the slice that it is in: long on a busy machine.
    end = time.monotonic() + 10
    while any(os.path.exists(f"/proc/{pid}") for pid in started) and time.monotonic() < end:
        time.sleep(0.05)
    assert not [pid for pid in started if os.path.exists(f"/proc/{pid}")]
    assert not list(tmp_path.iterdir()), "its folder is gone"
