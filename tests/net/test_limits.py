"""Every limit, with a clear error; options; what may be listened on."""
import json
import os
import re
import socket
import struct
import subprocess
import time

import bounced_pb2
import pytest
from conftest import BOUNCED, SCENES, Daemon, blob_name, frame, pack, read_all
from test_environment import exr
from test_framed import add_scene, envelope, render
from test_imports import png
from test_resume import break_off
from test_resume import framed as resumable
from ws_client import WebSocket

GLB = (SCENES / "cornell.glb").read_bytes()


def assert_limit(status_and_error, status, field):
    got, error = status_and_error
    assert got == status, error
    assert error["details"]["field"] == field and field in error["message"], error


def test_message_and_header_bytes(start):
    daemon = start("--limit", "message_bytes=5000", "--limit", "header_bytes=1K")
    assert_limit(daemon.json("POST", "/v1/scenes", "x" * 5001), 413, "message_bytes")
    client = daemon.framed()
    put = bounced_pb2.BlobPut(blob=blob_name(b"x" * 6000), size_bytes=6000)
    answer, _ = client.ask(envelope(blob_put=put), b"x" * 6000)
    assert answer.error.code == "limit" and answer.error.details.field == "message_bytes"
    client = daemon.framed()
    answer, _ = client.ask(envelope(scene_get=bounced_pb2.SceneGet(id="x" * 1100)))
    assert answer.error.code == "limit" and answer.error.details.field == "header_bytes"


def test_blob_bytes(start):
    daemon = start("--limit", "blob_bytes=4K")
    data = b"x" * 4097
    kind = {"Content-Type": "application/octet-stream"}
    for method, path in (("PUT", "/v1/blobs/" + blob_name(data)), ("POST", "/v1/render")):
        assert_limit(daemon.json(method, path, data, kind), 413, "blob_bytes")
    client = daemon.framed()
    put = bounced_pb2.BlobPut(blob=blob_name(data), size_bytes=len(data))
    assert client.ask(envelope(blob_put=put), data)[0].error.details.field == "blob_bytes"


def test_image_size(start):
    daemon = start("--limit", "image_side_px=64", "--limit", "image_pixels=2000")
    scene = daemon.add_scene()
    for size, status in (("32x32", 200), ("65x1", 413), ("64x64", 413)):
        got, error = daemon.json("GET", f"/v1/scenes/{scene}/frame.json?size={size}")
        assert got == status, error
        assert status == 200 or error["details"]["field"] == "size"


@pytest.mark.parametrize("limit,field", [("scene_triangles=3", "triangle"), ("scene_bytes=4096", "byte")])
def test_scene_size(start, limit, field):
    daemon = start("--limit", limit)
    blob = daemon.put_blob(GLB)
    status, error = daemon.json("POST", "/v1/scenes", {"blob": blob})
    assert status == 413 and error["code"] == "limit" and field in error["message"], error


def strip(count):
    return b"".join(struct.pack("<3f", i, i % 7, i % 11) for i in range(count))


def mesh(blob, primitives=1):
    return {"add_mesh": {"primitives": [{"positions": {"blob": blob}}] * primitives}}


def blob_of(data):
    return lambda daemon: daemon.put_blob(data)


