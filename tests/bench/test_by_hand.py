"""The scripts that are run by hand, without waiting for one: their arithmetic on frames made here, and
what they say of words that make no sense."""
import dataclasses
import json
import os
from pathlib import Path

import numpy
import pytest

import block_gather
import by_hand
import fairness
import import_stall
import paths
import second_camera
import temporal
import vpl_reference
from harness.glb import Glb

SCENE = Path(__file__).resolve().parents[1] / "scenes/cornell.glb"
TAKE_NAMES = [temporal, vpl_reference]  # of scenes
SCRIPTS = [block_gather, second_camera, *TAKE_NAMES]


@dataclasses.dataclass
class Frame:
    image: object
    report: dict
    command: str = "bounce render"

    def layer(self, name):
        assert name == "indirect"
        return self.image


def report(passes_ms=None, fragments=None, reused=()):
    return {"counts": {"fragments": fragments},
            "passes": [{"name": name, "ms": ms, "state": "reused" if name in reused else "ran"}
                       for name, ms in (passes_ms or {}).items()]}


# --- block_gather -------------------------------------------------------------------------------

def test_a_percentile_is_of_lit_pixels_over_their_own_value():
    """Ninety-eight right, one off by its own value, one by a tenth; what is dark does not count."""
    reference = numpy.zeros((10, 20, 3))
    reference[:, :10] = 1.0
    picture = reference.copy()
    picture[0, 0], picture[0, 1], picture[:, 10:] = 2.0, 1.1, 5.0
    mean = 1.5  # of the sums of channels, all pixels
    one, tenth = (error / (3 + .01 * mean) for error in (3, .3))
    expected = tenth + .01 * (one - tenth)  # between the 98th and the 99th of a hundred
    assert block_gather.percentile_99(reference, picture) == pytest.approx(expected)


def test_errors_of_blocks_by_hand():
    full = Frame(numpy.full((4, 4, 3), 2.0), report())
    off = numpy.full((4, 4, 3), 2.0)
    off[0, 0], off[0, 1] = 3.0, 1.0
    found = block_gather.compare(full, Frame(off, report(fragments=4)))
    assert found["fragments"] == pytest.approx(.25)
    assert found["rel_rmse"] == pytest.approx(numpy.sqrt(2 / 16) / 2)
    assert found["rmse_max"] == pytest.approx(numpy.sqrt(2 / 16) / 2)
    assert found["signed"] == pytest.approx(0)
    assert found["p99"] == pytest.approx(3 / 6.06)
    dark = Frame(numpy.zeros((4, 4, 3)), report())
    with pytest.raises(SystemExit, match="no indirect light"):
        block_gather.compare(dark, Frame(off, report(fragments=4)))


def test_the_stage_is_what_the_camera_pays_for_indirect_light():
    others = {"gbuffer": 1, "direct": 2, "shadow_map": 4, "rsm": 8, "vpl_grid": 16, "composite": 32,
              "readback": 64}
    own = {"discontinuity": 128, "fragments": 256, "surfaces": 512, "gather": 1024, "upsample": 2048}
    assert block_gather.stage_ms(report(others)) == 0
    assert block_gather.stage_ms(report({**others, **own})) == sum(own.values())


class Turns:
    """A daemon whose every second frame is of blocks, five times as fast."""

    def __init__(self):
        self.asked = []

    def render(self, _, technique, settings, **more):
        self.asked.append((technique, settings["vpls"], more["extra"]))
        image = numpy.full((2, 2, 3), 1.0)
        if technique == "rsm":
            return Frame(image, report({"gbuffer": 9.0, "gather": 10.0}))
        return Frame(image, report({"gbuffer": 9.0, "gather": 1.5, "upsample": .5}, fragments=1))


