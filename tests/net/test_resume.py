"""Resuming: what a connection that broke leaves, and who may take it over."""
import time

import bounced_pb2
import pytest
from conftest import IS_SANITIZED, frame
from test_views import Client, add_scene, envelope
from ws_client import WebSocket
from stopwatch import Stopwatch


def hello(connection, resume="", token=None):
    message = envelope(hello=bounced_pb2.Hello(min=1, max=1, resume=resume))
    if token:
        message.hello.token = token
    return connection.ask(message)[0].hello_reply


def break_off(client):
    """As a network does that goes away, with no goodbye."""
    connection = client.connection
    if isinstance(connection, WebSocket):
        connection.socket.transport.abort()
    else:
        connection.sock.close()


def framed(daemon, resume="", tcp=False, token=None):
    connection = daemon.framed(tcp=tcp, hello=False)
    return Client(connection), hello(connection, resume, token)


def socket(daemon, resume=""):
    connection = WebSocket(daemon, resume=resume)
    return Client(connection), connection.hello


@pytest.fixture(params=[framed, socket], ids=["framed", "websocket"])
def face(request):
    return request.param


def render(scene, **fields):
    return envelope(render=bounced_pb2.Render(scene=scene, frame=frame(**fields)))


def stats(daemon):
    return daemon.json("GET", "/v1/stats")[1]


def test_no_session_unless_asked_for(shared):
    connection = shared.framed(hello=False)
    assert not connection.hello().hello_reply.HasField("session")
    plain = WebSocket(shared)  # which could say goodbye
    assert len(plain.hello.session) == 64 and not plain.hello.resumed
    client, reply = framed(shared)
    assert len(reply.session) == 64 and not reply.resumed
    assert not framed(shared, "0" * 64)[1].resumed


def test_requests_go_on_and_their_answers_come(start, face):
    daemon = start(env={"BD_FAKE_FRAME_MS": "300"})
    client, reply = face(daemon)
    scene = add_scene(client)
    done = client.connection.send(render(scene))
    late = client.connection.send(render(scene))
    time.sleep(0.1)
    break_off(client)
    time.sleep(0.4)  # one ends with nobody there, one is under way
    client, again = face(daemon, reply.session)
    assert again.resumed and again.session not in ("", reply.session)
    images = {}
    while {done, late} - set(images):
        answer, data = client.connection.receive()
        if answer.HasField("render_reply"):
            images[answer.request_id] = data
    assert all(image.startswith(b"\x89PNG") for image in images.values())
    assert stats(daemon)["jobs_cancelled"] == 0
    # Once the new token was told, which who speaks has heard, the one before is spent.
    client.connection.ask(envelope(scene_list=bounced_pb2.SceneList()))
    assert not face(daemon, reply.session)[1].resumed


def test_an_answer_to_hello_may_be_lost_too(start, face):
    daemon = start(env={"BD_FAKE_FRAME_MS": "1000"})
    client, reply = face(daemon)
    wanted = client.connection.send(render(add_scene(client)))
    time.sleep(0.1)
    break_off(client)
    for _ in range(3):  # resumed by a client that hears nothing of it, and then by one that does
        client, again = face(daemon, reply.session)
        assert again.resumed
        break_off(client)
    client, again = face(daemon, reply.session)
    assert again.resumed and again.under_way == [wanted]


def test_what_arrived_is_told(start, face):
    """So that what was lost on its way, and that alone, can be sent again."""
    daemon = start(env={"BD_FAKE_FRAME_MS": "1000"})
    client, reply = face(daemon)
    assert not reply.under_way and "under_way" in reply.capabilities
    scene = add_scene(client)
    client.connection.ask(envelope(scene_list=bounced_pb2.SceneList()))  # is over: not among them
    watch = client.connection.send(envelope(scene_watch=bounced_pb2.SceneWatch()))
    view = client.connection.send(envelope(view_open=bounced_pb2.ViewOpen(
        scene=scene, frame=frame())))
    wanted = client.connection.send(render(scene))
    time.sleep(0.2)
    break_off(client)
    time.sleep(0.1)
    client, again = face(daemon, reply.session)
    assert sorted(again.under_way) == sorted([watch, view, wanted])


def test_across_faces(start):
    daemon = start(env={"BD_FAKE_FRAME_MS": "200"})
    client, reply = framed(daemon)
    wanted = client.connection.send(render(add_scene(client)))
    break_off(client)
    client, reply = socket(daemon, reply.session)
    assert reply.resumed
    while True:
        answer, data = client.connection.receive()
        if answer.request_id == wanted:
            break
    assert data.startswith(b"\x89PNG")