@pytest.mark.parametrize("limit, blob, op, fits, field", [
    ("picture_texels=10000", blob_of(png(64)), lambda b: {"add_texture": {"blob": b}}, 2,
     "add_texture.blob"),
    ("scene_bytes=64K", blob_of(strip(1320)), mesh, 1, "add_mesh.primitives[0]"),
    ("scene_bytes=64K", blob_of(strip(1320)), lambda b: mesh(b, 2), 0,
     "add_mesh.primitives[1]"),
    ("scene_bytes=64K", lambda daemon: exr(daemon, size="64x32"),
     lambda b: {"set_environment": {"map": b}}, 2, "set_environment.map"),
    ("picture_texels=200", blob_of((SCENES / "checker.glb").read_bytes()),
     lambda b: {"import": {"blob": b}}, 1, None),
])
def test_a_batch_is_no_larger_than_a_scene(start, limit, blob, op, fits, field):
    """However short its message; `fits`: so many operations do."""
    daemon = start("--limit", limit)
    path = f"/v1/scenes/{daemon.add_scene('two_lights.glb')}/edits"
    one = op(blob(daemon))
    if fits:
        status, reply = daemon.json("POST", path, {"ops": [one] * fits})
        assert status == 200, reply
    status, error = daemon.json("POST", path, {"ops": [one] * (fits + 1)})
    assert (status, error["code"]) == (413, "limit"), error
    assert field is None or error["details"]["field"] == f"ops[{fits}].{field}", error


def test_a_mesh_of_which_little_moves_counts_as_a_whole(start):
    daemon = start("--limit", "scene_bytes=256K")
    scene = daemon.add_scene("two_lights.glb")
    path, blob = f"/v1/scenes/{scene}/edits", daemon.put_blob(strip(3000))
    triangle = {"positions": {"values": [0, 0, 0, 1, 0, 0, 0, 1, 0]}}
    large = {"add_mesh": {"primitives": [{"positions": {"blob": blob}}, triangle]}}
    status, reply = daemon.json("POST", path, {"ops": [large]})
    assert status == 200, reply
    move = {"set_mesh_vertices": {"mesh": reply["ids"][0], "primitive": 1, **triangle}}
    assert daemon.json("POST", path, {"ops": [move] * 3})[0] == 200
    status, error = daemon.json("POST", path, {"ops": [move] * 4})
    assert (status, error["details"]["field"]) == (413, "ops[3].set_mesh_vertices"), error


def test_scene_files_and_scenes(start):
    daemon = start("--limit", "scene_files=2", "--limit", "scenes=2")
    blob = daemon.put_blob(GLB)
    files = {str(i): blob for i in range(3)}
    assert_limit(daemon.json("POST", "/v1/scenes", {"blob": blob, "files": files}), 413, "scene_files")
    first = daemon.add_scene()
    daemon.add_scene()
    assert_limit(daemon.json("POST", "/v1/scenes", {"blob": blob}), 413, "scenes")
    daemon.json("DELETE", "/v1/scenes/" + first)
    daemon.add_scene()


def test_reply_bytes(start):
    daemon = start("--limit", "reply_bytes=4K")
    scene = daemon.add_scene()
    assert daemon.request("GET", f"/v1/scenes/{scene}/frame.png?size=8x8")[0] == 200
    assert_limit(daemon.json("GET", f"/v1/scenes/{scene}/frame.exr?size=256x256&layers=direct"), 413,
                 "reply_bytes")


def test_jobs(start):
    daemon = start("--limit", "jobs_per_client=2", "--limit", "jobs_waiting=1",
                   env={"BD_FAKE_FRAME_MS": "2000"})
    client = daemon.framed()
    scene = add_scene(client)
    for _ in range(3):
        client.send(render(scene))
        time.sleep(0.1)  # the first is on the device, so that the second has the queue's one place
    answer, _ = client.receive()
    assert answer.error.code == "busy" and answer.error.details.field == "jobs_per_client"
    # Another client (an address, not a user) has its own two, but the queue has room for one.
    status, error = daemon.json("GET", f"/v1/scenes/{scene}/frame.png?size=8x8")
    assert status == 429 and error["details"]["field"] == "jobs_waiting", error


def edits_in_one_piece(client, *batches):
    """The answers to edits that arrive together, each a batch and its payload."""
    data, ids = b"", range(100, 100 + len(batches))
    for request_id, (batch, payload) in zip(ids, batches):
        data += pack(bounced_pb2.Envelope(request_id=request_id, edit_batch=batch), payload)
    client.sock.sendall(data)
    answers = dict((a.request_id, a) for a in (client.receive()[0] for _ in batches))
    return [answers[request_id] for request_id in ids]


