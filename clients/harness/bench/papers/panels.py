"""Panels of a figure as one SVG. The only module here that knows matplotlib, which is loaded late."""
from .. import plots

COLUMNS = 2
WIDTH, HEIGHT = 4.9, 3.7  # inches of a panel
LEGEND_ROOM = 1.3         # bars end below the legend
BAR_SPAN = 0.8            # of the way between two names, for all bars there


def drawing(pyplot, panels, title, salt):
    """SVG text fit to lie in the page; ids begin with `salt`."""
    columns = min(COLUMNS, len(panels))
    rows = -(-len(panels) // columns)
    shape = (WIDTH * columns, HEIGHT * rows)
    figure, grid = pyplot.subplots(rows, columns, figsize=shape, squeeze=False, layout="constrained")
    for axes in grid.flat[len(panels):]:
        axes.set_visible(False)
    for axes, panel in zip(grid.flat, panels):
        _fill(axes, panel)
    return plots.svg(pyplot, figure, salt, title)


def _fill(axes, panel):
    if panel.log_y:
        axes.set_yscale("log")
    if panel.log_x:
        axes.set_xscale("log")
    if panel.names:
        _bars(axes, panel)
    else:
        _lines(axes, panel)
    axes.set_title(panel.title, loc="left", fontsize=11)
    axes.set_xlabel(panel.x)
    axes.set_ylabel(panel.y)
    axes.grid(True, which="major", lw=0.7)
    axes.set_axisbelow(True)
    _ticks(axes, panel)
    if panel.names:
        axes.set_ylim(top=axes.get_ylim()[1] * LEGEND_ROOM)
    axes.legend(fontsize=8)


def _ticks(axes, panel):
    if panel.log_y:
        plots.logarithmic(axes.yaxis, (1, 2, 5))
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    else:
        axes.set_ylim(bottom=0)
    if panel.percent_y:
        plots.percents(axes.yaxis)
    if panel.names:
        axes.set_xticks(range(len(panel.names)), panel.names, fontsize=9)
    elif panel.log_x:
        values = sorted({x for line in panel.lines for x, _ in drawn(line)})
        axes.set_xticks(values, [_short(x) for x in values], fontsize=9)
        axes.minorticks_off()


def _short(value):
    return f"{value / 1000:.3g}k" if value >= 10000 else f"{value:.6g}"


def drawn(line):
    return [(x, y) for x, y in line.points if y is not None]


def _style(number, line):
    if line.paper:
        return {"color": plots.GREY, "marker": "x", "ls": "--"}
    return {"color": plots.COLORS[number % len(plots.COLORS)], "mec": "white",
            "marker": plots.MARKERS[number % len(plots.MARKERS)], "ls": "-"}


def _lines(axes, panel):
    for number, line in enumerate(panel.lines):
        points = drawn(line)
        if points:
            axes.plot(*zip(*points), label=line.label, lw=1.8, ms=6, mew=0.8, **_style(number, line))


def _bars(axes, panel):
    width = BAR_SPAN / len(panel.lines)
    for number, line in enumerate(panel.lines):
        points = drawn(line)
        if points:
            shift = (number + 0.5) * width - BAR_SPAN / 2
            color = plots.LIGHT if line.paper else _style(number, line)["color"]
            axes.bar([x + shift for x, _ in points], [y for _, y in points], width * 0.92,
                     color=color, label=line.label)
