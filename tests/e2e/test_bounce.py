"""bounce and the real daemon, from a file to a picture."""
import hashlib
import json
import os
import pathlib
import shutil
import signal
import struct
import subprocess
import time
import zlib

import numpy
import pytest

from conftest import BOUNCE, BUILD, HERE
from harness import exr, shapes
from harness.gltf import Writer
from skips import skip_without_device
from stopwatch import Stopwatch

SCENES = HERE / "../scenes"
REPORT_KEYS = {"scene", "revision", "size", "camera", "technique", "parameters", "seed", "aa",
               "device", "build", "time_ms", "passes", "omitted", "counts", "memory_mib", "flags",
               "nonfinite_pixels", "error", "stopped"}
SMALL = ("--size", "64x48", "--set", "vpls=64", "--set", "rsm_size=64")


@pytest.fixture(scope="module", autouse=True)
def device(tmp_path_factory):
    """Skips the whole file where no device works: the only test that may."""
    skip_without_device(BOUNCE, tmp_path_factory)


def cached(bounce):
    return {path.name for path in (bounce.folder / "caches").rglob("*") if path.is_file()}


def test_code_that_is_generated_sooner_renders_the_same(bounce):
    bounce.env["MESA_SHADER_CACHE_DIR"] = str(bounce.folder / "caches")
    bounce.env.pop("GALLIVM_PERF", None)
    words = ("render", SCENES / "cornell.glb", *SMALL, "--technique", "rsm")
    ok(bounce(*words, "-o", "quick.exr"))
    quick = cached(bounce)
    ok(bounce(*words, "-o", "again.exr"))
    assert cached(bounce) == quick  # all of it was there
    with subprocess.Popen([BUILD / "server/bounced", "--http", "none", "--listen", "unix:fast.sock", "--data", "data"],
                          cwd=bounce.folder, env=bounce.env, stderr=subprocess.DEVNULL) as daemon:
        while not (bounce.folder / "fast.sock").exists() and daemon.poll() is None:
            time.sleep(0.02)
        ok(bounce(*words, "-o", "fast.exr", "--server", "unix:fast.sock"))
        daemon.send_signal(signal.SIGTERM)
    if "llvmpipe" in bounce("devices").stdout.decode():
        assert cached(bounce) > quick  # none of it served the other
    (soon, _), (late, _) = (exr.read((bounce.folder / name).read_bytes()) for name in ("quick.exr", "fast.exr"))
    assert soon.keys() == late.keys()
    for name, plane in soon.items():
        assert (plane == late[name]).all(), name


@pytest.fixture
def running(bounce):
    """A daemon on the default socket."""
    (bounce.folder / "run").mkdir()
    with subprocess.Popen([BUILD / "server/bounced", "--http", "none", "--data", "data"],
                          cwd=bounce.folder, env=bounce.env, stderr=subprocess.PIPE) as daemon:
        path = bounce.folder / "run/bounced.sock"
        deadline = time.monotonic() + 60
        while not path.exists() and daemon.poll() is None and time.monotonic() < deadline:
            time.sleep(0.02)
        assert daemon.poll() is None, daemon.stderr.read().decode()
        bounce.daemon = daemon
        yield bounce
        daemon.send_signal(signal.SIGTERM)
        assert daemon.wait(timeout=30) == 0


def png_chunks(data):
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at = 8
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8:at + 8 + size]
        (crc,) = struct.unpack_from(">I", data, at + 8 + size)
        assert crc == zlib.crc32(kind + body)
        yield kind, body
        at += 12 + size


def ok(result):
    assert result.returncode == 0, result.stderr
    return result