def importing(scene, blob):
    return bounced_pb2.EditBatch(scene=scene, ops=[
        bounced_pb2.EditOp(**{"import": bounced_pb2.ImportEdit(blob=blob)})])


def dimming(scene):
    return bounced_pb2.EditBatch(scene=scene, ops=[
        bounced_pb2.EditOp(set_light=bounced_pb2.LightEdit(light=0, intensity=5))])


def test_a_file_in_an_edit_is_a_job(start):
    daemon = start("--limit", "jobs_per_client=1")
    client, scene = daemon.framed(), daemon.add_scene("two_lights.glb")
    batch = importing(scene, client.put_blob((SCENES / "checker.glb").read_bytes()))
    answers = edits_in_one_piece(client, (batch, b""), (dimming(scene), b""), (batch, b""))
    assert [a.edit_reply.revision for a in answers[:2]] == [2, 3]
    assert (answers[2].error.code, answers[2].error.details.field) == ("busy", "jobs_per_client")
    assert client.ask(bounced_pb2.Envelope(edit_batch=batch))[0].edit_reply.revision == 4
    client.close()


def post(path, body):
    head = (f"POST {path} HTTP/1.1", "Host: 127.0.0.1", "Content-Type: application/json", f"Content-Length: {len(body)}")
    return "\r\n".join(head).encode() + b"\r\n\r\n" + body


def test_an_edit_that_ended_has_given_its_job_back(start):
    """The next edit of the scene, and what was sent behind that one, begin in the same moment."""
    daemon = start("--limit", "jobs_per_client=1")
    scene, blob = daemon.add_scene("two_lights.glb"), daemon.put_blob((SCENES / "checker.glb").read_bytes())
    edits = f"/v1/scenes/{scene}/edits"
    file = json.dumps({"dry_run": True, "ops": [{"import": {"blob": blob}}]}).encode()
    light = json.dumps({"dry_run": True, "ops": [{"set_light": {"light": 0, "intensity": 5}}]}).encode()
    export = f"GET /v1/scenes/{scene}/export HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n".encode()
    with socket.create_connection(("127.0.0.1", daemon.port), 10) as first:
        first.sendall(post(edits, file))
        reply = daemon.raw(post(edits, light) + export)
        assert first.recv(4096).startswith(b"HTTP/1.1 200")
    assert [int(part[:3]) for part in reply.split(b"HTTP/1.1 ")[1:]] == [200, 200], reply[:2000]


def test_edit_bytes_per_client(start):
    daemon = start("--limit", "edit_bytes_per_client=4K")
    client, scene = daemon.framed(), daemon.add_scene("two_lights.glb")
    batch = importing(scene, client.put_blob((SCENES / "checker.glb").read_bytes()))
    answers = edits_in_one_piece(client, (batch, b"x" * 3000), (dimming(scene), b"x" * 3000),
                                 (dimming(scene), b""))
    assert [answers[i].edit_reply.revision for i in (0, 2)] == [2, 3]
    error = answers[1].error
    assert (error.code, error.details.field) == ("busy", "edit_bytes_per_client")
    # None of them is under way any more, and one alone may have any size.
    answer, _ = client.ask(bounced_pb2.Envelope(edit_batch=dimming(scene)), b"x" * 9000)
    assert answer.edit_reply.revision == 4
    client.close()


def test_requests_per_second(start):
    daemon = start("--limit", "requests_per_second=5")
    replies = [daemon.request("GET", "/v1/scenes") for _ in range(20)]
    refused = [reply for reply in replies if reply[0] == 429]
    assert 5 <= len(refused) <= 12 and replies[0][0] == 200  # a burst of twice the rate
    assert json.loads(refused[0][2])["details"]["field"] == "requests_per_second"
    assert refused[0][1]["Retry-After"] == "1"
    assert daemon.healthy()  # is asked by machines, and is free
    time.sleep(1)
    assert daemon.request("GET", "/v1/scenes")[0] == 200
    client = daemon.framed()  # another client: a user, not an address
    answers = [client.ask(envelope(stats=bounced_pb2.Stats()))[0] for _ in range(20)]
    assert "requests_per_second" in [answer.error.details.field for answer in answers]


