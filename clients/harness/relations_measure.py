"""How far two pictures are apart, and how far they may be."""
import numpy as np

# Pixels darker than this share of the layer's mean are measured against that.
FLOOR_EXACT, FLOOR_STATISTICAL = 0.01, 0.1
LIGHT_LAYERS = ("direct", "indirect", "emission")
SHARE = 0.999  # of the pixels that a statistical relation speaks of
MARGIN = 1e-4
SIGMAS_TILE, SIGMAS_ALL = 5.0, 4.0
TILE = 8  # pixels: what a few samples say of one pixel's variance is little


def relative(a, b, floor=FLOOR_EXACT):
    """Per pixel, largest of the channels; a NaN counts as infinite."""
    a, b = a.astype(np.float64), b.astype(np.float64)
    floor = floor * (np.abs(a).mean() + np.abs(b).mean()) / 2
    with np.errstate(all="ignore"):
        difference = np.abs(a - b) / np.maximum(np.maximum(np.abs(a), np.abs(b)), floor)
    difference[(a == b)] = 0
    return np.where(np.isfinite(difference), difference, np.inf).max(axis=-1)


def light_difference(a, b, factor=1.0, order=(0, 1, 2), mask=None, floor=FLOOR_EXACT,
                     layers=LIGHT_LAYERS):
    """Largest relative difference over the layers, and the layer that has it.

    Expected of b is `factor` times a with a's channels in that order. Pixels where mask is True do
    not count.
    """
    worst, where = 0.0, "all"
    for name in layers:
        expected = a.layer(name).astype(np.float64)[..., list(order)] * factor
        difference = relative(expected, b.layer(name), floor)
        if mask is not None:
            difference = difference[~mask]
        if difference.size and difference.max() > worst:
            worst, where = float(difference.max()), name
    return worst, where


def _differs_from_neighbours(values, differs):
    """True at both pixels of each of the horizontal, vertical and diagonal pairs that differ."""
    out = np.zeros(values.shape[:2], bool)
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):
        ahead = values[dy:, max(dx, 0):values.shape[1] + min(dx, 0)]
        behind = values[:values.shape[0] - dy, max(-dx, 0):values.shape[1] - max(dx, 0)]
        pair = differs(ahead, behind)
        out[dy:, max(dx, 0):out.shape[1] + min(dx, 0)] |= pair
        out[:out.shape[0] - dy, max(-dx, 0):out.shape[1] - max(dx, 0)] |= pair
    return out


def outlines(frame):
    """Pixels on either side of where depth or coverage jumps."""
    depth = frame.planes["depth.Z"].astype(np.float64)
    with np.errstate(all="ignore"):
        jumps = _differs_from_neighbours(
            depth, lambda a, b: ~(np.abs(a - b) <= 0.05 * np.minimum(np.abs(a), np.abs(b))))
    return jumps | _differs_from_neighbours(frame.planes["A"], lambda a, b: a != b)


def silhouettes(frame):
    """Pixels on either side of an edge between surfaces: outlines, and where the normal jumps."""
    normal = np.stack([frame.planes[f"normal.{axis}"] for axis in "XYZ"], -1).astype(np.float64)
    return outlines(frame) | _differs_from_neighbours(
        normal, lambda a, b: ~((a * b).sum(-1) > 0.9))


def map_edges(frame):
    """Pixels on either side of where what a map says doubles: a rounded texture coordinate moves
    the filter's weights there."""
    out = np.zeros(frame.planes["A"].shape, bool)
    for name in ("albedo", "emission"):
        values = frame.layer(name).astype(np.float64)
        out |= _differs_from_neighbours(
            values, lambda a, b: (np.maximum(a, b) > 2 * np.minimum(a, b)).any(-1))
    return out


def lit(frame):
    """direct + indirect: what lights add, without what shines by itself."""
    return frame.layer("direct").astype(np.float64) + frame.layer("indirect")


# --- statistical -------------------------------------------------------------------------------

LEVELS = (0.5, 0.9, 0.99, SHARE)