def test_a_picture_with_its_manifest(bounce):
    ok(bounce("render", SCENES / "cornell.glb", "-o", "out.png", *SMALL, "--seed", "7",
              "--report", "r.json"))
    chunks = list(png_chunks((bounce.folder / "out.png").read_bytes()))
    assert struct.unpack(">II", chunks[0][1][:8]) == (64, 48)
    texts = dict(body.split(b"\0", 1) for kind, body in chunks if kind == b"tEXt")
    report = json.loads((bounce.folder / "r.json").read_text())
    assert texts[b"scene"].decode() == report["scene"]
    assert texts[b"seed"] == b"7" and b"vpls=64" in texts[b"parameters"]
    assert texts[b"filter"] == b"box" and texts[b"technique"].decode() == report["technique"]
    assert float(texts[b"exposure_stops"]) == pytest.approx(report["exposure_stops"])


def auto_stops(rgb):
    luminance = rgb.astype(float) @ (0.2126, 0.7152, 0.0722)
    return numpy.log2(0.18) - numpy.log2(luminance[luminance > 0]).mean()


def closed_room(path):
    """Two rooms that share no light, a lamp in one of them and a camera in each."""
    w = Writer()
    grey = w.material("grey", color=(0.6, 0.6, 0.6), doubleSided=True)
    positions, normals, indices, _ = shapes.box((1, 1, 1))
    walls = w.mesh("walls", positions, normals, indices, grey)
    for x in (0, 3):
        w.node(f"room {x}", mesh=walls, translation=[x, 0, 0])
        w.camera(f"Camera{x}", (x, 0, 0.9), (0, 0, -1), yfov=1.2)
    w.light("lamp", "point", 5, position=(3, 0.5, 0))
    w.write_glb(path)


def test_a_closed_room_is_not_shown_as_bright_as_day(bounce):
    """Without occlusion of indirect light its walls let the other room's in: flagged, and what leaks does
    not decide how bright the picture is."""
    closed_room(bounce.folder / "rooms.glb")
    def render(camera, *words, name="out.png", settings=SMALL):
        ok(bounce("render", "rooms.glb", "-o", name, *settings, "--camera", camera, "--report", "r.json", *words))
        return json.loads((bounce.folder / "r.json").read_text())

    dark = render("Camera0", "--aa", "1")
    assert dark["exposure_stops"] == 0 and dark["flags"] == ["no_indirect_visibility"]
    lit = render("Camera3", "--aa", "1")
    assert lit["flags"] == ["no_indirect_visibility"]
    shown = render("Camera3", "--layers", "direct,indirect", name="out.exr")
    planes, _ = exr.read((bounce.folder / "out.exr").read_bytes())
    assert shown["exposure_stops"] == lit["exposure_stops"]
    assert lit["exposure_stops"] == pytest.approx(auto_stops(exr.layer(planes, "direct")), abs=0.01)
    assert lit["exposure_stops"] > auto_stops(exr.layer(planes, "beauty")) + 0.1
    # What was made for the exposure alone is in no file.
    render("Camera3", name="out.exr")
    planes, _ = exr.read((bounce.folder / "out.exr").read_bytes())
    assert set(planes) == set("RGBA")
    # A technique with visibility is measured on all that it has.
    traced = ("--size", "64x48", "--technique", "reference", "--set", "spp=4")
    seen = render("Camera3", settings=traced, name="out.exr")
    planes, _ = exr.read((bounce.folder / "out.exr").read_bytes())
    assert seen["flags"] == []
    assert seen["exposure_stops"] == pytest.approx(auto_stops(exr.layer(planes, "beauty")), abs=0.01)