def test_views_show_one_key_frame(start, face):
    daemon = start(env={"BD_FAKE_FRAME_MS": "5"})
    client, reply = face(daemon)
    scene = add_scene(client)
    views = [client.open(scene, refine=False) for _ in range(2)]
    for _ in views:
        assert client.frame(credit=False)[0].final
    client.move(views[0], 3, sequence=7)
    break_off(client)
    time.sleep(0.3)
    before = stats(daemon)["jobs_done"]
    time.sleep(0.3)
    assert stats(daemon)["jobs_done"] == before  # nothing is rendered for nobody
    client, again = face(daemon, reply.session)
    assert again.resumed
    frames = {}
    while len(frames) < 2:
        event, data = client.connection.receive()
        if event.HasField("view_frame"):
            frames[event.view_frame.view] = event.view_frame
            assert data.startswith(b"\xff\xd8")
    assert set(frames) == set(views) and all(f.final and f.step == 0 for f in frames.values())
    assert frames[views[0]].sequence == 7
    assert all(f.credits == 1 for f in frames.values())  # what was under way is no more
    assert client.silent(0.3)


def test_a_connection_that_only_seems_alive_is_replaced(start):
    daemon = start()
    client, reply = framed(daemon)
    view = client.open(add_scene(client), refine=False)
    second, again = framed(daemon, reply.session)
    assert again.resumed
    event = second.event()[0]
    while not event.HasField("view_frame"):
        event = second.event()[0]
    assert event.view_frame.view == view
    with pytest.raises((EOFError, ConnectionError)):
        while True:
            client.connection.receive()


def test_one_that_changes_hands_does_not_wait(start, face):
    """However few sessions may wait for a connection: this one has its next already."""
    daemon = start("--limit", "resumable_sessions=0", env={"BD_FAKE_FRAME_MS": "2500"})
    client, reply = face(daemon)
    wanted = client.connection.send(render(add_scene(client)))
    time.sleep(0.1)
    second, again = face(daemon, reply.session)
    assert again.resumed and again.under_way == [wanted]
    while True:  # longer than until the memory of sessions that have ended is given back
        answer, data = second.connection.receive()
        if answer.request_id == wanted:
            break
    assert data.startswith(b"\x89PNG")
    break_off(second)
    time.sleep(0.2)
    assert not face(daemon, again.session)[1].resumed


def test_it_ends_after_its_time_or_with_a_goodbye(start):
    daemon = start("--limit", "resume_seconds=1", env={"BD_FAKE_FRAME_MS": "30000"})
    client, reply = framed(daemon)
    scene = add_scene(client)
    client.connection.send(render(scene))
    time.sleep(0.1)
    break_off(client)
    time.sleep(0.3)
    assert stats(daemon)["jobs_cancelled"] == 0
    until = time.time() + 4
    while stats(daemon)["jobs_cancelled"] < 1:
        assert time.time() < until
        time.sleep(0.05)
    assert not framed(daemon, reply.session)[1].resumed
    client, reply = socket(daemon)
    client.connection.send(render(scene))
    time.sleep(0.1)
    client.connection.close()  # says so: nobody comes back
    until = time.time() + 0.8
    while stats(daemon)["jobs_cancelled"] < 2:
        assert time.time() < until
        time.sleep(0.02)
    assert not socket(daemon, reply.session)[1].resumed


def test_only_with_the_same_rights(start):
    daemon = start(token="correct-horse-battery\nanother-horse-staple")
    client, reply = framed(daemon, tcp=True, token="correct-horse-battery")
    break_off(client)
    time.sleep(0.2)
    assert not framed(daemon, reply.session, tcp=True, token="another-horse-staple")[1].resumed
    assert framed(daemon, reply.session, tcp=True, token="correct-horse-battery")[1].resumed


def test_what_is_kept_is_bounded(start):
    daemon = start("--limit", "resume_bytes=1M")
    client, reply = framed(daemon)
    scene = add_scene(client)
    large = dict(size=(512, 512), encoding="half")  # 2 MiB
    answer, data = client.connection.ask(render(scene, **large))
    assert len(data) == 1 << 21 and answer.HasField("render_reply")  # sent, if not kept
    wanted = [client.connection.send(render(scene, **large)) for _ in range(5)]
    break_off(client)
    until = time.time() + 20
    while stats(daemon)["jobs_done"] < 6:
        assert time.time() < until
        time.sleep(0.05)
    time.sleep(1)  # and encoded
    client, again = framed(daemon, reply.session)
    assert again.resumed
    answers = {}
    while set(wanted) - set(answers):
        answer, data = client.connection.receive()
        answers[answer.request_id] = answer
        assert len(data) < 1 << 20
    late = [answers[request] for request in wanted]
    assert all(answer.error.details.field == "resume_bytes" for answer in late), late
    before = daemon.rss_kib()
    for _ in range(30):
        client.connection.ask(render(scene, size=(256, 256), encoding="half"))
    assert IS_SANITIZED or daemon.rss_kib() - before < 16 << 10


