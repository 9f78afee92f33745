#!/usr/bin/python3
"""bounce, with pictures that are wrong in one way: $SPOIL names it, $HONEST_BOUNCE is the real one.

Stands where $BOUNCE is looked for, so that the harness is tested through all that it does.
"""
import json
import math
import os
import pathlib
import subprocess
import sys
import zlib

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "clients"))

from harness import exr  # noqa: E402
from harness.glb import Glb  # noqa: E402

LIGHT = ("", "direct.", "indirect.", "emission.")


class Picture:
    def __init__(self, planes, scene, report):
        self.planes, self.scene, self.report = planes, scene, report

    def scale(self, factor, layers=LIGHT):
        """factor is a number, or one a pixel."""
        for name in self.planes:
            if any(name == layer + c for layer in layers for c in "RGB"):
                self.planes[name] = (self.planes[name] * factor).astype(numpy.float32)

    def change(self, function):
        for layer in LIGHT:
            for name in (layer + c for c in "RGB"):
                if name in self.planes:
                    self.planes[name] = function(self.planes[name]).astype(numpy.float32)


def swap_channels(picture):
    for layer in LIGHT:
        if layer + "R" in picture.planes:
            planes = picture.planes
            planes[layer + "R"], planes[layer + "G"] = planes[layer + "G"], planes[layer + "R"]


def far_away(picture):
    """What is left of positions in 32 bits."""
    root = picture.scene.doc["nodes"][picture.scene.roots()[0]]
    offset = math.hypot(*root.get("translation", (0, 0, 0)))
    picture.scale(1 + min(offset, 1e8) * 1e-11)


FAULTS = {
    "none": lambda p: None,
    "indirect_times_pi": lambda p: p.scale(math.pi, ("indirect.",)),
    "direct_a_percent_bright": lambda p: p.scale(1.01, ("direct.",)),
    "cosine_twice": lambda p: p.scale(numpy.abs(p.planes.get("normal.Y", 0.9)), ("direct.",)),
    "a_pixel_aside": lambda p: p.change(lambda plane: numpy.roll(plane, 1, axis=1)),
    "channels_swapped": swap_channels,
    "offset": lambda p: p.change(lambda plane: plane + 1e-3),
    "clamped": lambda p: p.change(lambda plane: numpy.minimum(plane, 1)),
    "gamma": lambda p: p.change(lambda plane: numpy.sign(plane) * numpy.abs(plane) ** 1.02),
    "a_length_in_metres": lambda p: p.scale(
        p.planes["depth.Z"].astype(float) / (p.planes["depth.Z"].astype(float) + 1e-3)),
    "by_the_file": lambda p: p.scale(1 + 1e-4 * (zlib.crc32(p.scene.dumps()) % 97)),
    "by_the_axes": lambda p: p.scale(1 + 0.3 * p.planes["normal.X"]),
    "by_the_lights": lambda p: p.scale(1 + 0.01 * p.report["counts"]["lights"]),
    "by_the_triangles": lambda p: p.scale(1 + 0.01 * math.log2(p.report["counts"]["triangles"])),
    "digits_lost_far_away": far_away,
}


def main(words):
    code = subprocess.run([os.environ["HONEST_BOUNCE"], *words], check=False).returncode
    if code != 0 or words[0] != "render":
        return code
    output = pathlib.Path(words[words.index("-o") + 1])
    report = json.loads(pathlib.Path(words[words.index("--report") + 1]).read_text())
    planes, strings = exr.read(output.read_bytes())
    FAULTS[os.environ["SPOIL"]](Picture(planes, Glb.load(words[1]), report))
    output.write_bytes(exr.write(planes, strings))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
