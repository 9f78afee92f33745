"""Answers that do not end: motion JPEG and server-sent events, and who may ask for them."""
import contextlib
import json
import socket
import time

import bounced_pb2
import pytest
from conftest import IS_SANITIZED, SCENES
from stopwatch import Stopwatch

TOKEN = "correct-horse-battery"


class Stream:
    def __init__(self, daemon, path, headers=None, small=False):
        self.sock = socket.socket()
        if small:
            self.sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        self.sock.settimeout(10)
        self.sock.connect(("127.0.0.1", daemon.port))
        headers = {"Host": f"127.0.0.1:{daemon.port}", **(headers or {})}
        lines = "".join(f"{name}: {value}\r\n" for name, value in headers.items())
        self.sock.sendall(f"GET {path} HTTP/1.1\r\n{lines}\r\n".encode())
        self.data = b""
        self.head = self.until(b"\r\n\r\n").decode()
        self.status = int(self.head[9:12])

    def until(self, end):
        while end not in self.data:
            piece = self.sock.recv(65536)
            if not piece:
                raise EOFError(self.data)
            self.data += piece
        found, self.data = self.data.split(end, 1)
        return found

    def exactly(self, size):
        while len(self.data) < size:
            piece = self.sock.recv(65536)
            if not piece:
                raise EOFError
            self.data += piece
        found, self.data = self.data[:size], self.data[size:]
        return found

    def part(self):
        """The next picture and its headers."""
        if not getattr(self, "begun", False):
            assert self.exactly(11) == b"--bounced\r\n"
            self.begun = True
        head = dict(line.split(": ") for line in self.until(b"\r\n\r\n").decode().split("\r\n"))
        image = self.exactly(int(head["Content-Length"]))
        assert self.exactly(13) == b"\r\n--bounced\r\n"
        return head, image

    def event(self):
        while True:
            text = self.until(b"\n\n").decode()
            if text.startswith("data: "):
                return json.loads(text[6:])
            assert text.startswith(":"), text

    def silent(self, seconds):
        self.sock.settimeout(seconds)
        try:
            return not self.data and not self.sock.recv(1)
        except TimeoutError:
            return True
        finally:
            self.sock.settimeout(10)


def scene_path(scene, rest):
    return f"/v1/scenes/{scene}/{rest}"


# --- motion JPEG ----------------------------------------------------------------------------


def test_pictures_until_the_last(start):
    daemon = start(env={"BD_FAKE_FRAME_MS": "5"})
    scene = daemon.add_scene()
    stream = Stream(daemon, scene_path(scene, "stream.mjpeg?size=24x16&quality=80"))
    assert stream.status == 200 and "multipart/x-mixed-replace; boundary=bounced" in stream.head
    numbers = []
    while True:
        head, image = stream.part()
        assert image.startswith(b"\xff\xd8") and head["Content-Type"] == "image/jpeg"
        numbers.append(int(head["Bounced-Frame"]))
        if head["Bounced-Final"] == "1":
            break
    assert numbers == list(range(1, len(numbers) + 1)) and len(numbers) >= 2
    assert stream.silent(0.3)
    assert daemon.request("DELETE", scene_path(scene, "")[:-1])[0] == 204
    with pytest.raises(EOFError):
        stream.part()


def test_fps_and_its_faults(shared):
    scene = shared.add_scene()
    begin = time.time()
    stream = Stream(shared, scene_path(scene, "stream.mjpeg?fps=10&size=16x16"))
    for _ in range(3):
        stream.part()
    assert time.time() - begin >= 0.2
    for query, status in (("fps=x", 400), ("fps=-1", 400), ("fps=", 400), ("size=0x1", 413),
                          ("nonsense=1", 400), ("encoding=png", 400), ("plan=1", 400)):
        refused = Stream(shared, scene_path(scene, "stream.mjpeg?" + query))
        assert refused.status == status, (query, refused.head)
    assert Stream(shared, scene_path("0123456789abcdef", "stream.mjpeg")).status == 404
    assert shared.request("POST", scene_path(scene, "stream.mjpeg"), "{}",
                          {"Content-Type": "application/json"})[0] == 405


def test_a_viewer_that_leaves_ends_its_view(start):
    daemon = start(env={"BD_FAKE_FRAME_MS": "30000"})
    scene = daemon.add_scene()
    stream = Stream(daemon, scene_path(scene, "stream.mjpeg"))
    time.sleep(0.2)
    assert daemon.json("GET", "/v1/stats")[1]["jobs_running"] == 1
    stream.sock.close()
    until = time.time() + 3
    while daemon.json("GET", "/v1/stats")[1]["jobs_cancelled"] < 1:
        assert time.time() < until
        time.sleep(0.02)