def test_flags_that_fail_do_so_after_every_output(bounce):
    """A picture that must not have a flag is written, and so is its report; then the exit code says so."""
    w = Writer()
    positions, normals, indices, _ = shapes.box((1, 1, 1))
    w.node("box", mesh=w.mesh("box", positions, normals, indices, w.material("grey")))
    w.camera("Camera", (0, 0, 3), (0, 0, 1), yfov=1)  # away from all there is
    w.light("lamp", "point", 1, position=(0, 0, 3))
    w.write_glb(bounce.folder / "black.glb")

    def render(scene, *words, code):
        for name in ("out.png", "r.json"):
            (bounce.folder / name).unlink(missing_ok=True)
        result = bounce("render", scene, "-o", "out.png", "--report", "r.json", *SMALL, "--aa", "1", *words)
        assert result.returncode == code, result.stderr
        assert (bounce.folder / "out.png").stat().st_size > 0
        return json.loads((bounce.folder / "r.json").read_text())["flags"], result.stderr

    flags, said = render("black.glb", "-q", code=5)
    assert "blank_frame" in flags and "flag blank_frame" in said
    render("black.glb", "--fail-on", "none", code=0)
    cornell = SCENES / "cornell.glb"
    flags, _ = render(cornell, code=0)
    assert flags == ["no_indirect_visibility"]
    assert "flag no_indirect_visibility" in render(cornell, "-q", "--strict", code=5)[1]
    render(cornell, "--fail-on", "error_tail,blank_frame", code=0)
    render(cornell, "--fail-on", "error_tail,no_indirect_visibility", code=5)


def test_the_report_has_the_promised_shape(bounce):
    report = json.loads(ok(bounce("render", SCENES / "cornell.glb", "--json", *SMALL)).stdout)
    assert REPORT_KEYS <= set(report), REPORT_KEYS - set(report)
    assert report["size"] == [64, 48] and report["stopped"] == "complete"
    assert report["parameters"]["vpls"] == 64 and report["nonfinite_pixels"] == 0
    assert {p["state"] for p in report["passes"]} <= {"ran", "reused"}
    assert "gbuffer" in {p["name"] for p in report["passes"]}
    assert set(report["time_ms"]) == {"total", "load", "compile", "gpu", "check", "readback",
                                      "encode"}


def test_an_image_requested_twice_is_the_same_to_the_byte(bounce):
    for extension in ("png", "exr"):
        names = [f"{i}.{extension}" for i in (1, 2)]
        for name in names:
            ok(bounce("render", SCENES / "cornell.glb", "-o", name, *SMALL, "--aa", "4"))
        assert len({hashlib.sha256((bounce.folder / n).read_bytes()).digest() for n in names}) == 1


def test_techniques_are_what_they_say(running):
    """Both ends of every range, every choice and every rung are taken; one beyond is refused."""
    def plan(technique, pairs):
        words = [word for pair in pairs for word in ("--set", pair)]
        return running("render", SCENES / "cornell.glb", "--plan", "--quiet", "--technique",
                       technique, *words)

    table = ok(running("techniques")).stdout.decode()
    for technique in json.loads(ok(running("techniques", "--json")).stdout)["techniques"]:
        good, bad = [rung.split() for rung in technique["ladder"]], []
        default = " (default)" if technique.get("is_default") else ""
        assert f"{technique['name']:10} {technique['summary']}{default}\n" in table
        for p in technique["parameters"]:
            good += [[f"{p['key']}={word}"] for word in [*p["choices"], p["standard"]]]
            bad.append(f"{p['key']}=none-of-these")
            if not p["choices"]:
                low, high = p["minimum"], p["maximum"]
                good += [[f"{p['key']}={end:.17g}"] for end in (low, high)]
                bad += [f"{p['key']}={end:.17g}" for end in (low - 1, high + 1)]
            if p.get("whole"):
                bad.append(f"{p['key']}={low + 0.5}")
        for pairs in good:
            ok(plan(technique["name"], pairs))
        for pair in bad:
            result = plan(technique["name"], [pair])
            assert result.returncode == 2 and pair.split("=")[0] in result.stderr, pair


