"""What a reader wants to know: which technique for which error, and what it costs."""
import math

from .stats import decades, error_at_time, front, slope, time_at_error
from .store import rung_text

EQUAL_ERRORS = (0.01, 0.02, 0.05, 0.10, 0.20)
HEADLINE_ERROR = 0.02
EXACT = 1e-6
AGAINST = ("full", "model")
LAYERS = ("beauty", "indirect")


def plotted(error):
    """Where an error goes on a logarithmic axis: its upper end where the noise hides its value;
    EXACT where there is none, as of indirect light that neither side has. None if unknown."""
    shown = error["value"] or error["high"]
    return shown if shown is None else max(shown, EXACT)


def curve(result, scene, technique, against="full", layer="beauty"):
    """(median time, error, point) of every point that was measured, by time."""
    points = [p for p in result["points"] if p["state"] == "done" and p["scene"] == scene
              and p["technique"] == technique and layer in p["error"].get(against, {})]
    rows = [(p["time_ms"]["frame"]["median"], plotted(p["error"][against][layer]), p)
            for p in points]
    return sorted((r for r in rows if r[1] is not None and math.isfinite(r[1])), key=lambda r: r[0])


def techniques_of(result, scene):
    """Names with a measured point in the scene, in the registry's order."""
    there = {p["technique"] for p in result["points"]
             if p["scene"] == scene and p["state"] == "done"}
    return [t["name"] for t in result["techniques"] if t["name"] in there]


def floor_of(result, scene, technique, against, layer):
    """Error that the technique's model keeps whatever its settings; None if that is not known.

    Against its own model nothing but its settings keeps it from zero."""
    if against == "model":
        return None
    for item in result["decomposition"]:
        if (item["scene"], item["technique"], item["layer"]) == (scene, technique, layer):
            return item["floor"]
    return None


def percent(error, sign=""):
    """Two digits; what is below a hundred-thousandth is not told apart from nothing."""
    if abs(error) < 1e-5:
        return "0 %"
    return f"{100 * error:{sign}.2g} %" if abs(error) < 0.1 else f"{100 * error:{sign}.0f} %"


def duration(ms):
    if ms >= 99_950:
        return f"{ms / 60_000:.3g} min"
    if ms >= 999.5:
        return f"{ms / 1000:.3g} s"
    return f"{ms:.3g} ms"


def extrapolated(result, technique, points, wanted):
    """Time at which more samples would bring an unbiased reference there: error ~ 1 / sqrt(time).

    None for other techniques, whose error need not go on as it began."""
    unbiased = any(t["name"] == technique and t["is_reference"] for t in result["techniques"])
    if not (unbiased and points):
        return None
    ms, error, _ = min(points, key=lambda row: row[1])
    return ms * (error / wanted) ** 2


def _unreached(points, floor, wanted, later):
    if not points:
        return "not measured"
    if later is not None:
        return f"≈ {duration(later)} (not measured)"
    if floor is not None and floor > wanted:
        return f"not reached (floor {percent(floor)})"
    return f"not reached (best {percent(min(p[1] for p in points))})"


def equal_error(result, scene, against, layer):
    """Rows (technique, [text of the time at each of EQUAL_ERRORS])."""
    rows = []
    for technique in techniques_of(result, scene):
        points = curve(result, scene, technique, against, layer)
        floor = floor_of(result, scene, technique, against, layer)
        times = [time_at_error(points, wanted) for wanted in EQUAL_ERRORS]
        cells = []
        for wanted, ms in zip(EQUAL_ERRORS, times):
            if ms is None:
                later = extrapolated(result, technique, points, wanted)
                text = _unreached(points, floor, wanted, later)
            else:
                cheapest = wanted >= front(points)[0][1]
                text = ("≤ " if cheapest else "") + duration(ms)
            cells.append({"error": wanted, "ms": ms, "text": text})
        rows.append({"technique": technique, "floor": floor, "cells": cells})
    return rows


