"""Views: credits, what wins, better pictures of what is still, ends; watches."""
import time

import bounced_pb2
import pytest
from conftest import IS_SANITIZED, SCENES, blob_name, frame
from ws_client import WebSocket
from stopwatch import Stopwatch


def envelope(**bodies):
    out = bounced_pb2.Envelope()
    for name, body in bodies.items():
        getattr(out, name).CopyFrom(body)
    return out


class Client:
    """One connection of either face, its events kept apart from answers."""

    def __init__(self, connection):
        self.connection = connection
        self.events = []

    def ask(self, **bodies):
        wanted = self.connection.send(envelope(**bodies))
        while True:
            answer, data = self.connection.receive()
            if answer.WhichOneof("body") in ("view_frame", "view_end", "scene_event"):
                self.events.append((answer, data))
            elif answer.request_id == wanted:
                return answer

    def open(self, scene, size=(16, 16), fields=None, **options):
        request = frame(size=size, **(fields or {}))
        answer = self.ask(view_open=bounced_pb2.ViewOpen(scene=scene, frame=request, **options))
        assert answer.HasField("view_reply"), answer
        return answer.view_reply.view

    def event(self):
        return self.events.pop(0) if self.events else self.connection.receive()

    def frame(self, credit=True):
        event, data = self.event()
        assert event.HasField("view_frame"), event
        if credit:
            self.credit(event.view_frame.view)
        return event.view_frame, data

    def credit(self, view, count=1):
        message = envelope(view_credit=bounced_pb2.ViewCredit(view=view, count=count))
        message.request_id = 0
        self.connection.send(message)

    def move(self, view, x, sequence=None):
        pose = bounced_pb2.CameraPose(eye=[x, 1, 5], target=[0, 1, 0])
        update = bounced_pb2.ViewUpdate(view=view, pose=pose)
        if sequence is not None:
            update.sequence = sequence
        answer = self.ask(view_update=update)
        assert answer.HasField("done"), answer

    def silent(self, seconds):
        """True if nothing comes for so long."""
        if self.events:
            return False
        try:
            if isinstance(self.connection, WebSocket):
                self.events.append(self.connection.receive(seconds))
            else:
                self.connection.sock.settimeout(seconds)
                self.events.append(self.connection.receive())
        except (TimeoutError, OSError):
            return True
        finally:
            if not isinstance(self.connection, WebSocket):
                self.connection.sock.settimeout(10)
        return False

    def until_final(self, limit=50):
        frames = []
        while not frames or not frames[-1].final:
            frames.append(self.frame()[0])
            assert len(frames) < limit
        return frames


@pytest.fixture(params=["framed", "websocket"])
def face(request):
    return (lambda daemon: Client(daemon.framed())) if request.param == "framed" else (
        lambda daemon: Client(WebSocket(daemon)))


def add_scene(client):
    data = (SCENES / "cornell.glb").read_bytes()
    put = bounced_pb2.BlobPut(blob=blob_name(data), offset=0, size_bytes=len(data))
    wanted = client.connection.send(envelope(blob_put=put), data)
    answer, _ = client.connection.receive()
    assert answer.request_id == wanted and answer.blob_reply.complete
    return client.ask(scene_add=bounced_pb2.SceneAdd(blob=blob_name(data))).scene.id


def test_a_still_picture_gets_better_and_then_final(start, face):
    client = face(start(env={"BD_FAKE_FRAME_MS": "5"}))
    scene = add_scene(client)
    client.open(scene)
    frames = client.until_final()
    assert [f.number for f in frames] == list(range(1, len(frames) + 1))
    assert [f.step for f in frames] == list(range(len(frames))) and len(frames) >= 2
    # The cheapest parameters, those asked for, sub-frames, then better ones; nothing is taken back on the way.
    aa = [f.report.aa for f in frames]
    assert aa[:6] == [1, 1, 2, 4, 8, 16] and aa == sorted(aa) and aa[6] == 16 and aa[-3:] == [16, 32, 64]
    rungs = [tuple((p.key, p.value) for p in f.report.parameters) for f in frames]
    assert rungs[0] != () and set(rungs[1:6]) == {()} and len(set(rungs[6:])) >= 2 and len(set(zip(aa, rungs, strict=True))) == len(frames)
    vpls = [int(dict(rung).get("vpls", 1024)) for rung in rungs]
    assert vpls == sorted(vpls) and vpls[0] < 1024 < vpls[-1]
    assert [f.why_final.split(":")[0] for f in frames] == [""] * (len(frames) - 1) + ["settled"]
    assert [f.final for f in frames] == [False] * (len(frames) - 1) + [True]
    assert all(f.encoding == "jpg" and f.age_ms > 0 and f.report.revision == 1 for f in frames)
    assert client.silent(0.3)


