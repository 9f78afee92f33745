"""Arithmetic of error against run time: quartiles, the Pareto front, and reading off it.

A point is (time, error), both above zero; times in milliseconds, errors as ratios (0.02 is 2 %).
"""
import math


def quartiles(values):
    """(lower quartile, median, upper quartile), linear between the values that are there."""
    ordered = sorted(values)
    if not ordered:
        raise ValueError("quartiles of nothing")

    def at(share):
        place = share * (len(ordered) - 1)
        below = math.floor(place)
        above = min(below + 1, len(ordered) - 1)
        return ordered[below] + (place - below) * (ordered[above] - ordered[below])

    return at(0.25), at(0.5), at(0.75)


def front(points):
    """The points that no other beats in both time and error, by time: errors fall strictly.

    Points with a time or an error that is not finite and positive have no place on logarithmic axes
    and are left out.
    """
    usable = sorted(p for p in points if all(math.isfinite(x) and x > 0 for x in p[:2]))
    kept = []
    for point in usable:
        if not kept or point[1] < kept[-1][1]:
            kept.append(point)
    return kept


def _between(x, x0, y0, x1, y1):
    """y at x on the straight line through two points of logarithmic axes."""
    share = math.log(x / x0) / math.log(x1 / x0)
    return y0 * (y1 / y0) ** share


def time_at_error(points, error):
    """Time at which the front falls to `error`; None if it never does.

    Between two points of the front, on the line between them on logarithmic axes. An error that
    the cheapest point beats costs what that point costs: nothing cheaper was measured.
    """
    path = front(points)
    if not path or error < path[-1][1]:
        return None
    if error >= path[0][1]:
        return path[0][0]
    for (t0, e0, *_), (t1, e1, *_) in zip(path, path[1:]):
        if error >= e1:
            return _between(error, e0, t0, e1, t1)
    raise AssertionError("the front ends above an error that it reaches")


def error_at_time(points, time):
    """Error that `time` buys on the front; None if nothing is that cheap.

    A time beyond the last point buys the last point's error: nothing better was measured.
    """
    path = front(points)
    if not path or time < path[0][0]:
        return None
    if time >= path[-1][0]:
        return path[-1][1]
    for (t0, e0, *_), (t1, e1, *_) in zip(path, path[1:]):
        if time <= t1:
            return _between(time, t0, e0, t1, e1)
    raise AssertionError("the front ends before a time that it spans")


def slope(points):
    """p of error ~ time^p over the front, by least squares on logarithmic axes: -0.5 for samples
    that know nothing of each other. None for fewer than two points."""
    path = [(math.log(t), math.log(e)) for t, e, *_ in front(points)]
    if len(path) < 2:
        return None
    mean_t, mean_e = (sum(column) / len(path) for column in zip(*path))
    return (sum((t - mean_t) * (e - mean_e) for t, e in path)
            / sum((t - mean_t) ** 2 for t, _ in path))


def decades(low, high):
    """1, 3, 10, 30, ... from at least `low` to at most `high`."""
    if not 0 < low <= high:
        return []
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    steps = [m * 10.0 ** e for e in range(first, last + 1) for m in (1, 3)]
    return [step for step in steps if low <= step <= high]
