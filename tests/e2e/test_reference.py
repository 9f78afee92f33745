"""bounce reference as a user runs it: files that grow, what ends it, and what is refused."""
import json
import os
import pty
import re
import select
import signal
import subprocess
import time
from pathlib import Path

import numpy
import pytest

from conftest import BOUNCE, BUILD, HERE
from harness import exr, shapes
from harness.gltf import Writer
from stopwatch import Stopwatch

GLB = HERE / "../scenes/cornell.glb"
SMALL = ("--size", "24x16")
# Enough that no machine gets through it while a test waits.
ENDLESS = ("--size", "64x64", "--spp", "4000000")


@pytest.fixture(scope="module", autouse=True)
def daemon(tmp_path_factory):
    """One daemon for the tests that need none of their own; its XDG_RUNTIME_DIR."""
    folder = tmp_path_factory.mktemp("daemon")
    env = {**os.environ, "XDG_RUNTIME_DIR": str(folder)}
    with subprocess.Popen([BUILD / "server/bounced", "--http", "none", "--data", folder / "data"],
                          env=env, stderr=subprocess.PIPE) as process:
        until = time.monotonic() + 60
        while not (folder / "bounced.sock").exists() and process.poll() is None:
            assert time.monotonic() < until
            time.sleep(0.02)
        if process.poll() == 6:  # the reference needs no device, but the daemon does
            pytest.skip("no device here: " + process.stderr.read().decode())
        assert process.poll() is None, process.stderr.read().decode()
        yield str(folder)
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=30) == 0


@pytest.fixture
def alone(bounce):
    """bounce with no daemon to be found: it starts one."""
    return bounce


@pytest.fixture
def served(bounce, daemon):
    """bounce with a daemon on the default socket."""
    bounce.env["XDG_RUNTIME_DIR"] = daemon
    return bounce


def ok(result):
    assert result.returncode == 0, result.stderr
    return result


def read(bounce, name):
    return exr.read((bounce.folder / name).read_bytes())[0]


def manifest(bounce, name):
    return exr.read((bounce.folder / name).read_bytes())[1]


def parameters(bounce, name):
    return dict(word.split("=") for word in manifest(bounce, name)["parameters"].split())


def assert_alike(a, b, tolerance=2e-5):
    assert set(a) == set(b)
    for name in a:
        numpy.testing.assert_allclose(a[name], b[name], rtol=tolerance, atol=1e-7, err_msg=name)


def test_a_file_says_all_about_itself(alone):
    result = ok(alone("reference", GLB, "-o", "a.exr", *SMALL, "--spp", "6", "--json",
                      "--report", "r.json", "--filter", "box", "--bounces", "3", "--seed", "5",
                      "--set", "brdf=lambert"))
    report = json.loads(result.stdout)
    assert report == json.loads((alone.folder / "r.json").read_text())
    assert report["stopped"] == "complete" and report["parameters"]["spp"] == 6
    assert [p["name"] for p in report["passes"]] == ["bvh", "trace"]
    assert all(p["state"] == "ran" for p in report["passes"])
    assert report["memory_mib"]["reference"] > 0 and report["size"] == [24, 16]
    strings = manifest(alone, "a.exr")
    assert strings["technique"] == "reference" and strings["filter"] == "box"
    assert strings["seed"] == "5" and strings["scene"] == report["scene"]
    made = parameters(alone, "a.exr")
    assert made["spp"] == "6" and made["first_sample"] == "0" and made["bounces"] == "3"
    assert made["brdf"] == "lambert"
    planes = read(alone, "a.exr")
    assert len(planes) == 54
    for letter in "RGB":
        parts = sum(planes[f"{layer}.{letter}"] for layer in ("direct", "indirect", "emission"))
        numpy.testing.assert_allclose(parts, planes[letter], rtol=1e-5, atol=1e-8)
        halves = (planes[f"half_a.{letter}"] + planes[f"half_b.{letter}"]) / 2
        numpy.testing.assert_allclose(halves, planes[letter], rtol=1e-5, atol=1e-8)
        assert (planes[f"variance.{letter}"] >= 0).all()


@pytest.mark.parametrize("filter_name", ["point", "box"])
def test_a_resumed_file_is_an_uninterrupted_one(served, filter_name):
    options = (*SMALL, "--filter", filter_name)
    ok(served("reference", GLB, "-o", "whole.exr", *options, "--spp", "40"))
    for spp in ("4", "10", "40"):
        ok(served("reference", GLB, "-o", "grown.exr", *options, "--spp", spp))
        assert parameters(served, "grown.exr")["spp"] == spp
    assert_alike(read(served, "grown.exr"), read(served, "whole.exr"))
    assert manifest(served, "grown.exr") == manifest(served, "whole.exr")


