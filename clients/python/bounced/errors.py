"""What can go wrong, as exceptions.

Faults that the daemon names arrive as `Error` or one of its subclasses, with the daemon's code, the
field at fault and one line for a person. Mistakes that can be seen before anything is sent (an
array of the wrong shape, an option that does not exist) are Python's own ValueError and TypeError.
"""
from __future__ import annotations

from typing import Any

from .text import plain


class Error(Exception):
    """A request that failed.

    code     "usage", "bad_input", "unsupported", "limit", "unauthorized", "forbidden",
             "not_found", "conflict", "busy", "deadline", "cancelled", "device", "device_lost",
             "no_memory", "unreachable", "io", "internal"
    field    the JSON path, option or limit at fault; "" if none is
    message  one line for a person
    report   of a frame that a deadline or a cancel stopped: how far it came; else None
    """

    code = "internal"

    def __init__(self, message: str, field: str = "", code: str | None = None,
                 report: dict[str, Any] | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.field = field
        self.report = report
        if code is not None:
            self.code = code

    def __str__(self) -> str:
        place = f" ({self.field})" if self.field and self.field not in self.message else ""
        return plain(f"{self.code}: {self.message}{place}")


class BadInput(Error):
    """A scene, a picture or an edit that cannot be read or has no meaning."""

    code = "bad_input"


class Unsupported(Error):
    """Understood, and not offered by this daemon."""

    code = "unsupported"


class NotFound(Error):
    """No such scene, revision, name or object."""

    code = "not_found"


class Conflict(Error):
    """The scene has another revision than the edit was made for."""

    code = "conflict"


class Cancelled(Error):
    """Ended because the client asked for it."""

    code = "cancelled"


class Deadline(Error):
    """Not ready in the time that was allowed."""

    code = "deadline"


class Unreachable(Error):
    """No daemon there, or the connection broke, or what came back is no protocol."""

    code = "unreachable"


_CLASSES: dict[str, type[Error]] = {
    kind.code: kind
    for kind in (BadInput, Unsupported, NotFound, Conflict, Cancelled, Deadline, Unreachable)}


def error_of(code: str, message: str, field: str = "",
             report: dict[str, Any] | None = None) -> Error:
    """The exception of a code on the wire."""
    return _CLASSES.get(code, Error)(message, field, code, report)