@pytest.mark.parametrize("method,path,headers,status", [
    ("GET", "/v1/scenes", {"Authorization": "Bearer wrong"}, 401), ("GET", "/v1/nothing", {}, 404),
    ("GET", "/v1/scenes", {"Origin": "http://other"}, 403), ("POST", "/v1/scenes", {"Content-Type": "text/plain"}, 415),
])
def test_what_is_refused_counts_as_well(start, method, path, headers, status):
    daemon = start("--limit", "requests_per_second=5", token="correct-horse-battery")
    refused = [daemon.request(method, path, headers=headers)[0] for _ in range(20)]
    assert refused[0] == status and 5 <= refused.count(429) <= 12
    assert set(refused) == {status, 429}


def test_a_refusal_says_nothing_of_the_one_before(start):
    """On one connection, where each has a status of its own."""
    daemon = start("--limit", "requests_per_second=1")
    host = b"Host: 127.0.0.1\r\n"
    bad = b"POST /v1/scenes HTTP/1.1\r\n" + host + b"Content-Type: text/plain\r\n\r\n"
    last = b"GET /v1/scenes HTTP/1.1\r\n" + host + b"Connection: close\r\n\r\n"
    reply = daemon.raw(bad + bad + last)
    assert re.findall(rb"HTTP/1.1 (\d+)", reply) == [b"415", b"415", b"429"]


def test_nonsense_of_a_session_counts_as_well(start):
    daemon = start("--limit", "requests_per_second=5")
    client = daemon.framed()
    zero = envelope(stats=bounced_pb2.Stats())
    zero.request_id = 0
    for _ in range(20):
        client.send(zero)
    fields = [client.receive()[0].error.details.field for _ in range(20)]
    assert fields[0] == "request_id" and 5 <= fields.count("requests_per_second") <= 12


def test_connections(start):
    daemon = start("--limit", "connections=5")
    held = [socket.create_connection(("127.0.0.1", daemon.port), 5) for _ in range(5)]
    time.sleep(0.1)
    with socket.create_connection(("127.0.0.1", daemon.port), 5) as sixth:
        assert read_all(sixth) == b""
    for sock in held:
        sock.close()
    time.sleep(0.1)
    assert daemon.healthy()


def test_hello_and_idle_seconds(start):
    daemon = start("--limit", "header_seconds=1", "--limit", "idle_seconds=1")
    for hello, field in ((False, "header_seconds"), (True, "idle_seconds")):
        client = daemon.framed(hello=hello)
        answer, _ = client.receive()
        assert answer.error.details.field == field
        assert client.sock.recv(1) == b""


def test_scene_name_bytes(start):
    daemon = start("--limit", "scene_name_bytes=100")
    client, blob = daemon.framed(), daemon.put_blob(GLB)
    for name, is_too_long in (("n" * 100, False), ("n" * 101, True), ("\u00e9" * 51, True)):
        if is_too_long:
            assert_limit(daemon.json("POST", "/v1/scenes", {"blob": blob, "name": name}), 413,
                         "scene_name_bytes")
            add = bounced_pb2.SceneAdd(blob=blob, name=name)
            error = client.ask(envelope(scene_add=add))[0].error
            assert (error.code, error.details.field) == ("limit", "scene_name_bytes")
        else:
            status, scene = daemon.json("POST", "/v1/scenes", {"blob": blob, "name": name})
            assert status == 201 and scene["name"] == name
    assert len(daemon.json("GET", "/v1/scenes")[1]["scenes"]) == 1