def indirect_error(bounce, image):
    result = ok(bounce("compare", "truth.exr", image, "--layer", "indirect", "--json"))
    return json.loads(result.stdout)["rel_rmse"]["value"]


def test_a_filtered_file_is_judged_as_it_is_shown(served):
    ok(served("reference", GLB, "-o", "truth.exr", *SMALL, "--spp", "1024", "--seed", "9"))
    ok(served("reference", GLB, "-o", "plain.exr", *SMALL, "--spp", "8"))
    ok(served("reference", GLB, "-o", "filtered.exr", *SMALL, "--spp", "8", "--filter-noise"))
    assert parameters(served, "filtered.exr")["noise_filter"] == "on"
    plain, filtered = read(served, "plain.exr"), read(served, "filtered.exr")
    halves = [name for name in plain if name.startswith(("half_", "variance"))]
    assert len(halves) > 10
    assert_alike({n: filtered[n] for n in halves}, {n: plain[n] for n in halves}, 0)
    assert (filtered["indirect.G"] != plain["indirect.G"]).any()
    # By its halves, which are not filtered, the picture would have next to no error.
    truth = read(served, "truth.exr")["indirect.G"]
    shown = numpy.sqrt(((filtered["indirect.G"] - truth) ** 2).mean()) / truth.mean()
    assert indirect_error(served, "filtered.exr") == pytest.approx(shown, rel=0.3)


def test_what_is_done_is_not_done_again(served):
    ok(served("reference", GLB, "-o", "a.exr", *SMALL, "--spp", "8"))
    before = (served.folder / "a.exr").stat()
    result = ok(served("reference", GLB, "-o", "a.exr", *SMALL, "--spp", "4", "--json"))
    after = (served.folder / "a.exr").stat()
    assert (before.st_ino, before.st_mtime_ns) == (after.st_ino, after.st_mtime_ns)
    report = json.loads(result.stdout)
    assert report["parameters"]["spp"] == 8
    assert all(p["state"] == "planned" for p in report["passes"])


@pytest.mark.parametrize("changed,word", [
    (("--seed", "1"), "seed"),
    (("--bounces", "2"), "parameters"),
    (("--set", "brdf=lambert"), "parameters"),
    (("--model-of", "rsm"), "parameters"),
    (("--region", "0,0,4,4"), "region"),
    (("--size", "16x24"), "size"),
    (("--environment", "1,1,1"), "scene"),
])
def test_other_options_do_not_go_on_from_a_file(served, changed, word):
    ok(served("reference", GLB, "-o", "a.exr", *SMALL, "--spp", "2"))
    before = (served.folder / "a.exr").read_bytes()
    result = served("reference", GLB, "-o", "a.exr", *SMALL, "--spp", "4", *changed)
    assert result.returncode == 2 and word in result.stderr and "--force" in result.stderr
    assert (served.folder / "a.exr").read_bytes() == before
    ok(served("reference", GLB, "-o", "a.exr", *SMALL, "--spp", "4", *changed, "--force"))
    assert (served.folder / "a.exr").read_bytes() != before


@pytest.mark.parametrize("content", [b"", b"nonsense", b"\x76\x2f\x31\x01"])
def test_a_file_of_another_kind_is_left_alone(served, content):
    (served.folder / "a.exr").write_bytes(content)
    result = served("reference", GLB, "-o", "a.exr", *SMALL, "--spp", "2")
    assert result.returncode in (2, 4) and "a.exr" in result.stderr
    assert (served.folder / "a.exr").read_bytes() == content


def test_a_frame_is_no_reference(served):
    ok(served("render", GLB, "-o", "a.exr", *SMALL, "--technique", "direct"))
    result = served("reference", GLB, "-o", "a.exr", *SMALL)
    assert result.returncode == 2 and "--force" in result.stderr


