"""How far one picture's light is from another's, both without noise.

The figures are those of `bounce compare` for pictures that have no halves: tests/bench holds them to
it. They are worked out here because a picture is compared with several others, in a tenth of the time.
"""
import numpy

WORST_SHARE = 1e-4  # of the pixels that `trimmed` leaves out
TILE_PX, RESAMPLES = 16, 1000  # of the interval of motion


def between(reference, picture):
    """Root mean square over the mean and over the largest value of the reference, the same without
    the worst ten-thousandth of the pixels, of tones x / (x + mean) over their mean, of which no pixel that shines is most, and
    the error of the mean. None where it is black."""
    reference, picture = (numpy.asarray(p, numpy.float64) for p in (reference, picture))
    mean, largest = float(reference.mean()), float(reference.max())
    if not mean > 0:
        return None
    squares = ((picture - reference) ** 2).mean(axis=-1).ravel()
    kept = numpy.sort(squares)[:squares.size - int(squares.size * WORST_SHARE)]
    root = float(numpy.sqrt(squares.mean()))
    return {"rel_rmse": root / mean, "rmse_max": root / largest,
            "trimmed": float(numpy.sqrt(kept.mean())) / mean,
            "tones": _of_tones(reference / (reference + mean), picture / (picture + mean)),
            "signed": float(picture.mean()) / mean - 1}


def of_motion(halves, film):
    """Of a film, how far its steps from frame to frame are from those of what is true, over the mean, with its interval of
    95 % by drawing tiles of pixels anew; without the hundredth of the pixels that is farthest off; half of all steps' own; and how
    far what is true moves. `halves` are two films of what is true without common
    noise, which so drops out: algorithms.md E8. None where it is black."""
    halves = [numpy.asarray(half, numpy.float64) for half in halves]
    mean = float(halves[0].mean() + halves[1].mean()) / 2
    if not mean > 0:
        return None
    a, b = (numpy.diff(half, axis=0) for half in halves)
    moved = numpy.diff(numpy.asarray(film, numpy.float64), axis=0)
    squares = ((moved - a) * (moved - b)).mean(axis=(0, -1))
    kept = numpy.sort(squares.ravel())[:squares.size - squares.size // 100]
    off = numpy.abs((moved - (a + b) / 2).mean(axis=-1))
    tiles = _sums_of_tiles(squares)
    drawn = numpy.random.default_rng(1).integers(0, tiles.size, (RESAMPLES, tiles.size))
    low, high = numpy.percentile(tiles[drawn].sum(axis=1) / squares.size, (2.5, 97.5))
    return {"value": _root(squares.mean()) / mean, "low": _root(low) / mean, "high": _root(high) / mean,
            "trimmed": _root(kept.mean()) / mean, "half": float(numpy.median(off)) / mean, "true": _root((a * b).mean()) / mean}


def _sums_of_tiles(squares):
    down, across = (range(0, side, TILE_PX) for side in squares.shape)
    return numpy.add.reduceat(numpy.add.reduceat(squares, down, axis=0), across, axis=1).ravel()


def _root(square):
    """Of what noise may have put below zero."""
    return float(max(square, 0.0)) ** .5


def _of_tones(reference, picture):
    return float(numpy.sqrt(((picture - reference) ** 2).mean()) / reference.mean())