def test_scene_names_are_never_cut(shared):
    blob = shared.put_blob(GLB)
    assert_limit(shared.json("POST", "/v1/scenes", {"blob": blob, "name": "n" * 128}), 413,
                 "scene_name_bytes")
    status, scene = shared.json("POST", "/v1/scenes", {"blob": blob, "name": "n" * 127})
    assert status == 201 and scene["name"] == "n" * 127


def test_head_bytes(start):
    daemon = start("--limit", "head_bytes=2K")
    assert daemon.request("GET", "/v1/scenes", headers={"X-Long": "x" * 1500})[0] == 200
    for headers, path in (({"X-Long": "x" * 2100}, "/v1/scenes"), ({}, "/v1/scenes?a=" + "x" * 2100)):
        assert_limit(daemon.json("GET", path, headers=headers), 431, "head_bytes")
    with socket.create_connection(("127.0.0.1", daemon.port), 5) as web:
        web.sendall(b"GET /v1/socket HTTP/1.1\r\nHost: 127.0.0.1\r\nCookie: " + b"x" * 3000)
        assert read_all(web).startswith(b"HTTP/1.1 431 ")


def test_what_one_connection_has_under_way(start):
    daemon = start("--limit", "requests_per_connection=2", "--limit", "uploads_per_connection=1",
                   "--limit", "watches_per_connection=1", env={"BD_FAKE_FRAME_MS": "300"})
    scene = daemon.add_scene()
    for client in (daemon.framed(), WebSocket(daemon)):
        ids = [client.send(render(scene)) for _ in range(3)]
        answers = {answer.request_id: answer for answer in (client.receive()[0] for _ in range(3))}
        assert answers[ids[2]].error.details.field == "requests_per_connection"
        assert all(answers[id].HasField("render_reply") for id in ids[:2])
        for number in range(2):
            put = bounced_pb2.BlobPut(blob=blob_name(b"%d" % number), size_bytes=10)
            answer = client.ask(envelope(blob_put=put), b"abc")[0]
        assert (answer.error.code, answer.error.details.field) == ("busy", "uploads_per_connection")
        for _ in range(2):
            answer = client.ask(envelope(scene_watch=bounced_pb2.SceneWatch()))[0]
        assert (answer.error.code, answer.error.details.field) == ("busy", "watches_per_connection")
        client.close()


def test_connections_of_one_client(start):
    daemon = start("--limit", "connections_per_client=3")
    held = [socket.create_connection(("127.0.0.1", port), 5)
            for port in (daemon.port, daemon.tcp_port, daemon.port)]
    time.sleep(0.1)
    with socket.create_connection(("127.0.0.1", daemon.port), 5) as fourth:
        assert read_all(fourth) == b""
    other = daemon.framed()  # a user, not an address
    assert other.ask(envelope(stats=bounced_pb2.Stats()))[0].stats_reply.connections == 4
    for sock in held:
        sock.close()
    time.sleep(0.1)
    assert daemon.healthy()


def test_sessions_that_wait_for_their_client(start):
    daemon = start("--limit", "resumable_sessions=1")
    first, second = (resumable(daemon, "") for _ in range(2))
    tokens = [reply.session for _, reply in (first, second)]
    for client, _ in (first, second):
        break_off(client)
        time.sleep(0.2)
    resumed = [resumable(daemon, token)[1].resumed for token in tokens]
    assert resumed == [True, False]


def test_view_credits(start):
    daemon = start("--limit", "view_credits=3")
    scene, client = daemon.add_scene(), daemon.framed()
    view = bounced_pb2.ViewOpen(scene=scene, frame=frame(), credits=4)
    error = client.ask(envelope(view_open=view))[0].error
    assert error.details.field == "credits" and "view_credits" in error.message


# --- options --------------------------------------------------------------------------------


def run(*words, **keywords):
    return subprocess.run([BOUNCED, *words], capture_output=True, text=True, timeout=30, **keywords)