def errors(image, truth):
    """Per pixel, in units of the truth."""
    floor = FLOOR_STATISTICAL * np.abs(truth).mean()
    with np.errstate(all="ignore"):
        error = np.abs(image - truth) / np.maximum(np.abs(truth), floor)
    error[image == truth] = 0
    return np.where(np.isfinite(error), error, np.inf).max(axis=-1)


def signed(image, truth):
    """Relative error of the sum of all light, without the pixels that are furthest off: those that
    no relation speaks of, where an edge runs through a pixel's centre."""
    off = np.abs(image - truth).max(axis=-1)
    kept = off <= _quantile(off, SHARE)
    total = np.abs(truth[kept]).sum()
    found = (image - truth)[kept].sum()
    return float(found / total) if total else float(np.abs(image[kept]).sum())


def _quantile(values, level):
    """The least value that at most the share 1 - level of them exceed."""
    beyond = int((1 - level) * values.size + 1e-9)
    return float(np.sort(values.ravel())[values.size - 1 - beyond])


def discretisation(pairs):
    """What each level of the differences may be, by the measured errors that make them up.

    `pairs` are (image, finer image): n of them. If d is at most the sum of n errors, more than
    1 - a of the pixels can have d > q_1 + ... + q_n only if more than (1 - a) / n of them are
    beyond one of the q: with q the quantile at 1 - (1 - a) / n of each, never.
    """
    found = [errors(image, truth) for image, truth in pairs]
    return {level: MARGIN + sum(_quantile(error, 1 - (1 - level) / len(found)) for error in found)
            for level in LEVELS}


def seen_otherwise(frame, other):
    """Per pixel, by how much the albedo differs that the two show: where a change to the scene
    rounds texture coordinates, the filtered texel does too, and light with it (up to 1e-3 on Sponza
    after a subdivision)."""
    return np.minimum(relative(frame.layer("albedo"), other.layer("albedo")), 0.01)


SUBPIXELS = 256  # places that a rasteriser knows between two pixels (GL_SUBPIXEL_BITS = 8)


def corners(frame):
    """Per pixel on a silhouette, how much it changes by moving one such place: where triangles are
    smaller than pixels, rounding decides on which side of its corners a pixel is."""
    light = lit(frame)
    padded = np.pad(light, ((1, 1), (1, 1), (0, 0)), mode="edge")
    around = np.stack([padded[y:y + light.shape[0], x:x + light.shape[1]]
                       for y in range(3) for x in range(3)])
    change = np.abs(around - light).max(axis=0) / SUBPIXELS
    unit = np.maximum(np.abs(light), FLOOR_STATISTICAL * np.abs(light).mean() + 1e-300)
    return np.where(silhouettes(frame), (change / unit).max(axis=-1), 0)


def over_levels(image, other, allowed, slack=0.0):
    """(figure, tolerance, level) at the level whose figure is the largest share of its
    tolerance."""
    found = np.maximum(errors(image, other) - slack, 0)
    figures = [(_quantile(found, level), allowed[level], level) for level in LEVELS]
    return max(figures, key=lambda item: item[0] / item[1])


# --- noise ---------------------------------------------------------------------------------------


def _tiles(values):
    height, width = (side // TILE * TILE for side in values.shape[:2])
    cut = values[:height, :width].reshape(height // TILE, TILE, width // TILE, TILE, -1)
    return cut.sum(axis=(1, 3))


def sigmas(image, other, variance):
    """(of all pixels, of the 99 % quantile of tiles): differences in units of what noise and
    rounding allow, the worst channel."""
    margin = MARGIN * np.abs(image).mean()

    def in_units(difference, noise, count):
        with np.errstate(all="ignore"):
            value = np.abs(difference) / (np.sqrt(noise) + count * margin)
        value = np.where(difference == 0, 0, value)
        return np.where(np.isfinite(value), value, np.inf).max(axis=-1)

    difference = image - other
    everything = in_units(difference.sum((0, 1)), variance.sum((0, 1)), difference[..., 0].size)
    tiles = in_units(_tiles(difference), _tiles(variance), TILE * TILE)
    return float(everything), _quantile(tiles, 0.99)