def test_what_is_decided_by_chance_is_drawn_anew_until_it_settles(start, face):
    """Rounds of 64 sub-frames, for a frame that says how far off it is."""
    def aa_and_why(estimate):
        client = face(start(env={"BD_FAKE_FRAME_MS": "1", "BD_FAKE_ESTIMATE": estimate}))
        client.open(add_scene(client))
        frames = client.until_final()
        return [f.report.aa for f in frames[-7:]], frames[-1].why_final.split(":")[0], len({str(f.report.parameters) for f in frames[-7:]})

    assert aa_and_why("0.0021") == ([64, 128, 256, 512, 1024, 2048, 4096], "top", 1)
    aa, why, _ = aa_and_why("0.0019")
    assert (aa[-1], why) == (64, "settled")


def test_a_first_frame_that_had_to_compile_is_not_the_last(start, face):
    """Shaders are compiled once: what the next frame takes is told by the passes."""
    client = face(start("--limit", "view_refine_seconds=1", env={"BD_FAKE_FRAME_MS": "2", "BD_FAKE_COMPILE_MS": "700"}))
    client.open(add_scene(client))
    frames = client.until_final()
    assert len(frames) > 5 and frames[-1].why_final.startswith("settled:")


def test_a_view_says_that_a_better_picture_would_take_too_long(start, face):
    client = face(start("--limit", "view_refine_seconds=1", env={"BD_FAKE_FRAME_MS": "100"}))
    client.open(add_scene(client))
    frames = client.until_final()
    assert [f.report.aa for f in frames] == [1, 1, 2, 4, 8, 16]  # 16 sub-frames of a rung take 1.6 s
    assert frames[-1].why_final == "time: a better one would take about 1.6 s, limit view_refine_seconds is 1"


def test_a_view_that_is_not_to_be_refined_says_so(start, face):
    client = face(start())
    client.open(add_scene(client), refine=False)
    assert client.until_final()[0].why_final.startswith("refine:")


def test_no_third_frame_without_credit(start, face):
    client = face(start())
    view = client.open(add_scene(client))
    first, second = client.frame(credit=False)[0], client.frame(credit=False)[0]
    assert (first.credits, second.credits) == (1, 0)
    for x in range(5):
        client.move(view, x)
    assert client.silent(0.4)
    client.credit(view)
    third, image = client.frame(credit=False)
    assert third.number == 3 and third.step == 0 and third.replaced == 4 and image
    assert client.silent(0.3)
    client.credit(view, 1000)  # no more than it began with
    assert client.frame(credit=False)[0].credits == 1


def test_the_newest_camera_wins(start, face):
    client = face(start(env={"BD_FAKE_FRAME_MS": "150"}))
    view = client.open(add_scene(client), refine=False)
    assert client.frame()[0].final
    for i in range(1, 11):
        client.move(view, i, sequence=i)
    frames = client.until_final()
    assert frames[-1].sequence == 10 and len(frames) <= 3
    assert sum(f.replaced for f in frames) + len(frames) >= 10


def test_a_camera_that_never_rests_is_still_seen(start, face):
    client = face(start(env={"BD_FAKE_FRAME_MS": "100"}))
    view = client.open(add_scene(client))
    until, moves = time.time() + 3, 0
    while time.time() < until:
        moves += 1
        client.move(view, moves, sequence=moves)
        while client.events:
            event, _ = client.events.pop(0)
            client.events_seen = getattr(client, "events_seen", 0) + 1
            client.credit(event.view_frame.view)
        time.sleep(0.02)
    # At most one frame in two is stopped, and that before half of it: six a second at the least.
    assert client.events_seen >= 12, client.events_seen
    assert client.until_final()[-1].sequence == moves


def test_final_is_said_however_long_the_client_takes(start, face):
    client = face(start())
    client.open(add_scene(client), credits=1)
    numbers = []
    while True:
        time.sleep(0.1)
        shown, _ = client.frame(credit=False)
        numbers.append(shown.number)
        if shown.final:
            break
        client.credit(shown.view)
    assert numbers == list(range(1, len(numbers) + 1))


