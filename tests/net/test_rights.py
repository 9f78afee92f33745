"""What tokens may do: roles, scenes of a prefix, quotas; over HTTP, sessions and cookies."""
import contextlib
import http.client
import json

import bounced_pb2
import pytest
from conftest import SCENES, blob_name

pb = bounced_pb2

ADMIN, EDIT, READ = "admin-admin-admin-0", "edit-edit-edit-edit", "read-read-read-read"
MINE, MINE_READ, SMALL = "mine-mine-mine-mine", "mine-read-mine-read", "small-small-small-s"
SCENE_BYTES = (SCENES / "two_lights.glb").read_bytes()
LINES = f"""{ADMIN}
{EDIT} role=edit name=editor
{READ} role=read name=reader
{MINE} role=edit scenes=mine/ name=mine
{MINE_READ} role=read scenes=mine/
{SMALL} role=edit scenes=small/ name=small max_scenes=2 max_bytes=64K max_jobs=1"""
DIM = {"ops": [{"set_light": {"light": 0, "intensity": 5}}]}


class Asker:
    """One token's way to a daemon."""

    def __init__(self, daemon, token):
        self.daemon, self.token = daemon, token

    def request(self, method, path, body=None, **headers):
        headers = {"Authorization": "Bearer " + self.token, "Content-Type": "application/json",
                   **{name.replace("_", "-"): value for name, value in headers.items()}}
        if isinstance(body, dict):
            body = json.dumps(body)
        return self.daemon.request(method, path, body, headers)

    def json(self, method, path, body=None):
        status, _, text = self.request(method, path, body)
        return status, json.loads(text) if text else None

    def refusal(self, method, path, body=None):
        status, reply = self.json(method, path, body)
        assert status >= 400 and "\n" not in reply["message"], reply
        return status, reply["code"], reply.get("details", {}).get("field")

    def put_blob(self, data=SCENE_BYTES):
        name = blob_name(data)
        return self.request("PUT", "/v1/blobs/" + name, data,
                            Content_Type="application/octet-stream")[0]

    def add(self, name):
        return self.json("POST", "/v1/scenes", {"blob": blob_name(SCENE_BYTES), "name": name})

    def framed(self):
        client = self.daemon.framed(tcp=True, hello=False)
        assert client.hello(self.token).HasField("hello_reply")
        return client


@pytest.fixture
def ask(start):
    daemon = start(token=LINES)
    for token in (ADMIN, MINE, SMALL):  # with a prefix it finds what it sent itself
        assert Asker(daemon, token).put_blob() == 201
    return lambda token: Asker(daemon, token)


@contextlib.contextmanager
def framed(asker):
    client = asker.framed()
    yield lambda **bodies: client.ask(pb.Envelope(**bodies))[0]
    client.close()


def added(ask, name, token=ADMIN):
    status, reply = ask(token).add(name)
    assert status == 201, reply
    return "/v1/scenes/" + reply["id"]


FORBIDDEN = (403, "forbidden", "role")

# --- roles --------------------------------------------------------------------------------------


def test_a_reader_looks_and_changes_nothing(ask):
    scene, reader = added(ask, "s"), ask(READ)
    for path in ["", "?objects=1", "/log", "/export", "/frame.png?size=16x16"]:
        assert reader.request("GET", scene + path)[0] == 200, path
    for path in ["/v1/scenes", "/v1/devices", "/v1/techniques", "/v1/options"]:
        assert reader.request("GET", path)[0] == 200, path
    assert reader.request("HEAD", "/v1/blobs/" + blob_name(SCENE_BYTES))[0] == 200
    before = reader.json("GET", scene)[1]
    for method, path, body in [
            ("POST", scene + "/edits", DIM), ("POST", scene + "/undo", {}),
            ("POST", scene + "/revert", {"revision": 1}), ("POST", scene + "/commit", {}),
            ("POST", scene + "/names", {"name": "n"}), ("DELETE", scene, None),
            ("POST", "/v1/scenes", {"blob": blob_name(SCENE_BYTES), "name": "t"})]:
        assert reader.refusal(method, path, body) == FORBIDDEN, path
    assert reader.json("GET", scene)[1] == before


def test_an_edit_is_its_tokens(ask):
    """Whoever holds a token may say who of its holders it is; nobody passes for another token."""
    scene, editor, mine = added(ask, "mine/a"), ask(EDIT), ask(MINE)
    dim_red = {"ops": [{"set_light": {"light": 0, "color": [1, 0, 0]}}], "by": "Anna"}
    assert editor.json("POST", scene + "/edits", DIM)[1]["author"] == "editor"
    assert mine.json("POST", scene + "/edits", dim_red)[1]["author"] == "mine Anna"
    assert mine.refusal("POST", scene + "/undo", {"by": "editor"}) == (409, "conflict", "undo")
    assert mine.refusal("POST", scene + "/undo", {"by": "x" * 65}) == (413, "limit", "by")
    assert editor.json("POST", scene + "/undo", {})[1]["of"] == 2
    assert mine.json("POST", scene + "/undo", {"by": "Anna"})[1]["of"] == 3
    log = ask(ADMIN).json("GET", scene + "/log")[1]["entries"]
    assert [entry["author"] for entry in log[1:]] == ["editor", "mine Anna", "editor", "mine Anna"]