def equal_time(result, scene, against, layer):
    """(times, rows (technique, slope, [error that each buys]))."""
    curves = {t: curve(result, scene, t, against, layer) for t in techniques_of(result, scene)}
    all_times = [row[0] for points in curves.values() for row in points]
    times = decades(min(all_times), max(all_times)) if all_times else []
    rows = []
    for technique, points in curves.items():
        errors = [error_at_time(points, ms) for ms in times]
        rows.append({"technique": technique, "slope": slope(points), "cells": [
            {"ms": ms, "error": e, "text": "–" if e is None else percent(e)}
            for ms, e in zip(times, errors)]})
    return times, rows


def setting_near(points, wanted):
    """The settings of the cheapest point of the front with at most that error."""
    return next((point for _, error, point in front_rows(points) if error <= wanted), None)


def front_rows(points):
    """Like front, of rows with a point behind."""
    kept = set(map(tuple, front([row[:2] for row in points])))
    return [row for row in points if tuple(row[:2]) in kept]


def advice(result, scene, wanted=HEADLINE_ERROR):
    """One sentence: the technique for an error of `wanted` of the beauty, and what it costs."""
    names = techniques_of(result, scene)
    curves = {name: curve(result, scene, name) for name in names}
    reached = {name: ms for name, points in curves.items()
               if (ms := time_at_error(points, wanted)) is not None}
    missed = [name for name in names if name not in reached and curves[name]]
    if not reached and not missed:
        return "Nothing could be measured."
    if reached:
        best = min(reached, key=reached.get)
        point = setting_near(curves[best], wanted)
        near = f" (near {rung_text(point)})" if point else ""
        text = f"For {percent(wanted)} error use {best}{near}: {duration(reached[best])} a frame."
    else:
        best = min(missed, key=lambda name: min(row[1] for row in curves[name]))
        row = min(curves[best], key=lambda row: row[1])
        text = (f"Nothing measured here reaches {percent(wanted)} error; {best} comes closest with "
                f"{percent(row[1])} in {duration(row[0])} ({rung_text(row[2])})"
                f"{_later(result, best, curves[best], wanted)}.")
        missed.remove(best)
    return " ".join([text, *(_why_not(result, scene, name, curves[name], wanted)
                             for name in missed)])


def _why_not(result, scene, name, points, wanted):
    floor = floor_of(result, scene, name, "full", "beauty")
    ms, best, _ = min(points, key=lambda row: row[1])
    if floor is not None and floor > wanted:
        step = largest_step(result, scene, name)
        cause = f", most of it {step['name']}" if step else ""
        return (f"The model of {name} alone is {percent(floor)} off{cause}; {name} comes down to "
                f"{percent(best)} in {duration(ms)}.")
    return (f"{name} comes down to {percent(best)} in {duration(ms)}"
            f"{_later(result, name, points, wanted)}.")


def _later(result, name, points, wanted):
    ms = extrapolated(result, name, points, wanted)
    return "" if ms is None else (f" and would take about {duration(ms)}, since its error falls "
                                  "with the square root of time")


def largest_step(result, scene, technique, layer="beauty"):
    """Of those between the full reference and the model limit."""
    for item in result["decomposition"]:
        if (item["scene"], item["technique"], item["layer"]) == (scene, technique, layer):
            return max(item["steps"][:-1], key=lambda step: step["rel_rmse"], default=None)
    return None


def warnings(result):
    """Where a reference's noise is above a tenth of an error that it measures, and failed points."""
    lines = []
    for p in result["points"]:
        name = f"{p['scene']}, {p['technique']} {rung_text(p)}"
        if p["state"] != "done":
            lines.append(f"{name}: failed: {p['fault']}")
            continue
        for against, layers in p["error"].items():
            for layer, error in layers.items():
                shown = plotted(error)
                if shown and error["noise"] and error["noise"] > shown / 10:
                    lines.append(f"{name}: {layer} against {against}: the reference's noise "
                                 f"{percent(error['noise'])} is above a tenth of the error "
                                 f"{percent(shown)}; the interval has it, more samples "
                                 "would narrow it")
    return lines


def summarize(result):
    """For bench.json: advice and tables of every scene."""
    out = {}
    for scene in (s["name"] for s in result["scenes"]):
        tables = {f"{against} {layer}": equal_error(result, scene, against, layer)
                  for against in AGAINST for layer in LAYERS}
        out[scene] = {"advice": advice(result, scene), "equal_error": tables,
                      "equal_time": equal_time(result, scene, "full", "beauty")[1]}
    return out
