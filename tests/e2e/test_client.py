"""bounce alone, against a daemon that is made up: what it asks, and what it does with answers."""
import hashlib
import json
import os
import pathlib
import pty
import signal
import stat
import subprocess
import time

import pytest
from stopwatch import Stopwatch

PICTURE = b"\x89PNG fake picture"


def scene(fake, name="box.glb", text="not read by the fake"):
    path = fake.folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def daemon_is_gone(fake):
    """True also of a process that ended and was not waited for, as in a second Ctrl-C."""
    pid = fake.asked()[0]["pid"]
    try:
        status = pathlib.Path(f"/proc/{pid}/stat").read_text()
    except FileNotFoundError:
        return True
    return status.rsplit(")", 1)[1].split()[0] in "ZX"


def test_render_writes_the_picture_and_ends_its_daemon(fake):
    scene(fake)
    result = fake("render", "box.glb", "-o", "out.png", "--set", "vpls=256", "--size", "8x4")
    assert result.returncode == 0, result.stderr
    assert (fake.folder / "out.png").read_bytes() == PICTURE
    assert "a_flag of the test" in result.stderr
    assert b"gbuffer" in result.stdout
    assert daemon_is_gone(fake)
    [request] = fake.asked("render")
    frame = request["render"]["frame"]
    assert frame["size"] == [8, 4] and frame["aa"] == 16 and frame["encoding"] == "png"
    assert frame["parameters"] == [{"key": "vpls", "value": "256"}]
    assert request["render"]["name"] == "box.glb"


def test_nothing_is_left_but_the_picture(fake):
    scene(fake)
    fake("render", "box.glb", "-o", "out.png")
    assert sorted(p.name for p in fake.folder.iterdir()) == ["box.glb", "fake.log", "out.png"]
    mask = os.umask(0)
    os.umask(mask)
    assert stat.S_IMODE((fake.folder / "out.png").stat().st_mode) == 0o666 & ~mask


def test_a_large_file_travels_in_pieces_under_its_hash(fake):
    text = "x" * (2_500_000)
    scene(fake, text=text)
    assert fake("render", "box.glb", "-o", "out.png").returncode == 0
    pieces = fake.asked("blob_put")
    assert [p["payload"] for p in pieces] == [1 << 20, 1 << 20, 2_500_000 - (2 << 20)]
    name = "sha256:" + hashlib.sha256(text.encode()).hexdigest()
    assert {p["blob_put"]["blob"] for p in pieces} == {name}
    assert {"blob": name, "right": True} in fake.asked()


def test_an_empty_file_travels_too(fake):
    scene(fake, text="")
    assert fake("render", "box.glb", "-o", "out.png").returncode == 0
    assert [p["payload"] for p in fake.asked("blob_put")] == [0]


def test_what_the_daemon_holds_is_not_sent(fake):
    scene(fake)
    fake.mode("has_everything")
    assert fake("render", "box.glb", "-o", "out.png").returncode == 0
    assert fake.asked("blob_put") == []


def test_files_of_a_gltf_are_sent_by_the_uris_it_spells(fake):
    gltf = {"buffers": [{"uri": "my%20data.bin"}], "images": [{"uri": "my%20data.bin"},
                                                             {"uri": "tex/a.png"}]}
    scene(fake, "s/box.gltf", json.dumps(gltf))
    scene(fake, "s/my data.bin", "one")
    scene(fake, "s/tex/a.png", "one")  # the same content twice is sent once
    result = fake("render", "s/box.gltf", "-o", "out.png")
    assert result.returncode == 0, result.stderr
    blob = "sha256:" + hashlib.sha256(b"one").hexdigest()
    [request] = fake.asked("render")
    assert request["render"]["files"] == [{"key": "my%20data.bin", "value": blob},
                                          {"key": "tex/a.png", "value": blob}]
    assert len(fake.asked("blob_put")) == 2


@pytest.mark.parametrize("uri", ["../secret", "%2e%2e/secret", "/etc/passwd", "file:///etc/passwd",
                                 "link"])
def test_uris_that_lead_out_are_refused_and_nothing_is_sent(fake, uri):
    scene(fake, "secret", "secret")
    scene(fake, "s/box.gltf", json.dumps({"images": [{"uri": uri}]}))
    (fake.folder / "s/link").symlink_to("../secret")
    result = fake("render", "s/box.gltf", "-o", "out.png")
    assert result.returncode == 4
    assert "images[0].uri" in result.stderr and uri in result.stderr
    assert fake.asked("blob_put") == [] and fake.asked("render") == []


