"""The framed transport: hello, uploads, requests under way together, cancel, the private daemon."""
import os
import signal
import socket
import struct
import subprocess
import time

import bounced_pb2
import pytest
from conftest import BOUNCED, SCENES, Framed, blob_name, frame, pack, read_all
from stopwatch import Stopwatch

GLB = (SCENES / "cornell.glb").read_bytes()


def envelope(**bodies):
    out = bounced_pb2.Envelope()
    for name, body in bodies.items():
        getattr(out, name).CopyFrom(body)
    return out


def render(scene, **fields):
    return envelope(render=bounced_pb2.Render(scene=scene, frame=frame(**fields)))


def add_scene(client):
    blob = client.put_blob(GLB)
    answer, _ = client.ask(envelope(scene_add=bounced_pb2.SceneAdd(blob=blob, name="box")))
    assert answer.scene.id, answer
    return answer.scene.id


def test_hello_tells_version_limits_and_device(shared):
    client = shared.framed(hello=False)
    answer = client.hello()
    reply = answer.hello_reply
    assert (reply.version, reply.min, reply.max) == (1, 1, 1)
    limits = {pair.key: int(pair.value) for pair in reply.limits}
    assert limits["message_bytes"] == 16 << 20 and limits["jobs_waiting"] > 0
    assert {"render", "edits", "transient", "undo", "log", "export", "replay"} <= set(reply.capabilities)
    assert reply.device.__getattribute__("class")


def test_versions_that_do_not_meet(shared):
    client = shared.framed(hello=False)
    assert client.hello(low=2, high=9).error.code == "unsupported"
    assert client.sock.recv(1) == b""


def test_hello_comes_first(shared):
    client = shared.framed(hello=False)
    answer, _ = client.ask(envelope(stats=bounced_pb2.Stats()))
    assert answer.error.code == "usage" and answer.error.details.field == "hello"
    assert client.sock.recv(1) == b""


def test_tcp_needs_the_token_and_a_unix_socket_does_not(start):
    daemon = start(token="correct-horse-battery")
    for token in (None, "wrong", "correct-horse-battery "):
        client = daemon.framed(tcp=True, hello=False)
        assert client.hello(token).error.code == "unauthorized"
        assert client.sock.recv(1) == b""
    assert daemon.framed(tcp=True).ask(envelope(stats=bounced_pb2.Stats()))[0].HasField("stats_reply")
    assert daemon.framed(hello=False).hello().HasField("hello_reply")
    assert os.stat(daemon.socket_path).st_mode & 0o077 == 0


def test_blob_scene_frame(shared):
    client = shared.framed()
    scene = add_scene(client)
    have, _ = client.ask(envelope(blob_have=bounced_pb2.BlobHave(
        blobs=[blob_name(GLB), blob_name(b"no"), "nonsense"])))
    assert list(have.blob_reply.have) == [blob_name(GLB)]
    answer, image = client.ask(render(scene, encoding="png", aa=1))
    assert answer.render_reply.encoding == "png" and image.startswith(b"\x89PNG")
    assert answer.render_reply.report.stopped == "complete"
    answer, image = client.ask(render(scene, plan_only=True))
    assert image == b"" and answer.render_reply.report.passes[0].state in ("planned", "reused")
    listed, _ = client.ask(envelope(scene_list=bounced_pb2.SceneList()))
    assert scene in [entry.id for entry in listed.scene_list_reply.scenes]
    gone, _ = client.ask(envelope(scene_remove=bounced_pb2.SceneRemove(id=scene)))
    assert gone.HasField("done")
    assert client.ask(render(scene))[0].error.code == "not_found"


