"""A frame that was asked for before: the same bytes at once, and only where they are the same."""
import http.client
import json
import re
import time

import bounced_pb2
import pytest
from conftest import SCENES, frame
from test_identity import bearer, write

GLB = "two_lights.glb"
DIM = {"ops": [{"set_light": {"light": 0, "intensity": 5}}]}


class Frames:
    def __init__(self, daemon, scene=None):
        self.daemon, self.scene = daemon, scene or daemon.add_scene(GLB)

    def get(self, query="size=16x16", extension="png", **headers):
        headers = {name.replace("_", "-"): value for name, value in headers.items()}
        status, head, body = self.daemon.request(
            "GET", f"/v1/scenes/{self.scene}/frame.{extension}?{query}", headers=headers)
        return status, head, body

    def edit(self, what="edits", body=DIM):
        status, reply = self.daemon.json("POST", f"/v1/scenes/{self.scene}/{what}", body)
        assert status == 200, reply


@pytest.fixture
def frames(start):
    return Frames(start())


def is_remembered(reply):
    status, head, _ = reply
    assert status in (200, 304), reply
    return "Bounced-Remembered" in head


def test_the_same_again_is_not_rendered(start):
    frames = Frames(start(env={"BD_FAKE_FRAME_MS": "300"}))
    first = frames.get()
    done = frames.daemon.json("GET", "/v1/stats")[1]["jobs_done"]
    begin = time.time()
    again = [frames.get() for _ in range(10)]
    assert time.time() - begin < 1.5  # of 3 s
    assert not is_remembered(first) and all(is_remembered(reply) for reply in again)
    assert {reply[2] for reply in again} == {first[2]} and {reply[1]["ETag"] for reply in again} == {first[1]["ETag"]}
    assert frames.daemon.json("GET", "/v1/stats")[1]["jobs_done"] == done
    assert frames.daemon.metrics()["bounced_frames_remembered_total"] == 10


def test_a_remembered_frame_says_so_and_takes_no_credit(frames):
    first, again = frames.get(), frames.get()
    timing = again[1]["Server-Timing"]
    ran = [entry for entry in timing.split(", ") if "desc" not in entry and not re.search(r"dur=0.000$", entry)]
    assert all(entry.startswith("total;") for entry in ran), timing
    for name in ("Bounced-Scene", "Bounced-Device", "Bounced-Stopped", "Content-Type", "Cache-Control"):
        assert again[1].get(name) == first[1].get(name), name
    assert first[1]["Cache-Control"] == "private, no-cache"


@pytest.mark.parametrize("form, held", [
    ("{}", True), ("W/{}", True), ("*", True), (" * ", True), ('"other", {}', True), ('"a",W/{} , "b"', True),
    ('"other"', False), ("", False), ("x{}", False), ('"*"', False), ("*, {}", False), ("{}x", True),
])
def test_who_holds_it_is_told_so(frames, form, held):
    first = frames.get()
    for _ in range(2):
        status, head, body = frames.get(If_None_Match=form.format(first[1]["ETag"]))
        assert (status, body) == ((304, b"") if held else (200, first[2]))
        assert head["ETag"] == first[1]["ETag"] and head["Cache-Control"] == "private, no-cache"
    other = frames.get("size=17x16", If_None_Match=first[1]["ETag"])
    assert other[0] == 200 and other[1]["ETag"] != first[1]["ETag"]


def test_who_holds_what_was_rendered_anew_is_told_so(start):
    """Without a memory, too: the name is of what makes the picture."""
    frames = Frames(start("--limit", "frame_cache_bytes=0"))
    first = frames.get()
    reply = frames.get(If_None_Match=first[1]["ETag"])
    assert reply[0] == 304 and reply[2] == b"" and not is_remembered(reply)
    assert not is_remembered(frames.get())


def test_connections_go_on_after_a_304(frames):
    tag = frames.get()[1]["ETag"]
    connection = http.client.HTTPConnection("127.0.0.1", frames.daemon.port, timeout=10)
    for wanted in (304, 200, 304):
        headers = {"If-None-Match": tag} if wanted == 304 else {}
        connection.request("GET", f"/v1/scenes/{frames.scene}/frame.png?size=16x16", headers=headers)
        reply = connection.getresponse()
        assert reply.status == wanted and bool(reply.read()) == (wanted == 200)
    connection.close()


QUERIES = ["size=16x16", "size=17x16", "size=16x17", "camera=0", "technique=direct", "technique=multires_gather",
           "set=vpls=64", "set=vpls=65", "layers=direct", "layers=depth", "aa=2", "seed=1", "seed=2", "exposure=1",
           "exposure=1.5", "exposure=auto", "tonemap=agx", "tonemap=linear", "check=16", "check=16&against=full"]


