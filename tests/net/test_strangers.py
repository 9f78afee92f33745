"""Strangers: who has shown no token yet, however many they are, take next to nothing."""
import contextlib
import os
import select
import socket
import struct
import time

import bounced_pb2
import pytest
from conftest import ANSWER_S, IS_SANITIZED, Framed, blob_name, pack, read_all
from test_websocket import Raw, mask

TOKEN = "correct-horse-battery"
PROMISE = 8 << 20  # of a message that never ends
CROWD = 40


def unix(daemon):
    sock = socket.socket(socket.AF_UNIX)
    sock.connect(daemon.socket_path)
    return sock


def tcp(daemon):
    return socket.create_connection(("127.0.0.1", daemon.tcp_port))


def web(daemon):
    return socket.create_connection(("127.0.0.1", daemon.port))


def push(socks, first, piece, seconds=1.0):
    """Each sends `first` and then as many pieces as it gets rid of."""
    for sock in socks:
        sock.setblocking(False)
        with contextlib.suppress(OSError):
            sock.send(first)
    until, left = time.time() + seconds, {sock: PROMISE - 65536 for sock in socks}
    while left and time.time() < until:
        for sock in select.select([], list(left), [], 0.05)[1]:
            try:
                left[sock] -= sock.send(piece)
            except OSError:
                left[sock] = 0
            if left[sock] <= 0:
                del left[sock]


def growth_kib(daemon, socks, first, piece=b"x" * 65536):
    before = daemon.rss_kib()
    push(socks, first, piece)
    grown = daemon.rss_kib() - before
    for sock in socks:
        sock.close()
    return grown


FRAMED = struct.pack("<II", 4 + PROMISE, 4)
HOST = b"Host: 127.0.0.1\r\n"
JSON = b"Content-Type: application/json\r\n"
BODY = {
    "length": b"POST /v1/scenes HTTP/1.1\r\n" + HOST + JSON + b"Content-Length: %d\r\n\r\n" % PROMISE,
    "chunked": b"POST /v1/scenes HTTP/1.1\r\n" + HOST + JSON + b"Transfer-Encoding: chunked\r\n\r\n800000\r\n",
    "head": b"GET /v1/scenes HTTP/1.1\r\n" + HOST + b"Cookie: ",
    "pipelined": b"",
}


@pytest.mark.parametrize("face", [unix, tcp])
def test_a_crowd_before_hello(start, face):
    daemon = start(token=TOKEN)
    socks = [face(daemon) for _ in range(CROWD)]
    grown = growth_kib(daemon, socks, FRAMED)
    assert IS_SANITIZED or grown < CROWD * 32, grown
    assert daemon.healthy()


@pytest.mark.parametrize("kind", BODY)
def test_a_crowd_without_a_token(start, kind):
    daemon = start("--limit", "requests_per_second=1000000", token=TOKEN)
    piece = b"x" * 65536
    if kind == "pipelined":  # answers that nobody reads
        one = b"GET /v1/scenes HTTP/1.1\r\n" + HOST + b"\r\n"
        piece = one * (65536 // len(one))
    socks = [web(daemon) for _ in range(CROWD)]
    grown = growth_kib(daemon, socks, BODY[kind], piece)
    assert IS_SANITIZED or grown < CROWD * 96, grown
    assert daemon.healthy()


def test_pongs_that_a_stranger_does_not_read(start):
    daemon = start()
    socks = [Raw(daemon).sock for _ in range(CROWD)]
    ping = mask(0x9, b"p" * 125)
    grown = growth_kib(daemon, socks, b"", ping * (65536 // len(ping)))
    assert IS_SANITIZED or grown < CROWD * 128, grown
    assert daemon.healthy()


@pytest.mark.parametrize("face", [unix, tcp])
def test_a_hello_is_no_longer_than_hello_bytes(start, face):
    daemon = start(token=TOKEN)
    with contextlib.closing(face(daemon)) as sock:
        sock.settimeout(ANSWER_S)
        sock.sendall(struct.pack("<I", 4097))
        error = Framed(sock).receive()[0].error
        assert (error.code, error.details.field) == ("limit", "hello_bytes"), error
        assert "4096" in error.message
        assert sock.recv(1) == b""


@pytest.mark.parametrize("frames", [[4097], [4000, 97], [1] * 3 + [4094]])
def test_nor_on_a_websocket(start, frames):
    daemon = start()
    with contextlib.closing(Raw(daemon).sock) as sock:
        for number, size in enumerate(frames):
            opcode = 0x2 if number == 0 else 0x0
            sock.sendall(mask(opcode, b"\0" * size, fin=number == len(frames) - 1))
        assert b"hello_bytes" in read_all(sock)
    assert daemon.healthy()


def test_what_follows_a_hello_may_be_long(start):
    """In one piece with it, too: a client need not wait."""
    daemon = start(token=TOKEN)
    client = daemon.framed(tcp=True, hello=False)
    hello = bounced_pb2.Envelope(request_id=1)
    hello.hello.token = TOKEN
    data = os.urandom(100000)
    put = bounced_pb2.Envelope(request_id=2)
    put.blob_put.blob, put.blob_put.size_bytes = blob_name(data), len(data)
    client.sock.sendall(pack(hello) + pack(put, data))
    assert client.receive()[0].HasField("hello_reply")
    assert client.receive()[0].blob_reply.complete


def test_a_long_hello_fits(start):
    """With the longest token that the file takes and a session to resume."""
    token = "t" * 1000
    daemon = start(token=token)
    client = daemon.framed(tcp=True, hello=False)
    hello = bounced_pb2.Envelope(request_id=1)
    hello.hello.token, hello.hello.resume = token, "0" * 64
    assert client.ask(hello)[0].HasField("hello_reply")


def test_a_browsers_head_fits(start):
    daemon = start(token=TOKEN)
    headers = {"Cookie": "; ".join(f"other{i}=" + "c" * 200 for i in range(100)), "User-Agent": "u" * 300}
    assert daemon.request("GET", "/v1/scenes", headers=headers)[0] == 200


def test_no_body_is_read_before_the_token_is_looked_at(start):
    daemon = start(token=TOKEN)
    for kind, status in (("length", b"401"), ("chunked", b"411")):
        with contextlib.closing(web(daemon)) as sock:
            sock.settimeout(ANSWER_S)
            sock.sendall(BODY[kind])
            assert sock.recv(4096).startswith(b"HTTP/1.1 " + status)