@pytest.mark.parametrize("words,needle", [
    (["--limit", "nothing=1"], "nothing"), (["--limit", "scenes=0"], "scenes"), (["--frobnicate"], "frobnicate"),
    (["--http"], "http"), (["extra"], "extra"), (["--log", "xml"], "xml"), (["--private", "x"], "private"),
    (["--config", "/nonexistent"], "nonexistent"), (["--gpu-memory", "-1"], "gpu-memory"),
    (["--code", "slow"], "quick or fast"),
])
def test_bad_options(words, needle):
    result = run(*words)
    assert result.returncode == 2 and needle in result.stderr and result.stdout == ""


@pytest.mark.parametrize("address", ["0.0.0.0:0", "[::]:0", "192.0.2.1:0"])
@pytest.mark.parametrize("option", ["--http", "--listen"])
def test_no_public_listening_without_a_token(tmp_path, option, address):
    value = address if option == "--http" else "tcp:" + address
    words = ["--http", "none"] if option == "--listen" else []
    result = run(*words, option, value, "--data", str(tmp_path / "d"))
    assert result.returncode == 2 and "--token-file" in result.stderr


def test_a_daemon_that_nobody_could_reach_does_not_start(tmp_path):
    env = {name: value for name, value in os.environ.items() if name != "XDG_RUNTIME_DIR"}
    result = run("--http", "none", "--data", str(tmp_path / "d"), env=env)
    assert result.returncode == 2 and "XDG_RUNTIME_DIR" in result.stderr


@pytest.mark.parametrize("value", ["unix:", "tcp:127.0.0.1", "tcp:nowhere.example:1", "127.0.0.1:70000",
                                   "127.0.0.1:", "tcp:[::1:1", "unix:" + "x" * 200, "ftp:1:1"])
def test_bad_addresses(tmp_path, value):
    result = run("--http", "none", "--listen", value, "--data", str(tmp_path / "d"))
    assert result.returncode == 2 and result.stderr.count("\n") >= 1


@pytest.mark.parametrize("content,mode,needle", [
    ("", 0o600, "no entry"), ("# comment\n", 0o600, "no entry"), ("short\n", 0o600, "16"),
    ("long-enough-for-a-token\n", 0o644, "600"),
])
def test_token_files(tmp_path, content, mode, needle):
    file = tmp_path / "tokens"
    file.write_text(content)
    file.chmod(mode)
    result = run("--token-file", str(file), "--http", "127.0.0.1:0", "--data", str(tmp_path / "d"))
    assert result.returncode == 2 and needle in result.stderr


def test_config_file_has_the_same_keys(start, tmp_path):
    config = tmp_path / "bounced.conf"
    config.write_text("# ours\n\nlimit scenes=1\n  public-name render.example\nlog json\n")
    daemon = start("--config", str(config))
    assert daemon.request("GET", "/v1/scenes", headers={"Host": "render.example"})[0] == 200
    daemon.add_scene()
    assert daemon.json("POST", "/v1/scenes", {"blob": daemon.put_blob(GLB)})[0] == 413
    for line in daemon.log_path.read_text().splitlines():
        assert set(json.loads(line)) == {"time", "level", "area", "message"}
    config.write_text("config other\n")
    assert run("--config", str(config)).returncode == 2


def test_data_directory_is_ours_alone_and_only_once(start, tmp_path):
    daemon = start()
    assert daemon.data.stat().st_mode & 0o777 == 0o700
    second = run("--data", str(daemon.data), "--http", "127.0.0.1:0")
    assert second.returncode != 0 and "another daemon" in second.stderr
    (tmp_path / "open").mkdir(mode=0o755)
    os.chmod(tmp_path / "open", 0o755)
    assert "0700" in run("--data", str(tmp_path / "open"), "--http", "127.0.0.1:0").stderr


def test_version_and_help():
    assert re.fullmatch(r"bounced \d+\.\d+\.\d+\n", run("--version").stdout)
    assert "--public-name" in run("--help").stdout
