"""Relations and oracles through pictures that are wrong on purpose: each fault must be found by the
row that is there to find it, and an honest picture by none."""
import os
import pathlib

import pytest

from harness import oracles, relations, relations_box, relations_edit, relations_scenes
from harness.daemon import Daemon, NoDevice
from harness.techniques import chosen
from harness.verdicts import FAIL
from spoiled_bounce import FAULTS

HERE = pathlib.Path(__file__).parent

# fault, technique, and the rows that must fail
RELATIONS = [
    ("channels_swapped", "direct", "colour_channels"),
    ("offset", "direct", "light_power"),
    ("clamped", "direct", "light_power"),
    ("gamma", "direct", "added_lights"),
    ("a_length_in_metres", "direct", "scene_scale"),
    ("by_the_file", "direct", "reorder"),
    ("by_the_axes", "direct", "rotation"),
    ("by_the_axes", "reference", "rotation"),
    ("by_the_lights", "direct", "split_lights"),
    ("by_the_triangles", "direct", "subdivision"),
    ("digits_lost_far_away", "direct", "translation"),
    ("digits_lost_far_away", "many_light", "translation"),
    ("by_the_axes", "many_light", "rotation"),
]
ORACLES = [
    ("indirect_times_pi", "rsm", "D8 cube, rho = 0.5"),
    ("indirect_times_pi", "rsm", "D6 disc"),
    ("indirect_times_pi", "reference", "D3 sphere"),
    ("direct_a_percent_bright", "direct", "D2 flux"),
    ("direct_a_percent_bright", "reference", "D4 floor"),
    ("cosine_twice", "direct", "D4 floor"),
    ("a_pixel_aside", "direct", "D4 floor"),
    ("offset", "direct", "D12 two rooms"),
]


@pytest.fixture(scope="module")
def daemon():
    build = pathlib.Path(os.environ["BD_BUILD_DIR"])
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HONEST_BOUNCE", str(build / "clients/cli/bounce"))
        patch.setenv("SPOIL", "none")
        patch.setenv("BOUNCE", str(HERE / "spoiled_bounce.py"))
        patch.setenv("BOUNCED", str(build / "server/bounced"))
        try:
            with Daemon() as running:
                yield running
        except NoDevice as fault:
            pytest.skip(f"no device here: {fault}")


def _named(daemon, technique):
    known = {item.name: item for item in chosen(daemon)}
    if technique not in known:
        pytest.skip(f"no technique {technique}")
    return known[technique]


def _relation(daemon, fault, technique, relation, folder):
    """States of one relation on our own scene, in small and under its first light alone."""
    daemon.env["SPOIL"] = fault
    options = relations.parser().parse_args(["--size", "48x36"])
    scene = relations_edit.prepared(relations_scenes.load("workshop"))
    scene = relations_edit.with_lights(scene, relations_edit.light_nodes(scene)[:1])
    case = relations.Case(daemon, _named(daemon, technique), chosen(daemon), "workshop", scene,
                          options.size, False, folder)
    return [verdict.state for verdict in relations.judge(case, relation, options)]


def _oracle(daemon, fault, technique, name, folder):
    daemon.env["SPOIL"] = fault
    [oracle] = [item for item in oracles.ORACLES if item.name == name]
    reading = next(oracles.readings(_named(daemon, technique), False))
    return [verdict.state for verdict in oracles.judge(daemon, oracle, reading, folder, "")]


def _box(daemon, fault, folder):
    daemon.env["SPOIL"] = fault
    options = relations.parser().parse_args(["--size", "48x36", "--keep", str(folder)])
    return [verdict.state for verdict in relations_box.closed_box(
        daemon, _named(daemon, "direct"), options, "")]


@pytest.mark.parametrize("fault,technique,relation", RELATIONS)
def test_a_relation_finds_it(daemon, tmp_path, fault, technique, relation):
    assert FAIL in _relation(daemon, fault, technique, relation, tmp_path)


@pytest.mark.parametrize("fault,technique,oracle", ORACLES)
def test_an_oracle_finds_it(daemon, tmp_path, fault, technique, oracle):
    assert FAIL in _oracle(daemon, fault, technique, oracle, tmp_path)


def test_the_closed_box_finds_an_offset(daemon, tmp_path):
    assert FAIL in _box(daemon, "offset", tmp_path)


def test_an_honest_picture_passes_through(daemon, tmp_path):
    """That the wrapper itself spoils nothing; that honest pictures pass is the other tests'."""
    assert FAIL not in _relation(daemon, "none", "direct", "light_power", tmp_path)
    assert FAIL not in _oracle(daemon, "none", "direct", "D4 floor", tmp_path)


def test_every_fault_is_used():
    used = {case[0] for case in RELATIONS + ORACLES}
    assert used | {"none"} == set(FAULTS)