def test_both_techniques_take_turns_with_the_same_lights():
    daemon = Turns()
    found = block_gather.measure(daemon, SCENE, 64, 2, 3)
    names = [technique for technique, _, _ in daemon.asked]
    assert names[:8] == ["rsm", "multires_gather"] * 4
    assert {(vpls, extra) for _, vpls, extra in daemon.asked} == {(64, ("--fresh", "camera"))}
    assert found["rsm_ms"]["median"] == 10 and found["blocks_ms"]["median"] == 2
    assert found["faster"]["median"] == 5
    assert found["passes_ms"] == {"gather": 1.5, "upsample": .5}
    assert block_gather.row_of("sponza_dabrovic", 256, found).endswith("| 10, 2 | 5.0 (3) |")
    columns = {line.count("|") for line in block_gather.HEAD.split("\n")}
    assert columns == {block_gather.row_of("x", 1, found).count("|")}


# --- second_camera ------------------------------------------------------------------------------

def test_a_scene_of_one_camera_gets_another_beside_it(tmp_path):
    made = second_camera.with_two_cameras(SCENE, tmp_path)
    glb = paths.load(made)
    first, second = (glb.doc["nodes"][i] for i in glb.roots() if "camera" in glb.doc["nodes"][i])
    apart = numpy.subtract(second["translation"], first["translation"])
    assert numpy.linalg.norm(apart) == pytest.approx(.1 * paths.diagonal_m(glb))
    assert second_camera.with_two_cameras(made, tmp_path) == made  # which has two


class TwoCameras:
    """A daemon that keeps the light's side, 4 of 10 ms. To load the scene takes 3 more."""

    def hold(self, _):
        return {"id": "s1", "cameras": ["a", "b"]}

    def report(self, scene, _, camera, extra, **more):
        assert scene == "scene:s1" and more["size"] == second_camera.SIZE
        anew = extra == ("--fresh", "all")
        assert anew or camera == "1"
        made = report({"rsm": 4.0, "gather": 6.0}, reused=() if anew else ("rsm",))
        return {**made, "time_ms": {"total": 13.0 if anew else 9.0, "load": 3.0}}


def test_a_second_camera_is_charged_for_its_own_side():
    found = second_camera.measure(TwoCameras(), SCENE, "hisr", 3)
    assert found["with_upload_ms"] == pytest.approx(13)
    assert found["ratio"]["median"] == pytest.approx(.6)
    assert found["reused"] == ["rsm"]
    assert found["reused_share_of_first"] == pytest.approx(.4)


# --- fairness -----------------------------------------------------------------------------------

class Imports:
    """A client that remembers what the files hold that it is to render."""

    def __init__(self):
        self.seen = []

    def render_later(self, path, **_):
        self.seen.append(path.read_bytes())


def test_no_import_is_of_a_file_that_was_there_before(tmp_path, monkeypatch):
    monkeypatch.setattr(fairness, "TRIANGLES_SIDE", 3)
    client = Imports()
    for _ in range(2):  # batches of one run
        begins = fairness.import_job(tmp_path)(client)
        for _ in range(6):
            next(begins)()
            assert len(list(tmp_path.iterdir())) == 1
        begins.close()
    assert len(set(client.seen)) == len(client.seen) == 12
    assert not list(tmp_path.iterdir())


# --- what all of them share ---------------------------------------------------------------------

@pytest.fixture
def build(tmp_path, monkeypatch):
    """A build and a folder of all scenes, as far as a command line can tell."""
    for variable, place in by_hand.PROGRAMS.items():
        monkeypatch.delenv(variable, raising=False)
        (tmp_path / place).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / place).touch()
    for name in {name for script in SCRIPTS for name in script.SCENES}:
        (tmp_path / f"{name}.glb").touch()
    yield tmp_path
    for variable in by_hand.PROGRAMS:
        os.environ.pop(variable, None)


def words_of(script, build, output="result.json"):
    cache = ["--cache", str(build)] if script in TAKE_NAMES else []
    return [str(build), str(build), "-o", str(build / output), *cache]