@pytest.mark.parametrize("words,word", [
    (("--spp", "7"), "spp"), (("--bounces", "65"), "bounces"), (("--bounces", "few"), "bounces"),
    (("--lights", "sun"), "lights"), (("--filter", "gauss"), "filter"),
    (("--alpha", "blend"), "alpha"), (("--clamp", "-1"), "clamp"),
    (("--indirect-visibility", "maybe"), "indirect_visibility"),
    (("--model-of", "radiosity"), "radiosity"), (("--set", "vpls=4"), "vpls"),
    (("--region", "20,0,5,1"), "region"), (("--camera", "Nobody"), "Nobody"),
    (("--environment", "1,1"), "environment"), (("--time-limit", "soon"), "time-limit"),
])
def test_refusals_name_the_option_and_leave_no_file(served, words, word):
    result = served("reference", GLB, "-o", "a.exr", *SMALL, *words)
    assert result.returncode == 2 and word in result.stderr, result.stderr
    assert not (served.folder / "a.exr").exists()


def wait_for_samples(process, limit_s=30):
    """Reads the process's notes until it traces."""
    os.set_blocking(process.stderr.fileno(), False)
    text, until = b"", time.monotonic() + limit_s
    while b"bounce: reference" not in text and time.monotonic() < until:
        select.select([process.stderr], [], [], 1)
        text += process.stderr.read() or b""
    assert b"bounce: reference" in text, text
    os.set_blocking(process.stderr.fileno(), True)


def test_ctrl_c_keeps_what_there_is(alone):
    process = alone.start("reference", GLB, "-o", "a.exr", *ENDLESS)
    wait_for_samples(process)
    time.sleep(1.5)
    watch = Stopwatch()
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=120)
    assert process.returncode == 130, err
    assert watch.own_s() < 10
    said = re.search(rb"a\.exr has (\d+) spp of 4000000", err)
    assert said, err
    spp = int(said[1])
    assert spp >= 2 and parameters(alone, "a.exr")["spp"] == str(spp)
    assert len(list(alone.folder.glob("*.exr*"))) == 1  # nothing half-written beside it
    # And the same command goes on.
    ok(alone("reference", GLB, "-o", "a.exr", *ENDLESS[:2], "--spp", spp + 2))
    assert parameters(alone, "a.exr")["spp"] == str(spp + 2)


def test_a_daemon_that_dies_leaves_the_samples(alone):
    process = alone.start("reference", GLB, "-o", "a.exr", *ENDLESS)
    wait_for_samples(process)
    time.sleep(1.5)
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    assert len(children) == 1
    os.kill(int(children[0]), signal.SIGKILL)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 7 and b"signal 9" in err and b"a.exr has" in err, err
    assert int(parameters(alone, "a.exr")["spp"]) >= 2


def test_a_time_limit_keeps_what_fits(served):
    watch = Stopwatch()
    result = ok(served("reference", GLB, "-o", "a.exr", "--size", "32x32", "--time-limit", "1.5",
                       "--json"))
    assert watch.own_s() < 20 and watch.wall_s() > 1
    report = json.loads(result.stdout)
    spp = report["parameters"]["spp"]
    assert report["stopped"] == "deadline" and spp >= 2
    assert f"time is up; a.exr has {spp} spp" in result.stderr
    assert parameters(served, "a.exr")["spp"] == str(spp)


def test_a_limit_that_nothing_fits(served):
    result = served("reference", GLB, "-o", "a.exr", "--size", "2000x2000", "--time-limit",
                    "0.005", "--bounces", "64")
    assert result.returncode == 5 and "time-limit" in result.stderr
    assert not (served.folder / "a.exr").exists()


def test_a_region_alone_is_traced(served):
    ok(served("reference", GLB, "-o", "a.exr", *SMALL, "--spp", "2", "--region", "4,3,10,7"))
    ok(served("reference", GLB, "-o", "whole.exr", *SMALL, "--spp", "2"))
    part, whole = read(served, "a.exr"), read(served, "whole.exr")
    inside = numpy.zeros(part["R"].shape, bool)
    inside[3:10, 4:14] = True
    assert (part["R"][inside] == whole["R"][inside]).all()
    assert (part["R"][~inside] == 0).all() and (part["A"][~inside] == 0).all()
    assert manifest(served, "a.exr")["region"] == "4,3,10,7"


