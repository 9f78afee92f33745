"""A conversation with a daemon: requests from any thread, one thread that reads the answers."""
from __future__ import annotations

import threading
from concurrent.futures import Future, InvalidStateError
from typing import Any, Callable, Generic, Sequence, TypeVar

from .errors import Error, Unreachable
from .messages import EVENTS, error_from, pb
from .resume import VERSION, Lost, Reopen, Resumer, hello_of
from .transport import Buffer, Transport

GOODBYE_S = 1.0  # for a peer that reads no more

T = TypeVar("T")
Unit = tuple[bytes, Sequence[Buffer]]  # a header and the pieces of a payload
# An envelope and its payload.
Answer = tuple[Any, memoryview]
OnEvent = Callable[[Any, memoryview], None]


class _Call:
    """What a request waits for. `lasts`: events come behind its answer, until its owner leaves."""

    def __init__(self, unit: Unit, on_event: OnEvent | None,
                 on_gone: Callable[[Error], None] | None, is_bound: bool) -> None:
        self.future: Future[Answer] = Future()
        self.unit: Unit | None = unit  # until it is answered: it may be lost on its way
        self.sent_on = 0  # the connection's generation
        self.on_event = on_event
        self.on_gone = on_gone
        self.is_bound = is_bound
        self.then: Callable[[], None] | None = None

    @property
    def lasts(self) -> bool:
        return self.on_gone is not None

    def end(self, error: Error) -> None:
        """Nothing more comes."""
        self.fail(error)
        if self.on_gone:
            self.on_gone(error)

    def fail(self, error: BaseException) -> None:
        try:
            self.future.set_exception(error)
        except InvalidStateError:
            pass  # it was answered before


class Pending(Generic[T]):
    """A request under way. `result` waits for it; `cancel` asks the daemon to stop."""

    def __init__(self, conn: Connection, request_id: int, future: Future[Answer],
                 read: Callable[[Any, memoryview], T]) -> None:
        self.request_id = request_id
        self._conn = conn
        self._future = future
        self._read = read

    def done(self) -> bool:
        """Whether `result` would return, or raise, at once."""
        return self._future.done()

    def cancel(self) -> None:
        """The request ends with `Cancelled`, unless its answer is on its way already."""
        if not self._future.done():
            self._conn.cancel(self.request_id)

    def result(self, timeout_s: float | None = None) -> T:
        """The answer, or the error that the daemon gave. TimeoutError leaves it under way."""
        return self._read(*self._future.result(timeout_s))

    def wait(self) -> T:
        """The same; whatever interrupts the wait (Ctrl-C) cancels the request."""
        try:
            return self.result()
        finally:
            self.cancel()


