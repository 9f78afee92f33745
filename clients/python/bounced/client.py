"""A daemon to talk to: `connect` and `private`."""
from __future__ import annotations

from types import TracebackType
from typing import Any, Unpack

from . import due
from .conn import Connection, Pending
from .frame import Frame, FrameOptions, render_request
from .files import PathLike
from .messages import as_dict, pb
from .private import PrivateDaemon
from .resume import Reopen
from .scene import Environment, OnProgress, Scenes, send_file, start_render
from .transport import StreamTransport, Transport, open_transport
from .view import Watch


class Client:
    """A connection to one daemon, from any thread. Close it, or use it as a context manager.

    scenes        what the daemon holds
    capabilities  names of what it can do
    limits        every limit, by name
    build         its version
    device        what it renders on: name, class, software
    """

    def __init__(self, transport: Transport, token: str | None = None, timeout_s: float = 60,
                 daemon: PrivateDaemon | None = None, reopen: Reopen | None = None,
                 resume_s: float | None = None, by: str | None = None) -> None:
        self._daemon = daemon
        self._conn = Connection(transport, token, timeout_s, daemon.reason if daemon else None,
                                reopen, resume_s)
        hello = self._conn.hello
        self._principal: str = hello.author
        self.by = by
        self.scenes = Scenes(self._conn)
        self.capabilities = list(hello.capabilities)
        self.limits = dict(self._conn.limits)
        self.build: str = hello.build
        self.device: dict[str, Any] = as_dict(hello.device)

    @property
    def by(self) -> str | None:
        """Who does what this client does, of those whom the token or user stands for."""
        return self._conn.by

    @by.setter
    def by(self, name: str | None) -> None:
        self._conn.by = None if name is None else due.text("by", name)

    @property
    def author(self) -> str:
        """Whose the edits are that this client makes: as in the log."""
        return self._principal + (f" {self.by}" if self.by else "")

    def __enter__(self) -> Client:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Ends the connection, and the daemon if it is a private one. What is under way fails."""
        self._conn.close()
        if self._daemon is not None:
            self._daemon.end()

    def render(self, file: PathLike, *, environment: Environment | None = None,
               progress: OnProgress | None = None, **options: Unpack[FrameOptions]) -> Frame:
        """One frame of a file, which the daemon forgets after it. Options: `FrameOptions`."""
        request = self._file_request(file, environment, progress, options)
        return start_render(self._conn, request, progress).wait()

    def render_later(self, file: PathLike, *, environment: Environment | None = None,
                     progress: OnProgress | None = None,
                     **options: Unpack[FrameOptions]) -> Pending[Frame]:
        """The same without waiting for the frame; the file is sent before it returns."""
        request = self._file_request(file, environment, progress, options)
        return start_render(self._conn, request, progress)

    def _file_request(self, file: PathLike, environment: Environment | None,
                      progress: OnProgress | None, options: FrameOptions) -> Any:
        request = render_request(options, progress is not None)
        send_file(self._conn, file, environment, request)
        return request

    def watch(self) -> Watch:
        """Events of all scenes, from now on."""
        return Watch(self._conn, None)

    def techniques(self) -> list[dict[str, Any]]:
        """What frames can be rendered with: model, parameters with ranges, tolerances."""
        reply = self._conn.call("techniques", pb.Techniques(), "techniques_reply")
        return [as_dict(technique) for technique in reply.techniques]

    def devices(self) -> list[dict[str, Any]]:
        """What could be rendered on; the one in use first."""
        reply = self._conn.call("devices", pb.Devices(), "devices_reply")
        return [as_dict(device) for device in reply.devices]

    def stats(self) -> dict[str, Any]:
        """Jobs, memory (MiB), connections."""
        return as_dict(self._conn.call("stats", pb.Stats(), "stats_reply"))


def connect(address: str | None = None, token: str | None = None, timeout_s: float = 60,
            resume_s: float | None = None, by: str | None = None) -> Client:
    """Connects to a daemon that runs.

    address    "unix:PATH", "tcp:HOST:PORT", "http://HOST:PORT" (a WebSocket on the daemon's HTTP
               port; https:// through a proxy); None: the socket of this user's daemon,
               $XDG_RUNTIME_DIR/bounced.sock
    token      where the daemon asks for one
    timeout_s  for the connection and the daemon's first word; requests wait as long as they take
    resume_s   a connection that breaks is taken up again, and tried for so long before what is under
               way fails; None: as long as the daemon keeps the session (its limit resume_seconds,
               30); 0: not at all
    by         who does what this client does, of those whom the token or user stands for: in log and
               events, and whose edits `undo` takes back. 1 to 64 bytes
    """
    def reopen(within_s: float) -> Transport:
        return open_transport(address, token, within_s)

    return Client(reopen(timeout_s), token, timeout_s, None, reopen, resume_s, by)


def private(device: str | None = None, limits: dict[str, int] | None = None,
            timeout_s: float = 60, by: str | None = None) -> Client:
    """Starts a daemon of one's own over a socket pair; it ends with the client.

    device  "auto" (default), "software", "egl:N", "uuid:HEX", "pci:ID"
    limits  by name, as `bounced --limit`
    by      as for `connect`

    The executable is $BOUNCED, or lies near this package, or on PATH. What it logs goes to standard
    error.
    """
    daemon = PrivateDaemon(device, limits)
    try:
        return Client(StreamTransport(daemon.sock), None, timeout_s, daemon, by=by)
    except BaseException:
        daemon.end()
        raise
