"""The other renderer: against a program that is made up, and against Blender where it is installed."""
import os
import sys
from pathlib import Path

import numpy
import pytest

from harness import exr, glb
from harness.bench import cycles
from harness.bench.contestants import CYCLES_SPP, chosen
from harness.bench.measure import Stage
from harness.bench.references import References
from harness.daemon import Daemon, NoDevice, RenderError

SCENE = Path(__file__).resolve().parents[1] / "scenes" / "cornell.glb"
SIZE = (32, 32)
# Writes light of 1 with noise that falls as it does with samples, and what it was asked for.
BLENDER = """#!{python}
import json, pathlib, sys
import numpy
sys.path.insert(0, {clients!r})
from harness import exr
if "--version" in sys.argv:
    print("Blender 9.8.7")
    sys.exit()
job = json.loads(pathlib.Path(sys.argv[-1]).read_text())
assert abs(job["yfov"] - {yfov}) < 1e-6 and job["lambert"]
for shot in job["shots"]:
    rng = numpy.random.default_rng(shot["seed"])
    shape = job["size"][::-1]
    noise = rng.normal(0, shot["spp"] ** -0.5, shape)
    planes = {{f"ViewLayer.{{name}}.{{c}}": numpy.full(shape, value) for c in "RGB"
              for name, value in (("DiffCol", 0.5), ("DiffInd", 2.0), ("DiffDir", 0.5))}}
    for c in "RGB":
        planes["ViewLayer.DiffInd." + c] += 2 * noise
    pathlib.Path(shot["file"]).write_bytes(exr.write(planes))
    shot["s"] = 0.25
pathlib.Path(job["answer"]).write_text(json.dumps({{"shots": job["shots"]}}))
"""


@pytest.fixture
def made_up(tmp_path, monkeypatch):
    program = tmp_path / "blender"
    yfov = glb.Glb.load(SCENE).doc["cameras"][0]["perspective"]["yfov"]
    program.write_text(BLENDER.format(python=sys.executable, clients=os.environ["PYTHONPATH"], yfov=yfov))
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    cycles.version.cache_clear()
    yield
    cycles.version.cache_clear()


@pytest.fixture(scope="module")
def stage():
    try:
        with Daemon() as daemon:
            yield Stage(daemon, SIZE, None)
    except NoDevice as fault:
        pytest.skip(str(fault))


def measured(stage, folder, is_filtered, spp=64):
    references = References(stage, folder / "cache", {"brdf": "lambert"}, 16, None)
    contestant = cycles.Cycles(stage, references)
    time = contestant.measured(SCENE, "Camera", is_filtered, {"spp": str(spp), "brdf": "lambert"}, [1, 2],
                               lambda seed: folder / f"{is_filtered}-{seed}.exr")
    pictures = [exr.read((folder / f"{is_filtered}-{seed}.exr").read_bytes())[0] for seed in (1, 2)]
    return time, [exr.layer(planes, "indirect") for planes in pictures], pictures


def test_raw_pictures_are_the_mean_of_their_halves(stage, made_up, tmp_path):
    time, (one, other), (planes, _) = measured(stage, tmp_path, False)
    assert time["frame"]["median"] == pytest.approx(500) and time["runs"] == 2
    assert one.mean() == pytest.approx(1, abs=0.01)
    assert (one - other).std() == pytest.approx((2 / 64) ** 0.5, rel=0.1)  # two seeds, each of 64 samples
    beauty = exr.layer(planes, "direct") + exr.layer(planes, "indirect") + exr.layer(planes, "emission")
    assert numpy.allclose(exr.layer(planes, "beauty"), beauty, atol=1e-5)


def test_the_filter_takes_noise_off_surfaces(stage, made_up, tmp_path):
    _, (raw, _), _ = measured(stage, tmp_path, False)
    time, (smooth, _), (planes, _) = measured(stage, tmp_path, True)
    assert time["frame"]["median"] > 500
    assert smooth.mean() == pytest.approx(raw.mean(), rel=0.02)
    assert smooth[8:24, 8:24].std() < 0.5 * raw[8:24, 8:24].std()
    assert not any(name.startswith("half") for name in planes)


def test_what_it_says_when_it_fails_is_told(stage, made_up, tmp_path):
    Path(tmp_path / "blender").write_text("#!/bin/sh\necho out of paint >&2\nexit 3\n")
    with pytest.raises(RenderError, match="cycles: out of paint"):
        measured(stage, tmp_path, False)


def test_it_takes_part_where_it_is_installed(stage, made_up, monkeypatch, tmp_path):
    names = [c.name for c in chosen(stage.daemon)]
    assert names[-4:] == ["auto", "reference+filter", "cycles", "cycles+filter"]
    assert [r["spp"] for r in chosen(stage.daemon, ["cycles"])[0].ladder] == list(map(str, CYCLES_SPP))
    (tmp_path / "blender").unlink()
    monkeypatch.setenv("PATH", str(tmp_path))
    cycles.version.cache_clear()
    assert [c.name for c in chosen(stage.daemon)][-2:] == ["auto", "reference+filter"]
    with pytest.raises(SystemExit, match="nobody of the name cycles"):
        chosen(stage.daemon, ["cycles"])


def test_blender_agrees_with_the_reference(stage, tmp_path):
    cycles.version.cache_clear()
    if not cycles.version():
        pytest.skip("Blender is not installed")
    settings = {"spp": "256", "brdf": "lambert"}
    halves, _ = cycles.halves_of(SCENE, "Camera", settings, SIZE, 1)
    reference = References(stage, tmp_path, {"brdf": "lambert"}, 256, None).get(SCENE, {})
    for layer in ("direct", "indirect"):
        ours, theirs = exr.layer(reference.planes, layer).mean(), cycles.mean_of(halves)[layer].mean()
        assert theirs == pytest.approx(ours, rel=0.02), layer
