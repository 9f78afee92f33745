"""Errors, as `bounce compare --json` measures them: nothing is measured here."""
import json
import math
import shlex
import subprocess

from ..daemon import RenderError
from .summary import LAYERS

SECONDS = 300


def measured(daemon, reference, picture):
    """By layer: the headline figure with its interval, and all figures of compare."""
    words = ["compare", str(reference), str(picture), "--json", "--quiet"]
    for layer in LAYERS:
        words += ["--layer", layer]
    shown = shlex.join(["bounce", *words])
    try:
        done = subprocess.run([daemon.bounce, *words], capture_output=True, text=True,
                              env=daemon.env, check=False, timeout=SECONDS)
    except subprocess.TimeoutExpired:
        raise RenderError(f"no figures within {SECONDS} s", shown) from None
    if done.returncode != 0:
        raise RenderError(done.stderr.strip() or f"exit code {done.returncode}", shown,
                          done.returncode)
    layers = json.loads(done.stdout)["layers"]
    return {name: headline(figures) for name, figures in layers.items()}


def headline(figures):
    """Of one layer's figures, the relative RMSE and what tells how far to trust it."""
    head = figures["rel_rmse"]
    return {"value": head["value"], "low": head["low"], "high": head["high"],
            "signed": figures["signed_error"]["value"], "noise": figures["noise_floor"]["value"],
            "figures": figures}


def over_seeds(errors):
    """One error of several pictures that differ by their seeds: the root of their mean square.

    Its interval spans theirs; the other figures are those of the first picture. With a single
    picture it is that picture's."""
    first = errors[0]
    values = [e["value"] for e in errors]
    if len(errors) == 1 or None in values:
        return first
    ends = [[e[end] for e in errors if e[end] is not None] for end in ("low", "high")]
    return {**first, "value": math.sqrt(sum(v * v for v in values) / len(values)),
            "low": min(ends[0], default=None), "high": max(ends[1], default=None),
            "signed": sum(e["signed"] for e in errors) / len(errors), "each": values}