def test_layers_add_up_to_beauty(bounce):
    ok(bounce("render", SCENES / "checker.glb", "-o", "out.exr", *SMALL, "--layers",
              "beauty,direct,indirect,emission,albedo,normal,depth"))
    planes, strings = exr.read((bounce.folder / "out.exr").read_bytes())
    beauty = exr.layer(planes, "beauty")
    parts = sum(exr.layer(planes, name).astype(numpy.float64)
                for name in ("direct", "indirect", "emission"))
    assert beauty.max() > 0
    assert numpy.abs(parts - beauty).max() <= 1e-5 * beauty.max()
    assert numpy.all(numpy.abs(parts - beauty) <= 1e-5 * numpy.maximum(beauty, 1e-3 * beauty.max()))
    covered = planes["A"] > 0
    length = numpy.sqrt(sum(planes["normal." + c] ** 2 for c in "XYZ"))
    assert numpy.allclose(length[planes["A"] == 1], 1, atol=1e-3)
    assert numpy.all(planes["depth.Z"][covered] > 0) and numpy.all(planes["depth.Z"][covered] < 1e9)
    assert strings["filter"] == "point"


def test_a_plan_names_what_is_left_out(bounce):
    plan = json.loads(ok(bounce("render", SCENES / "cornell.glb", "--plan", "--json",
                                "--technique", "direct")).stdout)
    assert {p["state"] for p in plan["passes"]} == {"planned"}
    assert "rsm" not in {p["name"] for p in plan["passes"]}
    assert all(o["reason"] for o in plan["omitted"])


def test_another_camera_reuses_the_lights_work(running):
    scene = SCENES / "two_lights.glb"
    held = ok(running("scene", "add", scene, "--json"))
    scene_id = json.loads(held.stdout)["id"]
    cameras = json.loads(held.stdout)["cameras"]
    first, second = (json.loads(ok(running("render", "scene:" + scene_id, "--json", *SMALL,
                                           "--camera", camera)).stdout) for camera in cameras[:2])
    states = {p["name"]: p["state"] for p in second["passes"]}
    assert {p["state"] for p in first["passes"]} == {"ran"}
    assert states["rsm"] == states["shadow_map"] == "reused" and states["gbuffer"] == "ran"
    assert first["camera"] != second["camera"]
    ok(running("scene", "rm", scene_id))
    assert running("render", "scene:" + scene_id, "--json").returncode == 4


def test_a_gltf_with_a_file_beside_it(running):
    folder = running.folder / "my scene"
    folder.mkdir()
    for name in ("bare.gltf", "bare.bin"):
        shutil.copy(SCENES / name, folder)
    ok(running("render", folder / "bare.gltf", "-o", "out.png", *SMALL))
    (folder / "bare.bin").unlink()
    result = running("render", folder / "bare.gltf", "-o", "gone.png", *SMALL)
    assert result.returncode == 4 and "bare.bin" in result.stderr
    assert not (running.folder / "gone.png").exists()


@pytest.mark.parametrize("content,says", [(b"", "empty"), (b"{", "JSON"),
                                          (b"glTF\x02\0\0\0", "header")])
def test_bad_input_is_one_line_and_code_4(bounce, content, says):
    (bounce.folder / "bad.glb").write_bytes(content)
    result = bounce("render", "bad.glb", "-o", "out.png", "--quiet")
    assert result.returncode == 4
    lines = [line for line in result.stderr.splitlines() if line.startswith("bounce:")]
    assert len(lines) == 1 and says in lines[0] and "bad.glb" in lines[0]
    assert not (bounce.folder / "out.png").exists()


@pytest.mark.parametrize("words", [("render", "bad.gltf", "-o", "out.png", "--quiet"),
                                   ("scene", "add", "bad.gltf", "--quiet")])
