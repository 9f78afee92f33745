"""Pictures that clients send are decoded in a child: bombs, limits, what becomes of a child that dies."""
import contextlib
import os
import pathlib
import signal
import struct
import threading
import time
import zlib

import bounced_pb2 as pb
import pytest
from conftest import IS_SANITIZED, SCENES
from test_environment import exr
from test_framed import envelope
from test_imports import children, png

MIB = 1 << 20


def texture(daemon, data):
    return {"add_texture": {"blob": daemon.put_blob(data)}}


def post(daemon, scene, *ops, timeout=60):
    import json
    status, _, text = daemon.request("POST", f"/v1/scenes/{scene}/edits", json.dumps({"ops": ops}),
                                     {"Content-Type": "application/json"}, timeout=timeout)
    return status, json.loads(text)


def import_children(daemon):
    found = []
    for folder, _ in children(daemon.process.pid):
        with contextlib.suppress(OSError):
            if b"--import" in (folder / "cmdline").read_bytes():
                found.append(int(folder.name))
    return found


def is_at_work(pid):
    """It has its question: the descriptor that it waited on is closed."""
    return not os.path.exists(f"/proc/{pid}/fd/3")


def peak_kib(daemon):
    status = pathlib.Path(f"/proc/{daemon.process.pid}/status").read_text()
    return int(status.split("VmHWM:")[1].split()[0])


def reset_peak(daemon):
    pathlib.Path(f"/proc/{daemon.process.pid}/clear_refs").write_text("5")
    return peak_kib(daemon)


# --- bombs ----------------------------------------------------------------------------------


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png_of(width, height, data, kind=2, bits=8, interlace=0):
    head = struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, interlace)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def deflated_zeros(count):
    """So many zeros in a thousandth of the bytes."""
    deflate = zlib.compressobj(9)
    pieces = [deflate.compress(bytes(MIB)) for _ in range(count // MIB)]
    return b"".join(pieces) + deflate.flush()


def short_png():
    """Promises 16384 x 16384 and ends a thousandth of the way."""
    return png_of(16384, 16384, deflated_zeros(MIB))


def long_png():
    """64 MiB of rows for a picture of one."""
    return png_of(1, 1, deflated_zeros(64 * MIB))


def text_png():
    """A picture of one texel and 64 MiB of compressed text."""
    text = chunk(b"zTXt", b"Comment\0\0" + deflated_zeros(64 * MIB))
    small = png(1)
    return small[:33] + text + small[33:]


def progressive_jpeg(side_px, scans):
    """Flat grey, its one component told again and again: 8 bytes a scan."""
    def segment(marker, data):
        return struct.pack(">BBH", 0xff, marker, 2 + len(data)) + data
    quantisation = segment(0xdb, b"\0" + b"\1" * 64)
    frame = segment(0xc2, struct.pack(">BHHB", 8, side_px, side_px, 1) + b"\1\x11\0")
    # One code of one bit: "no more in this block".
    dc = segment(0xc4, b"\0" + b"\1" + b"\0" * 15 + b"\0")
    ac = segment(0xc4, b"\x10" + b"\1" + b"\0" * 15 + b"\0")
    blocks = ((side_px + 7) // 8) ** 2
    first = segment(0xda, b"\1\1\0\0\0\0") + bytes(blocks // 8 + 1)
    again = segment(0xda, b"\1\1\0\1\x3f\0") + b"\0"
    return b"\xff\xd8" + quantisation + frame + dc + ac + first + again * scans + b"\xff\xd9"


def exr_head(width, height, tiled=0, compression=0, version=2, window=None):
    def attribute(name, kind, data):
        return name + b"\0" + kind + b"\0" + struct.pack("<i", len(data)) + data
    box = struct.pack("<4i", *(window or (0, 0, width - 1, height - 1)))
    channels = b"".join(name + b"\0" + struct.pack("<iBBBBii", 1, 0, 0, 0, 0, 1, 1) for name in (b"B", b"G", b"R"))
    head = attribute(b"channels", b"chlist", channels + b"\0")
    head += attribute(b"compression", b"compression", bytes([compression]))
    head += attribute(b"dataWindow", b"box2i", box) + attribute(b"displayWindow", b"box2i", box)
    head += attribute(b"lineOrder", b"lineOrder", b"\0") + attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1))
    head += attribute(b"screenWindowCenter", b"v2f", bytes(8))
    head += attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1))
    if tiled:
        head += attribute(b"tiles", b"tiledesc", struct.pack("<IIB", tiled, tiled, 0))
    flags = version | (0x200 if tiled else 0)
    return struct.pack("<II", 20000630, flags) + head + b"\0"


