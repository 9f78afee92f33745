"""The direct layer against pictures by an independent renderer, by metric.

Relative RMSE is debiased with the reference's two halves (algorithms.md E1, E2). The goal is 3 % and
a signed error of 1 %. Sibenik does not reach it, and why is in tests/bench/results/NOTES.md: a window
of alpha 0.5 that we render as opaque, the terminator of normal maps, coincident faces. Its bounds
hold what is reached, so that nothing gets worse unseen.
"""
import json
import os
import pathlib
import subprocess

import pytest

BUILD = pathlib.Path(os.environ["BD_BUILD_DIR"])
SHARED = pathlib.Path(os.environ["BD_SHARED_DIR"])

#        scene                    size       rel. RMSE  signed error
CASES = [("cornell_box_spot_side", "192x192", 0.03, 0.01),
         ("sponza_dabrovic", "192x144", 0.03, 0.01),
         ("sibenik", "192x144", 0.21, 0.015)]


def compare(image, layer, references):
    out = subprocess.run([BUILD / "clients/cli/bounce", "compare", references[0], "--half",
                          references[1], image, "--layer", layer, "--json"],
                         check=True, capture_output=True)
    figures = json.loads(out.stdout)
    assert figures["debiased"] == "reference"
    return {name: figures[name]["value"] for name in ("rel_rmse", "signed_error", "nonfinite")}


@pytest.mark.parametrize("scene,size,rel_rmse_max,signed_max", CASES)
def test_direct_layer(tmp_path, scene, size, rel_rmse_max, signed_max):
    references = [SHARED / f"references/{scene}.lambert.point.{half}.exr" for half in (1, 2)]
    if not references[0].exists():
        pytest.skip(f"{references[0]} is not here")
    image = tmp_path / "frame.exr"
    subprocess.run([BUILD / "clients/cli/bounce", "render", SHARED / f"scenes/{scene}.glb",
                    "-o", image, "--size", size, "--aa", "1", "--technique", "direct",
                    "--layers", "direct", "--camera", "Camera", "--set", "brdf=lambert",
                    "--quiet"],
                   check=True, env={**os.environ, "XDG_RUNTIME_DIR": str(tmp_path)}, timeout=120)
    figures = compare(image, "direct", references)
    print(scene, figures)
    assert figures["nonfinite"] == 0
    assert figures["rel_rmse"] <= rel_rmse_max
    assert abs(figures["signed_error"]) <= signed_max
