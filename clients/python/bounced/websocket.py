"""The framed transport over a WebSocket: each binary message is u32 header_len | header | payload.

Debian's python3-websockets does the protocol; sockets and threads are ours, so that this transport
behaves as the others do.
"""
from __future__ import annotations

import collections
import socket
import ssl
import struct
import threading
from typing import Any, Sequence
from urllib.parse import urlsplit

from .errors import Error, Unreachable, error_of
from .transport import Buffer, close_socket, connect_tcp

PATH = "/v1/socket"
SUBPROTOCOL = "bounced.v1"
READ_BYTES = 1 << 18
_CODES = {400: "usage", 401: "unauthorized", 403: "forbidden", 404: "not_found", 429: "busy"}


def _protocol_of(url: str) -> Any:
    """A protocol without sockets; its class has another name since websockets 11."""
    try:
        from websockets import client
        from websockets.uri import parse_uri
    except ImportError as error:
        raise Unreachable("http:// addresses need Debian's python3-websockets; unix: and tcp: do "
                          "not", "server") from error
    kind = getattr(client, "ClientProtocol", None) or getattr(client, "ClientConnection")
    return kind(parse_uri(url), subprotocols=[SUBPROTOCOL], max_size=None)


class WebSocketTransport:
    """Made by open_websocket.

    The protocol object is guarded by `_state_lock`, for moments only. Bytes leave through an outbox
    that whoever holds `_send_lock` empties: the reader answers pings and must not wait for a
    writer whose peer waits for the reader.
    """

    def __init__(self, sock: socket.socket, protocol: Any) -> None:
        self._sock = sock
        self._protocol = protocol
        self._state_lock = threading.Lock()
        self._send_lock = threading.Lock()
        self._outbox: collections.deque[bytes] = collections.deque()
        self._pieces: list[bytes] = []
        self._messages: collections.deque[bytes] = collections.deque()

    def shake_hands(self, token: str | None) -> None:
        request = self._protocol.connect()
        if token is not None:
            request.headers["Authorization"] = f"Bearer {token}"
        self._protocol.send_request(request)
        self._collect_output()
        self._empty_outbox(wait=True)
        response = None
        while response is None:
            data = self._sock.recv(READ_BYTES)
            if data:
                self._protocol.receive_data(data)
            else:
                self._protocol.receive_eof()
            events = self._protocol.events_received()
            response = events.pop(0) if events else None
            if response is None and not data:
                raise Unreachable("the server closed the connection during the handshake")
            self._sort(events)
        self._check(response)

    def _check(self, response: Any) -> None:
        problem = self._protocol.handshake_exc
        if problem is not None and response.status_code != 101:
            raise error_of(_CODES.get(response.status_code, "unreachable"),
                           f"the server answered {response.status_code} "
                           f"{response.reason_phrase} instead of opening a WebSocket")
        if problem is not None:
            raise Unreachable(f"no WebSocket: {problem}")
        if self._protocol.subprotocol != SUBPROTOCOL:
            raise Unreachable(f"the server does not speak {SUBPROTOCOL}")

    def send(self, header: bytes, payload: Sequence[Buffer] = ()) -> None:
        message = b"".join((struct.pack("<I", len(header)), header, *payload))
        with self._state_lock:
            if self._protocol.state.name != "OPEN":
                raise BrokenPipeError("the WebSocket is closed")
            self._protocol.send_binary(message)
            self._outbox.extend(self._protocol.data_to_send())
        self._empty_outbox(wait=True)

    def receive(self) -> tuple[memoryview, memoryview] | None:
        while not self._messages:
            data = self._sock.recv(READ_BYTES)
            if not data or not self._take(data):
                return None
        message = memoryview(self._messages.popleft())
        header_len = int.from_bytes(message[:4], "little")
        if len(message) < 4 or header_len > len(message) - 4:
            raise Unreachable(f"the daemon sent nonsense: a header of {header_len} bytes in a "
                              f"message of {len(message)}")
        return message[4:4 + header_len], message[4 + header_len:]

    def _take(self, data: bytes) -> bool:
        """False once the peer closed and nothing more is to be read."""
        with self._state_lock:
            self._protocol.receive_data(data)
            events = self._protocol.events_received()
            self._outbox.extend(self._protocol.data_to_send())
            is_open = self._protocol.state.name == "OPEN"
        self._sort(events)
        self._empty_outbox(wait=False)
        if self._protocol.parser_exc is not None:
            raise Unreachable(f"the daemon sent nonsense: {self._protocol.parser_exc}")
        return is_open or bool(self._messages)

    def _sort(self, events: list[Any]) -> None:
        """Joins the pieces of messages; pings and pongs are the protocol's own business."""
        for frame in events:
            if frame.opcode.name not in ("CONT", "TEXT", "BINARY"):
                continue
            self._pieces.append(frame.data)
            if frame.fin:
                self._messages.append(b"".join(self._pieces))
                self._pieces.clear()

    def _collect_output(self) -> None:
        with self._state_lock:
            self._outbox.extend(self._protocol.data_to_send())

    def _empty_outbox(self, wait: bool) -> None:
        while self._outbox and self._send_lock.acquire(blocking=wait):
            try:
                while self._outbox:
                    data = self._outbox.popleft()
                    if data:  # an empty one asks for half a close, which close() does wholly
                        self._sock.sendall(data)
            finally:
                self._send_lock.release()

    def close(self) -> None:
        try:
            with self._state_lock:
                if self._protocol.state.name == "OPEN":
                    self._protocol.send_close(1000)
                self._outbox.extend(self._protocol.data_to_send())
            self._empty_outbox(wait=False)
        except OSError:
            pass  # the peer is gone: nobody to say goodbye to
        close_socket(self._sock)


def open_websocket(address: str, token: str | None, timeout_s: float) -> WebSocketTransport:
    """Connects to http://HOST:PORT; https:// goes through TLS with the system's certificates."""
    url = urlsplit(address)
    secure = url.scheme in ("https", "wss")
    try:
        host, port = url.hostname, url.port or (443 if secure else 80)
    except ValueError:
        host, port = None, 0
    if not host:
        raise Error(f"{address}: http://HOST:PORT", "server", "usage")
    path = url.path.rstrip("/") or PATH
    named = f"[{host}]" if ":" in host else host
    protocol = _protocol_of(f"{'wss' if secure else 'ws'}://{named}:{port}{path}")
    sock = connect_tcp(host, port, timeout_s)
    try:
        sock.settimeout(timeout_s)  # for the handshakes: that of TLS, too
        if secure:
            sock = ssl.create_default_context().wrap_socket(sock, server_hostname=host)
        transport = WebSocketTransport(sock, protocol)
        transport.shake_hands(token)
        sock.settimeout(None)
    except (OSError, EOFError) as error:
        sock.close()
        raise Unreachable(f"cannot reach {address}: {error}", "server") from error
    except Error:
        sock.close()
        raise
    return transport
