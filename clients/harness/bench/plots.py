"""The figures of a page, as SVG texts that need nothing beside them. matplotlib is loaded late."""
import io
import math
import re

from .store import rung_text
from .summary import EXACT, HEADLINE_ERROR, curve, duration, floor_of, front_rows, percent, techniques_of

# Told apart by people who see few colours too, and by marker (Okabe and Ito 2008).
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
MARKERS = "osD^vPX"
GREY, LIGHT = "#667", "#dde"
LABEL_WORDS = 2  # of a point, as many as there is room for
CLOSE = 1.25  # lines whose names would touch: the ratio of two floors


class NoMatplotlib(Exception):
    """One line that says what to install."""


def load():
    """matplotlib's pyplot, set up for figures that lie in a page's text."""
    try:
        import matplotlib
        matplotlib.use("svg")
        import matplotlib.pyplot as pyplot
    except ImportError as fault:
        raise NoMatplotlib("the page needs matplotlib (Debian: python3-matplotlib); bench.csv and "
                           f"bench.json are complete ({fault})") from None
    pyplot.rcParams.update({
        "svg.fonttype": "none", "svg.hashsalt": "bounced", "font.family": "sans-serif", "font.size": 11,
        "xtick.labelsize": 10, "ytick.labelsize": 10,
        "axes.spines.top": False, "axes.spines.right": False, "axes.edgecolor": GREY,
        "xtick.color": GREY, "ytick.color": GREY, "axes.labelcolor": "#334", "grid.color": LIGHT,
        "legend.frameon": False, "path.simplify": True})
    return pyplot


def style_of(result, technique):
    """(colour, marker) of a technique: the same in every figure, and no two alike up to 49."""
    index = [t["name"] for t in result["techniques"]].index(technique)
    return COLORS[index % len(COLORS)], MARKERS[(index + index // len(COLORS)) % len(MARKERS)]


def _short(settings):
    """Of a rung of many settings the first: they grow together."""
    first, *more = settings.split()[:LABEL_WORDS + 1] or [""]
    return settings if len(more) < LABEL_WORDS else f"{first} …"


def svg(pyplot, figure, salt, label):
    """The figure's text, fit to lie in HTML: no prologue, no metadata, ids that begin with `salt`."""
    out = io.StringIO()
    figure.savefig(out, format="svg", bbox_inches="tight", pad_inches=0.08,
                   metadata={"Creator": None, "Date": None, "Format": None, "Type": None})
    pyplot.close(figure)
    text = out.getvalue()
    text = text[text.index("<svg"):]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.S)
    text = re.sub(r'<!--.*?-->\n?', "", text, flags=re.S)
    used = set(re.findall(r'(?:="#|url\(#)([^")]+)', text))
    text = re.sub(r' id="([^"]+)"', lambda m: m[0] if m[1] in used else "", text)
    text = re.sub(r'( id="|="#|url\(#)', rf"\g<1>{salt}-", text)
    text = re.sub(r"(\d\.\d\d)\d+(?=[^<>]*>)", r"\1", text)  # in tags: a hundredth of a point is as good
    text = re.sub(r"\s*\n\s*", " ", text)
    text = re.sub(r"font: ([\d.]+)px [^;\"]*", r"font-size: \1px", text)
    return text.replace("<svg ", f'<svg role="img" aria-label="{label}" ', 1)


def percents(axis):
    from matplotlib.ticker import FuncFormatter
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:g} %"))


def logarithmic(axis, steps):
    from matplotlib.ticker import LogLocator, NullFormatter
    axis.set_major_locator(LogLocator(subs=steps, numticks=12))
    axis.set_minor_locator(LogLocator(subs=range(1, 10), numticks=99))
    axis.set_minor_formatter(NullFormatter())
    axis.set_tick_params(which="minor", length=2)


def _times(axis):
    from matplotlib.ticker import FuncFormatter
    axis.set_major_formatter(FuncFormatter(
        lambda ms, _: f"{ms / 1000:g} s" if ms >= 1000 else f"{ms:g} ms"))


