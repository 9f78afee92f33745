"""Reads the EXR files that a daemon writes on `exr_raw`: scan lines, not compressed.

Strict: what is not exactly such a file is refused, and no length in it is believed. The layout is
the OpenEXR file format's: magic, version, attributes, offset table, one chunk a line.
"""
from __future__ import annotations

import struct

import numpy
from numpy.typing import NDArray

from .errors import Unreachable

_KINDS: dict[int, numpy.dtype] = {1: numpy.dtype("<f2"), 2: numpy.dtype("<f4")}
_SIDE_PX_MAX = 32768
_ORDERS = ("RGBA", "RGB", "XYZ")

Planes = dict[str, NDArray[numpy.float32]]


def _refuse(why: str) -> Unreachable:
    return Unreachable(f"no plain EXR as the daemon writes on exr_raw: {why}")


def _text(data: bytes, at: int, limit: int = 256) -> tuple[str, int]:
    end = data.find(b"\0", at, at + limit)
    if end < 0:
        raise _refuse("a name without an end")
    return data[at:end].decode("utf-8", "replace"), end + 1


def _attributes(data: bytes) -> tuple[dict[str, tuple[str, bytes]], int]:
    """By name: (kind, value); and where the offset table begins."""
    if data[:8] != struct.pack("<II", 20000630, 2):
        raise _refuse("magic or version")
    out: dict[str, tuple[str, bytes]] = {}
    at = 8
    while True:
        name, at = _text(data, at)
        if not name:
            return out, at
        kind, at = _text(data, at)
        size = int.from_bytes(data[at:at + 4], "little")
        at += 4
        if at + size > len(data):
            raise _refuse(f"attribute {name} beyond the end")
        out[name] = kind, data[at:at + size]
        at += size


def _value(attributes: dict[str, tuple[str, bytes]], name: str, kind: str) -> bytes:
    found = attributes.get(name)
    if found is None or found[0] != kind:
        raise _refuse(f"no {kind} {name}")
    return found[1]


def _channels(value: bytes) -> list[tuple[str, numpy.dtype]]:
    """Names and kinds, in the file's order."""
    out: list[tuple[str, numpy.dtype]] = []
    at = 0
    while True:
        name, at = _text(value, at)
        if not name:
            return out
        if at + 16 > len(value):
            raise _refuse("a channel beyond its list")
        kind, _, x_step, y_step = struct.unpack_from("<iB3xii", value, at)
        if kind not in _KINDS or (x_step, y_step) != (1, 1):
            raise _refuse(f"channel {name}")
        out.append((name, _KINDS[kind]))
        at += 16


def _size(attributes: dict[str, tuple[str, bytes]]) -> tuple[int, int]:
    window = _value(attributes, "dataWindow", "box2i")
    if len(window) != 16:
        raise _refuse("dataWindow")
    left, top, right, bottom = struct.unpack("<4i", window)
    width, height = right - left + 1, bottom - top + 1
    if (left, top) != (0, 0) or not (0 < width <= _SIDE_PX_MAX and 0 < height <= _SIDE_PX_MAX):
        raise _refuse(f"dataWindow {left},{top} {right},{bottom}")
    return width, height


def _lines(data: bytes, at: int, height: int, line_bytes: int) -> NDArray[numpy.uint8]:
    """height x line_bytes, once table and chunks are what they must be: one after the other."""
    first = at + 8 * height
    if len(data) != first + height * (8 + line_bytes):
        raise _refuse(f"{len(data)} bytes where {first + height * (8 + line_bytes)} belong")
    offsets = numpy.frombuffer(data, "<u8", height, at)
    rows = numpy.frombuffer(data, numpy.uint8, offset=first).reshape(height, 8 + line_bytes)
    heads = numpy.ascontiguousarray(rows[:, :8]).view("<i4")
    number = numpy.arange(height, dtype=numpy.uint64)
    if not ((offsets == first + number * numpy.uint64(8 + line_bytes)).all() and
            (heads[:, 0] == number).all() and (heads[:, 1] == line_bytes).all()):
        raise _refuse("lines out of order")
    return rows[:, 8:]


def read(data: bytes) -> tuple[Planes, dict[str, str]]:
    """(planes by channel name, height x width float32; string attributes by name)."""
    attributes, at = _attributes(data)
    if _value(attributes, "compression", "compression") != b"\0":
        raise _refuse("it is compressed")
    width, height = _size(attributes)
    channels = _channels(_value(attributes, "channels", "chlist"))
    lines = _lines(data, at, height, sum(kind.itemsize for _, kind in channels) * width)
    planes: Planes = {}
    place = 0
    for name, kind in channels:
        part = numpy.ascontiguousarray(lines[:, place:place + kind.itemsize * width])
        planes[name] = part.view(kind).astype(numpy.float32, copy=False)
        place += kind.itemsize * width
    strings = {name: value.decode("utf-8", "replace")
               for name, (kind, value) in attributes.items() if kind == "string"}
    return planes, strings


def layers(planes: Planes) -> dict[str, NDArray[numpy.float32]]:
    """Planes put together by layer: "indirect.R", ".G", ".B" are "indirect", height x width x 3; a
    layer of one channel is height x width. The nameless one is "beauty"."""
    groups: dict[str, dict[str, NDArray[numpy.float32]]] = {}
    for name, plane in planes.items():
        layer, _, channel = name.rpartition(".")
        groups.setdefault(layer or "beauty", {})[channel] = plane
    return {layer: _join(group) for layer, group in groups.items()}


def _join(group: dict[str, NDArray[numpy.float32]]) -> NDArray[numpy.float32]:
    if len(group) == 1:
        return next(iter(group.values()))
    order = next((order for order in _ORDERS if set(order) == set(group)), sorted(group))
    return numpy.stack([group[channel] for channel in order], axis=-1)