def test_frames_per_second(start, face):
    client = face(start())
    scene = add_scene(client)
    watch = Stopwatch()
    view = client.open(scene, frames_per_second=10)
    for _ in range(4):
        client.frame()
    assert watch.own_s() < 2 and watch.wall_s() >= 0.3
    answer = client.ask(view_update=bounced_pb2.ViewUpdate(view=view, frames_per_second=-1))
    assert answer.error.details.field == "frames_per_second"


def test_views_take_turns(start):
    daemon = start(env={"BD_FAKE_FRAME_MS": "20"})
    client = Client(daemon.framed())
    scene = add_scene(client)
    views = [client.open(scene, refine=False) for _ in range(4)]
    shown = {view: 0 for view in views}
    until = time.time() + 2
    x = 0
    while time.time() < until:
        x += 1
        for view in views:
            client.move(view, x)
        for event, _ in client.events:
            shown[event.view_frame.view] += 1
            client.credit(event.view_frame.view)
        client.events.clear()
        time.sleep(0.02)
    assert min(shown.values()) > 0.5 * max(shown.values()) > 2, shown


def test_closed_cancelled_and_removed(start, face):
    client = face(start(env={"BD_FAKE_FRAME_MS": "30"}))
    scene = add_scene(client)
    view = client.open(scene)
    assert client.ask(view_close=bounced_pb2.ViewClose(view=view)).HasField("done")
    client.events.clear()
    assert client.silent(0.3)
    assert client.ask(view_close=bounced_pb2.ViewClose(view=view)).error.code == "not_found"
    view = client.open(scene)
    opened = client.connection.next_id - 1
    again = envelope(stats=bounced_pb2.Stats())
    again.request_id = opened  # its events go by that id
    client.connection.send(again)
    while True:
        answer, _ = client.connection.receive()
        if answer.HasField("error"):
            assert answer.error.code == "conflict"
            break
    assert client.ask(cancel=bounced_pb2.Cancel(request_id=opened)).HasField("done")
    client.events.clear()
    assert client.silent(0.3)
    view = client.open(scene)
    client.frame()
    assert client.ask(scene_remove=bounced_pb2.SceneRemove(id=scene)).HasField("done")
    while True:
        event, _ = client.event()
        if event.HasField("view_end"):
            break
    assert event.view_end.view == view and event.view_end.error.code == "not_found"
    assert client.silent(0.2)


@pytest.mark.parametrize("options,fields,field", [
    ({}, dict(check=64), "check"), ({}, dict(plan_only=True), "plan_only"),
    ({}, dict(target_error=5.0), "target_error"), ({}, dict(encoding="none"), "encoding"),
    ({}, dict(size=(0, 5)), "size"), ({}, dict(camera="nobody"), "camera"),
    ({}, dict(technique="nothing"), "technique"), (dict(credits=0), {}, "credits"),
    (dict(credits=17), {}, "credits"), (dict(frames_per_second=float("nan")), {}, "frames_per_second"),
    (dict(scene="0123456789abcdef"), {}, "scene"),
])
def test_bad_views_name_their_field(shared, options, fields, field):
    client = Client(shared.framed())
    scene = add_scene(client)
    request = frame(**fields)
    options = {"scene": scene, **options}
    answer = client.ask(view_open=bounced_pb2.ViewOpen(frame=request, **options))
    assert answer.error.details.field == field, answer


@pytest.mark.parametrize("pose,field", [
    (dict(eye=[0, 0], target=[0, 0, 1]), "pose.eye"), (dict(eye=[0, 0, 0]), "pose.target"),
    (dict(eye=[1, 2, 3], target=[1, 2, 3]), "pose.target"),
    (dict(eye=[0, 0, 0], target=[0, 1, 0]), "pose.up"),
    (dict(eye=[0, 0, 0], target=[0, 0, 1], up=[0, 0, 0]), "pose.up"),
    (dict(eye=[0, 0, 0], target=[0, 0, 1], up=[0, 0, -3]), "pose.up"),
    (dict(eye=[0, float("nan"), 0], target=[0, 0, 1]), "pose.eye"),
    (dict(eye=[0, 0, 2e15], target=[0, 0, 1]), "pose.eye"),
    (dict(eye=[0, 0, 0], target=[0, -1e300, 1]), "pose.target"),
    (dict(eye=[0, 0, 0], target=[0, 0, 1], up=[0, float("inf"), 0]), "pose.up"),
    (dict(eye=[0, 0, 0], target=[0, 0, 1], yfov=3.2), "pose.yfov"),
    (dict(eye=[0, 0, 0], target=[0, 0, 1], yfov=0), "pose.yfov"),
])
def test_bad_poses_name_their_field(shared, pose, field):
    client = Client(shared.framed())
    scene = add_scene(client)
    view = client.open(scene)
    update = bounced_pb2.ViewUpdate(view=view, pose=bounced_pb2.CameraPose(**pose))
    assert client.ask(view_update=update).error.details.field == field
    request = frame()
    request.pose.CopyFrom(update.pose)
    answer = client.ask(view_open=bounced_pb2.ViewOpen(scene=scene, frame=request))
    assert answer.error.details.field == field