class Connection:
    """Speaks `hello` when made. Every request is answered once, by request id.

    reopen    makes another transport to the same daemon, within so many seconds. With it a
              connection that breaks is taken up again (resume.py), for `resume_s` at most (None: as
              long as the daemon waits), while requests, watches and views go on
    why_gone  of a private daemon: why it has ended
    """

    def __init__(self, transport: Transport, token: str | None = None, timeout_s: float = 60,
                 why_gone: Callable[[], Error] | None = None, reopen: Reopen | None = None,
                 resume_s: float | None = None) -> None:
        self.by: str | None = None  # who asks, within the token or user: in edits
        self._transport = transport
        self._why_gone = why_gone
        self._resumer = None if reopen is None or resume_s == 0 else Resumer(reopen, token,
                                                                              resume_s)
        self._lock = threading.Lock()
        self._wire = threading.Lock()  # which transport is in use, and what was sent on it
        self.generation = 1  # of the transport: one more with each that was taken up again
        self._calls: dict[int, _Call] = {}
        self._last_id = 0
        self._gone: Error | None = None
        self._closing = False
        self._ended = threading.Event()
        self._last_id_seen = 0  # by the last look whether the client is silent
        self._reader = threading.Thread(target=self._read_all, name="bounced reader", daemon=True)
        self._reader.start()
        try:
            self.hello = self._shake_hands(token, timeout_s)
        except BaseException:
            self.close()
            raise
        self.limits = {pair.key: int(pair.value) for pair in self.hello.limits}
        if self._resumer:
            self._resumer.greeted(self.hello)
        if why_gone is None and self.limits.get("idle_seconds"):
            # A private daemon waits as long as its client lives; others hang up on the silent.
            threading.Thread(target=self._keep_alive, args=(self.limits["idle_seconds"] / 3,),
                             name="bounced keep-alive", daemon=True).start()

    def _keep_alive(self, pause_s: float) -> None:
        while not self._ended.wait(pause_s):
            with self._lock:
                is_silent = self._last_id == self._last_id_seen
                self._last_id_seen = self._last_id
            if is_silent:
                try:
                    self.start("stats", pb.Stats(), lambda *_: None)
                except Error:
                    return

    def _shake_hands(self, token: str | None, timeout_s: float) -> Any:
        hello = hello_of(token, "" if self._resumer else None)
        pending = self.start("hello", hello, lambda envelope, _: envelope.hello_reply)
        try:
            reply = pending.result(timeout_s)
        except TimeoutError as error:
            raise Unreachable(f"no answer to hello within {timeout_s:g} s", "server") from error
        if reply.version != VERSION:
            raise Unreachable(f"the daemon speaks version {reply.version}", "server")
        return reply

    def start(self, name: str, body: Any, read: Callable[[Any, memoryview], T],
              payload: Sequence[Buffer] = (), on_event: OnEvent | None = None,
              on_gone: Callable[[Error], None] | None = None,
              is_bound: bool = False) -> Pending[T]:
        """Sends the request `name` and returns without waiting.

        read      makes the result of the answer, on the thread that asks for it
        on_event  gets events on the reader's thread; what it raises fails the request
        on_gone   says that events come behind the answer too, until `forget`; is told, on the
                  reader's thread, when the connection ends
        is_bound  to this transport: fails with `Lost` if another one takes its place
        """
        with self._lock:
            if self._gone:
                raise self._gone
            self._last_id += 1
            request_id = self._last_id
            unit = (_header(request_id, name, body), payload)
            call = self._calls[request_id] = _Call(unit, on_event, on_gone, is_bound)
        self._post(call)
        return Pending(self, request_id, call.future, read)

    def call(self, name: str, body: Any, want: str, payload: Sequence[Buffer] = (),
             is_bound: bool = False) -> Any:
        """Sends a request and waits for its answer's body `want`."""
        def read(envelope: Any, _: memoryview) -> Any:
            if envelope.WhichOneof("body") != want:
                raise Unreachable(f"{name} was answered by {envelope.WhichOneof('body')}")
            return getattr(envelope, want)

        return self.start(name, body, read, payload, is_bound=is_bound).wait()

    def tell(self, name: str, body: Any) -> None:
        """Says what needs no answer; nothing if the connection is gone."""
        try:
            with self._wire:
                self._transport.send(_header(0, name, body), ())
        except OSError:
            pass

    def cancel(self, request_id: int) -> None:
        """Asks the daemon to end a request, and does not wait."""
        try:
            self.start("cancel", pb.Cancel(request_id=request_id), lambda *_: None)
        except Error:
            pass  # who is gone has cancelled everything

    def forget(self, request_id: int) -> None:
        """Of a request whose events nobody wants any more."""
        with self._lock:
            self._calls.pop(request_id, None)

    def _post(self, call: _Call) -> None:
        """Sends it on the transport of the moment; once, however often it is posted."""
        try:
            with self._wire:
                unit = call.unit
                if unit is None or call.sent_on == self.generation:
                    return  # the reader was faster, after it took up the connection again
                call.sent_on = self.generation
                self._transport.send(*unit)
        except OSError:
            # The reader finds out: it sends this again on another transport, or fails it. The
            # daemon may also have said why before it closed. A peer that reads no more but keeps
            # silent is left by closing.
            if self._resumer is None and threading.current_thread() is not self._reader:
                self._reader.join(2)
                if self._reader.is_alive():
                    self._transport.close()

    def _read_all(self) -> None:
        while reason := self._read_stream():
            if not self._resume():
                self._end(self._reason(reason))
                break

    def _read_stream(self) -> str | None:
        """Until it breaks: how that looked. None: it has ended, and everything with it."""
        try:
            while unit := self._transport.receive():
                self._take(*unit)
        except Error as reason:
            self._end(reason)
        except OSError as reason:
            return f"the connection broke: {reason}"
        except Exception as reason:  # whatever it is, nobody may wait for ever
            self._end(Unreachable(f"the daemon sent nonsense: {reason!r}", "server"))
        else:
            return "the daemon closed the connection"
        return None

    def _reason(self, seen: str) -> Error:
        """Why the stream ended. A private daemon's end says more than what is seen from here."""
        if self._why_gone is None or self._closing:
            return Unreachable(seen, "server")
        self._transport.close()
        return self._why_gone()

    def _end(self, error: Error) -> None:
        if self._closing:
            error = Unreachable("the connection was closed", "server")
        with self._lock:
            self._gone = error
            calls = list(self._calls.values())
            self._calls.clear()
        self._ended.set()
        for call in calls:
            call.end(error)

    def _resume(self) -> bool:
        """On another transport the session goes on; False if there is none to be had."""
        if self._resumer is None or self._closing:
            return False
        self._transport.close()  # and whoever waits in a send
        with self._lock:
            self._last_id += 1
            request_id = self._last_id
        resumed = self._resumer.resume(request_id)
        if resumed is None:
            return False
        transport, reply = resumed
        with self._wire:
            self._transport = transport
            self.generation += 1
        if self._closing:
            transport.close()
        self._ask_whether_all_is_told(self.generation, frozenset(reply.under_way))
        return True

    def _ask_whether_all_is_told(self, generation: int, under_way: frozenset[int]) -> None:
        """The daemon says its kept answers again, in order, and then answers this."""
        def settle() -> None:
            if generation == self.generation:
                self._settle(under_way)

        with self._lock:
            self._last_id += 1
            request_id = self._last_id
            unit = (_header(request_id, "cancel", pb.Cancel(request_id=0)), ())
            call = self._calls[request_id] = _Call(unit, None, None, True)
            call.then = settle
        self._post(call)

    def _settle(self, under_way: frozenset[int]) -> None:
        """What waits still is under way, or was lost on its way, or ended unheard."""
        with self._lock:
            waiting = [(number, call) for number, call in self._calls.items()
                       if call.sent_on < self.generation and number not in under_way]
            for number, call in waiting:
                if call.is_bound or call.future.done():
                    del self._calls[number]
        for _, call in waiting:
            if call.is_bound:
                call.fail(Lost("the connection broke while this was sent", "server"))
            elif call.future.done():
                call.end(Unreachable("it ended while the connection was broken", "server"))
            else:
                self._post(call)

    def _take(self, header: memoryview, payload: memoryview) -> None:
        envelope = pb.Envelope.FromString(bytes(header))
        body = envelope.WhichOneof("body")
        if body == "error" and not envelope.request_id:
            raise error_from(envelope.error)  # about the stream, which has ended with it
        is_event = body in EVENTS
        with self._lock:
            call = self._calls.get(envelope.request_id)
            if call and not is_event and not (call.lasts and body != "error"):
                del self._calls[envelope.request_id]
        if call is None:
            return  # of a request that was forgotten
        if is_event:
            self._pass_on(call, envelope, payload)
        elif body == "error":
            call.end(error_from(envelope.error))
        else:
            self._answer(call, envelope, payload)

    def _answer(self, call: _Call, envelope: Any, payload: memoryview) -> None:
        call.unit = None
        try:
            call.future.set_result((envelope, payload))
        except InvalidStateError:
            pass  # its progress callback raised, or it was answered before the connection broke
        if call.then:
            call.then()

    def _pass_on(self, call: _Call, envelope: Any, payload: memoryview) -> None:
        if call.on_event is None:
            return
        try:
            call.on_event(envelope, payload)
        except Exception as error:
            call.fail(error)

    def _say_goodbye(self) -> None:
        """The end of a stream alone would leave everything under way, for us to come back."""
        with self._lock:
            left = list(self._calls)
        impatience = threading.Timer(GOODBYE_S, self._transport.close)
        impatience.daemon = True
        impatience.start()
        for request_id in left:
            self.cancel(request_id)
        impatience.cancel()

    def close(self) -> None:
        """Ends the conversation; what is under way fails. More than once is once."""
        if self._resumer and not self._closing:
            self._resumer.stop()
            self._say_goodbye()
        self._closing = True
        self._transport.close()
        if threading.current_thread() is not self._reader:
            self._reader.join()


def _header(request_id: int, name: str, body: Any) -> bytes:
    envelope = pb.Envelope(request_id=request_id)
    getattr(envelope, name).CopyFrom(body)
    # Without a field set, CopyFrom does not choose the body.
    getattr(envelope, name).SetInParent()
    serialized: bytes = envelope.SerializeToString()
    return serialized