def test_a_missing_file_is_noted_and_left_to_the_importer(fake):
    scene(fake, "box.gltf", json.dumps({"images": [{"uri": "gone.png"}]}))
    result = fake("render", "box.gltf", "-o", "out.png")
    assert result.returncode == 0
    assert "gone.png" in result.stderr


def test_standard_output_gets_the_picture_alone(fake):
    scene(fake)
    result = fake("render", "box.glb", "-o", "-")
    assert result.returncode == 0
    assert result.stdout == PICTURE


def test_a_terminal_gets_no_picture(fake):
    scene(fake)
    leader, follower = pty.openpty()
    process = subprocess.run([str(p) for p in (os.environ["BD_BUILD_DIR"] + "/clients/cli/bounce",
                                               "render", "box.glb", "-o", "-")],
                             cwd=fake.folder, env=fake.env, stdout=follower,
                             stderr=subprocess.PIPE, timeout=30, check=False)
    os.close(leader)
    os.close(follower)
    assert process.returncode == 2
    assert b"terminal" in process.stderr
    assert fake.asked() == []


def test_report_and_json_are_the_same_object(fake):
    scene(fake)
    result = fake("render", "box.glb", "--json", "--report", "r.json")
    assert result.returncode == 0, result.stderr
    report = json.loads(result.stdout)
    assert report == json.loads((fake.folder / "r.json").read_text())
    assert report["technique"] == "rsm" and report["parameters"] == {"vpls": 256}
    assert report["passes"] == [{"name": "gbuffer", "ms": 1.5, "state": "ran"}]
    [request] = fake.asked("render")
    assert request["render"]["frame"]["encoding"] == "none"


def test_a_plan_renders_nothing(fake):
    scene(fake)
    result = fake("render", "box.glb", "--plan")
    assert result.returncode == 0
    assert b"gbuffer" in result.stdout
    [request] = fake.asked("render")
    assert request["render"]["frame"]["plan_only"] is True


@pytest.mark.parametrize("code,exit_code", [("usage", 2), ("bad_input", 4), ("limit", 4),
                                            ("deadline", 5), ("busy", 5), ("device", 6),
                                            ("device_lost", 6), ("unauthorized", 7),
                                            ("internal", 7), ("something_new", 7)])
def test_errors_become_exit_codes(fake, code, exit_code):
    scene(fake)
    fake.mode("error:" + code)
    result = fake("render", "box.glb", "-o", "out.png")
    assert result.returncode == exit_code
    assert "no, because of a test" in result.stderr
    assert not (fake.folder / "out.png").exists()


def test_errors_are_json_on_request(fake):
    scene(fake)
    fake.mode("error:bad_input")
    result = fake("render", "box.glb", "--json")
    assert json.loads(result.stdout) == {"code": "bad_input", "message": "box.glb: no, because of a test",
                                         "details": {"field": "test"}}


@pytest.mark.parametrize("mode,exit_code,says", [("crash", 7, "signal 11"), ("close", 7, "code 0"),
                                                 ("no_device", 6, "code 6"),
                                                 ("garbage", 7, "nonsense"),
                                                 ("unauthorized", 7, "token")])
def test_a_daemon_that_fails_is_named(fake, mode, exit_code, says):
    scene(fake)
    fake.mode(mode)
    result = fake("render", "box.glb", "-o", "out.png")
    assert (result.returncode, says in result.stderr) == (exit_code, True), result.stderr
    assert daemon_is_gone(fake)


def interrupt(fake, count, pause_s, when="render"):
    scene(fake)
    process = fake.start("render", "box.glb", "-o", "out.png", start_new_session=True)
    deadline = time.monotonic() + 20
    while not fake.asked(when) and time.monotonic() < deadline:
        time.sleep(0.02)
    watch = Stopwatch()
    for _ in range(count):
        # As a terminal does: to the whole foreground group.
        os.killpg(process.pid, signal.SIGINT)
        time.sleep(pause_s)
    process.communicate(timeout=120)
    assert not (fake.folder / "out.png").exists()
    assert daemon_is_gone(fake)
    return process.returncode, watch


def test_ctrl_c_cancels_the_frame(fake):
    fake.mode("endless")
    code, watch = interrupt(fake, 1, 0)
    assert code == 130
    assert watch.own_s() < 2
    [cancel] = fake.asked("cancel")
    assert cancel["cancel"]["request_id"] == fake.asked("render")[0]["request_id"]


def test_ctrl_c_gives_up_on_a_daemon_that_does_not_answer(fake):
    fake.mode("deaf")
    code, watch = interrupt(fake, 1, 0)
    assert code == 130
    assert watch.own_s() < 10 and watch.wall_s() > 2.5