def _bars(row, against, layer):
    """Lengths of a point's bars to the left, right, below and above it: quartiles, interval."""
    ms, error, point = row
    time, measured = point["time_ms"]["frame"], point["error"][against][layer]
    low, high = measured["low"], measured["high"]
    below = error - low if low and 0 < low <= error else 0
    above = high - error if high and math.isfinite(high) and high >= error else 0
    return max(ms - time["q1"], 0), max(time["q3"] - ms, 0), below, above


def drawn(result, scene, technique, against, layer):
    """The rows of a curve that have an error at all: the others would stretch the axis to nothing."""
    return [row for row in curve(result, scene, technique, against, layer) if row[1] > EXACT]


def _draw_curve(axes, result, scene, technique, against, layer):
    rows = drawn(result, scene, technique, against, layer)
    if not rows:
        return
    color, marker = style_of(result, technique)
    left, right, below, above = zip(*(_bars(row, against, layer) for row in rows))
    axes.errorbar([r[0] for r in rows], [r[1] for r in rows], xerr=(left, right),
                  yerr=(below, above), fmt=marker, color=color, ms=6, elinewidth=1.2, mec="white",
                  mew=0.8, label=technique, zorder=3)
    path = front_rows(rows)
    axes.plot([r[0] for r in path], [r[1] for r in path], color=color, lw=1.8, alpha=0.85, zorder=2)
    for ms, error, point in path[:1] + path[1:][-1:]:
        # To the left of a last point there is room only where the front has some length.
        first = point is path[0][2]
        right = first or ms < 4 * path[0][0]
        axes.annotate(_short(rung_text(point)), (ms, error), color=color, fontsize=8,
                      xytext=(6 if right else -7, 5 if first else -4),
                      textcoords="offset points", ha="left" if right else "right",
                      va="bottom" if first else "top", zorder=4, annotation_clip=True)


def _draw_floors(axes, result, scene, against, layer):
    """Dashed lines from the highest down; names go below a line where one is close above."""
    floors = {t: floor_of(result, scene, t, against, layer) for t in techniques_of(result, scene)}
    above = math.inf
    for technique, floor in sorted(floors.items(), key=lambda item: -(item[1] or 0)):
        if not floor:
            continue
        color, _ = style_of(result, technique)
        below = floor > above / CLOSE
        axes.axhline(floor, color=color, lw=1, ls=(0, (5, 4)), alpha=0.8, zorder=1)
        axes.annotate(f"{technique}: floor {percent(floor)}", (0.995, floor),
                      xycoords=("axes fraction", "data"), ha="right",
                      va="top" if below else "bottom", fontsize=8, color=color,
                      xytext=(0, -2 if below else 1), textcoords="offset points")
        above = floor


def error_against_time(pyplot, result, scene, against, layer, salt):
    """Log-log: every point with its quartiles and its interval, each technique's Pareto front, the
    floors of the models."""
    figure, axes = pyplot.subplots(figsize=(6.4, 4.6))
    _fill(axes, result, scene, against, layer)
    axes.set_xlabel("time of a new frame, median and quartiles")
    axes.set_ylabel(f"relative RMSE of {layer}")
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1.0), ncol=4, fontsize=10, borderaxespad=0.2)
    truth = "the whole rendering equation" if against == "full" else "each technique’s own model"
    return svg(pyplot, figure, salt, f"{scene}: error of {layer} against {truth} over time")


