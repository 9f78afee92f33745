"""HTTP as bytes: where messages end, what is answered when they make no sense, slow peers."""
import json
import socket
import time

import pytest
from conftest import SCENES, blob_name, read_all
from stopwatch import Stopwatch

HOST = b"Host: 127.0.0.1\r\n"
OCTETS = b"Content-Type: application/octet-stream\r\n"
NEXT = b"GET /healthz HTTP/1.1\r\n" + HOST + b"\r\n"


def status_of(reply):
    assert reply.startswith(b"HTTP/1.1 "), reply[:100]
    return int(reply[9:12])


def assert_one_json_error(reply, status):
    assert status_of(reply) == status, reply
    assert reply.count(b"HTTP/1.1 ") == 1, reply
    head, body = reply.split(b"\r\n\r\n", 1)
    assert b"application/json" in head and b"<html" not in reply.lower()
    assert set(json.loads(body)) == {"code", "message", "details"}


# --- the five behaviours of interface.md ----------------------------------------------------


@pytest.mark.parametrize("headers,status", [
    (b"Content-Length: 5\r\nTransfer-Encoding: chunked\r\n", 400),
    (b"Transfer-Encoding: chunked\r\nContent-Length: 5\r\n", 400),
    (b"Transfer-Encoding: chunked\r\n", 411), (b"Transfer-Encoding: identity\r\n", 411),
    (b"Transfer-Encoding: gzip, chunked\r\n", 411), (b"transfer-encoding:xchunked\r\n", 411),
    (b"Content-Length: 5\r\nContent-Length: 5\r\n", 400),
    (b"Content-Length: 5\r\nContent-Length: 6\r\n", 400),
    (b"Content-Length: 5,5\r\n", 400), (b"Content-Length: -5\r\n", 400),
    (b"Content-Length: +5\r\n", 400), (b"Content-Length: 0x5\r\n", 400),
    (b"Content-Length: 99999999999999999999999\r\n", 400),
])
@pytest.mark.parametrize("method", [b"PUT", b"GET"])
def test_1_ambiguous_lengths_are_refused_and_closed(shared, method, headers, status):
    path = b" /v1/blobs/" + blob_name(b"hello").encode() if method == b"PUT" else b" /healthz"
    request = method + path + b" HTTP/1.1\r\n" + HOST + OCTETS + headers + b"\r\n"
    # What follows must not be taken for a request of its own.
    assert_one_json_error(shared.raw(request + b"5\r\nhello\r\n0\r\n\r\n" + NEXT), status)


@pytest.mark.parametrize("method,path", [(b"PUT", b"/v1/blobs/" + blob_name(b"").encode()),
                                         (b"POST", b"/v1/scenes")])
def test_2_no_length_is_an_empty_body(shared, method, path):
    kind = OCTETS if method == b"PUT" else b"Content-Type: application/json\r\n"
    watch = Stopwatch()
    request = method + b" " + path + b" HTTP/1.1\r\n" + HOST + kind + b"\r\n"
    close = NEXT.replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n")
    reply = shared.raw(request + close)
    assert watch.own_s() < 2
    assert reply.count(b"HTTP/1.1 ") == 2 and reply.endswith(b'{"ok":true}')
    assert status_of(reply) == (201 if method == b"PUT" else 400)


def test_3_expect_continue_is_answered_after_the_checks(shared):
    data = b"expected content"
    path = b"/v1/blobs/" + blob_name(data).encode()

    def ask(headers, length=len(data)):
        sock = socket.create_connection(("127.0.0.1", shared.port), 5)
        sock.sendall(b"PUT " + path + b" HTTP/1.1\r\n" + HOST + headers +
                     b"Expect: 100-continue\r\nContent-Length: %d\r\n\r\n" % length)
        return sock

    with ask(OCTETS) as sock:
        assert sock.recv(100) == b"HTTP/1.1 100 Continue\r\n\r\n"
        sock.sendall(data)
        assert status_of(sock.recv(1000)) == 201
    with ask(OCTETS, 1 << 50) as sock:  # too large: no 100 before the 413
        assert_one_json_error(read_all(sock), 413)
    with ask(b"Content-Type: text/plain\r\n") as sock:
        assert_one_json_error(read_all(sock), 415)
    reply = shared.raw(b"GET /healthz HTTP/1.1\r\n" + HOST + b"Expect: tea\r\nConnection: close\r\n\r\n")
    assert_one_json_error(reply, 417)


def test_3_expect_continue_needs_the_token_first(start):
    daemon = start(token="correct-horse-battery")
    request = (b"PUT /v1/blobs/" + blob_name(b"x").encode() + b" HTTP/1.1\r\n" + HOST + OCTETS +
               b"Expect: 100-continue\r\nContent-Length: 1\r\n\r\n")
    assert_one_json_error(daemon.raw(request), 401)