# --- events ---------------------------------------------------------------------------------


def test_events_of_all_and_of_one(shared):
    everything = Stream(shared, "/v1/events")
    assert everything.status == 200 and "text/event-stream" in everything.head
    scene, other = shared.add_scene(), shared.add_scene()
    one = Stream(shared, scene_path(scene, "events"))
    event = everything.event()
    assert (event["scene"], event["kind"], event["revision"]) == (scene, "added", 1)
    assert event["hash"].startswith("sha256:")
    assert everything.event()["scene"] == other
    for gone in (other, scene):
        shared.request("DELETE", scene_path(gone, "")[:-1])
    assert [everything.event()["kind"] for _ in range(2)] == ["removed", "removed"]
    assert one.event()["scene"] == scene and one.silent(0.2)
    assert Stream(shared, scene_path("0123456789abcdef", "events")).status == 404


def test_events_are_kept_alive_and_idle_is_no_fault(start):
    daemon = start("--limit", "idle_seconds=1", "--limit", "keep_alive_seconds=2")
    stream = Stream(daemon, "/v1/events")
    watch = Stopwatch()
    assert stream.until(b"\n\n").startswith(b":")
    assert watch.own_s() < 4 and watch.wall_s() > 1.5
    daemon.add_scene()
    assert stream.event()["kind"] == "added"


def test_a_slow_reader_is_told_that_it_missed_something(start):
    daemon = start("--limit", "requests_per_second=100000", "--limit", "jobs_per_client=128")
    stream = Stream(daemon, "/v1/events", small=True)
    before = daemon.rss_kib()
    client = daemon.framed()
    blob = client.put_blob((SCENES / "cornell.glb").read_bytes())
    add = bounced_pb2.Envelope(scene_add=bounced_pb2.SceneAdd(blob=blob))
    count = 6000  # some 900 KiB of events: more than the sockets' own buffers
    for _ in range(count // 200):
        for _ in range(100):
            client.send(add)
            add.ClearField("request_id")
        for scene in [client.receive()[0].scene.id for _ in range(100)]:
            client.send(bounced_pb2.Envelope(scene_remove=bounced_pb2.SceneRemove(id=scene)))
        assert all(client.receive()[0].HasField("done") for _ in range(100))
    kinds = []
    while "missed" not in kinds:
        kinds.append(stream.event()["kind"])
    assert 0 < len(kinds) < count
    assert IS_SANITIZED or daemon.rss_kib() - before < 64 << 10


# --- who may ask ----------------------------------------------------------------------------


@pytest.mark.parametrize("path", ["/v1/events", "/v1/scenes/{}/events",
                                  "/v1/scenes/{}/stream.mjpeg?size=16x16"])
def test_browser_rules(start, path):
    daemon = start(token=TOKEN)
    path = path.format(daemon.add_scene())
    ours = f"http://127.0.0.1:{daemon.port}"
    bearer = {"Authorization": "Bearer " + TOKEN}
    assert Stream(daemon, path).status == 401
    assert Stream(daemon, path, bearer).status == 200
    assert Stream(daemon, path, {**bearer, "Host": "evil.example"}).status == 403
    assert Stream(daemon, path, {**bearer, "Origin": "http://evil.example"}).status == 403
    assert Stream(daemon, path, {**bearer, "Origin": ours}).status == 200
    _, headers, _ = daemon.request("POST", "/v1/session", "{}", {"Content-Type": "application/json"})
    cookie = headers["Set-Cookie"].split("; ")[0]
    assert Stream(daemon, path, {"Cookie": cookie}).status == 200
    assert Stream(daemon, path, {"Cookie": cookie, "Origin": "http://evil.example"}).status == 403
    assert Stream(daemon, path, {"Cookie": cookie[:-2]}).status == 401


def test_streams_end_with_the_daemon(start):
    daemon = start()
    scene = daemon.add_scene()
    streams = [Stream(daemon, "/v1/events"), Stream(daemon, scene_path(scene, "stream.mjpeg"))]
    watch = Stopwatch()
    daemon.stop()
    assert watch.own_s() < 5
    for stream in streams:
        with contextlib.suppress(EOFError):
            stream.until(b"never")