def test_every_field_of_a_request_counts(frames):
    seen = {}
    requests = [(f"size=16x16&{query}" if not query.startswith("size") else query, "png") for query in QUERIES]
    requests += [("size=16x16", "jpg"), ("size=16x16&quality=50", "jpg"), ("size=16x16", "exr"),
                 ("size=16x16&half=1", "exr"), ("size=16x16&layers=direct,depth", "exr"),
                 ("size=16x16&layers=depth,direct", "exr")]
    replies = [frames.get(*request) for request in requests]
    assert not any(is_remembered(reply) for reply in replies if reply[0] == 200)
    for request, reply in zip(requests, replies):
        if reply[0] == 200:
            assert reply[1]["ETag"] not in seen, (request, seen[reply[1]["ETag"]])
            seen[reply[1]["ETag"]] = request
    assert len(seen) > 18, [(request, reply[2]) for request, reply in zip(requests, replies) if reply[0] != 200]
    for request, reply in zip(requests, replies):
        again = frames.get(*request)
        assert again[0] == reply[0] and again[2] == reply[2]
        assert reply[0] != 200 or is_remembered(again), request


@pytest.mark.parametrize("query", ["deadline_ms=5000", "target_error=50", "fresh=none", "fresh=camera", "fresh=all"])
def test_what_time_decides_is_never_remembered(frames, query):
    for _ in range(2):
        reply = frames.get("size=16x16&" + query)
        assert not is_remembered(reply) and "ETag" not in reply[1] and reply[1]["Cache-Control"] == "no-store"
    frames.get()
    assert not is_remembered(frames.get("size=16x16&" + query))  # nor answered by another


def test_reports_and_plans_are_made_anew(frames):
    for query, extension in (("size=16x16", "json"), ("size=16x16&plan=1", "png")):
        for _ in range(2):
            status, head, body = frames.get(query, extension)
            assert status == 200 and "ETag" not in head and "Bounced-Remembered" not in head


def test_every_edit_counts(frames):
    tags = [frames.get()[1]["ETag"]]

    def changed():
        reply = frames.get()
        assert not is_remembered(reply) and reply[1]["ETag"] not in tags
        tags.append(reply[1]["ETag"])
        assert is_remembered(frames.get())

    frames.edit()
    changed()
    for intensity in (6, 7):  # twice, on the same revision
        frames.edit(body={"ops": [{"set_light": {"light": 0, "intensity": intensity}}], "durability": "transient"})
        changed()
    frames.edit("commit", {})
    changed()
    frames.edit("undo", {})
    changed()  # the revision is in the picture
    other = Frames(frames.daemon)
    assert not is_remembered(other.get()) and other.get()[1]["ETag"] not in tags


def test_a_name_gives_no_rights(start, tmp_path):
    tokens = ["mine-mine-mine-mine mine", "yours-yours-yours-y yours"]
    file = write(tmp_path / "tokens", "\n".join(f"{t.split()[0]} scenes={t.split()[1]}/" for t in tokens) + "\n")
    daemon = start("--token-file", file)
    mine, yours = (bearer(token.split()[0]) for token in tokens)
    kind = {"Content-Type": "application/octet-stream"}
    from conftest import blob_name
    data = (SCENES / GLB).read_bytes()
    daemon.request("PUT", "/v1/blobs/" + blob_name(data), data, {**mine, **kind})
    scene = json.loads(daemon.request("POST", "/v1/scenes", json.dumps({"blob": blob_name(data), "name": "mine/a"}),
                                      {**mine, "Content-Type": "application/json"})[2])["id"]
    path = f"/v1/scenes/{scene}/frame.png?size=16x16"
    tag = daemon.request("GET", path, headers=mine)[1]["ETag"]
    for extra in ({}, {"If-None-Match": tag}, {"If-None-Match": "*"}):
        assert daemon.request("GET", path, headers={**yours, **extra})[0] == 404
        assert daemon.request("GET", path, headers=extra)[0] == 401
    daemon.request("DELETE", f"/v1/scenes/{scene}", headers=mine)
    for extra in ({}, {"If-None-Match": tag}, {"If-None-Match": "*"}):
        assert daemon.request("GET", path, headers={**mine, **extra})[0] == 404


def test_what_is_kept_is_bounded(start):
    frames = Frames(start("--limit", "frame_cache_bytes=40K"))
    sizes = [len(frames.get(f"size=16x16&seed={seed}")[2]) for seed in range(60)]
    assert sum(sizes) + 60 * 600 > 40 << 10
    assert not is_remembered(frames.get("size=16x16&seed=0")) and is_remembered(frames.get("size=16x16&seed=59"))
    large = frames.get("size=512x512&layers=direct", "exr")  # above a quarter of it
    assert large[0] == 200 and not is_remembered(frames.get("size=512x512&layers=direct", "exr"))


def test_the_framed_face_renders_what_it_is_asked_for(frames):
    """Where the report is looked at: a bench asks the same again and again."""
    client = frames.daemon.framed()
    request = bounced_pb2.Envelope(render=bounced_pb2.Render(scene=frames.scene, frame=frame()))
    for _ in range(2):
        report = client.ask(bounced_pb2.Envelope.FromString(request.SerializeToString()))[0].render_reply.report
        assert not report.remembered
    client.close()