PIZ, ZIP = 4, 3
EXR_BOMBS = {
    "all_of_8192": exr_head(8192, 8192, compression=PIZ),
    "tiles_of_one": exr_head(8192, 8192, tiled=1, compression=PIZ),
    "huge_window": exr_head(0, 0, window=(-2**31, -2**31, 2**31 - 1, 2**31 - 1)),
    "wide_window": exr_head(0, 0, window=(0, 0, 2**31 - 2, 0)),
    "deep": exr_head(8192, 8192, version=0x802),
    "parts": exr_head(8192, 8192, version=0x1002),
}
PICTURE_BOMBS = {
    "short_png": short_png, "long_png": long_png, "text_png": text_png,
    "jpeg_of_many_scans": lambda: progressive_jpeg(2048, 20000),
    "jpeg_of_65500": lambda: progressive_jpeg(65500, 1)[:2000],
    "hdr": lambda: b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 32767 +X 32767\n" + b"\2\2\x7f\xff" * 999,
}


def assert_bomb_is_harmless(daemon, scene, op, before_kib):
    status, error = post(daemon, scene, op)
    assert status in (400, 413), error
    assert error["details"]["field"].startswith("ops[0]."), error
    assert peak_kib(daemon) - before_kib < 32 * 1024 or IS_SANITIZED


@pytest.mark.parametrize("name", PICTURE_BOMBS)
def test_a_picture_that_is_a_bomb(shared, name):
    scene, op = shared.add_scene("two_lights.glb"), texture(shared, PICTURE_BOMBS[name]())
    if name in ("long_png", "text_png"):  # they are pictures for all that
        before_kib = reset_peak(shared)
        status, reply = post(shared, scene, op)
        assert status in (200, 400, 413), reply
        assert peak_kib(shared) - before_kib < 32 * 1024 or IS_SANITIZED
    else:
        assert_bomb_is_harmless(shared, scene, op, reset_peak(shared))
    assert shared.healthy()


@pytest.mark.parametrize("name", EXR_BOMBS)
def test_a_sky_that_is_a_bomb(shared, name):
    scene, blob = shared.add_scene("two_lights.glb"), shared.put_blob(EXR_BOMBS[name] + bytes(4096))
    before_kib = reset_peak(shared)
    assert_bomb_is_harmless(shared, scene, {"set_environment": {"map": blob}}, before_kib)
    status, error = shared.json("POST", "/v1/scenes", {"blob": shared.put_blob((SCENES / "cornell.glb").read_bytes()),
                                                       "environment": {"map": blob}})
    assert status in (400, 413) and error["details"]["field"] == "environment.map", error
    assert peak_kib(shared) - before_kib < 32 * 1024 or IS_SANITIZED


def test_memory_of_a_picture_is_a_limit(start):
    if IS_SANITIZED:
        pytest.skip("the sanitizer's own memory is above any such limit")
    daemon = start("--limit", "import_bytes=16M")
    scene = daemon.add_scene("two_lights.glb")
    status, error = post(daemon, scene, texture(daemon, png(4096)))
    assert status == 413 and "limited to 16 MiB" in error["message"], error
    assert error["details"]["field"] == "ops[0].add_texture.blob"
    sky = daemon.put_blob(EXR_BOMBS["all_of_8192"] + bytes(4096))
    status, error = post(daemon, scene, {"set_environment": {"map": sky}})
    assert status == 413 and "limited to 16 MiB" in error["message"], error


def test_processor_time_of_a_picture_is_a_limit(start):
    daemon = start("--limit", "import_cpu_seconds=1")
    scene = daemon.add_scene("two_lights.glb")
    status, error = post(daemon, scene, texture(daemon, progressive_jpeg(16000, 480)))
    assert status == 413 and "more than 1 s of processor time" in error["message"], error
    assert "ops[0].add_texture.blob" in error["message"]