def test_bad_input_names_the_file_and_the_place_in_it(running, words):
    document = json.loads((SCENES / "bare.gltf").read_text())
    document["nodes"][1]["mesh"] = "0"
    (running.folder / "bad.gltf").write_text(json.dumps(document))
    shutil.copy(SCENES / "bare.bin", running.folder)
    result = running(*words)
    assert result.returncode == 4
    assert result.stderr.startswith("bounce: bad.gltf: nodes[1].mesh: "), result.stderr
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize("words,code,says", [
    (("--device", "egl:99"), 6, "egl:99"),
    (("--technique", "magic"), 2, "magic"),
    (("--set", "vpls=-1"), 2, "vpls"),
    (("--set", "magic=1"), 2, "magic"),
    (("--camera", "nobody"), 2, "nobody"),
    (("--size", "20000x20000"), 4, "20000"),
    (("--layers", "magic"), 2, "magic"),
    (("--deadline-ms", "1", "--size", "2048x2048"), 5, "deadline"),
])
def test_refusals_have_their_code_and_name_the_cause(bounce, words, code, says):
    result = bounce("render", SCENES / "cornell.glb", "-o", "out.png", *words)
    assert (result.returncode, says in result.stderr) == (code, True), result.stderr
    assert not (bounce.folder / "out.png").exists()


@pytest.mark.parametrize("technique", ["hisr", "reference"])
@pytest.mark.parametrize("deadline_ms", [1, 300])  # in the import; in the frame where that is fast
def test_a_missed_deadline_has_a_report(bounce, technique, deadline_ms):
    result = bounce("render", SCENES / "cornell.glb", "-o", "out.png", "--size", "2048x2048",
                    "--technique", technique, "--deadline-ms", str(deadline_ms), "--report", "r.json")
    assert result.returncode == 5
    report = json.loads((bounce.folder / "r.json").read_text())
    assert report["stopped"] == "deadline" and report["size"] == [2048, 2048]
    assert f"the deadline of {deadline_ms} ms passed" in result.stderr  # as it was asked for
    assert not (bounce.folder / "out.png").exists()


def test_ctrl_c_ends_a_long_frame_soon(bounce):
    ok(bounce("render", SCENES / "cornell.glb", "-o", "warm.png", *SMALL))
    process = bounce.start("render", SCENES / "cornell.glb", "-o", "out.png", "--size", "1024x1024",
                           "--aa", "64", start_new_session=True)
    time.sleep(3)  # well into the frame, which takes far longer
    assert process.poll() is None
    watch = Stopwatch()
    os.killpg(process.pid, signal.SIGINT)
    process.communicate(timeout=120)
    seconds = watch.own_s()
    print(f"ended after {seconds:.2f} s")
    assert process.returncode == 130
    # 0.5 s to cancel on a software device, and what the private daemon's own end takes.
    assert seconds < 2
    assert not (bounce.folder / "out.png").exists()


def test_a_daemon_that_ends_is_not_an_interrupted_user(running):
    process = running.start("render", SCENES / "cornell.glb", "-o", "out.png", "--size", "1024x1024",
                            "--aa", "64")
    time.sleep(2)
    assert process.poll() is None
    running.daemon.send_signal(signal.SIGTERM)
    time.sleep(0.2)
    running.daemon.send_signal(signal.SIGTERM)  # no patience
    _, err = process.communicate(timeout=30)
    assert process.returncode == 7 and "shutting down" in err.decode()
    assert not (running.folder / "out.png").exists()


def test_jpeg_and_a_single_layer(bounce):
    ok(bounce("render", SCENES / "cornell.glb", "-o", "out.jpg", *SMALL))
    assert (bounce.folder / "out.jpg").read_bytes()[:2] == b"\xff\xd8"
    ok(bounce("render", SCENES / "cornell.glb", "-o", "n.png", *SMALL, "--layers", "normal"))
    ok(bounce("render", SCENES / "cornell.glb", "-o", "b.png", *SMALL))
    assert (bounce.folder / "n.png").read_bytes() != (bounce.folder / "b.png").read_bytes()


def test_the_version_is_the_same_in_both():
    versions = [subprocess.run([program, "--version"], capture_output=True, check=True).stdout
                .split()[1] for program in (BOUNCE, BUILD / "server/bounced")]
    assert versions[0] == versions[1]