@pytest.mark.parametrize("token, status", [(READ, 403), (EDIT, 201), (ADMIN, 201)])
def test_uploads_take_an_editor(ask, token, status):
    data = b"content of %s" % token.encode()
    assert ask(token).put_blob(data) == status
    found = ask(ADMIN).request("HEAD", "/v1/blobs/" + blob_name(data))[0]
    assert found == (404 if status == 403 else 200)


def test_a_file_of_ones_own_takes_an_editor(ask):
    for token, status in [(READ, 403), (EDIT, 200)]:
        got = ask(token).request("POST", "/v1/render?size=16x16", SCENE_BYTES,
                                 Content_Type="model/gltf-binary")
        assert got[0] == status, got
    with framed(ask(READ)) as say:
        answer = say(render=pb.Render(blob=blob_name(SCENE_BYTES)))
        assert answer.error.code == "forbidden"


def test_uploads_of_a_session_take_an_editor(ask):
    data = b"pieces"
    put = pb.BlobPut(blob=blob_name(data), size_bytes=0)
    with framed(ask(READ)) as say:
        answer = say(blob_put=put)
        assert (answer.error.code, answer.error.details.field) == ("forbidden", "role")
    client = ask(EDIT).framed()
    assert client.put_blob(data) == blob_name(data)
    client.close()


@pytest.mark.parametrize("path", ["/metrics", "/v1/stats"])
def test_figures_of_the_daemon_are_for_admins(ask, path):
    assert ask(ADMIN).request("GET", path)[0] == 200
    for token in (READ, EDIT, MINE):
        assert ask(token).refusal("GET", path) == FORBIDDEN
    assert ask("x" * 20).request("GET", path)[0] == 401


def by_cookie(daemon, method, path, body, headers):
    """The status of an answer to a request without any token."""
    connection = http.client.HTTPConnection("127.0.0.1", daemon.port, timeout=20)
    with contextlib.closing(connection):
        connection.request(method, path, body, headers)
        return connection.getresponse().status


def test_a_cookie_keeps_the_tokens_grant(ask):
    scene = added(ask, "s")
    daemon = ask(ADMIN).daemon
    for token, status in [(READ, 403), (MINE, 404), (EDIT, 200)]:
        got = ask(token).request("POST", "/v1/session")
        assert got[0] == 204
        cookie = got[1]["Set-Cookie"].split(";")[0]
        origin = f"http://127.0.0.1:{daemon.port}"
        headers = {"Cookie": cookie, "Origin": origin, "Content-Type": "application/json"}
        assert by_cookie(daemon, "POST", scene + "/edits", json.dumps(DIM), headers) == status
        assert by_cookie(daemon, "GET", "/metrics", None, headers) == 403


# --- scenes of a prefix -------------------------------------------------------------------------


def test_others_scenes_are_not_there(ask):
    theirs, ours = added(ask, "theirs"), added(ask, "mine/a")
    missing = "/v1/scenes/" + "0" * 16
    gets = ["", "?objects=1", "/log", "/export", "/export?revision=1", "/frame.png?size=16x16",
            "/frame.json?size=16x16", "/events", "/stream.mjpeg?size=16x16"]
    posts = [("/edits", DIM), ("/undo", {}), ("/revert", {"revision": 1}), ("/commit", {}),
             ("/names", {"name": "n"})]
    for asker in (ask(MINE), ask(MINE_READ)):
        for path in gets:
            got, wanted = (asker.json("GET", s + path) for s in (theirs, missing))
            assert got[0] == wanted[0] == 404 and got[1]["code"] == "not_found", path
            assert (got[1]["message"].replace(theirs[11:], "") ==
                    wanted[1]["message"].replace(missing[11:], "")), path
        assert [s["name"] for s in asker.json("GET", "/v1/scenes")[1]["scenes"]] == ["mine/a"]
    for path, body in posts:
        assert ask(MINE).refusal("POST", theirs + path, body)[:2] == (404, "not_found")
        assert ask(MINE_READ).refusal("POST", ours + path, body) == FORBIDDEN
    assert ask(MINE).refusal("DELETE", theirs)[:2] == (404, "not_found")
    assert ask(MINE).json("POST", ours + "/edits", DIM)[0] == 200
    assert ask(MINE).refusal("POST", "/v1/scenes", {
        "blob": blob_name(SCENE_BYTES), "name": "min"})[:2] == (403, "forbidden")
    assert ask(ADMIN).json("GET", theirs)[1]["revision"] == 1


