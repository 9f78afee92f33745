"""A session that goes on after its connection broke: another transport, and `hello` with the
session's token (protocol/manual.md, HelloReply). What then becomes of requests is in conn.py."""
from __future__ import annotations

import threading
import time
from typing import Any, Callable

from .errors import Error, Unreachable
from .messages import error_from, pb
from .transport import NobodyThere, Transport

VERSION = 1  # of the protocol
CLIENT_NAME = "bounced-python/0.1"
ATTEMPT_S = 5.0  # for one transport, and for its hello
PAUSES_S = (0.05, 0.1, 0.2, 0.4, 0.8, 1.6)  # between attempts; the last one again and again

# Makes another transport to the same daemon, within so many seconds.
Reopen = Callable[[float], Transport]


class Lost(Unreachable):
    """It was under way when the connection broke, and has no meaning on another one."""


def hello_of(token: str | None, resume: str | None) -> Any:
    hello = pb.Hello(min=VERSION, max=VERSION, client=CLIENT_NAME)
    if token is not None:
        hello.token = token
    if resume is not None:
        hello.resume = resume
    return hello


class Resumer:
    """`resume` runs on the reader's thread, `stop` on any."""

    def __init__(self, reopen: Reopen, token: str | None, patience_s: float | None) -> None:
        self._reopen = reopen
        self._token = token
        self._patience_s = patience_s
        self._session = ""
        self._stopped = threading.Event()
        self._trying: Transport | None = None

    def greeted(self, reply: Any) -> None:
        """What the first hello was answered. A daemon that does not say which requests arrived
        gives no session worth having: they could be carried out twice."""
        limit = next((int(pair.value) for pair in reply.limits if pair.key == "resume_seconds"), 0)
        self._patience_s = min(limit, limit if self._patience_s is None else self._patience_s)
        self._session = reply.session if "under_way" in reply.capabilities else ""

    def stop(self) -> None:
        """No further attempt; one that is under way ends."""
        self._stopped.set()
        if self._trying is not None:
            self._trying.close()

    def resume(self, request_id: int) -> tuple[Transport, Any] | None:
        """A transport that the session goes on with, and the answer to its hello, which had this
        id; None if there is none in time, or the daemon has forgotten the session."""
        until = time.monotonic() + (self._patience_s or 0)
        attempt = 0
        while self._session and not self._stopped.is_set():
            left = until - time.monotonic()
            if left <= 0:
                return None
            try:
                return self._attempt(request_id, min(left, ATTEMPT_S))
            except NobodyThere:
                return None
            except Error as error:
                if error.code not in ("unreachable", "busy"):
                    return None
            self._stopped.wait(min(left, PAUSES_S[min(attempt, len(PAUSES_S) - 1)]))
            attempt += 1
        return None

    def _attempt(self, request_id: int, timeout_s: float) -> tuple[Transport, Any] | None:
        transport = self._trying = self._reopen(timeout_s)
        impatience = threading.Timer(timeout_s, transport.close)
        impatience.daemon = True
        impatience.start()
        try:
            reply = self._greet(transport, request_id)
        except Error:
            transport.close()
            raise
        except Exception as error:  # nonsense, too: the reader's thread has to go on
            transport.close()
            raise Unreachable(f"the connection broke: {error!r}", "server") from error
        finally:
            impatience.cancel()
            self._trying = None
        if not reply.resumed:
            transport.close()
            return None
        self._session = reply.session
        return transport, reply

    def _greet(self, transport: Transport, request_id: int) -> Any:
        envelope = pb.Envelope(request_id=request_id, hello=hello_of(self._token, self._session))
        transport.send(envelope.SerializeToString(), ())
        unit = transport.receive()
        if unit is None:
            raise Unreachable("the daemon closed the connection", "server")
        answer = pb.Envelope.FromString(bytes(unit[0]))
        if answer.WhichOneof("body") == "error":
            raise error_from(answer.error)
        return answer.hello_reply