def test_paths_are_not_opened_by_the_daemon(running):
    """The scene's own path means nothing to the daemon: only blobs travel."""
    source = pathlib.Path(SCENES / "cornell.glb").read_bytes()
    (running.folder / "moved.glb").write_bytes(source)
    ok(running("scene", "add", "moved.glb"))
    (running.folder / "moved.glb").unlink()
    listed = json.loads(ok(running("scenes", "--json")).stdout)["scenes"]
    result = ok(running("render", "scene:" + listed[0]["id"], "-o", "out.png", *SMALL))
    assert result.returncode == 0


def test_watch_says_what_becomes_of_scenes(running):
    watch = running.start("watch", "--json", "--count", "2")
    ids = []
    while watch.poll() is None and len(ids) < 50:  # the first ones may be before it listens
        ids.append(running("scene", "add", SCENES / "cornell.glb").stdout.split()[0].decode())
        assert running("scene", "rm", ids[-1]).returncode == 0
    out, err = watch.communicate(timeout=20)
    assert watch.returncode == 0, err
    events = [json.loads(line) for line in out.splitlines()]
    assert {event["kind"] for event in events} == {"added", "removed"}
    assert all(event["scene"] in ids for event in events)


EDITS = {"ops": [
    {"add_light": {"kind": "spot", "intensity": 20, "cone_outer": 0.9, "color": [1, 0.4, 0.1]}},
    {"add_node": {"light": -2, "transform": {"translation": [0.1, 0.6, 0.2],
                                             "rotation": [-0.7, 0.1, 0, 0.7]}}},
    {"set_material": {"material": 0, "base_color": [0.7, 0.3, 0.1, 1], "roughness": 0.35,
                      "emissive": [0.2, 3, 0.1]}},
    {"set_transform": {"node": 0, "matrix": [1, 0.2, 0, 0, 0, 0.9, 0, 0, 0.1, 0, 1, 0,
                                             0.03, 0.07, 0, 1]}},
    {"add_mesh": {"name": "sheet", "primitives": [{
        "positions": {"values": [-0.3, 0.1, 0.2, 0.3, 0.1, 0.2, 0, 0.5, 0.1, 9, 9, 9]},
        "colors": {"values": [1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 1, 1, 1, 1, 1, 1]},
        "indices": {"values": [0, 1, 2]}}]}},
    {"add_node": {"name": "sheet", "mesh": -6}},
]}


def test_an_export_gives_the_same_picture(running):
    """Edited, exported, and added again: the same bytes of every layer."""
    def add(path):
        return ok(running("scene", "add", path)).stdout.split()[0].decode()

    def picture(scene, name):
        ok(running("render", f"scene:{scene}", "-o", name, *SMALL, "--layers",
                   "beauty,normal,depth"))
        return exr.read((running.folder / name).read_bytes())[0]

    edited = add(SCENES / "checker.glb")
    (running.folder / "edits.json").write_text(json.dumps(EDITS))
    ok(running("edit", edited, "edits.json"))
    result = ok(running("scene", "export", edited, "out.glb"))
    assert "left_out_unused_vertices: 1" in result.stderr
    again = add("out.glb")
    before, after = picture(edited, "before.exr"), picture(again, "after.exr")
    assert set(before) == set(after) and before["R"].max() > 0
    for channel in before:
        assert before[channel].tobytes() == after[channel].tobytes(), channel
    ok(running("scene", "export", again, "second.glb"))
    files = [(running.folder / name).read_bytes() for name in ("out.glb", "second.glb")]
    assert files[0] == files[1]
    ok(running("scene", "export", edited, "first.glb", "1"))
    assert (running.folder / "first.glb").read_bytes() != files[0]
    refused = running("scene", "export", edited, "none.glb", "99")
    assert refused.returncode == 4 and not (running.folder / "none.glb").exists()
    assert ok(running("scene", "export", edited, "-")).stdout == files[0]
