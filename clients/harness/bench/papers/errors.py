"""How far one picture's light is from another's, both without noise.

The figures are those of `bounce compare` for pictures that have no halves: tests/bench holds them to
it. They are worked out here because a picture is compared with several others, in a tenth of the time.
"""
import numpy

WORST_SHARE = 1e-4  # of the pixels that `trimmed` leaves out


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


def _of_tones(reference, picture):
    return float(numpy.sqrt(((picture - reference) ** 2).mean()) / reference.mean())