def test_techniques_say_what_they_are(shared):
    reply = shared.framed().ask(envelope(techniques=bounced_pb2.Techniques()))[0].techniques_reply
    techniques = {technique.name: technique for technique in reply.techniques}
    assert [t.name for t in reply.techniques][:2] == ["direct", "rsm"]
    assert [t.name for t in reply.techniques if t.is_default] == ["many_light"]
    direct, rsm = techniques["direct"], techniques["rsm"]
    assert direct.model.indirect_bounces == 0 and list(direct.model.indirect_lights) == []
    assert list(direct.model.lights) == ["punctual", "emissive", "environment"]
    assert rsm.model.indirect_bounces == 1 and rsm.model.glossy_receivers
    assert direct.HasField("tolerance_indirect") and direct.tolerance_indirect == 0
    assert rsm.ladder and all("=" in pair for rung in rsm.ladder for pair in rung.split())
    parameters = {parameter.key: parameter for parameter in rsm.parameters}
    vpls, kernel = parameters["vpls"], parameters["vpl_kernel"]
    assert (vpls.minimum, vpls.standard, vpls.whole, list(vpls.choices)) == (1, "1024", True, [])
    assert vpls.maximum >= 1 << 20 and not parameters["near_field"].whole
    assert kernel.standard == "patch" and "point" in kernel.choices
    assert not kernel.HasField("minimum")
    assert "vpls" not in [parameter.key for parameter in direct.parameters]


def test_inline_scene_is_not_kept(shared):
    client = shared.framed()
    blob = client.put_blob(GLB)
    before = client.ask(envelope(stats=bounced_pb2.Stats()))[0].stats_reply.scenes
    answer, image = client.ask(envelope(render=bounced_pb2.Render(blob=blob, frame=frame(aa=1))))
    assert image.startswith(b"\x89PNG"), answer
    assert client.ask(envelope(stats=bounced_pb2.Stats()))[0].stats_reply.scenes == before


def test_uploads_in_small_pieces_and_two_at_once(shared):
    client = shared.framed()
    one, two = os.urandom(300000), os.urandom(200001)
    sent = []
    for offset in range(0, len(one), 7001):
        for data in (one, two):
            if offset < len(data):
                put = bounced_pb2.BlobPut(blob=blob_name(data), offset=offset, size_bytes=len(data))
                sent.append(client.send(envelope(blob_put=put), data[offset:offset + 7001]))
    complete = 0
    for _ in sent:
        answer, _ = client.receive()
        assert answer.HasField("blob_reply"), answer
        complete += answer.blob_reply.complete
    assert complete == 2
    assert client.put_blob(one) == blob_name(one)  # once more: known, and fine


@pytest.mark.parametrize("put,payload,code", [
    (dict(blob="sha256:xyz", offset=0, size_bytes=1), b"x", "usage"),
    (dict(blob=blob_name(b"y"), offset=0, size_bytes=1), b"x", "bad_input"),
    (dict(blob=blob_name(b"x"), offset=0, size_bytes=1), b"xx", "usage"),
    (dict(blob=blob_name(b"x"), offset=1, size_bytes=2), b"x", "conflict"),
    (dict(blob=blob_name(b"x"), offset=0, size_bytes=1 << 60), b"x", "limit"),
    (dict(), b"x", "usage"),
])
def test_bad_pieces(shared, put, payload, code):
    client = shared.framed()
    answer, _ = client.ask(envelope(blob_put=bounced_pb2.BlobPut(**put)), payload)
    assert answer.error.code == code, answer
    assert client.ask(envelope(stats=bounced_pb2.Stats()))[0].HasField("stats_reply")


@pytest.mark.parametrize("fields,field", [
    (dict(size=(4,)), "size"), (dict(size=(0, 4)), "size"), (dict(encoding="tiff"), "encoding"),
    (dict(tonemap="x"), "tonemap"), (dict(exposure="nan"), "exposure"), (dict(jpeg_quality=0), "jpeg_quality"),
    (dict(technique="x" * 32), "technique"),
])
def test_bad_frames_name_their_field(shared, fields, field):
    client = shared.framed()
    scene = add_scene(client)
    answer, _ = client.ask(render(scene, **fields))
    assert answer.error.details.field == field, answer