def test_ctrl_c_while_the_daemon_starts(fake):
    fake.mode("slow_start")
    code, watch = interrupt(fake, 1, 0, when="hello")
    assert code == 130
    assert watch.own_s() < 2.5


def test_a_second_ctrl_c_ends_all_at_once(fake):
    fake.mode("deaf")
    code, watch = interrupt(fake, 2, 0.3)
    assert code == 130
    assert watch.own_s() < 1.5


def starts(fake):
    return [e["argv"] for e in fake.asked() if "argv" in e]


def test_a_running_daemon_is_used(running):
    scene(running)
    assert running("render", "box.glb", "-o", "out.png").returncode == 0
    assert len(starts(running)) == 1


@pytest.mark.parametrize("words,code", [
    (["-o", "a.exr"], "quick"), (["-o", "a.png"], "fast"), (["-o", "a.png", "--aa", "1"], "quick"),
    (["-o", "a.png", "--aa", "16", "--size", "128x128"], "quick"), (["-o", "a.exr", "--size", "513x512"], "fast"),
    (["-o", "a.exr", "--target-error", "5"], "fast")])
def test_what_renders_little_wants_its_code_soon(fake, words, code):
    scene(fake)
    assert fake("render", "box.glb", *words).returncode == 0
    (started,) = [entry["argv"] for entry in fake.asked() if "argv" in entry]
    assert started[started.index("--code") + 1] == code


def test_a_device_asks_for_a_daemon_of_its_own(running):
    scene(running)
    assert running("render", "box.glb", "-o", "out.png", "--device", "egl:1").returncode == 0
    words = starts(running)[1]
    assert words[:2] == ["--private", "3"] and words[-2:] == ["--device", "egl:1"]


def test_scene_commands(running):
    scene(running)
    result = running("scenes")
    assert result.returncode == 0 and b"s1" in result.stdout and b"box.glb" in result.stdout
    result = running("scenes", "--json")
    assert json.loads(result.stdout)["scenes"][0] == {
        "id": "s1", "name": "box.glb", "revision": 3, "cameras": [], "lights": [], "flags": [],
        "bounds_min": [], "bounds_max": [], "objects": []}
    result = running("scene", "add", "box.glb")
    assert result.returncode == 0 and result.stdout.startswith(b"s2")
    assert running("scene", "rm", "s1").returncode == 0
    assert running("scene", "rm", "s9").returncode == 4


def test_a_held_scene_is_rendered_by_its_id(running):
    assert running("render", "scene:s1", "-o", "out.png").returncode == 0
    [request] = running.asked("render")
    assert request["render"]["scene"] == "s1" and "blob" not in request["render"]


def test_server_addresses(running):
    scene(running)
    address = f"unix:{running.folder}/run/bounced.sock"
    assert running("scenes", "--server", address).returncode == 0
    result = running("scenes", "--server", "unix:/nowhere")
    assert result.returncode == 7 and "/nowhere" in result.stderr
    result = running("scenes", "--server", "tcp:127.0.0.1:1")
    assert result.returncode == 7
    result = running("scenes", "--server", "http://127.0.0.1:7480")
    assert result.returncode == 2 and "--listen" in result.stderr
    assert running("scenes", "--server", "7480").returncode == 2


def test_a_token_is_sent(running):
    (running.folder / "token").write_text("secret token of the test\n")
    assert running("scenes", "--token-file", "token").returncode == 0
    assert running.asked("hello")[0]["hello"]["token"] == "secret"
    (running.folder / "empty").write_text("\n")
    assert running("scenes", "--token-file", "empty").returncode == 2


def test_scene_commands_start_no_daemon(fake):
    result = fake("scenes")
    assert result.returncode == 7 and "bounced.sock" in result.stderr
    assert starts(fake) == []


def test_devices_start_one(fake):
    result = fake("devices")
    assert result.returncode == 0
    assert result.stdout.decode().split() == ["*", "software", "Fake", "(software)"]


@pytest.mark.parametrize("words", [["render"], ["render", "gone.glb", "-o", "x.png"],
                                   ["render", "box.glb", "-o", "gone/x.png"], ["log"], [],
                                   ["render", "box.glb", "-o", "x.png", "--aa", "0"]])
def test_mistakes_start_no_daemon(fake, words):
    scene(fake)
    assert fake(*words).returncode in (2, 4)
    assert starts(fake) == []


def test_no_daemon_to_start(bounce):
    scene(bounce)
    bounce.env["BOUNCED"] = "/nowhere/bounced"
    result = bounce("render", "box.glb", "-o", "x.png")
    assert result.returncode == 7 and "/nowhere/bounced" in result.stderr