def test_limits_of_views(start):
    daemon = start("--limit", "views_per_connection=2", "--limit", "views_per_client=3")
    one, two = Client(daemon.framed()), Client(daemon.framed())
    scene = add_scene(one)
    opening = dict(view_open=bounced_pb2.ViewOpen(scene=scene, frame=frame()))
    first = one.open(scene)
    one.open(scene)
    assert one.ask(**opening).error.details.field == "views_per_connection"
    two.open(scene)
    assert two.ask(**opening).error.details.field == "views_per_client"
    one.ask(view_close=bounced_pb2.ViewClose(view=first))
    two.open(scene)
    one.connection.close()
    two.connection.close()
    three = Client(daemon.framed())
    time.sleep(0.3)
    three.open(scene)
    three.open(scene)


def test_half_floats(shared):
    client = Client(shared.framed())
    client.open(add_scene(client), size=(8, 4), fields=dict(encoding="half"))
    shown, data = client.frame()
    assert shown.encoding == "half" and len(data) == 8 * 4 * 4 * 2
    numpy = pytest.importorskip("numpy")
    pixels = numpy.frombuffer(data, "<f2").reshape(4, 8, 4).astype(float)
    want = (numpy.arange(8)[None, :, None] + numpy.arange(4)[:, None, None] +
            numpy.arange(4)[None, None, :] + 1) * 0.01
    want[..., 3] = 1
    assert numpy.abs(pixels - want).max() < 1e-4


def test_a_frame_that_fails_ends_the_view(start):
    daemon = start(env={"BD_FAKE_FRAME_MS": "60"})
    client = Client(daemon.framed())
    scene = add_scene(client)
    client.open(scene, fields=dict(deadline_ms=10))
    event, _ = client.event()
    assert event.view_end.error.code == "deadline"


def test_a_client_that_reads_nothing_is_not_fed(start):
    daemon = start("--limit", "idle_seconds=6")
    client = Client(daemon.framed())
    scene = add_scene(client)
    view = client.open(scene, size=(512, 512), credits=16, fields=dict(encoding="half"))
    before = daemon.rss_kib()
    peer = Client(daemon.framed())
    for _ in range(300):  # credits without reading
        client.credit(view, 16)
        update = envelope(view_update=bounced_pb2.ViewUpdate(view=view, sequence=1))
        client.connection.send(update)
        time.sleep(0.005)
    grown = daemon.rss_kib() - before
    assert IS_SANITIZED or grown < 64 << 10, grown  # 300 frames would be 600 MiB
    unsent = daemon.json("GET", "/v1/stats")[1]["unsent_bytes"]
    assert 0 < unsent < 16 << 20, unsent
    until = time.time() + 60
    while time.time() < until and daemon.json("GET", "/v1/stats")[1]["connections"] > 2:
        time.sleep(0.1)
    assert daemon.json("GET", "/v1/stats")[1]["connections"] <= 2
    peer.connection.close()


def test_watches(start, face):
    daemon = start()
    client, other = face(daemon), Client(daemon.framed())
    wanted = client.ask(scene_watch=bounced_pb2.SceneWatch())
    assert wanted.HasField("done")
    scene = add_scene(other)
    event, _ = client.event()
    assert event.request_id == wanted.request_id
    assert (event.scene_event.kind, event.scene_event.scene) == ("added", scene)
    assert event.scene_event.revision == 1 and event.scene_event.hash.startswith("sha256:")
    other.ask(scene_remove=bounced_pb2.SceneRemove(id=scene))
    assert client.event()[0].scene_event.kind == "removed"
    assert client.ask(cancel=bounced_pb2.Cancel(request_id=wanted.request_id)).HasField("done")
    add_scene(other)
    assert client.silent(0.2)
    missing = client.ask(scene_watch=bounced_pb2.SceneWatch(scene="0123456789abcdef"))
    assert missing.error.code == "not_found"