@pytest.mark.parametrize("data,status", [
    (b"nonsense\r\n\r\n", 400), (b"GET\r\n\r\n", 400), (b"GET / HTTP/9.9\r\n\r\n", 505),
    (b"BREW / HTTP/1.1\r\n\r\n", 400), (b"\x16\x03\x01\x02\x00\x01\x00", 400),
    (b"GET /\x00 HTTP/1.1\r\n\r\n", 400), (b"GET / HTTP/1.1\r\nA B: c\r\n\r\n", 400),
    (b"GET / HTTP/1.1\r\n(x): c\r\n\r\n", 400), (b"GET nowhere HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    (b"GET / HTTP/1.1\r\nHost: a\x01b\r\n\r\n", 400),
    (b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", 400), (b"GET / HTTP/2.0\r\n\r\n", 505),
    (b"GET / HTTP/1.1\r\nHost : 127.0.0.1\r\n\r\n", 400),
    (b"GET /%2e%2e/%2e%2e/etc/passwd HTTP/1.1\r\nConnection: close\r\n" + HOST + b"\r\n", 404),
    (b"GET /../../etc/passwd HTTP/1.1\r\nConnection: close\r\n" + HOST + b"\r\n", 404),
    (b"CONNECT evil:80 HTTP/1.1\r\n" + HOST + b"\r\n", 404),
    (b"GET /v1/scenes HTTP/1.1\r\n" + HOST + HOST + b"Connection: close\r\n\r\n", 400),
    (b"GET /v1/scenes HTTP/1.1\r\nConnection: close\r\n\r\n", 400),
    (b"GET / HTTP/1.1\r\nConnection: close\r\nX: " + b"a" * 40000 + b"\r\n\r\n", 431),
    (b"GET /" + b"a" * 40000 + b" HTTP/1.1\r\n\r\n", 431),
    (b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 20000 + b"\r\n", 431),
])
def test_4_errors_are_our_json(shared, data, status):
    assert_one_json_error(shared.raw(data), status)


def test_4_an_upgrade_is_refused_and_closed(shared):
    for name in (b"websocket", b"h2c", b"tea"):
        reply = shared.raw(b"GET /nope HTTP/1.1\r\n" + HOST + b"Connection: Upgrade\r\nUpgrade: " +
                           name + b"\r\nHTTP2-Settings: AAMAAABkAAQAAP__\r\n\r\n" + NEXT)
        assert_one_json_error(reply, 404)


def test_5_a_large_answer_does_not_hold_up_others(shared):
    scene = shared.add_scene()
    path = b"/v1/scenes/" + scene.encode() + b"/frame.exr?size=2048x2048&layers=direct,normal&technique=direct"
    with socket.create_connection(("127.0.0.1", shared.port), 60) as sock:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
        sock.sendall(b"GET " + path + b" HTTP/1.1\r\n" + HOST + b"Connection: close\r\n\r\n")
        head = sock.recv(200)  # the answer began, and we stop reading
        worst = 0.0
        for _ in range(20):
            start = time.time()
            assert shared.healthy()
            worst = max(worst, time.time() - start)
        assert worst < 5  # who waited for it would wait until we read on
        whole = head + read_all(sock)
    head, body = whole.split(b"\r\n\r\n", 1)
    length = int([line for line in head.split(b"\r\n") if b"Content-Length" in line][0].split()[1])
    assert len(body) == length > 1 << 20


# --- where a head ends: no two readers may differ ---------------------------------------------

GET = b"GET /v1/techniques HTTP/1.1\r\n"


@pytest.mark.parametrize("data, why", [
    (GET + HOST + b"X: a\r\n b\r\n\r\n", "folded"), (GET + HOST + b"X: a\r\n\tb\r\n\r\n", "folded"),
    (GET + b" Host: 127.0.0.1\r\n\r\n", "folded"),
    (GET.replace(b"\r", b"") + HOST + b"\r\n", "carriage return"), (GET + HOST[:-2] + b"\n\r\n", "carriage return"),
    (GET + HOST + b"\n", "carriage return"), (GET + HOST + b"X: a\n\n", "carriage return"),
    (GET + HOST + b"X: a\rY: b\r\n\r\n", "carriage return"), (GET + HOST + b"X: a\r\r\n\r\n", "carriage return"),
    (GET + HOST + b"\rX: a\r\n\r\n", "carriage return"), (b"\nGET / HTTP/1.1\r\n" + HOST + b"\r\n", "carriage return"),
    (GET + HOST + b"Content-Length : 5\r\n\r\nhello", "name"), (GET + HOST + b"Content-Length\t: 5\r\n\r\n", "name"),
    (GET + HOST + b"Content\x00-Length: 5\r\n\r\n", "zero"), (GET + HOST + b"X: a\x00b\r\n\r\n", "zero"),
    (GET + HOST + b": empty\r\n\r\n", "name"), (GET + HOST + b"no colon\r\n\r\n", "name"),
    (GET + HOST + b"nocolon\r\n\r\n", "colon"), (GET + HOST + b"Content-Length\x0b: 5\r\n\r\n", "name"),
    (b"GET /v1/techniques\r\n" + HOST + b"\r\n", ""), (b"GET  /v1/techniques HTTP/1.1\r\n" + HOST + b"\r\n", ""),
    (b"GET /v1/techniques HTTP/1.1 \r\n" + HOST + b"\r\n", ""), (b"GET\t/v1/techniques\tHTTP/1.1\r\n" + HOST + b"\r\n", ""),
])
def test_heads_that_two_could_read_differently(shared, data, why):
    for cut in (len(data), 1, len(data) // 2):
        with socket.create_connection(("127.0.0.1", shared.port), 10) as sock:
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            for at in range(0, len(data), cut) if cut > 1 else range(0, min(len(data), 90)):
                sock.sendall(data[at:at + cut] if cut > 1 or at < 89 else data[at:])
            sock.sendall(NEXT)
            reply = read_all(sock)
        assert_one_json_error(reply, 400)
        assert why in json.loads(reply.split(b"\r\n\r\n", 1)[1])["message"], reply


@pytest.mark.parametrize("body", [
    b"5;ext=1\r\nhello\r\n0\r\n\r\n", b"5;a=\"\r\n\"\r\nhello\r\n0\r\n\r\n", b"5 \r\nhello\r\n0\r\n\r\n",
    b"0x5\r\nhello\r\n0\r\n\r\n", b"5\nhello\n0\n\n", b"fffffffffffffffff\r\n", b"0\r\nTrailer: x\r\n\r\n",
])
@pytest.mark.parametrize("encoding, status", [
    (b"Transfer-Encoding: chunked\r\n", 411), (b"Transfer-Encoding: chunked\r\nContent-Length: 5\r\n", 400),
    (b"Transfer-Encoding: chunked\r\nTransfer-Encoding: identity\r\n", 411),
    (b"Transfer-Encoding: chunked, identity\r\n", 411), (b"Transfer-Encoding:\x0bchunked\r\n", None),
])
def test_chunks_are_never_read(shared, encoding, status, body):
    post = b"POST /v1/scenes HTTP/1.1\r\n" + HOST + b"Content-Type: application/json\r\n"
    reply = shared.raw(post + encoding + b"\r\n" + body + NEXT)
    assert_one_json_error(reply, status or status_of(reply))
    assert status_of(reply) in (400, 411)


def test_an_empty_line_may_come_before_a_request(shared):
    close = NEXT.replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n")
    reply = shared.raw(b"\r\n" + NEXT + b"\r\n\r\n" + close)
    assert reply.count(b"HTTP/1.1 200") == 2


@pytest.mark.parametrize("target, host, status", [
    (b"http://127.0.0.1/v1/techniques", b"127.0.0.1", 200), (b"HTTP://localhost:81/v1/techniques", b"localhost:81", 200),
    (b"https://127.0.0.1/v1/techniques", b"127.0.0.1", 200),
    # Who names the host in the target means that one, whatever stands in the header.
    (b"http://127.0.0.1/v1/techniques", b"evil.example", 200), (b"http://evil.example/v1/techniques", b"127.0.0.1", 403),
    (b"http://user@127.0.0.1/v1/techniques", b"127.0.0.1", 403), (b"http://127.0.0.1", b"127.0.0.1", 200),
    (b"http://127.0.0.1?x=1", b"127.0.0.1", 200), (b"http:///v1/techniques", b"127.0.0.1", 403),
    (b"http://127.0.0.1/v1/techniques", None, 400), (b"ftp://127.0.0.1/v1/techniques", b"127.0.0.1", 404),
    (b"http://127.0.0.1/http://127.0.0.1/v1/techniques", b"127.0.0.1", 404), (b"*", b"127.0.0.1", 404),
])
def test_targets_that_name_their_host(shared, target, host, status):
    header = b"Host: %s\r\n" % host if host else b""
    reply = shared.raw(b"GET " + target + b" HTTP/1.1\r\n" + header + b"Connection: close\r\n\r\n")
    assert status_of(reply) == status or (status == 403 and status_of(reply) == 400), reply
    assert reply.count(b"HTTP/1.1 ") == 1


# --- beyond the five ------------------------------------------------------------------------


def test_pipelined_requests_are_answered_in_order(shared):
    scene = shared.add_scene().encode()
    get = b"GET /v1/scenes/" + scene + b"/frame.json?size=8x8&seed=%d HTTP/1.1\r\n" + HOST + b"%b\r\n"
    data = b"".join(get % (i, b"" if i < 19 else b"Connection: close\r\n") for i in range(20))
    reply = shared.raw(data)
    seeds = [int(part.split(b",")[0]) for part in reply.split(b'"seed":')[1:]]
    assert seeds == list(range(20))


def test_a_request_behind_one_that_was_refused_ends_with_its_peer(start):
    """The refusal comes once the body is on the disk, and the next request begins within it."""
    daemon = start(env={"BD_FAKE_FRAME_MS": "3000"})
    scene = daemon.add_scene().encode()
    with socket.create_connection(("127.0.0.1", daemon.port), 10) as sock:
        sock.sendall(b"POST /v1/render?layers=nope HTTP/1.1\r\n" + HOST + OCTETS +
                     b"Content-Length: 4\r\n\r\nglTFGET /v1/scenes/" + scene +
                     b"/frame.png?size=8x8 HTTP/1.1\r\n" + HOST + b"\r\n")
        assert status_of(sock.recv(4096)) == 400
        time.sleep(0.2)
    until = time.time() + 20
    while daemon.json("GET", "/v1/stats")[1]["jobs_cancelled"] < 1:
        assert time.time() < until, "the frame is rendered for nobody"
        time.sleep(0.05)


def test_a_request_may_come_byte_by_byte(shared):
    with socket.create_connection(("127.0.0.1", shared.port), 5) as sock:
        for byte in NEXT:
            sock.sendall(bytes([byte]))
        assert sock.recv(1000).endswith(b'{"ok":true}')


def test_http_1_0_closes(shared):
    assert shared.raw(b"GET /healthz HTTP/1.0\r\n" + HOST + b"\r\n").endswith(b'{"ok":true}')


def test_refused_bodies_do_not_eat_the_answer(shared):
    """The peer sends on, as most do; the refusal must arrive and not drown in a reset."""
    request = b"POST /v1/scenes HTTP/1.1\r\n" + HOST + b"Content-Type: text/plain\r\n"
    body = b"x" * (4 << 20)
    for _ in range(5):
        reply = shared.raw(request + b"Content-Length: %d\r\n\r\n" % len(body) + body)
        assert_one_json_error(reply, 415)


def test_slow_heads_run_into_their_deadline(start):
    daemon = start("--limit", "header_seconds=1", "--limit", "idle_seconds=2")
    with socket.create_connection(("127.0.0.1", daemon.port), 10) as sock:
        watch = Stopwatch()
        sock.sendall(b"GET /healthz HTTP/1.1\r\n")
        reply = b""
        sock.settimeout(0.1)
        while watch.own_s() < 8:  # a byte every tenth of a second: never silent
            try:
                if piece := sock.recv(4096):
                    reply += piece
                else:
                    break
            except TimeoutError:
                sock.sendall(b"X")
            except ConnectionError:
                break
        assert watch.own_s() < 6 and watch.wall_s() > 0.9
        assert_one_json_error(reply, 408)
        assert b"header_seconds" in reply


def test_silent_connections_are_closed(start):
    daemon = start("--limit", "header_seconds=1", "--limit", "idle_seconds=1")
    for opening in (b"", NEXT):
        with socket.create_connection(("127.0.0.1", daemon.port), 10) as sock:
            sock.sendall(opening)
            watch = Stopwatch()
            read_all(sock)
            assert watch.own_s() < 5 and watch.wall_s() > 0.5
    with socket.create_connection(("127.0.0.1", daemon.port), 10) as sock:
        sock.sendall(b"PUT /v1/blobs/" + blob_name(b"abc").encode() + b" HTTP/1.1\r\n" + HOST +
                     OCTETS + b"Content-Length: 3\r\n\r\na")
        assert_one_json_error(read_all(sock), 408)


def test_a_peer_that_does_not_read_is_let_go(start):
    daemon = start("--limit", "idle_seconds=1")
    scene = daemon.add_scene().encode()
    with socket.create_connection(("127.0.0.1", daemon.port), 10) as sock:
        sock.sendall(b"GET /v1/scenes/" + scene + b"/frame.exr?size=2048x2048&layers=direct,normal&technique=direct"
                     b" HTTP/1.1\r\n" + HOST + b"\r\n")
        until = time.time() + 40
        while time.time() < until:
            if daemon.json("GET", "/v1/stats")[1]["connections"] == 1:
                break  # only the one that asks
            time.sleep(0.2)
        else:
            raise AssertionError("the connection is still there")


def test_a_one_shot_scene_that_is_none(shared):
    glb = (SCENES / "cornell.glb").read_bytes()
    for body in (b"", b"glTF", glb[:100], b"\x00" * 5000):
        reply = shared.raw(b"POST /v1/render HTTP/1.1\r\n" + HOST + OCTETS +
                           b"Connection: close\r\nContent-Length: %d\r\n\r\n" % len(body) + body)
        assert_one_json_error(reply, 400)
