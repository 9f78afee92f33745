"""The WebSocket face: handshake and who may make one, messages in pieces, limits, close codes."""
import base64
import hashlib
import os
import socket
import struct
import time

import bounced_pb2
import pytest
from conftest import SCENES, blob_name, frame, read_all, reload
from websockets.exceptions import ConnectionClosed
from ws_client import WebSocket as Socket, parse, unit

GLB = (SCENES / "cornell.glb").read_bytes()
TOKEN = "correct-horse-battery"


def envelope(**bodies):
    out = bounced_pb2.Envelope()
    for name, body in bodies.items():
        getattr(out, name).CopyFrom(body)
    return out


STATS = envelope(stats=bounced_pb2.Stats())


def stats():
    return envelope(stats=bounced_pb2.Stats())


def handshake(key="dGhlIHNhbXBsZSBub25jZQ==", extra="", host="127.0.0.1", drop=(), **changes):
    headers = {"Host": host, "Upgrade": "websocket", "Connection": "keep-alive, Upgrade",
               "Sec-WebSocket-Key": key, "Sec-WebSocket-Version": "13",
               "Sec-WebSocket-Protocol": "other, bounced.v1"}
    headers.update({name.replace("_", "-"): value for name, value in changes.items()})
    lines = "".join(f"{name}: {value}\r\n" for name, value in headers.items() if name not in drop)
    return f"GET /v1/socket HTTP/1.1\r\n{lines}{extra}\r\n".encode()


def status_of(daemon, data):
    with socket.create_connection(("127.0.0.1", daemon.port), 10) as sock:
        sock.sendall(data)
        return sock.recv(4096)


def mask(opcode, payload, fin=True, masked=True, rsv=0):
    head = bytes([fin << 7 | rsv << 4 | opcode])
    bit = 0x80 if masked else 0
    if len(payload) < 126:
        head += bytes([bit | len(payload)])
    elif len(payload) < 65536:
        head += bytes([bit | 126]) + struct.pack(">H", len(payload))
    else:
        head += bytes([bit | 127]) + struct.pack(">Q", len(payload))
    if not masked:
        return head + payload
    key = os.urandom(4)
    return head + key + bytes(b ^ key[i % 4] for i, b in enumerate(payload))


class Raw:
    """A peer that keeps to nothing."""

    def __init__(self, daemon, first=b""):
        self.sock = socket.create_connection(("127.0.0.1", daemon.port), 10)
        self.sock.sendall(handshake() + first)
        self.data = b""
        while b"\r\n\r\n" not in self.data:
            self.data += self.sock.recv(1)
        assert self.data.startswith(b"HTTP/1.1 101 "), self.data

    def exactly(self, size):
        data = b""
        while len(data) < size:
            piece = self.sock.recv(size - len(data))
            if not piece:
                raise EOFError
            data += piece
        return data

    def frame(self):
        first, second = self.exactly(2)
        assert second < 0x80
        size = second
        if size == 126:
            size = struct.unpack(">H", self.exactly(2))[0]
        elif size == 127:
            size = struct.unpack(">Q", self.exactly(8))[0]
        return first & 15, self.exactly(size)

    def close_code(self):
        """Reads up to the close; what error came before it."""
        code = None
        while True:
            opcode, payload = self.frame()
            if opcode == 8:
                assert self.sock.recv(1) == b""
                return struct.unpack(">H", payload[:2])[0] if payload else None, code
            if opcode == 2:
                code = parse(payload)[0].error.code


HELLO = envelope(hello=bounced_pb2.Hello(min=1, max=1))
HELLO.request_id = 1
STATS.request_id = 2


# --- handshake ------------------------------------------------------------------------------