def refusal(script, words, capsys):
    with pytest.raises(SystemExit) as ended:
        script.main(words)
    assert ended.value.code == 2
    return capsys.readouterr().err.splitlines()[-1]


@pytest.mark.parametrize("script", SCRIPTS)
def test_what_is_not_there_is_named_at_once(script, build, capsys):
    away = refusal(script, words_of(script, build, "nowhere/result.json"), capsys)
    assert "-o: there is no folder" in away
    (build / "cornell_box_spot_side.glb").unlink()
    assert "cornell_box_spot_side.glb" in refusal(script, words_of(script, build), capsys)
    (build / by_hand.PROGRAMS["BOUNCED"]).unlink()
    assert "BUILD_DIR: there is no" in refusal(script, words_of(script, build), capsys)


@pytest.mark.parametrize("script", TAKE_NAMES)
def test_a_scene_that_is_not_there_is_named_at_once(script, build, capsys):
    words = [*words_of(script, build), "--scenes", "sponza_dabrovic,,box"]
    assert "there is no" in refusal(script, words, capsys)


@pytest.mark.parametrize("script, option", [(block_gather, "--runs"), (block_gather, "--size"),
                                            (second_camera, "--runs"), (temporal, "--frames")])
@pytest.mark.parametrize("value", ["0", "-1", "2.5", "many", "99999"])
def test_a_number_that_measures_nothing_is_refused(script, option, value, build, capsys):
    line = refusal(script, [*words_of(script, build), f"{option}={value}"], capsys)
    assert option in line and "from 1 to 16384" in line


def test_scenes_are_named_and_programs_are_the_build_s(build):
    parser = by_hand.parser("What it does.\n\nMore.")
    by_hand.add_names(parser, ("sibenik",))
    options = by_hand.parse(parser, words_of(block_gather, build) + ["--scenes", "sibenik,garden"])
    assert options.names == ("sibenik", "garden") and options.build == build.resolve()
    assert os.environ["BOUNCE"] == str(build.resolve() / "clients/cli/bounce")
    assert by_hand.parse(parser, words_of(block_gather, build)).names == ("sibenik",)
    by_hand.write({"machine": by_hand.machine()}, options.output)
    assert set(json.loads(options.output.read_text())["machine"]) == {"cpu", "cores", "kernel",
                                                                      "load_before"}


# --- import_stall -------------------------------------------------------------------------------


def metrics(name, counts, longest_s):
    ends = ("0.02", "0.05", "0.1", "+Inf")
    lines = [f'bounced_{name}_seconds_bucket{{le="{end}"}} {count}' for end, count in zip(ends, counts)]
    return "\n".join([*lines, f"bounced_{name}_seconds_max {longest_s}", ""])


def test_stalls_of_a_phase_are_those_that_came_in_it():
    def read(*words):
        return import_stall.parse_stalls(metrics("loop_stall", *words), "loop_stall")
    before = read((90, 95, 99, 100), 0.2)
    # Four new ones: one below 20 ms, two below 50, one below 100; the longest of late is an older one.
    row = import_stall.difference(before, read((91, 98, 103, 104), 0.2))
    assert row == {"over_20_ms": 3, "over_50_ms": 1, "over_100_ms": 0, "longest_ms": 100}
    # And one that is the longest of late is known to the digit.
    row = import_stall.difference(before, read((90, 95, 99, 101), 0.3251))
    assert row == {"over_20_ms": 1, "over_50_ms": 1, "over_100_ms": 1, "longest_ms": 325.1}
    assert import_stall.difference(before, before)["longest_ms"] == 0


def test_the_large_scene_is_as_large_as_asked_for_and_the_same_again():
    data = import_stall.make_scene(2, 3, seed=1)
    assert 2e6 <= len(data) < 2.3e6
    assert data == import_stall.make_scene(2, 3, seed=1) != import_stall.make_scene(2, 3, seed=2)
    glb = Glb.loads(data)
    assert len(glb.doc["meshes"]) == 3 and len(glb.binary) > 2e6
