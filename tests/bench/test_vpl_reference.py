"""The VPL reference (vpl_reference.c) against technique `rsm` with the same VPLs, and its pixels
against all of the picture."""
import os
from pathlib import Path

import numpy
import pytest

import vpl_reference
from harness.daemon import Daemon, NoDevice

SCENES = Path(__file__).resolve().parents[1] / "scenes"
IS_LONG = "BD_LONG" in os.environ
CASES = [("cornell.glb", {"vpls": "64"}), ("two_lights.glb", {"vpls": "64", "vpl_kernel": "disk"})]
if IS_LONG:
    CASES = [(scene, settings) for scene in ("cornell.glb", "two_lights.glb")
             for settings in ({"vpls": "4096"}, {"vpls": "64"}, {"vpls": "64", "vpl_kernel": "disk"})]


@pytest.fixture(scope="module")
def daemon():
    try:
        with Daemon() as running:
            yield running
    except NoDevice as fault:
        pytest.skip(str(fault))


def records_of(tmp_path, scene, size, pixels=0, seed=1, **settings):
    file = tmp_path / "records"
    vpl_reference.make_records(os.environ["BD_BUILD_DIR"], SCENES / scene, file, size, pixels, seed,
                               settings)
    return vpl_reference.read_records(file)


def indirect(daemon, scene, size, **settings):
    frame = daemon.render(SCENES / scene, "rsm", {"brdf": "lambert", **settings}, size=size,
                          layers=("beauty", "indirect"))
    return frame.layer("indirect").astype(float)


@pytest.mark.parametrize("scene,settings", CASES)
def test_all_pixels_are_those_of_rsm(daemon, tmp_path, scene, settings):
    """With few VPLs many are near, and integrated as patches."""
    size = (48, 40)
    line, records = records_of(tmp_path, scene, size, **settings)
    seen = indirect(daemon, scene, size, **settings)
    rebuilt = numpy.zeros_like(seen)
    rebuilt[records["y"], records["x"]] = records["radiance_cd_m2"]
    assert line["pixels"] == len(records) > 0
    assert numpy.sqrt(((rebuilt - seen) ** 2).mean()) < 1e-4 * seen.mean()
    # What the device loses in 32 bits at the few pixels next to a patch.
    assert rebuilt == pytest.approx(seen, rel=1e-3, abs=1e-5 * seen.mean())


@pytest.mark.skipif(not IS_LONG, reason="eight runs of the tool: suite long")
def test_sampled_pixels_stand_for_all_of_them(daemon, tmp_path):
    """Weighed by one over their probability, the mean over seeds is the picture's, and that of a part
    of the picture is the part's: within four standard errors."""
    size, scene, settings = (96, 96), "cornell.glb", {"vpls": "256"}
    seen = indirect(daemon, scene, size, **settings)
    edge = numpy.abs(seen - numpy.roll(seen, 1, axis=1)).mean(axis=2) > 0.1 * seen.mean()
    sums, parts, pixels = [], [], []
    for seed in range(8):
        _, records = records_of(tmp_path, scene, size, 400, seed, **settings)
        weight, at = 1 / records["probability"], (records["y"], records["x"])
        sums.append((weight * seen[at].mean(axis=1)).sum())
        parts.append((weight * edge[at]).sum())
        pixels.append(edge[at].mean())
        assert len(records) == 400
    for found, all_of_it in ((sums, seen.mean(axis=2).sum()), (parts, edge.sum())):
        error = numpy.std(found, ddof=1) / numpy.sqrt(len(found))
        assert numpy.mean(found) == pytest.approx(all_of_it, abs=4 * error)
        assert error < 0.05 * all_of_it
    assert numpy.mean(pixels) > 2 * edge.mean()  # more of those at edges


def test_an_error_is_what_its_pixels_say():
    records = numpy.zeros(4, vpl_reference.RECORD)
    records["probability"] = (1, 1, 0.5, 0.5)
    sample = vpl_reference.Sample(records, (4, 2))  # six of eight pixels are lit
    truth = numpy.array([[2.0] * 3, [2.0] * 3, [1.0] * 3, [1.0] * 3])
    found = sample.error(truth + numpy.array([[0.0], [0.0], [0.0], [0.3]]), truth)
    assert found["rel_rmse"] == pytest.approx(numpy.sqrt(2 * 0.09 / 8) / 1.0)
    assert found["signed"] == pytest.approx(2 * 0.3 / 8)
    assert found["worst_ten_pixels_share"] == pytest.approx(1)
