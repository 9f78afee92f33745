"""What a film of indirect light should show: each frame from two other grids of many virtual lights.

Both are the VPL reference of 65,536 VPLs a light at every pixel (vpl_reference.c: `rsm` with so many,
summed in double precision), their spots turned about their own axes by 30 and by 60 degrees
(paths.py). A square grid repeats after 90: these two and the one of the techniques that are measured
against them lie as far apart as they can, and share no VPL. What the two have in common is the light;
what one has and the other has not is the error of so many VPLs.

Frames are kept in a folder and are made but once; an interrupted run goes on with the next.
"""
import os
from pathlib import Path

import numpy

import paths
import vpl_reference
from harness.bench.measure import digest

SETTINGS = {"vpls": "65536"}
HALVES_ROLL_DEGREES = (30.0, 60.0)


class Truth:
    """Of one film: `glb` and what moves in it."""

    def __init__(self, build, cache, glb, moving, frames, size, version):
        self.build, self.folder = build, Path(cache)
        self.glb, self.moving, self.frames, self.size = glb, moving, frames, size
        self.hash = digest(glb.dumps(), moving, frames, size, sorted(SETTINGS.items()),
                           HALVES_ROLL_DEGREES, paths.STEP_PER_DIAGONAL, version)
        self.folder.mkdir(parents=True, exist_ok=True)

    def frame(self, number):
        """Both halves, height x width x 3 each."""
        return [self._half(number, half) for half in range(2)]

    def _half(self, number, half):
        file = self.folder / f"film-{self.hash}-{number:03}-{'ab'[half]}.npy"
        if not file.is_file():
            part = file.with_suffix(f".{os.getpid()}.npy")
            numpy.save(part, self._picture(number, half).astype(numpy.float32))
            os.replace(part, file)
        return numpy.load(file).astype(numpy.float64)

    def _picture(self, number, half):
        """Indirect radiance, summed now."""
        scene = self.folder / f"film-{self.hash}-{os.getpid()}.glb"
        records = scene.with_suffix(".bin")
        paths.scene_at(self.glb, self.moving, number, self.frames,
                       HALVES_ROLL_DEGREES[half]).save(scene)
        try:
            vpl_reference.make_records(self.build, scene, records, self.size, 0, 0, SETTINGS)
            _, found = vpl_reference.read_records(records)
        finally:
            scene.unlink()
            records.unlink(missing_ok=True)
        width, height = self.size
        picture = numpy.zeros((height, width, 3))
        picture[found["y"], found["x"]] = found["radiance_cd_m2"]
        return picture
