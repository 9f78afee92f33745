"""The figure of a film, on pictures made here: what flickers, what is steady, what follows and what lags."""
import numpy
import pytest

import films

FRAMES, SHAPE = 9, (6, 8, 3)


def film_of(truth_at, picture_at):
    film = films.Film()
    for number in range(FRAMES):
        truth = numpy.full(SHAPE, truth_at(number))
        film.add({"full": [truth, truth.copy()]}, {"it": ("full", numpy.full(SHAPE, picture_at(number)))})
    (row,) = film.rows()
    return film, row


def still(_):
    return 1.0


def brighter(number):
    return 1 + .1 * number


def test_steady_is_steady_however_wrong():
    _, row = film_of(still, lambda number: 1.3)
    assert row["J_value_percent"] == 0 and row["true_motion_percent"] == 0


def test_what_flickers_is_told_by_how_much():
    _, row = film_of(still, lambda number: 1 + .05 * (-1) ** number)
    assert row["J_value_percent"] == pytest.approx(10)


def test_what_follows_does_not_flicker():
    _, row = film_of(brighter, lambda number: 1.2 + .1 * number)
    assert row["J_value_percent"] == pytest.approx(0, abs=.01)
    mean = numpy.mean([brighter(number) for number in range(FRAMES)])
    assert row["true_motion_percent"] == pytest.approx(100 * .1 / mean, abs=.01)


def test_what_lags_is_off_by_what_is_true():
    _, row = film_of(brighter, still)
    assert row["J_value_percent"] == pytest.approx(row["true_motion_percent"], abs=.01)


def test_noise_of_the_truth_is_not_told_as_flicker():
    noise = numpy.random.default_rng(1)
    film = films.Film()
    for _ in range(200):
        halves = [1 + .2 * noise.standard_normal((24, 24, 3)) for _ in range(2)]
        film.add({"full": halves}, {"it": ("full", numpy.ones((24, 24, 3)))})
    (row,) = film.rows()
    assert abs(row["J_value_percent"]) < 2  # the halves' own difference is 28


def test_a_strip_shows_the_truth_on_top():
    film, _ = film_of(still, lambda number: .25)
    strip = film.strip()
    assert strip.shape[0] == 2 * SHAPE[0] and strip[0, 0, 0] == 1 and strip[-1, 0, 0] == .25