def test_a_sky_lights_and_is_seen(served):
    ok(served("reference", GLB, "-o", "dark.exr", *SMALL, "--spp", "2", "--lights", "environment"))
    ok(served("reference", GLB, "-o", "lit.exr", *SMALL, "--spp", "2", "--lights", "environment",
              "--environment", "1,2,4"))
    dark, lit = read(served, "dark.exr"), read(served, "lit.exr")
    assert dark["R"].max() == 0 and lit["direct.R"].max() > 0
    sky = lit["A"] == 0
    if sky.any():
        assert (lit["emission.B"][sky] == 4).all()
    # The same constant as a map.
    ok(served("render", GLB, "-o", "map.exr", "--size", "8x4", "--technique", "direct"))
    ok(served("reference", GLB, "-o", "mapped.exr", *SMALL, "--spp", "2", "--environment",
              "map.exr"))
    assert parameters(served, "mapped.exr")["lights"] == "all"


def test_a_rasterized_frame_says_whether_the_sky_lights(served):
    words = ("render", GLB, "-o", "a.exr", *SMALL, "--environment", "1,1,1", "--technique", "direct")
    assert "environment_not_lighting" not in ok(served(*words)).stderr
    assert "environment_not_lighting" in ok(served(*words, "--set", "light_rays=0")).stderr


def test_default_lights_stand_in_where_the_sky_does_not_light(served):
    """A scene without lights under a sky: what cannot use the sky shows the default lights, and what can
    does without them."""
    w = Writer()
    positions, normals, indices, _ = shapes.box((1, 1, 1))
    w.node("box", mesh=w.mesh("box", positions, normals, indices, w.material("grey", color=(0.5, 0.5, 0.5))))
    w.camera("Camera", (0, 0, 4), (0, 0, -1), yfov=1)
    w.write_glb(served.folder / "bare.glb")

    def render(name, *words):
        ok(served("render", "bare.glb", "-o", name, *SMALL, "--report", "r.json", *words))
        return read(served, name), json.loads((served.folder / "r.json").read_text())["flags"]

    sky, traced = ("--environment", "1,1,1"), ("--technique", "reference", "--set", "spp=2")
    plain, flags = render("plain.exr", "--technique", "direct")
    assert flags == ["default_lights"] and plain["R"].max() > 0
    under, flags = render("under.exr", "--technique", "direct", *sky, "--set", "light_rays=0")
    assert flags == ["default_lights", "environment_not_lighting: the default lights shine instead"]
    assert all((plain[name] == under[name]).all() for name in plain)
    lit, flags = render("lit.exr", *traced, *sky, "--layers", "direct")
    assert flags == []
    alone, flags = render("alone.exr", *traced, *sky, "--layers", "direct", "--set", "lights=environment")
    assert flags == [] and (lit["direct.R"] == alone["direct.R"]).all() and lit["direct.R"].max() > 0
    seen = plain["A"] > 0
    rasterized, flags = render("rasterized.exr", "--technique", "direct", *sky)
    assert flags == [] and (rasterized["R"][seen] != plain["R"][seen]).any()
    model, flags = render("model.exr", *traced[:3], "spp=64", *sky, "--set", "model_of=direct")
    assert flags == [] and abs(model["R"][seen] - rasterized["R"][seen]).mean() < 0.01
    model, flags = render("model.exr", *traced, *sky, "--set", "model_of=direct", "--set", "lights=punctual")
    assert "default_lights" in flags and abs(model["R"][seen] - plain["R"][seen]).mean() < 0.01


def test_a_picture_of_the_reference(served):
    ok(served("render", GLB, "-o", "a.png", *SMALL, "--technique", "reference", "--set", "spp=2"))
    assert (served.folder / "a.png").read_bytes().startswith(b"\x89PNG")
    ok(served("render", GLB, "-o", "a.exr", *SMALL, "--technique", "reference", "--set", "spp=2",
              "--layers", "direct,halves"))
    names = set(read(served, "a.exr"))
    assert "half_b.indirect.G" in names and "variance.R" not in names and "depth.Z" not in names


def test_a_bar_with_what_is_left_on_a_terminal(alone):
    terminal, end = pty.openpty()
    process = subprocess.Popen([BOUNCE, "reference", GLB, "-o", "a.exr", *ENDLESS[:2], "--spp",
                                "4000000", "--time-limit", "3"], cwd=alone.folder, env=alone.env,
                               stdout=subprocess.PIPE, stderr=end)
    os.close(end)
    text = b""
    while True:
        try:
            piece = os.read(terminal, 65536)
        except OSError:  # the other end is closed
            break
        if not piece:
            break
        text += piece
    os.close(terminal)
    process.communicate(timeout=30)
    assert process.returncode == 0
    assert re.search(rb"reference \[#* *\] \d+ of 4000000 spp, \d+ s left", text), text[-2000:]
