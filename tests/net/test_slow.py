"""Peers that drip: something that never ends though it is never silent, on every face, either way."""
import os
import select
import socket
import struct
import time

import bounced_pb2 as pb
import pytest
from conftest import IS_SANITIZED, pack, read_all
from test_framed import envelope
from test_http_raw import HOST, OCTETS, assert_one_json_error
from test_streams import Stream
from test_websocket import HELLO, Raw, mask, unit

LIMIT = "slow_bytes_per_second"
# After a second of grace a thousand bytes a second are wanted; ten times a second one comes.
LIMITS = ["--limit", "idle_seconds=1", "--limit", LIMIT + "=1000"]
GIVE_UP_S = 30


def drip(socks):
    """A byte of each, ten times a second, until all have been hung up on: the seconds it took."""
    start, ends = time.time(), {}
    while len(ends) < len(socks) and time.time() - start < GIVE_UP_S:
        for sock in set(socks) - set(ends):
            try:
                sock.send(b"x")
            except OSError:
                ends[sock] = time.time() - start
        # What it says before it hangs up; a readable end is an end.
        for sock in select.select(list(set(socks) - set(ends)), [], [], 0.1)[0]:
            ends[sock] = time.time() - start
    assert len(ends) == len(socks), "some were served for ever"
    return ends


def http_body(daemon):
    sock = socket.create_connection(("127.0.0.1", daemon.port), 10)
    sock.sendall(b"PUT /v1/blobs/sha256:" + b"0" * 64 + b" HTTP/1.1\r\n" + HOST + OCTETS +
                 b"Content-Length: 1000000\r\n\r\nabc")
    return sock


def short_body(daemon):
    sock = socket.create_connection(("127.0.0.1", daemon.port), 10)
    sock.sendall(b"POST /v1/scenes HTTP/1.1\r\n" + HOST + OCTETS + b"Content-Length: 100000\r\n\r\n{")
    return sock


def test_what_comes_a_byte_at_a_time(start):
    daemon = start(*LIMITS)
    stream = daemon.framed()
    stream.sock.sendall(struct.pack("<II", 100000, 10))
    web = Raw(daemon, mask(2, unit(HELLO)))
    web.frame()
    web.sock.sendall(mask(2, struct.pack("<I", 50) + b"x" * 100, fin=False)[:60])
    blob, short = http_body(daemon), short_body(daemon)
    socks = [stream.sock, web.sock, blob, short]
    ends = drip(socks)
    assert min(ends.values()) > 0.8, ends
    for sock in (blob, short):
        reply = read_all(sock)
        assert_one_json_error(reply, 408)
        assert LIMIT.encode() in reply
    assert stream.receive()[0].error.details.field == LIMIT
    assert web.close_code() == (1008, "deadline")
    assert daemon.healthy()


def test_what_comes_fast_enough_may_take_its_time(start):
    daemon = start(*LIMITS)
    data = os.urandom(6000)
    client = daemon.framed()
    put = envelope(blob_put=pb.BlobPut(blob="sha256:" + "0" * 64, size_bytes=10000))
    put.request_id = 7
    whole = pack(put, data)
    for at in range(0, len(whole), 250):  # 2,500 bytes a second, for longer than the grace
        client.sock.sendall(whole[at:at + 250])
        time.sleep(0.1)
    assert client.receive()[0].blob_reply.offset == len(data)


def drip_from(daemon, socks, work=lambda: None):
    """Reads a few bytes of each, now and then, until the daemon has let all of them go."""
    start_s = time.time()
    while daemon.json("GET", "/v1/stats")[1]["connections"] > 1:  # the one that asks
        assert time.time() - start_s < GIVE_UP_S, "some were served for ever"
        for sock in socks:
            sock.settimeout(0.01)
            try:
                sock.recv(8)
            except OSError:
                pass
        work()
        time.sleep(0.1)
    return time.time() - start_s


def test_an_answer_that_is_read_a_byte_at_a_time(start):
    daemon = start(*LIMITS)
    scene = daemon.add_scene()
    path = f"/v1/scenes/{scene}/frame.exr?size=1024x1024&layers=direct,normal,albedo,depth"
    plain = socket.socket()
    plain.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    plain.connect(("127.0.0.1", daemon.port))
    plain.sendall(b"GET " + path.encode() + b" HTTP/1.1\r\n" + HOST + b"\r\n")
    assert drip_from(daemon, [plain]) > 0.8
    assert daemon.healthy()


def test_pictures_that_are_read_a_byte_at_a_time(start):
    daemon = start(*LIMITS)
    scene = daemon.add_scene()
    pictures = Stream(daemon, f"/v1/scenes/{scene}/stream.mjpeg?size=700x700", small=True)
    numbers = iter(range(1, 1000))

    def change():  # until the system's own buffers are full, and the daemon's begin to be
        edit = {"ops": [{"set_light": {"light": 0, "intensity": next(numbers)}}],
                "durability": "transient"}
        assert daemon.json("POST", f"/v1/scenes/{scene}/edits", edit)[0] == 200

    assert drip_from(daemon, [pictures.sock], change) > 0.8
    assert daemon.healthy()


def sent_until_it_stops(sock, data):
    """How much of it the daemon takes from a peer that reads nothing."""
    sent, view = 0, memoryview(data)
    sock.settimeout(1)
    try:
        while sent < len(data):
            sent += sock.send(view[sent:sent + 65536])
    except TimeoutError:
        pass
    sock.settimeout(20)
    return sent


def test_requests_end_where_nobody_reads_their_answers(start):
    """However small the answers are, and though what is asked is free."""
    daemon, count = start(), 400000
    client = daemon.framed()
    cancel = envelope(cancel=pb.Cancel(request_id=99))
    cancel.request_id = 7
    unit_bytes = len(pack(cancel))
    before = daemon.rss_kib()
    for _ in range(10):  # at a pace at which no one look finds much that waits
        client.sock.sendall(pack(cancel) * 80)
        time.sleep(0.02)
    sent = 800 * unit_bytes + sent_until_it_stops(client.sock, pack(cancel) * count)
    assert sent < count * unit_bytes / 4
    assert IS_SANITIZED or daemon.rss_kib() - before < 16 << 10
    for _ in range(sent // unit_bytes):
        assert client.receive()[0].HasField("done")
    client.sock.sendall(pack(cancel)[sent % unit_bytes:])
    assert client.receive()[0].HasField("done")


def test_pongs_that_nobody_reads_are_few_bytes(start):
    daemon = start()
    web = Raw(daemon, mask(2, unit(HELLO)))
    web.frame()
    before = daemon.rss_kib()
    sent_until_it_stops(web.sock, mask(9, b"") * 3000000)
    assert IS_SANITIZED or daemon.rss_kib() - before < 64 << 10
    assert daemon.healthy()


def test_any_speed_where_it_is_wanted(start):
    daemon = start("--limit", "idle_seconds=1", "--limit", LIMIT + "=0")
    client = daemon.framed()
    whole = struct.pack("<II", 4 + 60, 60) + b"\0" * 40
    for at in range(0, len(whole), 2):
        client.sock.sendall(whole[at:at + 2])
        time.sleep(0.1)
    with pytest.raises(TimeoutError):  # still patient
        client.sock.settimeout(0.3)
        client.sock.recv(1)
