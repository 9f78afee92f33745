"""Arrays into the payload of one message, and into blobs where that is full."""
from __future__ import annotations

from typing import Any

import numpy
from numpy.typing import ArrayLike

from . import due
from .files import Content, content_of

ALIGNMENT_BYTES = 16  # of each array in the payload; more than any number in it needs


def float_array(name: str, values: ArrayLike, width: int) -> numpy.ndarray:
    """n x width, float32 in little-endian order. ValueError names `name`."""
    try:
        array = numpy.ascontiguousarray(values, "<f4")
    except (TypeError, ValueError):
        due.wrong_kind(name, f"an array of n x {width} numbers", values)
    if array.ndim != 2 or array.shape[1] != width:
        raise ValueError(f"{name}: shape {array.shape}, not n x {width}")
    return array


def index_array(name: str, values: ArrayLike) -> numpy.ndarray:
    """Whole numbers, three a triangle: n x 3 or flat."""
    given = numpy.asarray(values)
    if given.size % 3 or (given.ndim == 2 and given.shape[1] != 3) or given.ndim not in (1, 2):
        raise ValueError(f"{name}: shape {given.shape}, not n x 3")
    if given.dtype.kind not in "ui":
        raise ValueError(f"{name}: {given.dtype}, not whole numbers")
    if given.size and not 0 <= given.min() <= given.max() < 1 << 32:
        raise ValueError(f"{name}: from {given.min()} to {given.max()}, not 0 to 2^32 - 1")
    return numpy.ascontiguousarray(given, "<u4")


class Payload:
    """Collects arrays; `place` then decides where each lies."""

    def __init__(self) -> None:
        self._entries: list[tuple[Any, memoryview]] = []

    def add(self, data: Any, array: numpy.ndarray) -> None:
        """`data` is the Data message that will say where the array lies."""
        # A copy: the caller may change his before it is sent.
        self._entries.append((data, memoryview(array.tobytes())))

    def __len__(self) -> int:
        return len(self._entries)

    def place(self, room_bytes: int) -> tuple[list[bytes | memoryview], list[Content]]:
        """Fills the Data messages: (pieces of the payload, contents to be uploaded)."""
        pieces: list[bytes | memoryview] = []
        contents: list[Content] = []
        offset = 0
        for data, view in self._entries:
            size = view.nbytes
            if offset + size > room_bytes:
                content = content_of(bytes(view))
                contents.append(content)
                data.blob = content.blob
                continue
            data.payload, data.offset, data.size_bytes = True, offset, size
            padding = -size % ALIGNMENT_BYTES
            pieces += [view, bytes(padding)]
            offset += size + padding
        return pieces, contents
