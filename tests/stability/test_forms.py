"""The closed forms against numbers that others worked out, and against each other."""
import numpy
import pytest

from harness import oracles_forms as forms
from harness.oracles_scenes import ORACLES, View

CEILING = {.1: 1.5983968, .25: 1.1849861, .5: 0.7754678, .75: 0.5432904, .9: 0.4498207}


@pytest.mark.parametrize("a,expected", CEILING.items())
def test_a_floor_under_a_ceiling(a, expected):
    closed = (2 + a * a) / (1 - a * a) ** 2 - 3 * a * numpy.arccos(a) / (1 - a * a) ** 2.5
    assert closed == pytest.approx(expected, abs=1e-7)
    assert forms.disc_to_ceiling(a, 1e5) == pytest.approx(expected, abs=1e-6)


def test_a_finite_disc_is_the_sum_of_its_rings():
    a, reach = 0.5, 3.0
    x = (numpy.arange(200000) + 0.5) / 200000 * reach
    rings = 2 * a * numpy.sum(x / ((a * a + x * x) ** 1.5 * (1 + x * x) ** 2)) * reach / 200000
    assert forms.disc_to_ceiling(a, reach) == pytest.approx(rings, rel=1e-6)


def test_discs():
    assert forms.offset_disc(1, 1, 1) == pytest.approx(.2763932, abs=1e-7)
    assert forms.offset_disc(1, 1, 1e-6) == pytest.approx(forms.coaxial_disc(1, 1), abs=1e-7)


def test_rectangles():
    assert forms.rectangle_over_corner(1, 1, 1) == pytest.approx(.1385316, abs=1e-7)
    assert 4 * forms.rectangle_over_corner(.5, .5, 1) == pytest.approx(.2394565, abs=1e-7)
    assert forms.wall_from_corner(1, 1, 1) == pytest.approx(.0557342, abs=1e-7)
    assert forms.wall(1, 1e6, 1) == pytest.approx(.1464466, abs=1e-6)


def test_a_square_seen_from_all_of_its_neighbour():
    grid = (numpy.arange(400) + 0.5) / 400
    seen = forms.wall(1, 0.5, grid[:, None], grid[None, :] - 0.5)
    assert seen.mean() == pytest.approx(forms.UNIT_SQUARES["sharing an edge"], rel=1e-4)


def test_bounces_add_up():
    assert forms.bounce_sum(.5, forms.UNLIMITED) == pytest.approx(1)
    assert forms.bounce_sum(.5, 0) == 0
    assert forms.bounce_sum(.5, 3) == pytest.approx(.875)


def test_cube_first_bounce_is_part_of_the_whole():
    for rho, total in forms.CUBE_TOTAL.items():
        for (u, v), first, every in zip(forms.CUBE_POINTS, forms.CUBE_FIRST, total):
            direct = forms.cube_direct(u, v)
            assert direct + rho * first < every
    assert forms.concentric_spheres(1, 2, .8, .5, 1) == pytest.approx((1.5238095, 1.9047619))
    assert forms.floor_under_a_ball(1, 2, 1) == pytest.approx(.8211146, abs=1e-6)
    assert forms.slab_transmittance(1.5) == pytest.approx(.9230769, abs=1e-7)


def test_a_view_knows_the_points_behind_its_pixels():
    down = View("", (0, 0.5, 0), (0, -1, 0), 2.0, up=(0, 0, -1), at=(0, -1, 0)).points(2)
    assert down[0, 0] == pytest.approx([-1, -1, -1]) and down[0, 1] == pytest.approx([1, -1, -1])
    assert down[1, 0] == pytest.approx([-1, -1, 1])
    inside = View("", (0.4, 0.2, 0.8), (0, 0, -1), yfov=1.4, at=2.0).points(8)
    assert numpy.linalg.norm(inside, axis=-1) == pytest.approx(2.0 * numpy.ones((8, 8)))


@pytest.mark.parametrize("oracle", ORACLES, ids=lambda oracle: oracle.name)
def test_cameras_of_an_oracle_have_names_of_their_own(oracle):
    assert len({view.name for view in oracle.views}) == len(oracle.views)
