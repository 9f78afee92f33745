"""From the whole rendering equation down to what a technique draws, one restriction at a time.

Each rung is a reference of its own (algorithms.md E9); the steps between neighbours say what each
restriction costs. Which rungs there are follows from the model that a technique declares.

A step is the difference of two pictures, d. Root mean squares of steps do not add up, so the Gram
matrix of all steps goes with them: entry (i, j) is mean(d_i d_j) / mean(R0)^2, its diagonal the square
of each step's relative RMSE, and the sum of all its entries the square of the whole way's. The noise
of references drops out of every entry, because the two factors come from different halves of the
samples (E1), which share no random number.
"""
import numpy

from ..exr import layer as layer_of
from ..techniques import UNLIMITED

FULL = {}
SEVERAL_BOUNCES = 4


def rungs_of(technique):
    """(what was taken away, settings of the reference) from R0 to the technique's model limit."""
    model = technique.model
    rungs = [("", dict(FULL))]

    def restrict(what, **settings):
        rungs.append((what, {**rungs[-1][1], **settings}))

    if technique.is_reference:
        return rungs
    if model.indirect_bounces < SEVERAL_BOUNCES:
        restrict(f"bounces beyond {SEVERAL_BOUNCES}", bounces=str(SEVERAL_BOUNCES))
        restrict(_bounces_left(model.indirect_bounces), bounces=str(model.indirect_bounces))
    elif model.indirect_bounces != UNLIMITED:
        restrict(f"bounces beyond {model.indirect_bounces}", bounces=str(model.indirect_bounces))
    if not model.indirect_visibility and model.indirect_bounces > 0:
        restrict("occlusion of indirect light", indirect_visibility="off")
    if model.lights != {"punctual", "emissive", "environment"}:
        lost = sorted({"punctual", "emissive", "environment"} - model.lights)
        restrict(f"light of {' and '.join(lost)} sources", lights="+".join(sorted(model.lights)))
    rungs.append(("gloss of senders, transmission, coverage", limit_of(technique)))
    return rungs


def _bounces_left(bounces):
    return {0: "indirect light", 1: "bounces 2 to 4"}.get(
        bounces, f"bounces {bounces + 1} to {SEVERAL_BOUNCES}")


def limit_of(technique):
    """Settings of the reference for the technique's own model: what more samples would tend to."""
    return dict(FULL) if technique.is_reference else {"model_of": technique.name}


def halves(planes, layer):
    """Both halves of a layer of a reference, height x width x 3 in double."""
    suffix = "" if layer == "beauty" else f".{layer}"
    return [layer_of(planes, f"half_{h}{suffix}").astype(numpy.float64) for h in "ab"]


def noise(planes, layer):
    """Noise of the mean of both halves over its mean: algorithms.md E1. None where it is black."""
    a, b = halves(planes, layer)
    mean = float((a + b).mean() / 2)
    return float(numpy.sqrt(((a - b) ** 2).mean()) / 2 / mean) if mean > 0 else None


def decomposition(names, references, picture, layer):
    """Steps from the first reference to the picture, with their Gram matrix.

    `names` are those of the steps: one between each two references, one from the last to the
    picture. None where the first reference is black."""
    chain = [halves(planes, layer) for planes in references]
    drawn = layer_of(picture, layer).astype(numpy.float64)
    chain.append([drawn, drawn])
    mean = float(sum(half.mean() for half in chain[0]) / 2)
    if not mean > 0:
        return None
    steps = [(numpy.subtract(below[0], above[0]) / mean, numpy.subtract(below[1], above[1]) / mean)
             for above, below in zip(chain, chain[1:])]
    gram = numpy.array([[((da * eb).mean() + (db * ea).mean()) / 2 for ea, eb in steps]
                        for da, db in steps])
    return {"layer": layer, "mean": mean, "gram": gram.tolist(),
            "steps": [{"name": name, "rel_rmse": root(gram[i, i]),
                       "signed": float(sum(half.mean() for half in step) / 2)}
                      for i, (name, step) in enumerate(zip(names, steps))],
            "total": root(gram.sum()), "floor": root(gram[:-1, :-1].sum())}


def root(square):
    """Of what noise may have put below zero."""
    return float(numpy.sqrt(max(float(square), 0.0)))