def test_unknown_bodies_are_answered_and_the_connection_goes_on(shared):
    client = shared.framed()
    client.sock.sendall(struct.pack("<II", 9, 5) + b"\x08\x63\xa2\x1f\x00")  # id 99, field 500
    answer, _ = client.receive()
    assert (answer.request_id, answer.error.code) == (99, "unsupported")
    answer, _ = client.ask(envelope(progress=bounced_pb2.Progress()))
    assert answer.error.code == "unsupported"
    assert client.ask(envelope(stats=bounced_pb2.Stats()))[0].HasField("stats_reply")


def test_request_ids(start):
    daemon = start(env={"BD_FAKE_FRAME_MS": "300"})
    client = daemon.framed()
    scene = add_scene(client)
    zero = envelope(stats=bounced_pb2.Stats())
    zero.request_id = 0
    client.send(zero)
    assert client.receive()[0].error.details.field == "request_id"
    twice = render(scene)
    twice.request_id = 77
    client.send(twice)
    client.send(twice)
    first, _ = client.receive()
    assert (first.request_id, first.error.code) == (77, "conflict")
    assert client.receive()[0].render_reply.encoding == "png"


def test_progress_only_if_asked(shared):
    client = shared.framed()
    blob = client.put_blob(GLB)
    request = envelope(render=bounced_pb2.Render(blob=blob, frame=frame(aa=1), progress=True))
    client.send(request)
    stages = []
    while True:
        answer, _ = client.receive()
        if answer.WhichOneof("body") != "progress":
            break
        stages.append(answer.progress.stage)
    assert stages == ["import", "queue", "encode"] and answer.HasField("render_reply")


def test_cancel_ends_a_frame_quickly(start):
    daemon = start(env={"BD_FAKE_FRAME_MS": "30000"})
    client = daemon.framed()
    scene = add_scene(client)
    running, waiting = client.send(render(scene)), client.send(render(scene))
    time.sleep(0.1)
    watch = Stopwatch()
    for request_id in (waiting, running, 4711):
        client.send(envelope(cancel=bounced_pb2.Cancel(request_id=request_id)))
    answers = [client.receive()[0] for _ in range(5)]
    assert watch.own_s() < 0.5
    codes = {answer.request_id: answer.error.code for answer in answers if answer.HasField("error")}
    assert codes == {running: "cancelled", waiting: "cancelled"}
    assert [a.error.details.report.stopped for a in answers if a.HasField("error")] == ["cancelled"] * 2
    assert sum(answer.HasField("done") for answer in answers) == 3


def test_a_scene_that_was_added_is_not_called_cancelled(shared):
    """The cancel comes while the scene is on its way to the disk, which the pool has no time for."""
    client = shared.framed()
    scene = client.put_blob(GLB)
    many = [blob_name(b"%d" % i) for i in range(14000)]
    for attempt in range(8):
        name = f"attempt {attempt}"
        for _ in range(16):
            client.send(envelope(blob_have=bounced_pb2.BlobHave(blobs=many)))
        wanted = client.send(envelope(scene_add=bounced_pb2.SceneAdd(blob=scene, name=name)))
        time.sleep(0.01 * attempt)
        client.send(envelope(cancel=bounced_pb2.Cancel(request_id=wanted)))
        answer, seen = None, 0
        while answer is None or seen < 17:
            got, _ = client.receive()
            seen += got.request_id != wanted
            answer = got if got.request_id == wanted else answer
        listed = client.ask(envelope(scene_list=bounced_pb2.SceneList()))[0].scene_list_reply.scenes
        assert answer.HasField("scene") == (name in [s.name for s in listed]), (attempt, answer)


def test_deadline_is_answered_with_how_far_it_came(start):
    daemon = start(env={"BD_FAKE_FRAME_MS": "30000"})
    client = daemon.framed()
    watch = Stopwatch()
    answer, _ = client.ask(render(add_scene(client), deadline_ms=200))
    assert answer.error.code == "deadline" and watch.own_s() < 2
    assert answer.error.details.report.stopped == "deadline"


