"""Frames of a group, in turns: times from reports as bench takes them, errors of their pictures."""
import shlex

import numpy

from .. import measure
from . import errors

SEED = 1
FRESH = ("--fresh", "all")
HALVES = ("half_a.indirect", "half_b.indirect")  # of the reference


def of_group(stage, group, paths, shrink, rounds):
    """A point for each run. The first frame of each warms up, and is its picture if one is wanted."""
    pictured = {a for run in group.runs for a in run.against}
    in_halves = {run.moves_as for run in group.runs}
    pictures, reports = {}, {}
    for run in group.runs:
        if run.film:
            layers = HALVES if run.label in in_halves else ("indirect",)
            reports[run.label], pictures[run.label] = _film(stage, run, paths, shrink, layers)
            continue
        wanted = run.label in pictured or run.against
        report, picture = _first(stage, run, paths, shrink, wanted)
        pictures[run.label] = picture
        reports[run.label] = [] if run.timed else [report]
    for _ in range(rounds):
        for run in group.runs:
            if run.timed and not run.film:
                reports[run.label].append(_report(stage, run, paths, shrink))
    return [_point(stage, run, shrink, reports[run.label], pictures) for run in group.runs]


def size_px(run, shrink):
    return max(1, run.size // shrink)


def _asked(run, shrink):
    side = size_px(run, shrink)
    return {"size": (side, side), "camera": run.camera, "seed": SEED, "aa": run.aa, "extra": FRESH}


def _report(stage, run, paths, shrink):
    return stage.ask(stage.daemon.report, paths[run.scene], run.technique, run.all_settings,
                     layers=("beauty", "indirect"), **_asked(run, shrink))


def _first(stage, run, paths, shrink, wanted):
    """The first frame's report, and its indirect light if that is wanted."""
    if not wanted:
        return _report(stage, run, paths, shrink), None
    frame = stage.ask(stage.daemon.render, paths[run.scene], run.technique, run.all_settings,
                      layers=("indirect",), **_asked(run, shrink))
    return frame.report, frame.layer("indirect")


def _film(stage, run, paths, shrink, layers):
    """Reports of its frames, and each layer of them as one array."""
    frames = [stage.ask(stage.daemon.render, paths[scene], run.technique, run.all_settings, layers=layers,
                        **_asked(run, shrink)) for scene in run.film]
    return [frame.report for frame in frames], [numpy.stack([frame.layer(name) for frame in frames]) for name in layers]


def _point(stage, run, shrink, reports, pictures):
    last, side = reports[-1], size_px(run, shrink)
    command = stage.daemon.command("SCENE", run.technique, run.all_settings, (side, side),
                                   run.camera, seed=SEED, aa=run.aa)
    return {"label": run.label, "scene": run.scene.name, "technique": run.technique,
            "settings": run.all_settings, "size": side, "camera": run.camera,
            "time_ms": measure.times_of(reports), "counts": last.get("counts", {}),
            "flags": last.get("flags", []), "command": shlex.join(command).replace("SCENE", run.scene.shown, 1),
            "error": {a: errors.between(pictures[a], pictures[run.label]) for a in run.against},
            **({"motion": errors.of_motion(pictures[run.moves_as], pictures[run.label][0])} if run.moves_as else {})}
