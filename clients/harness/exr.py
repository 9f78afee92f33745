"""Reads the EXR files that bounced writes: scan lines, float or half, ZIP; writes plain ones. Shares no
code with it.

The layout is that of the OpenEXR file format: magic, version, attributes, offset table, chunks of
16 lines. ZIP is deflate over bytes that were split in two halves and then delta-coded.
"""
import struct
import zlib

import numpy

LINES_PER_CHUNK = {b"\x00": 1, b"\x03": 16}  # stored as it is, ZIP
LONG_NAMES = 0x400  # beside the version: some name has more than 31 letters


def _text(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def _header(data):
    magic, version = struct.unpack_from("<II", data)
    assert magic == 20000630 and version & ~LONG_NAMES == 2, "not a plain scan-line EXR"
    attributes, at = {}, 8
    while data[at]:
        name, at = _text(data, at)
        kind, at = _text(data, at)
        (size,) = struct.unpack_from("<i", data, at)
        attributes[name] = (kind, data[at + 4:at + 4 + size])
        at += 4 + size
    return attributes, at + 1


def _channels(value):
    channels, at = [], 0
    while value[at]:
        name, at = _text(value, at)
        (kind,) = struct.unpack_from("<i", value, at)
        channels.append((name, {1: numpy.float16, 2: numpy.float32}[kind]))
        at += 16
    return channels


def _unzip(packed, size):
    if len(packed) == size:  # stored as it is where deflate did not help
        return packed
    deltas = numpy.frombuffer(zlib.decompress(packed), numpy.uint8).astype(numpy.int64)
    deltas[1:] -= 128
    halves = numpy.cumsum(deltas).astype(numpy.uint8)
    out = numpy.empty(size, numpy.uint8)
    out[0::2] = halves[:(size + 1) // 2]
    out[1::2] = halves[(size + 1) // 2:]
    return out.tobytes()


def read(data):
    """(planes by channel name as float32 arrays of height x width, strings by attribute name)"""
    attributes, at = _header(data)
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"][1])
    width, height = right - left + 1, bottom - top + 1
    lines = LINES_PER_CHUNK[attributes["compression"][1]]
    channels = _channels(attributes["channels"][1])
    planes = {name: numpy.empty((height, width), numpy.float32) for name, _ in channels}
    row_bytes = sum(numpy.dtype(kind).itemsize for _, kind in channels) * width
    offsets = struct.unpack_from(f"<{-(-height // lines)}Q", data, at)
    for offset in offsets:
        first, packed_size = struct.unpack_from("<ii", data, offset)
        rows = min(lines, height - (first - top))
        chunk = _unzip(data[offset + 8:offset + 8 + packed_size], rows * row_bytes)
        place = 0
        for row in range(first - top, first - top + rows):
            for name, kind in channels:
                planes[name][row] = numpy.frombuffer(chunk, kind, width, place)
                place += numpy.dtype(kind).itemsize * width
    strings = {n: v.decode() for n, (kind, v) in attributes.items() if kind == "string"}
    return planes, strings


def layer(planes, name):
    """height x width x 3 of one layer."""
    prefix = "" if name == "beauty" else name + "."
    return numpy.stack([planes[prefix + c] for c in "RGB"], axis=-1)


def _attribute(name, kind, value):
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value


def write(planes, strings=None):
    """Bytes of a file: float planes by channel name, alike in shape; uncompressed."""
    names = sorted(planes)
    height, width = planes[names[0]].shape
    channels = b"".join(name.encode() + b"\0" + struct.pack("<iB3xii", 2, 0, 1, 1)
                        for name in names) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    header = b"".join((
        struct.pack("<II", 20000630, 2),
        _attribute("channels", "chlist", channels), _attribute("compression", "compression", b"\0"),
        _attribute("dataWindow", "box2i", window), _attribute("displayWindow", "box2i", window),
        _attribute("lineOrder", "lineOrder", b"\0"),
        _attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
        _attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
        _attribute("screenWindowWidth", "float", struct.pack("<f", 1)),
        *(_attribute(key, "string", value.encode()) for key, value in (strings or {}).items()),
        b"\0"))
    rows = numpy.stack([numpy.asarray(planes[name], "<f4") for name in names], axis=1)
    size = 4 * width * len(names)
    first = len(header) + 8 * height
    offsets = struct.pack(f"<{height}Q", *(first + y * (8 + size) for y in range(height)))
    chunks = (struct.pack("<ii", y, size) + rows[y].tobytes() for y in range(height))
    return header + offsets + b"".join(chunks)