def test_bytes_that_are_no_message_end_the_connection(shared):
    for data in (struct.pack("<II", 4 + 3, 3) + b"\xff\xff\xff", struct.pack("<I", 3),
                 struct.pack("<I", 0xffffffff), struct.pack("<II", 8, 5)):
        client = shared.framed()
        client.sock.sendall(data)
        answer, _ = client.receive()
        assert answer.request_id == 0 and answer.error.code in ("bad_input", "limit")
        assert client.sock.recv(1) == b""
    assert shared.healthy()


# --- private --------------------------------------------------------------------------------


def start_private(tmp_path):
    ours, theirs = socket.socketpair()
    env = {**os.environ, "TMPDIR": str(tmp_path), "HOME": str(tmp_path / "home")}
    process = subprocess.Popen([BOUNCED, "--private", str(theirs.fileno())], env=env,
                               pass_fds=[theirs.fileno()], stderr=subprocess.PIPE)
    theirs.close()
    ours.settimeout(30)
    return process, Framed(ours)


def test_private_daemon_serves_one_and_leaves_nothing(tmp_path):
    process, client = start_private(tmp_path)
    assert client.hello().HasField("hello_reply")
    answer, image = client.ask(render(add_scene(client), aa=1))
    assert image.startswith(b"\x89PNG"), answer
    folders = [entry for entry in tmp_path.iterdir() if entry.name.startswith("bounced.")]
    assert len(folders) == 1 and folders[0].stat().st_mode & 0o077 == 0
    process.send_signal(signal.SIGINT)  # Ctrl-C reaches it too; it is the client's to decide
    time.sleep(0.2)
    assert process.poll() is None
    client.close()
    assert process.wait(timeout=5) == 0
    assert not [entry for entry in tmp_path.iterdir() if entry.name.startswith("bounced.")]


def test_private_daemon_ends_with_a_client_that_was_killed(tmp_path):
    process, client = start_private(tmp_path)
    client.hello()
    client.send(render(add_scene(client), size=(2048, 2048)))
    client.close()
    assert process.wait(timeout=10) == 0


def test_private_needs_a_socket(tmp_path):
    process = subprocess.run([BOUNCED, "--private", "99"], stderr=subprocess.PIPE, timeout=30,
                             env={**os.environ, "TMPDIR": str(tmp_path)})
    assert process.returncode == 2 and b"99" in process.stderr


def test_a_long_frame_says_how_far_it_is(start):
    client = start(env={"BD_FAKE_FRAME_MS": "3500"}).framed()
    request = render(add_scene(client))
    request.render.progress = True
    client.send(request)
    shares = []
    while True:
        answer, _ = client.receive()
        if answer.WhichOneof("body") != "progress":
            break
        if answer.progress.HasField("share"):
            assert answer.progress.stage == "render"
            shares.append(answer.progress.share)
    assert answer.HasField("render_reply"), answer
    assert len(shares) >= 2 and shares == sorted(shares) and 0 < shares[0] < shares[-1] < 1


def test_layers_by_group_and_a_region(shared):
    client = shared.framed()
    scene = add_scene(client)
    for region in ([1, 2, 3], [0, 0, 4, 0], [0, 0, 1, 1, 1]):
        answer, _ = client.ask(render(scene, technique="reference", region=region))
        assert answer.error.code == "usage" and answer.error.details.field == "region", region
    sizes = {}
    for layers in (["beauty"], ["halves"], ["variance"], ["halves", "variance"]):
        answer, data = client.ask(render(scene, technique="reference", encoding="exr", aa=1,
                                         exr_raw=True, layers=layers))
        assert answer.HasField("render_reply"), answer
        sizes[",".join(layers)] = len(data)
    # Not compressed: 24 planes of halves, 9 of variances, 256 floats each, and their names.
    assert sizes["halves"] - sizes["beauty"] >= 24 * 1024
    assert sizes["variance"] - sizes["beauty"] >= 9 * 1024
    assert sizes["halves,variance"] == sizes["halves"] + sizes["variance"] - sizes["beauty"]
