"""Our reference beside pictures by an independent renderer.

Figures are those of algorithms.md E: with two independent halves I1, I2 of ours and A, B of theirs,
the mean of (I1 - A)(I2 - B) is the squared difference of what both tend to, free of either's noise.
Relative to theirs, as a root; negative where noise is larger than the difference. The interval is a
bootstrap over tiles of 16 x 16 pixels, 95 %.

The same of pictures averaged over blocks of 4 x 4 or 8 x 8 pixels first: a quarter or an eighth of
the noise, a quarter or an eighth of its root, so that light which is too bright or too dark over an
area shows that drowns pixel by pixel. What changes sign within a block, such as a shadow's edge that
lies elsewhere, cancels there; that is for the figure by pixel.

Their `direct` has the emission in it.
"""
import dataclasses
import os
import pathlib
import subprocess
import sys

import numpy

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "clients"))
from harness import exr  # noqa: E402
from harness.glb import Glb  # noqa: E402

BUILD = pathlib.Path(os.environ.get("BD_BUILD_DIR", ROOT / "build"))
SHARED = pathlib.Path(os.environ.get("BD_SHARED_DIR", ROOT / "../shared"))
TILE_PX = 16
BLOCKS_PX = [4, 8]  # divisors of a tile
RESAMPLES = 2000
# Every Lambertian picture there is: scene, pixel filter.
PICTURES = [("cornell_box", "box"), ("cornell_box_spot_side", "box"),
            ("cornell_box_spot_side", "point"), ("sponza_dabrovic", "box"),
            ("sponza_dabrovic", "point"), ("sibenik", "box"), ("sibenik", "point")]


# What direct_by_hand.c can take over of their ways, in the order of server/reference/README.md, "Beside an independent renderer".
HABITS = ["pixel=.01", "decode_last", "bend", "soften", "twins"]


@dataclasses.dataclass
class Figure:
    """Relative RMSE and its interval, and the relative difference of the means with its standard
    error; all of them fractions."""
    rel_rmse: float
    low: float
    high: float
    signed: float
    signed_error: float


def signed_root(square):
    return numpy.sign(square) * numpy.sqrt(abs(square))


def blocks(picture, side_px):
    """Mean over each whole block of a height x width (x 3) picture."""
    rows, columns = picture.shape[0] // side_px, picture.shape[1] // side_px
    cut = picture[:rows * side_px, :columns * side_px]
    return cut.reshape(rows, side_px, columns, side_px, *picture.shape[2:]).mean(axis=(1, 3))


def figure(ours, theirs, keep=None, block_px=1):
    """`ours` and `theirs`: two halves each, height x width x 3. `keep`: weights by pixel."""
    if block_px > 1:
        assert keep is None and TILE_PX % block_px == 0
        ours, theirs = ([blocks(half, block_px) for half in pair] for pair in (ours, theirs))
    keep = numpy.ones(theirs[0].shape[:2]) if keep is None else keep.astype(float)
    mean = (((theirs[0] + theirs[1]) / 2).mean(axis=2) * keep).sum() / keep.sum()
    square = ((ours[0] - theirs[0]) * (ours[1] - theirs[1])).mean(axis=2) * keep
    difference = ((ours[0] + ours[1] - theirs[0] - theirs[1]) / 2).mean(axis=2) * keep
    by_tile = numpy.stack([blocks(plane, TILE_PX // block_px).ravel() for plane in (square, keep)])
    pick = numpy.random.default_rng(1).integers(0, by_tile.shape[1], (RESAMPLES, by_tile.shape[1]))
    sums = by_tile[:, pick].sum(axis=2)
    low, high = numpy.quantile(sums[0] / sums[1], (0.025, 0.975))
    return Figure(float(signed_root(square.sum() / keep.sum()) / mean),
                  float(signed_root(low) / mean), float(signed_root(high) / mean),
                  float(difference.sum() / keep.sum() / mean), signed_noise(ours, theirs, keep, mean))


def signed_noise(ours, theirs, keep, mean):
    """Standard error of the difference of the means, from how the halves differ by pixel."""
    variance = sum(((pair[0] - pair[1]).mean(axis=2) ** 2 / 4 * keep ** 2).sum()
                   for pair in (ours, theirs))
    return float(numpy.sqrt(variance) / keep.sum() / mean)


def suffix(pixel_filter):
    return ".point" if pixel_filter == "point" else ""


def reference_paths(scene, pixel_filter):
    return [SHARED / f"references/{scene}.lambert{suffix(pixel_filter)}.{half}.exr"
            for half in (1, 2)]


def load(path):
    return exr.read(pathlib.Path(path).read_bytes())[0]


def load_theirs(scene, pixel_filter):
    """{"direct": [half, half], "indirect": [half, half]}"""
    planes = [load(path) for path in reference_paths(scene, pixel_filter)]
    return {name: [exr.layer(half, name) for half in planes] for name in ("direct", "indirect")}


def size_of(theirs):
    height, width = theirs["direct"][0].shape[:2]
    return f"{width}x{height}"


def two_sided(scene, folder):
    """A copy of the scene with no single-sided material: theirs has none, and an area light shines
    from both its sides there."""
    path = pathlib.Path(folder) / f"{scene}.glb"
    if not path.exists():
        glb = Glb.load(SHARED / f"scenes/{scene}.glb")
        for material in glb.doc["materials"]:
            material["doubleSided"] = True
        glb.save(path)
    return path


def render_half(scene, pixel_filter, size, samples, seed, folder):
    path = pathlib.Path(folder) / f"{scene}.{pixel_filter}.{seed}.exr"
    subprocess.run([BUILD / "tests/tools/reference", two_sided(scene, folder), path, size, "Camera",
                    str(samples), f"filter={pixel_filter}", "alpha=coverage", "lambert=1",
                    "bounces=16", f"seed={seed}"],
                   check=True, capture_output=True,
                   env={**os.environ, "BOUNCED": str(BUILD / "server/bounced")})
    return load(path)


def render_ours(scene, pixel_filter, size, samples, folder):
    """Two halves of `samples` each, by seeds of their own."""
    halves = [render_half(scene, pixel_filter, size, samples, seed, folder) for seed in (1, 2)]
    return {"direct": [exr.layer(h, "direct") + exr.layer(h, "emission") for h in halves],
            "indirect": [exr.layer(h, "indirect") for h in halves]}


def by_hand(scene, size, habits, folder):
    """The direct layer without noise, and the share of each pixel that twin surfaces cover
    (direct_by_hand.c)."""
    path = pathlib.Path(folder) / "direct.f32"
    subprocess.run([BUILD / "tests/golden/direct_by_hand", SHARED / f"scenes/{scene}.glb", size,
                    path, *habits], check=True)
    width, height = map(int, size.split("x"))
    planes = numpy.fromfile(path, numpy.float32).reshape(height, width, 7)
    return planes[..., :3], planes[..., 6]