def test_pictures_of_a_file_are_shrunk_to_their_limit(start):
    daemon = start("--limit", "picture_texels=100")
    blob = daemon.put_blob((SCENES / "checker.glb").read_bytes())
    flag = "shrunk_pictures: 1 of 2, to 80 of 128 texels (picture_texels)"
    status, scene = daemon.json("POST", "/v1/scenes", {"blob": blob})
    assert status == 201 and flag in scene["flags"], scene
    status, reply = post(daemon, daemon.add_scene("two_lights.glb"), {"import": {"blob": blob}})
    assert status == 200 and flag in reply["flags"], reply
    # What is exported is what is held, and fits.
    glb = daemon.request("GET", f"/v1/scenes/{scene['id']}/export")[2]
    status, again = daemon.json("POST", "/v1/scenes", {"blob": daemon.put_blob(glb)})
    assert status == 201 and flag not in again["flags"], again


# --- children -------------------------------------------------------------------------------


def answer_of(client, batch):
    answers = []
    thread = threading.Thread(target=lambda: answers.append(client.ask(batch)[0]))
    thread.start()
    return thread, answers


def slow_batch(client, scene):
    blob = client.put_blob(progressive_jpeg(16000, 480))
    return envelope(edit_batch=pb.EditBatch(scene=scene, ops=[pb.EditOp(add_texture=pb.TextureEdit(blob=blob))]))


def wait_for(find, seconds=20):
    until = time.time() + seconds
    while time.time() < until:
        found = find()
        if found:
            return found
        time.sleep(0.005)
    raise AssertionError("it did not happen")


@pytest.mark.parametrize("number, word", [(signal.SIGKILL, "(out of memory?)"), (signal.SIGTERM, "")])
def test_a_killed_child_is_told_as_killed(start, number, word):
    daemon = start()
    client, scene = daemon.framed(), daemon.add_scene("two_lights.glb")
    thread, answers = answer_of(client, slow_batch(client, scene))
    pid = wait_for(lambda: [pid for pid in import_children(daemon) if is_at_work(pid)])[0]
    os.kill(pid, number)
    thread.join()
    error = answers[0].error
    assert error.code == "no_memory" and f"killed by signal {int(number)}" in error.message, error
    assert word in error.message and "ops[0].add_texture.blob" in error.message
    assert error.details.field == "ops[0].add_texture.blob"
    # The next is none the worse for it.
    assert post(daemon, scene, texture(daemon, png(4)))[0] == 200


def test_a_killed_import_is_told_with_its_file(start):
    from test_imports import glb
    daemon = start()
    client = daemon.framed()
    thread, answers = answer_of(client, envelope(scene_add=pb.SceneAdd(blob=client.put_blob(glb(24)), name="large.glb")))
    os.kill(wait_for(lambda: import_children(daemon))[0], signal.SIGKILL)
    thread.join()
    assert answers[0].error.message.startswith("large.glb: the import was killed by signal 9 (out of memory?)"), answers


def test_edits_go_on_while_a_picture_is_decoded(start):
    daemon = start()
    slow, quick = daemon.framed(), daemon.framed()
    scenes = [daemon.add_scene("two_lights.glb") for _ in range(2)]
    thread, _ = answer_of(slow, slow_batch(slow, scenes[0]))
    wait_for(lambda: [pid for pid in import_children(daemon) if is_at_work(pid)])
    small = quick.put_blob(png(4))
    for _ in range(3):
        op = pb.EditOp(add_texture=pb.TextureEdit(blob=small))
        answer = quick.ask(envelope(edit_batch=pb.EditBatch(scene=scenes[1], ops=[op])))[0]
        assert answer.HasField("edit_reply"), answer
    assert thread.is_alive()  # else this has shown nothing
    for pid in import_children(daemon):
        if is_at_work(pid):
            os.kill(pid, signal.SIGKILL)
    thread.join()


def test_children_wait_and_are_used_once(start):
    daemon = start("--limit", "imports_at_once=2")
    scene = daemon.add_scene("two_lights.glb")
    assert import_children(daemon) == []
    seen = set()
    for side_px in (2, 3, 4):
        assert post(daemon, scene, texture(daemon, png(side_px)))[0] == 200
        waiting = wait_for(lambda: (pids := import_children(daemon)) and len(pids) == 2 and pids)
        assert set(waiting) - seen, "one of them has answered and ended"
        seen |= set(waiting)
    # One that died while it waited costs nobody an answer.
    for pid in waiting:
        os.kill(pid, signal.SIGKILL)
    assert post(daemon, scene, texture(daemon, png(5)))[0] == 200
    pids = import_children(daemon)
    daemon.stop()
    assert not [pid for pid in pids if os.path.exists(f"/proc/{pid}")]