def overview(pyplot, result, path):
    """One file for a README: the beauty of every scene against the whole rendering equation."""
    scenes = [s["name"] for s in result["scenes"] if techniques_of(result, s["name"])]
    if not scenes:
        return
    columns = min(2, len(scenes))
    rows = -(-len(scenes) // columns)
    figure, grid = pyplot.subplots(rows, columns, figsize=(5.2 * columns, 3.9 * rows),
                                   squeeze=False, layout="constrained")
    for axes in grid.flat[len(scenes):]:
        axes.set_visible(False)
    for axes, scene in zip(grid.flat, scenes):
        _fill(axes, result, scene, "full", "beauty")
        axes.set_title(scene, loc="left", fontsize=11)
    figure.supxlabel("time of a new frame, median and quartiles", fontsize=11)
    figure.supylabel("relative RMSE against the whole rendering equation", fontsize=11)
    names = dict(zip(*reversed(grid.flat[0].get_legend_handles_labels())))
    figure.legend(names.values(), names.keys(), loc="lower center",
                  bbox_to_anchor=(0.5, 1.0), ncol=6)
    figure.savefig(path, format="svg", bbox_inches="tight", facecolor="white",
                   metadata={"Date": None, "Creator": None})
    pyplot.close(figure)


def _fill(axes, result, scene, against, layer):
    axes.set_xscale("log")
    axes.set_yscale("log")
    for technique in techniques_of(result, scene):
        _draw_curve(axes, result, scene, technique, against, layer)
    _draw_floors(axes, result, scene, against, layer)
    axes.set_ylim(*axes.get_ylim())
    axes.axhspan(0, HEADLINE_ERROR, color="#0072B2", alpha=0.06, lw=0, zorder=0)
    axes.grid(True, which="major", lw=0.7)
    axes.set_axisbelow(True)
    logarithmic(axes.xaxis, (1,))
    _times(axes.xaxis)
    logarithmic(axes.yaxis, (1, 2, 5))
    percents(axes.yaxis)


def pass_bars(pyplot, result, scene, salt):
    """Stacked: what each pass takes at each rung, as a share of the whole frame."""
    points = [row[2] for t in techniques_of(result, scene) for row in curve(result, scene, t)
              if row[2]["time_ms"]["passes"]]
    if not points:
        return None
    names = list(dict.fromkeys(n for p in points for n in p["time_ms"]["passes"]))
    colors = pyplot.get_cmap("tab20")
    figure, axes = pyplot.subplots(figsize=(6.4, 0.9 + 0.3 * len(points)))
    for row, point in enumerate(points):
        start, whole = 0.0, point["time_ms"]["frame"]["median"]
        for name, time in point["time_ms"]["passes"].items():
            share = time["median"] / whole if whole > 0 else 0
            index = names.index(name)
            axes.barh(row, share, left=start, color=colors(index % 20), height=0.72,
                      label=name if row == _first_with(points, name) else None)
            start += share
        axes.annotate(duration(whole), (start, row), xytext=(4, 0), textcoords="offset points",
                      va="center", fontsize=8, color=GREY)
    axes.set_yticks(range(len(points)), [f"{p['technique']} {rung_text(p)}"
                                         for p in points], fontsize=9)
    axes.invert_yaxis()
    axes.set_xlim(0, 1.15)
    percents(axes.xaxis)
    axes.set_xlabel("share of the frame; the rest is between passes")
    axes.legend(fontsize=8, ncol=4, loc="lower left", bbox_to_anchor=(0, 1.0), borderaxespad=0.3,
                columnspacing=1.0, handlelength=1.0)
    return svg(pyplot, figure, salt, f"{scene}: time of passes")


def _first_with(points, name):
    return next(i for i, p in enumerate(points) if name in p["time_ms"]["passes"])


def step_bars(pyplot, result, item, salt):
    """What lies between the whole rendering equation and a technique's best picture."""
    color, _ = style_of(result, item["technique"])
    steps = item["steps"]
    figure, axes = pyplot.subplots(figsize=(6.4, 0.9 + 0.42 * (len(steps) + 1)))
    values = [*(s["rel_rmse"] for s in steps), item["total"]]
    signed = [*(s["signed"] for s in steps), sum(s["signed"] for s in steps)]
    widest = max(max(values), 1e-9)
    axes.barh(range(len(values)), values, height=0.55, color=[color] * len(steps) + [GREY])
    axes.plot([abs(s) for s in signed], range(len(signed)), "|", color="black", ms=14, mew=1.6)
    for row, (value, mean) in enumerate(zip(values, signed)):
        axes.annotate(f"{percent(value)}  (mean {percent(mean, '+')})",
                      (max(value, abs(mean)), row), xytext=(6, 0), textcoords="offset points",
                      va="center", fontsize=9, color="#334")
    axes.set_yticks(range(len(values)), [*(s["name"] for s in steps), "all together"], fontsize=9)
    axes.invert_yaxis()
    axes.set_xlim(0, widest * 1.55)
    percents(axes.xaxis)
    axes.set_xlabel("relative RMSE of the step; | its mean")
    return svg(pyplot, figure, salt, f"{item['scene']}: steps from the full reference to "
                                     f"{item['technique']}")
