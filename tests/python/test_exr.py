"""The EXR reader: what it makes of a file, and that no byte of one can lead it astray."""
import random
import struct
import sys

import bounced
import numpy
import pytest
from bounced import exr
from conftest import HERE

sys.path.append(str(HERE / "../../clients"))
from harness import exr as harness_exr  # noqa: E402


def planes():
    random_numbers = numpy.random.default_rng(1)
    return {name: random_numbers.normal(size=(3, 5)).astype(numpy.float32)
            for name in ("A", "B", "G", "R", "depth.Z", "half_a.direct.B", "half_a.direct.G",
                         "half_a.direct.R", "normal.X", "normal.Y", "normal.Z")}


def test_reads_what_an_independent_writer_wrote():
    written = planes()
    data = harness_exr.write(written, {"technique": "rsm"})
    read, strings = exr.read(data)
    assert read.keys() == written.keys() and strings == {"technique": "rsm"}
    for name, plane in written.items():
        assert (read[name] == plane).all() and read[name].dtype == numpy.float32
    layers = exr.layers(read)
    assert {name: layer.shape for name, layer in layers.items()} == {
        "beauty": (3, 5, 4), "depth": (3, 5), "half_a.direct": (3, 5, 3), "normal": (3, 5, 3)}
    assert (layers["beauty"][..., 0] == written["R"]).all()
    assert (layers["beauty"][..., 3] == written["A"]).all()
    assert (layers["normal"][..., 1] == written["normal.Y"]).all()


def test_channels_of_sixteen_bits(scene):
    frame = scene.render(size=(7, 3), exr_half=True, layers=["depth"])
    full = scene.render(size=(7, 3), layers=["depth"])
    assert len(frame.data) < len(full.data)
    numpy.testing.assert_allclose(frame.rgba, full.rgba, rtol=1e-3)


def test_every_shortened_file_is_refused():
    data = harness_exr.write(planes())
    for size in range(len(data)):
        with pytest.raises(bounced.Unreachable):
            exr.read(data[:size])
    with pytest.raises(bounced.Unreachable):
        exr.read(data + b"\0")


def test_damaged_files_are_read_or_refused_and_nothing_else():
    data = harness_exr.write(planes(), {"name": "value"})
    numbers = random.Random(2)
    refused = 0
    for _ in range(4000):
        damaged = bytearray(data)
        for _ in range(numbers.randint(1, 4)):
            damaged[numbers.randrange(len(data) - 700)] = numbers.randrange(256)
        try:
            read, _ = exr.read(bytes(damaged))
            assert all(plane.shape == (3, 5) for plane in read.values())
        except bounced.Unreachable:
            refused += 1
    assert refused > 1000


@pytest.mark.parametrize("place", range(3))
def test_lines_come_in_order(place):
    """Each in the table, in its own head, and with its length."""
    data = harness_exr.write(planes())
    table = len(data) - 3 * (8 + 8 + 5 * 4 * len(planes()))
    at = (table + 8, table + 3 * 8, table + 3 * 8 + 4)[place]
    number = int.from_bytes(data[at:at + 4], "little") + 1
    with pytest.raises(bounced.Unreachable, match="out of order"):
        exr.read(data[:at] + number.to_bytes(4, "little") + data[at + 4:])


@pytest.mark.parametrize("place,value,why", [
    (b"dataWindow\0box2i\0\x10\0\0\0", struct.pack("<4i", 0, 0, 1 << 20, 1 << 20), "dataWindow"),
    (b"dataWindow\0box2i\0\x10\0\0\0", struct.pack("<4i", 0, 0, 4, -2), "dataWindow"),
    (b"compression\0compression\0\1\0\0\0", b"\3", "compressed"),
    (b"channels\0chlist\0", struct.pack("<i", 1 << 30), "beyond"),
])
def test_lengths_are_not_believed(place, value, why):
    data = harness_exr.write(planes())
    at = data.index(place) + len(place)
    with pytest.raises(bounced.Unreachable, match=why):
        exr.read(data[:at] + value + data[at + len(value):])
