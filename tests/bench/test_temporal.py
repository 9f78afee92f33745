"""The arithmetic of temporal.py on films made by hand, and where paths.py puts lights."""
import math
from pathlib import Path

import numpy
import pytest

import paths
import temporal

SCENE = Path(__file__).resolve().parents[1] / "scenes/cornell.glb"


def noisy(rng, image, deviation):
    return [image + rng.normal(0, deviation, image.shape) for _ in range(2)]


def test_noise_of_the_halves_drops_out():
    rng = numpy.random.default_rng(3)
    true, series = numpy.full((64, 64, 3), 2.0), temporal.Series()
    for _ in range(20):
        series.add(true + 0.1, noisy(rng, true, 0.5))
    figure = series.figure(2.0)
    assert figure["value"] == pytest.approx(0.05, rel=0.1)
    assert figure["low"] < 0.05 < figure["high"]
    assert len(figure["frames"]) == 20


def test_a_picture_that_moves_with_the_light_has_no_error_of_motion():
    """However wrong each of its frames is, and one that flickers has all of it."""
    rng = numpy.random.default_rng(4)
    film = temporal.Film()
    names = list(film.motion)
    for number in range(12):
        true = numpy.full((32, 32, 3), 1.0 + 0.1 * number)
        film.add(noisy(rng, true, 1e-3), {name: true + (0.5 if name == names[0] else
                                                        0.2 * (number % 2)) for name in names})
    found = film.result("light")
    still, flickering = found["techniques"][:2]
    assert abs(still["J"]["value"] * found["mean_cd_m2"]) < 1e-3
    assert still["frame_error"]["value"] * found["mean_cd_m2"] == pytest.approx(0.5, rel=1e-2)
    assert flickering["J"]["value"] * found["mean_cd_m2"] == pytest.approx(0.2, rel=1e-2)
    assert found["true_motion"]["value"] * found["mean_cd_m2"] == pytest.approx(0.1, rel=1e-2)


def test_a_ratio_is_of_the_same_tiles():
    rng, all_of_it, half = numpy.random.default_rng(6), temporal.Series(), temporal.Series()
    for _ in range(5):
        error, true = rng.normal(0, 1, (64, 64, 3)) ** 3, numpy.zeros((64, 64, 3))
        all_of_it.add(error, [true, true])
        half.add(error / 2, [true, true])
    assert half.ratio(all_of_it) == pytest.approx({"value": 0.5, "low": 0.5, "high": 0.5})


def test_tiles_hold_every_pixel_once():
    squares = numpy.random.default_rng(5).random((37, 50))
    sums = temporal.tile_sums(squares)
    assert len(sums) == 3 * 4
    assert sums.sum() == pytest.approx(squares.sum())


def test_a_roll_turns_a_light_about_its_axis():
    quaternion = [-0.0769526, 0.4275826, 0.0365615, 0.8999526]
    rolled = paths.rolled(quaternion, 30)
    assert paths.turned(rolled, [0, 0, 1]) == pytest.approx(paths.turned(quaternion, [0, 0, 1]),
                                                            abs=1e-6)
    cosine = paths.turned(rolled, [1, 0, 0]) @ paths.turned(quaternion, [1, 0, 0])
    assert cosine == pytest.approx(math.cos(math.radians(30)), abs=1e-6)


@pytest.mark.parametrize("moving", ["light", "camera"])
def test_a_path_is_straight_and_even_about_where_the_node_was(moving):
    glb = paths.load(SCENE)
    node_of = {"light": paths.light_node, "camera": paths.camera_node}[moving]
    at = [numpy.array(node_of(paths.scene_at(glb, moving, i, 5))["translation"]) for i in range(5)]
    assert at[2] == pytest.approx(numpy.array(node_of(glb)["translation"]))
    steps = numpy.diff(at, axis=0)
    assert steps == pytest.approx(numpy.repeat(steps[:1], 4, axis=0), abs=1e-9)
    assert numpy.linalg.norm(steps[0]) == pytest.approx(paths.diagonal_m(glb) / 1000)
