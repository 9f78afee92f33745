"""Quartiles, Pareto fronts and what is read off them, on points made by hand."""
import math
import random

import pytest

from harness.bench.stats import decades, error_at_time, front, quartiles, slope, time_at_error


def test_quartiles_of_known_lists():
    assert quartiles([7]) == (7, 7, 7)
    assert quartiles([4, 1, 3, 2, 5]) == (2, 3, 4)
    assert quartiles([1, 2, 3, 4]) == (1.75, 2.5, 3.25)
    with pytest.raises(ValueError):
        quartiles([])


def test_front_drops_what_another_point_beats():
    points = [(10, 0.5), (20, 0.6), (30, 0.2), (30, 0.3), (5, 0.9), (40, 0.2), (50, 0.1)]
    assert front(points) == [(5, 0.9), (10, 0.5), (30, 0.2), (50, 0.1)]
    assert front([]) == []


def test_front_is_monotone_whatever_comes_in():
    rng = random.Random(4)
    for _ in range(200):
        points = [(rng.choice([1, 2, 4, 8]) * rng.random(), rng.random()) for _ in range(12)]
        path = front(points)
        assert path and all(a[0] < b[0] and a[1] > b[1] for a, b in zip(path, path[1:]))
        # Nothing that is left out would have been better anywhere.
        for time, error in points:
            assert any(t <= time and e <= error for t, e in path)


def test_front_has_no_place_for_what_a_logarithm_has_none():
    points = [(1, 0.0), (2, math.nan), (3, math.inf), (0, 0.1), (4, -0.2), (5, 0.3)]
    assert front(points) == [(5, 0.3)]


def test_time_at_error_is_straight_on_logarithmic_axes():
    points = [(10, 0.1), (1000, 0.001)]  # error = 1 / time
    for error in (0.1, 0.05, 0.02, 0.01, 0.001):
        assert time_at_error(points, error) == pytest.approx(1 / error, rel=1e-12)
    assert time_at_error(points, 0.0009) is None
    assert time_at_error(points, 0.5) == 10  # nothing cheaper was measured
    assert time_at_error([], 0.5) is None


def test_time_at_error_takes_the_cheapest_way():
    # The dear point reaches 5 % too, but the cheap ones were there before.
    points = [(10, 0.1), (20, 0.05), (25, 0.07), (500, 0.05), (900, 0.01)]
    assert time_at_error(points, 0.05) == pytest.approx(20)
    assert 20 < time_at_error(points, 0.04) < 900


def test_error_at_time_is_its_inverse():
    points = [(10, 0.1), (30, 0.04), (1000, 0.001)]
    for error in (0.09, 0.04, 0.02, 0.002):
        assert error_at_time(points, time_at_error(points, error)) == pytest.approx(error)
    assert error_at_time(points, 9) is None
    assert error_at_time(points, 5000) == 0.001


def test_slope_is_the_power_of_time():
    assert slope([(1, 0.8), (4, 0.4), (16, 0.2), (9, 0.7)]) == pytest.approx(-0.5)
    assert slope([(1, 0.5), (2, 0.6)]) is None  # only one of them is on the front


def test_decades():
    assert decades(2, 400) == [3, 10, 30, 100, 300]
    assert decades(10, 10) == [10]
    assert decades(0, 10) == []