def test_handshake_of_the_rfc(shared):
    reply = status_of(shared, handshake())
    assert b"Sec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n" in reply
    assert reply.startswith(b"HTTP/1.1 101 ") and b"Sec-WebSocket-Protocol: bounced.v1\r\n" in reply
    key = base64.b64encode(os.urandom(16)).decode()
    accept = hashlib.sha1((key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").encode()).digest()
    assert base64.b64encode(accept) in status_of(shared, handshake(key=key))


@pytest.mark.parametrize("changes,status", [
    (dict(host="evil.example"), 403), (dict(Origin="http://evil.example"), 403),
    (dict(Origin="null"), 403), (dict(drop=("Host",)), 400),
    (dict(drop=("Upgrade",)), 426), (dict(Connection="keep-alive"), 426),
    (dict(Sec_WebSocket_Version="12"), 426), (dict(drop=("Sec-WebSocket-Version",)), 426),
    (dict(key="short"), 400), (dict(key="=" * 24), 400), (dict(drop=("Sec-WebSocket-Key",)), 400),
    (dict(extra="Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"), 400),
    (dict(Sec_WebSocket_Protocol="bounced.v2"), 400), (dict(drop=("Sec-WebSocket-Protocol",)), 400),
])
def test_handshakes_that_are_refused(shared, changes, status):
    reply = status_of(shared, handshake(**changes))
    assert reply.startswith(b"HTTP/1.1 %d " % status), reply
    assert b"application/json" in reply


def test_our_own_pages_may(shared):
    origin = f"http://127.0.0.1:{shared.port}"
    client = Socket(shared, origin=origin)
    assert client.socket.subprotocol == "bounced.v1"
    client.close()


def test_post_is_no_handshake(shared):
    assert shared.request("POST", "/v1/socket", "{}", {"Content-Type": "application/json"})[0] == 405


def test_token_by_header_or_cookie(start):
    daemon = start(token=TOKEN)
    ours = f"http://127.0.0.1:{daemon.port}"
    assert status_of(daemon, handshake()).startswith(b"HTTP/1.1 401 ")
    assert status_of(daemon, handshake(Authorization="Bearer wrong")).startswith(b"HTTP/1.1 401 ")
    Socket(daemon, {"Authorization": "Bearer " + TOKEN})
    cookie = log_in(daemon)
    Socket(daemon, {"Cookie": "a=b; " + cookie}, origin=ours)
    # A cookie goes along with whatever page asks: without our own Origin it opens nothing.
    assert status_of(daemon, handshake(Cookie=cookie)).startswith(b"HTTP/1.1 403 ")
    other = cookie[:-1] + ("0" if cookie[-1] != "0" else "1")
    assert status_of(daemon, handshake(Cookie=other, Origin=ours, host=ours[7:])).startswith(
        b"HTTP/1.1 401 ")
    assert daemon.request("DELETE", "/v1/session", headers={
        "Cookie": cookie, "Authorization": "", "Origin": ours})[0] == 204
    assert status_of(daemon, handshake(Cookie=cookie, Origin=ours, host=ours[7:])).startswith(
        b"HTTP/1.1 401 ")


# --- the cookie -----------------------------------------------------------------------------


def log_in(daemon):
    status, headers, _ = daemon.request("POST", "/v1/session", "{}",
                                        {"Content-Type": "application/json"})
    assert status == 204
    attributes = headers["Set-Cookie"].split("; ")
    assert {"HttpOnly", "SameSite=Strict", "Path=/"} <= set(attributes)
    return attributes[0]


def test_cookie_stands_for_the_token(start):
    daemon = start(token=TOKEN)
    cookie = log_in(daemon)
    ours = f"http://127.0.0.1:{daemon.port}"
    bare = {"Authorization": ""}
    assert daemon.request("GET", "/v1/scenes", headers=bare)[0] == 401
    assert daemon.request("GET", "/v1/scenes", headers={**bare, "Cookie": cookie})[0] == 200
    blob = "/v1/blobs/" + blob_name(b"x")
    octets = {**bare, "Cookie": cookie, "Content-Type": "application/octet-stream"}
    assert daemon.request("PUT", blob, b"x", octets)[0] == 403
    assert daemon.request("PUT", blob, b"x", {**octets, "Origin": "http://evil.example"})[0] == 403
    assert daemon.request("PUT", blob, b"x", {**octets, "Origin": ours})[0] == 201
    # A cookie makes no other cookie, and a wrong token is not mended by one.
    json = {"Content-Type": "application/json", "Cookie": cookie, "Origin": ours}
    assert daemon.request("POST", "/v1/session", "{}", {**json, **bare})[0] == 401
    assert daemon.request("GET", "/v1/scenes",
                          headers={"Cookie": cookie, "Authorization": "Bearer wrong"})[0] == 401
    assert daemon.request("DELETE", "/v1/session", headers={**bare, "Cookie": cookie})[0] == 403
    status, headers, _ = daemon.request("DELETE", "/v1/session",
                                        headers={**bare, "Cookie": cookie, "Origin": ours})
    assert status == 204 and "Max-Age=0" in headers["Set-Cookie"]
    assert daemon.request("GET", "/v1/scenes", headers={**bare, "Cookie": cookie})[0] == 401


def test_cookies_expire_and_are_few(start):
    daemon = start("--limit", "cookies=2", "--limit", "cookie_seconds=2", token=TOKEN)
    first = log_in(daemon)
    time.sleep(0.05)
    others = [log_in(daemon), log_in(daemon)]

    def works(cookie):
        return daemon.request("GET", "/v1/scenes",
                              headers={"Authorization": "", "Cookie": cookie})[0] == 200

    assert [works(cookie) for cookie in [first, *others]] == [False, True, True]
    time.sleep(2.1)
    assert not any(works(cookie) for cookie in others)


# --- messages -------------------------------------------------------------------------------


def test_blob_scene_frame(shared):
    client = Socket(shared)
    put = bounced_pb2.BlobPut(blob=blob_name(GLB), offset=0, size_bytes=len(GLB))
    assert client.ask(envelope(blob_put=put), GLB)[0].blob_reply.complete
    answer, _ = client.ask(envelope(scene_add=bounced_pb2.SceneAdd(blob=blob_name(GLB))))
    scene = answer.scene.id
    answer, image = client.ask(envelope(render=bounced_pb2.Render(scene=scene, frame=frame(aa=1))))
    assert answer.render_reply.encoding == "png" and image.startswith(b"\x89PNG")
    # Larger than one read, and than a length of 16 bits.
    answer, image = client.ask(envelope(render=bounced_pb2.Render(
        scene=scene, frame=frame(size=(256, 256), encoding="exr", exr_raw=True))))
    assert len(image) > 256 * 256 * 16 and image.startswith(b"\x76\x2f\x31\x01")
    client.close()
    assert shared.healthy()


def test_hello_comes_first(shared):
    client = Socket(shared, hello=False)
    answer, _ = client.ask(stats())
    assert answer.error.code == "usage" and answer.error.details.field == "hello"
    with pytest.raises(ConnectionClosed) as closed:
        client.receive()
    assert closed.value.rcvd.code == 1008


def test_fragments_and_pings_between_them(shared):
    message = unit(STATS)
    raw = Raw(shared, mask(2, unit(HELLO)))
    assert parse(raw.frame()[1])[0].hello_reply.version == 1
    raw.sock.sendall(mask(2, message[:1], fin=False))
    raw.sock.sendall(mask(9, b"are you there"))
    assert raw.frame() == (10, b"are you there")
    for byte in message[1:]:
        raw.sock.sendall(mask(0, bytes([byte]), fin=False))
    raw.sock.sendall(mask(0, b""))
    assert parse(raw.frame()[1])[0].HasField("stats_reply")
    raw.sock.sendall(mask(8, struct.pack(">H", 1000)))
    assert raw.close_code() == (1000, None)


@pytest.mark.parametrize("data,code,error", [
    (mask(1, b"text"), 1003, None),
    (mask(2, b"abc"), 1007, "bad_input"),
    (mask(2, struct.pack("<I", 9) + b"short"), 1007, "bad_input"),
    (mask(2, struct.pack("<I", 3) + b"\xff\xff\xff"), 1007, "bad_input"),
    (mask(2, struct.pack("<I", 1 << 30) + b"x"), 1009, "limit"),
    (b"\x82\xff" + struct.pack(">Q", 1 << 40) + b"mask-", 1009, "limit"),
    (mask(2, b"x", masked=False), 1002, None),
    (mask(2, b"x", rsv=4), 1002, None),  # compressed: never agreed to
    (mask(3, b"x"), 1002, None), (mask(0, b"x"), 1002, None),
    # What breaks the frame itself is closed without a code.
    (mask(9, b"x" * 126), None, None), (mask(9, b"x", fin=False), None, None),
    (mask(2, b"x", fin=False) + mask(2, b"x"), 1002, None),
    (mask(8, b"\x03"), None, None), (mask(8, struct.pack(">H", 1005)), 1002, None),
], ids=["text", "short", "cut", "nonsense", "long_header", "long", "unmasked", "compressed", "opcode",
        "continuation", "long_ping", "split_ping", "two_begun", "close_of_1", "close_1005"])
def test_breaches_are_closed_with_their_code(shared, data, code, error):
    raw = Raw(shared)
    raw.sock.sendall(data)
    assert raw.close_code() == (code, error)
    assert shared.healthy()


def test_an_empty_first_fragment(shared):
    """It begins a message of nothing, to which there is nothing to copy."""
    raw = Raw(shared, mask(2, b"", fin=False) + mask(0, b"", fin=False) + mask(0, unit(HELLO)))
    assert parse(raw.frame()[1])[0].HasField("hello_reply")
    raw.sock.sendall(mask(2, b"", fin=False) + mask(0, unit(STATS)))
    assert parse(raw.frame()[1])[0].HasField("stats_reply")
    raw.sock.close()


def test_a_message_in_pieces_is_bounded_too(start):
    daemon = start("--limit", "message_bytes=4096")
    raw = Raw(daemon, mask(2, unit(HELLO)))
    raw.frame()
    piece = mask(2, struct.pack("<I", 100) + b"x" * 2000, fin=False)
    raw.sock.sendall(piece + mask(0, b"x" * 2000, fin=False))
    raw.sock.sendall(mask(0, b"x" * 2000, fin=False))
    assert raw.close_code() == (1009, "limit")


def test_a_limit_lowered_under_a_message(start, tmp_path):
    config = tmp_path / "conf"
    config.write_text("limit message_bytes=65536\n")
    daemon = start("--config", str(config))
    raw = Raw(daemon, mask(2, unit(HELLO)))
    raw.frame()
    raw.sock.sendall(mask(2, struct.pack("<I", 100) + b"x" * 8000, fin=False))
    raw.sock.sendall(mask(9, b""))
    assert raw.frame()[0] == 10  # what was sent before has been read
    config.write_text("limit message_bytes=4096\n")
    reload(daemon)
    raw.sock.sendall(mask(0, b"x" * 2000, fin=False))
    assert raw.close_code() == (1009, "limit")


def test_silent_peers(start):
    daemon = start("--limit", "header_seconds=1", "--limit", "idle_seconds=2")
    half = socket.create_connection(("127.0.0.1", daemon.port), 10)
    half.sendall(handshake()[:-2])
    mute = Raw(daemon)  # makes the handshake, says no hello
    dead = Raw(daemon, mask(2, unit(HELLO)))  # says hello, answers no ping
    dead.frame()
    assert read_all(half).startswith(b"HTTP/1.1 408 ")
    assert mute.close_code() == (1008, "deadline")
    opcodes = []
    with pytest.raises((EOFError, ConnectionError)):
        while True:
            opcodes.append(dead.frame()[0])
    assert 9 in opcodes
    assert daemon.healthy()


def test_pings_are_no_hello(start):
    daemon = start("--limit", "header_seconds=1")
    raw = Raw(daemon)
    until, opcode, payload = time.time() + 6, None, b""
    while opcode != 8:
        assert time.time() < until, "a peer that says no hello is served for ever"
        raw.sock.sendall(mask(9, b"still here"))
        time.sleep(0.2)
        opcode, payload = raw.frame()
        if opcode == 2:
            assert parse(payload)[0].error.details.field == "header_seconds"
    assert struct.unpack(">H", payload[:2])[0] == 1008


def test_a_peer_that_answers_pings_may_be_silent(start):
    """A ping itself is no reason to end, either."""
    daemon = start("--limit", "idle_seconds=2")
    peer = Raw(daemon, mask(2, unit(HELLO)))
    peer.frame()
    for _ in range(4):  # one a second
        opcode, payload = peer.frame()
        assert opcode == 9
        peer.sock.sendall(mask(10, payload))
    assert peer.sock.fileno() >= 0 and daemon.healthy()


def test_pings_that_are_answered_keep_it_open(start):
    daemon = start("--limit", "idle_seconds=2", env={"BD_FAKE_FRAME_MS": "4500"})
    scene = daemon.add_scene()
    client = Socket(daemon)
    answer, image = client.ask(envelope(render=bounced_pb2.Render(scene=scene, frame=frame(aa=1))))
    assert answer.HasField("render_reply") and image


def test_drain_says_going_away(start):
    daemon = start()
    client = Socket(daemon)
    daemon.process.terminate()
    with pytest.raises(ConnectionClosed) as closed:
        client.receive()
    assert closed.value.rcvd.code == 1001


def test_a_peer_that_leaves_takes_its_jobs_with_it(start):
    daemon = start(env={"BD_FAKE_FRAME_MS": "30000"})
    scene = daemon.add_scene()
    client = Socket(daemon)
    client.send(envelope(render=bounced_pb2.Render(scene=scene, frame=frame(aa=1))))
    time.sleep(0.1)
    client.close()
    until = time.time() + 2
    while daemon.json("GET", "/v1/stats")[1]["jobs_cancelled"] < 1:
        assert time.time() < until
        time.sleep(0.02)


def test_compression_is_not_agreed_to(shared):
    client = Socket(shared, compression="deflate")
    assert client.socket.extensions == []
    client.close()


def test_floods_of_pings_and_handshakes(shared):
    raw = Raw(shared, mask(2, unit(HELLO)))
    raw.frame()
    raw.sock.sendall(mask(9, b"") * 2000)
    assert [raw.frame() for _ in range(2000)] == [(10, b"")] * 2000
    before = shared.open_files()
    halves = [socket.create_connection(("127.0.0.1", shared.port), 10) for _ in range(50)]
    for half in halves:
        half.sendall(handshake()[:60])
        half.close()
    time.sleep(0.2)
    assert shared.open_files() <= before + 2
    assert shared.healthy()
