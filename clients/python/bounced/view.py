"""Events of a scene, and pictures of it that stay current."""
from __future__ import annotations

import queue
import time
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Callable, Generic, Iterator, TypeVar, Unpack, cast

from . import due
from .conn import Connection
from .errors import Error, Unreachable
from .frame import Frame, FrameOptions, Pose, encoding_of, fill_request, report_of
from .messages import as_dict, error_from, pb
from .types import SceneEvent

T = TypeVar("T")


class Subscription(Generic[T]):
    """What comes behind a request's answer, for one thread that takes it: an iterator, and a
    context manager that ends it. Outside of a `with`, leaving a `for` loop ends it too."""

    def __init__(self, conn: Connection, name: str, body: Any, answer: str,
                 read: Callable[[Any, memoryview], T | None]) -> None:
        self._conn = conn
        self._read = read
        self._news: queue.SimpleQueue[tuple[Any, memoryview] | Error] = queue.SimpleQueue()
        self._held = False
        self._ended: Error | bool = False
        pending = conn.start(name, body, lambda envelope, _: envelope,
                             on_event=lambda envelope, payload: self._news.put((envelope, payload)),
                             on_gone=self._news.put)
        self._request_id = pending.request_id
        try:
            reply = pending.wait()
            if reply.WhichOneof("body") != answer:
                raise Unreachable(f"{name} was answered by {reply.WhichOneof('body')}")
        except BaseException:
            conn.forget(self._request_id)
            raise
        self._answer = getattr(reply, answer)

    def __enter__(self: S) -> S:
        self._held = True
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()

    def __iter__(self) -> Iterator[T]:
        try:
            while (news := self.next()) is not None:
                yield news
        finally:
            if not self._held:
                self.close()

    def next(self, timeout_s: float | None = None) -> T | None:
        """The next one; None once it was closed. TimeoutError if none comes in time."""
        until = None if timeout_s is None else time.monotonic() + timeout_s
        while not self._ended:
            try:
                left = None if until is None else max(0.0, until - time.monotonic())
                unit = self._news.get(timeout=left)
            except queue.Empty:
                raise TimeoutError(f"nothing came within {timeout_s:g} s") from None
            if isinstance(unit, Error):
                self._ended = unit
            elif (news := self._read(*unit)) is not None:
                return news
        if isinstance(self._ended, Error):
            raise self._ended
        return None

    def close(self) -> None:
        """Ends it; what has come and was not taken is dropped. More than once is once."""
        if self._ended:
            return
        self._ended = True
        self._conn.forget(self._request_id)
        self._say_goodbye()
        # A thread that waits in `next` sees the end.
        self._news.put((pb.Envelope(), memoryview(b"")))

    def _say_goodbye(self) -> None:
        self._conn.cancel(self._request_id)


S = TypeVar("S", bound=Subscription[Any])


class Watch(Subscription[SceneEvent]):
    """Events of one scene, or of all: made by `Scene.watch` and `Client.watch`."""

    def __init__(self, conn: Connection, scene: str | None) -> None:
        body = pb.SceneWatch()
        if scene is not None:
            body.scene = scene
        super().__init__(conn, "scene_watch", body, "done", self._read_event)

    @staticmethod
    def _read_event(envelope: Any, _: memoryview) -> SceneEvent | None:
        if envelope.WhichOneof("body") != "scene_event":
            return None
        return cast(SceneEvent, as_dict(envelope.scene_event))


@dataclass(frozen=True)
class ViewFrame(Frame):
    """A frame of a view.

    number     from 1, none skipped
    final      nothing better follows until something changes
    why_final  in words, of a final one: top, settled, time, deadline or refine, and what that means
    step       of the improvement of a still picture, from 0
    sequence   of the last `View.update` that it shows, 0 before the first
    replaced   frames or changes that newer ones replaced since the last
    transient  so many transient batches lie on `report["revision"]`
    age_ms     from the change that it shows to its sending
    """

    number: int = 0
    final: bool = False
    step: int = 0
    sequence: int = 0
    replaced: int = 0
    transient: int = 0
    age_ms: float = 0
    why_final: str = ""


class View(Subscription[ViewFrame]):
    """A picture of a scene that stays current: made by `Scene.view`.

    Frames are taken one at a time. The daemon has at most `credits` under way; one is given back
    when the next frame is asked for, so who is slow gets fewer and newer frames, not older ones.
    """

    def __init__(self, conn: Connection, scene: str, options: FrameOptions, *, credits: int,
                 frames_per_second: float | None, refine: bool) -> None:
        self._options: FrameOptions = options
        self._sequence = 0
        self._owed = 0
        body = pb.ViewOpen(scene=scene)
        due.put(body, "credits", credits)
        due.put(body, "refine", refine)
        fill_request(body.frame, options, "jpeg")
        if frames_per_second is not None:
            due.put(body, "frames_per_second", frames_per_second)
        super().__init__(conn, "view_open", body, "view_reply", self._read_frame)
        self.number: int = self._answer.view

    def next(self, timeout_s: float | None = None) -> ViewFrame | None:
        """The next frame; None once the view was closed. TimeoutError if none comes in time.

        Gives the credit of the frame before it back."""
        self._pay()
        return super().next(timeout_s)

    def _pay(self) -> None:
        if self._owed and not self._ended:
            self._conn.tell("view_credit", pb.ViewCredit(view=self.number, count=self._owed))
        self._owed = 0

    def latest(self, timeout_s: float | None = None) -> ViewFrame | None:
        """As `next`, but passes over frames that have already been followed by another."""
        frame = self.next(timeout_s)
        while frame is not None and not self._news.empty():
            frame = self.next(timeout_s) or frame
        return frame

    def _read_frame(self, envelope: Any, payload: memoryview) -> ViewFrame | None:
        body = envelope.WhichOneof("body")
        if body == "view_end":
            self._conn.forget(self._request_id)
            self._ended = (error_from(envelope.view_end.error)
                           if envelope.view_end.HasField("error") else True)
            return None
        if body != "view_frame":
            return None
        self._owed += 1
        frame = envelope.view_frame
        return ViewFrame(report_of(frame.report), encoding_of(frame, payload), bytes(payload),
                         frame.number, frame.final, frame.step, frame.sequence,
                         frame.replaced, frame.transient, frame.age_ms, frame.why_final)

    def update(self, *, frames_per_second: float | None = None, refine: bool | None = None,
               **options: Unpack[FrameOptions]) -> int:
        """Changes what is named and keeps the rest. Returns a number that the frames which show
        the change carry as `sequence`. `pose=Pose(...)` alone is the common case."""
        body = pb.ViewUpdate(view=self.number, sequence=self._sequence + 1)
        pose = options.get("pose")
        if set(options) == {"pose"} and isinstance(pose, Pose):
            pose.fill(body.pose)
        merged = cast(FrameOptions, {**self._options, **options})
        if "pose" in options:
            merged.pop("camera", None)
        elif "camera" in options:
            merged.pop("pose", None)
        if options and not body.HasField("pose"):
            fill_request(body.frame, merged, "jpeg")
        if frames_per_second is not None:
            due.put(body, "frames_per_second", frames_per_second)
        if refine is not None:
            due.put(body, "refine", refine)
        self._sequence += 1
        self._conn.call("view_update", body, "done")
        self._options = merged
        return self._sequence

    def _say_goodbye(self) -> None:
        try:
            self._conn.start("view_close", pb.ViewClose(view=self.number), lambda *_: None)
        except Error:
            pass  # gone with the connection
