"""The examples, run as they are at tiny sizes, on the real renderer."""
import json
import os
import subprocess

import bounced
import pytest
from PIL import Image
from conftest import EXAMPLES, PACKAGE

REAL = os.environ["BD_RENDERER"]


@pytest.fixture(scope="module", autouse=True)
def device():
    """Skips where no device works: the only reason to."""
    os.environ["BOUNCED"] = REAL
    try:
        with bounced.private() as daemon:
            yield daemon.capabilities
    except bounced.Error as error:
        if error.code == "device":
            pytest.skip(f"no device here: {error}")
        raise


def run(name, *words, expect=0):
    result = subprocess.run(["/usr/bin/python3", EXAMPLES / f"{name}.py", *map(str, words)],
                            env={**os.environ, "PYTHONPATH": PACKAGE, "BOUNCED": REAL,
                                 "PYTHONDONTWRITEBYTECODE": "1"},
                            capture_output=True, text=True, timeout=120, check=False)
    assert result.returncode == expect, result.stdout + result.stderr
    return result


def test_ci_job(tmp_path):
    common = ("--golden", tmp_path / "golden.exr", "--size", 24)
    run("ci_job", *common, expect=3)
    run("ci_job", *common, "--keep", "--report", tmp_path / "report.json")
    assert json.loads((tmp_path / "report.json").read_text())["size"] == [24, 24]
    assert "0.000 %, allowed" in run("ci_job", *common).stdout
    run("ci_job", *common, "--technique", "direct", expect=1)
    run("ci_job", tmp_path / "golden.exr", expect=4)


def test_readmes_first_example_runs(tmp_path):
    """What README.md shows first is what a reader tries first."""
    text = (EXAMPLES / "../README.md").read_text()
    lines = text.split("```python\n")[1].split("```")[0]
    assert "bounced.private()" in lines
    code = lines.replace('"room.glb"', repr(str(EXAMPLES / "../../../tests/scenes/cornell.glb")))
    (tmp_path / "first.py").write_text(code.replace("(640, 480)", "(32, 24)"))
    subprocess.run(["/usr/bin/python3", "first.py"], cwd=tmp_path, timeout=60, check=True,
                   env={**os.environ, "PYTHONPATH": PACKAGE, "BOUNCED": REAL})
    assert (tmp_path / "room.png").read_bytes().startswith(b"\x89PNG")


def test_turntable(tmp_path):
    run("turntable", "-o", tmp_path, "--size", 16, "--steps", 3, "--technique", "direct")
    pictures = [path.read_bytes() for path in sorted(tmp_path.glob("*.png"))]
    assert len(pictures) == 3 and len(set(pictures)) == 3


def test_edit_session(tmp_path):
    with bounced.private() as daemon:
        scene = daemon.scenes.add(EXAMPLES / "../../../tests/scenes/cornell.glb")
        try:
            with scene.edit(dry_run=True) as edit:
                edit.set_light(0, intensity=1)
        except bounced.Unsupported as error:
            pytest.skip(f"this daemon takes no edits: {error}")
    out = run("edit_session", "-o", tmp_path, "--size", 16).stdout
    # The texels: the files differ by the revision that their manifests name.
    before, lamp, dragged, after = [Image.open(path).tobytes()
                                    for path in sorted(tmp_path.glob("*.png"))]
    assert before == after and len({before, lamp, dragged}) == 3
    assert "would run again: " in out and "a lamp" in out