def test_others_scenes_are_not_there_for_sessions(ask):
    theirs, ours = (added(ask, name)[11:] for name in ("theirs", "mine/a"))
    with framed(ask(MINE)) as say:
        for body in [{"view_open": pb.ViewOpen(scene=theirs)},
                     {"scene_watch": pb.SceneWatch(scene=theirs)},
                     {"render": pb.Render(scene=theirs)},
                     {"scene_log": pb.SceneLog(scene=theirs)},
                     {"scene_export": pb.SceneExport(scene=theirs)},
                     {"edit_batch": pb.EditBatch(scene=theirs)},
                     {"scene_remove": pb.SceneRemove(id=theirs)}]:
            answer = say(**body)
            assert answer.error.code == "not_found", (body, answer)
        assert say(scene_watch=pb.SceneWatch(scene=ours)).HasField("done")


def test_events_tell_of_ones_own_scenes_alone(ask):
    theirs, ours = (added(ask, name) for name in ("theirs", "mine/a"))
    client = ask(MINE_READ).framed()
    assert client.ask(pb.Envelope(scene_watch=pb.SceneWatch()))[0].HasField("done")
    for scene in (theirs, ours):
        assert ask(ADMIN).json("POST", scene + "/edits", DIM)[0] == 200
    event = client.receive()[0].scene_event
    assert (event.scene, event.revision) == (ours[11:], 2)
    client.close()


def hello(token, resume):
    return pb.Envelope(hello=pb.Hello(min=1, max=1, token=token, resume=resume))


def test_a_session_is_taken_over_by_its_own_token_alone(ask):
    daemon, resumed = ask(EDIT).daemon, []
    for token in (EDIT, READ):
        first, second = (daemon.framed(tcp=True, hello=False) for _ in range(2))
        reply = first.ask(hello(EDIT, ""))[0].hello_reply
        assert reply.session and not reply.resumed
        first.close()
        resumed.append(second.ask(hello(token, reply.session))[0].hello_reply.resumed)
        second.close()
    assert resumed == [True, False]


# --- quotas -------------------------------------------------------------------------------------


def test_max_scenes(ask):
    small = ask(SMALL)
    client = small.framed()
    body = pb.SceneAdd(blob=blob_name(SCENE_BYTES))
    for name in ("small/a", "small/b", "small/c"):
        body.name = name
        answer = client.ask(pb.Envelope(scene_add=body))[0]
    assert (answer.error.code, answer.error.details.field) == ("limit", "max_scenes")
    first = small.json("GET", "/v1/scenes")[1]["scenes"][0]["id"]
    assert small.request("DELETE", "/v1/scenes/" + first)[0] == 204
    assert client.ask(pb.Envelope(scene_add=body))[0].HasField("scene")
    client.close()
    assert ask(ADMIN).add("small/d")[0] == 201  # another's quota


def test_max_bytes_holds_edits_back_but_only_those_that_grow(ask):
    small, scene = ask(SMALL), added(ask, "small/a", SMALL)
    count = 3000
    grow = {"ops": [{"add_mesh": {"primitives": [
        {"positions": {"values": [float(i % 7) for i in range(9 * count)]}}]}}]}
    for edit in (grow, {**grow, "durability": "transient"}):
        assert small.refusal("POST", scene + "/edits", edit)[1:] == ("limit", "max_bytes")
    assert small.json("GET", scene)[1]["revision"] == 1
    assert small.json("POST", scene + "/edits", DIM)[0] == 200
    assert ask(ADMIN).json("POST", scene + "/edits", grow)[0] == 200  # his is another's quota
    assert small.json("POST", scene + "/edits", DIM)[0] == 200  # above it, but no further
    assert small.refusal("POST", "/v1/scenes", {
        "blob": blob_name(SCENE_BYTES), "name": "small/b"})[1:] == ("limit", "max_bytes")
    assert ask(ADMIN).json("POST", scene + "/revert", {"revision": 2})[0] == 200
    assert small.refusal("POST", scene + "/revert", {"revision": 3})[1:] == ("limit", "max_bytes")


def test_max_jobs(start):
    daemon = start(token=LINES, env={"BD_FAKE_FRAME_MS": "300"})
    assert Asker(daemon, ADMIN).put_blob() == 201
    scene = added(lambda token: Asker(daemon, token), "small/a")[11:]
    client = Asker(daemon, SMALL).framed()
    ids = [client.send(pb.Envelope(render=pb.Render(scene=scene))) for _ in range(2)]
    answers = {}
    while len(answers) < 2:
        answer = client.receive()[0]
        if answer.WhichOneof("body") != "progress":
            answers[answer.request_id] = answer
    assert answers[ids[0]].HasField("render_reply"), answers
    assert answers[ids[1]].error.code == "busy"
    assert answers[ids[1]].error.details.field == "max_jobs"
    assert client.ask(pb.Envelope(render=pb.Render(scene=scene)))[0].HasField("render_reply")
    client.close()
