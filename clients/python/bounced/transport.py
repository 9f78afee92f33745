"""Whole units over a connected socket: a header and a payload at a time.

A transport has `send(header, payload)`, from any thread; `receive()`, on one thread, which gives
None at the stream's end; and `close()`, which ends a `receive` that waits.
"""
from __future__ import annotations

import os
import socket
import struct
import threading
from typing import Protocol, Sequence, Union

import numpy

from . import due
from .errors import Error, Unreachable

Buffer = Union[bytes, bytearray, memoryview]


class NobodyThere(Unreachable):
    """No daemon serves a socket of this machine: it has ended, and all its sessions with it."""


class Transport(Protocol):
    def send(self, header: bytes, payload: Sequence[Buffer]) -> None: ...

    def receive(self) -> tuple[memoryview, memoryview] | None: ...

    def close(self) -> None: ...


class StreamTransport:
    """The framed stream: u32 total | u32 header_len | header | payload, little-endian."""

    def __init__(self, sock: socket.socket) -> None:
        self._sock = sock
        self._send_lock = threading.Lock()

    def send(self, header: bytes, payload: Sequence[Buffer] = ()) -> None:
        size = sum(memoryview(piece).nbytes for piece in payload)
        prefix = struct.pack("<II", 4 + len(header) + size, len(header))
        with self._send_lock:
            self._sock.sendall(prefix + header)
            for piece in payload:
                self._sock.sendall(piece)

    def receive(self) -> tuple[memoryview, memoryview] | None:
        prefix = self._exactly(8, may_end=True)
        if prefix is None:
            return None
        total, header_len = struct.unpack("<II", prefix)
        if header_len > total - 4:
            raise Unreachable(f"the daemon sent nonsense: a header of {header_len} bytes in a "
                              f"unit of {total}")
        rest = self._exactly(total - 4)
        assert rest is not None
        return rest[:header_len], rest[header_len:]

    def _exactly(self, size: int, may_end: bool = False) -> memoryview | None:
        """None if the stream ends before the first byte and may."""
        # Pages of it are real once they are written to: memory grows with what arrives.
        view = memoryview(numpy.empty(size, numpy.uint8).data)
        used = 0
        while used < size:
            got = self._sock.recv_into(view[used:])
            if got == 0 and used == 0 and may_end:
                return None
            if got == 0:
                raise ConnectionResetError("the daemon closed it in the middle of a unit")
            used += got
        return view

    def close(self) -> None:
        close_socket(self._sock)


def close_socket(sock: socket.socket) -> None:
    """Closes it for whoever waits in it, too."""
    try:
        sock.shutdown(socket.SHUT_RDWR)
    except OSError:
        pass  # the peer was faster
    sock.close()


def default_path() -> str | None:
    """Where a daemon without --listen waits; None without $XDG_RUNTIME_DIR."""
    folder = os.environ.get("XDG_RUNTIME_DIR", "")
    return os.path.join(folder, "bounced.sock") if folder.startswith("/") else None


def connect_unix(path: str, timeout_s: float) -> socket.socket:
    sock = socket.socket(socket.AF_UNIX)
    sock.settimeout(timeout_s)
    try:
        sock.connect(path)
    except OSError as error:
        sock.close()
        is_gone = isinstance(error, (ConnectionRefusedError, FileNotFoundError))
        raise (NobodyThere if is_gone else Unreachable)(
            f"cannot reach unix:{path}: {error.strerror or error}", "server") from error
    sock.settimeout(None)
    return sock


def split_host_port(text: str, address: str) -> tuple[str, int]:
    """HOST:PORT or [HOST]:PORT."""
    host, colon, port = text.rpartition(":")
    if host.startswith("[") and host.endswith("]"):
        host = host[1:-1]
    if not colon or not host or not port.isdecimal() or int(port) > 65535:
        raise Error(f"{address}: tcp:HOST:PORT", "server", "usage")
    return host, int(port)


def connect_tcp(host: str, port: int, timeout_s: float) -> socket.socket:
    try:
        sock = socket.create_connection((host, port), timeout_s)
    except OSError as error:
        raise Unreachable(f"cannot reach {host}:{port}: {error.strerror or error}",
                          "server") from error
    sock.settimeout(None)
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return sock


def open_transport(address: str | None, token: str | None, timeout_s: float) -> Transport:
    """Connects to an address as `bounced.connect` takes it."""
    if address is None:
        path = default_path()
        if path is None:
            raise Unreachable("no daemon: XDG_RUNTIME_DIR is not set; name an address", "server")
        return StreamTransport(connect_unix(path, timeout_s))
    scheme, _, rest = due.text("address", address).partition(":")
    if scheme == "unix" and rest:
        return StreamTransport(connect_unix(rest, timeout_s))
    if scheme == "tcp":
        return StreamTransport(connect_tcp(*split_host_port(rest, address), timeout_s))
    if scheme in ("http", "https", "ws", "wss"):
        from .websocket import open_websocket  # python3-websockets is needed here alone
        return open_websocket(address, token, timeout_s)
    raise Error(f"{address}: unix:PATH, tcp:HOST:PORT or http://HOST:PORT", "server", "usage")