def until_jobs_done(daemon, count):
    until = time.time() + 20
    while stats(daemon)["jobs_done"] < count:
        assert time.time() < until
        time.sleep(0.05)
    time.sleep(1)  # and encoded


def answers_again(daemon, token):
    """What is sent again, in order, to who takes the session up."""
    connection = daemon.framed(hello=False)
    assert hello(connection, token).resumed
    connection.next_id = 1 << 20  # none of theirs
    last = connection.send(envelope(cancel=bounced_pb2.Cancel(request_id=0)))
    answers = []
    while True:
        answer, data = connection.receive()
        if answer.request_id == last:
            return answers
        answers.append((answer, data))


LARGE = dict(size=(512, 512), encoding="half")  # 2 MiB


def test_who_has_heard_makes_room_for_who_has_not(start):
    daemon = start("--limit", "resume_bytes=5M", env={"BD_FAKE_FRAME_MS": "300"})
    first, _ = framed(daemon)
    scene = add_scene(first)
    second, reply = framed(daemon)
    for _ in range(2):
        first.connection.ask(render(scene, **LARGE))
    second.connection.next_id = 1000
    wanted = second.connection.send(render(scene, **LARGE))
    time.sleep(0.1)
    break_off(second)
    until_jobs_done(daemon, 3)
    answers = answers_again(daemon, reply.session)
    assert [(a.request_id, len(data)) for a, data in answers] == [(wanted, 1 << 21)]


def test_one_that_is_never_kept_takes_no_others_place(start):
    daemon = start("--limit", "resume_bytes=1M")
    client, reply = framed(daemon)
    scene = add_scene(client)
    client.connection.ask(render(scene, size=(64, 64)))
    small = client.connection.next_id - 1
    client.connection.ask(render(scene, **LARGE))
    break_off(client)
    time.sleep(0.2)
    again = [answer.request_id for answer, _ in answers_again(daemon, reply.session)]
    assert small in again and small + 1 not in again


def test_answers_without_a_payload_are_always_kept(start):
    daemon = start("--limit", "resume_bytes=0", env={"BD_FAKE_FRAME_MS": "30000"})
    client, reply = framed(daemon)
    wanted = client.connection.send(render(add_scene(client), deadline_ms=400))
    time.sleep(0.1)
    break_off(client)
    time.sleep(1)
    answer = answers_again(daemon, reply.session)[-1][0]
    assert (answer.request_id, answer.error.code) == (wanted, "deadline")


def test_what_must_have_arrived_is_not_sent_again(start):
    daemon = start("--limit", "resume_seconds=1")
    client, reply = framed(daemon)
    asked = []
    for pause in (0.1, 1.3, 0.1):
        asked.append(client.connection.send(envelope(scene_list=bounced_pb2.SceneList())))
        client.connection.receive()
        time.sleep(pause)
    break_off(client)
    time.sleep(0.2)
    again = [answer.request_id for answer, _ in answers_again(daemon, reply.session)]
    assert again == asked[2:]


def test_watches_missed_something(start):
    daemon = start()
    client, reply = framed(daemon)
    other = Client(daemon.framed())
    wanted = client.ask(scene_watch=bounced_pb2.SceneWatch()).request_id
    break_off(client)
    time.sleep(0.2)
    add_scene(other)
    client, _ = framed(daemon, reply.session)
    kinds = []
    while "missed" not in kinds:
        event, _ = client.event()
        if event.HasField("scene_event"):
            assert event.request_id == wanted
            kinds.append(event.scene_event.kind)
    assert kinds == ["missed"]


def test_a_drain_waits_for_nobody(start):
    daemon = start(env={"BD_FAKE_FRAME_MS": "30000"})
    client, _ = framed(daemon)
    scene = add_scene(client)
    client.connection.send(render(scene))
    client.open(scene)
    time.sleep(0.1)
    break_off(client)
    time.sleep(0.1)
    watch = Stopwatch()
    daemon.stop()
    assert watch.own_s() < 5
