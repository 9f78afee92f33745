"""Scenes that nobody chose, for counting how often a spot check is right on what it has not seen.

usage: random_scenes.py COUNT FOLDER [--first N]

Scene N is a function of N alone: a room (closed, with a window, or an open court), lamps of every kind and
emissive panels, some of them where the camera does not look; furniture of boxes, spheres and poles thinner than
a pixel; materials from rough to mirror, metals, checkers. Written as FOLDER/random_N.glb.
"""
import argparse
import math
import sys
from pathlib import Path

import numpy as np

from harness import shapes
from harness.gltf import Writer


def sphere(radius, rings=10):
    """(positions, normals, indices, uv)."""
    positions, uv = [], []
    for i in range(rings + 1):
        for j in range(2 * rings + 1):
            theta, phi = math.pi * i / rings, math.pi * j / rings
            positions.append((math.sin(theta) * math.cos(phi), math.cos(theta), math.sin(theta) * math.sin(phi)))
            uv.append((j / (2 * rings), i / rings))
    width = 2 * rings + 1
    indices = [(a, a + 1, a + width + 1) for i in range(rings) for j in range(2 * rings)
               for a in [i * width + j]]
    indices += [(a, a + width + 1, a + width) for i in range(rings) for j in range(2 * rings)
                for a in [i * width + j]]
    normals = np.array(positions)
    return normals * radius, normals, np.array(indices), np.array(uv)


class Maker:
    def __init__(self, number):
        self.random = np.random.default_rng(number)
        self.writer = Writer()
        self.half = np.array([self.random.uniform(1.5, 5), self.random.uniform(1.2, 2.5),
                              self.random.uniform(1.5, 5)])
        self.kind = ("closed", "window", "court")[number % 3]

    def material(self, shiny=0.3):
        random = self.random
        glossy = random.random() < shiny
        more = {}
        if random.random() < 0.2:
            side = int(random.integers(4, 17))
            dark = np.indices((side, side)).sum(0) % 2
            texels = np.full((side, side, 4), 255, np.uint8)
            texels[dark == 1, :3] = random.integers(20, 120, 3)
            more["pbr"] = {"baseColorTexture": {"index": self.writer.texture(texels, nearest=True)}}
        return self.writer.material("surface", color=tuple(random.uniform(0.05, 0.9, 3)),
                                    roughness=float(random.uniform(0.05, 0.5) if glossy else random.uniform(0.6, 1)),
                                    metallic=float(glossy and random.random() < 0.4), doubleSided=True, **more)

    def add(self, name, shape, material, **place):
        positions, normals, indices, uv = shape
        mesh = self.writer.mesh(name, positions, normals, indices, material, uv)
        self.writer.node(name, mesh=mesh, **place)

    def wall(self, center, u, v, hole=None):
        """A rectangle, or the four around a hole whose halves are a share of its own."""
        material = self.material(0.1)
        center, u, v = (np.asarray(a, float) for a in (center, u, v))
        if hole is None:
            self.add("wall", shapes.quad(center, u, v), material)
            return
        rest = (1 - hole) / 2
        for along, across in (((1 + hole) / 2, 0), (-(1 + hole) / 2, 0)):
            self.add("wall", shapes.quad(center + along * u, rest * u, v), material)
        for up in ((1 + hole) / 2, -(1 + hole) / 2):
            self.add("wall", shapes.quad(center + up * v, hole * u, rest * v), material)

    def room(self):
        x, y, z = self.half
        self.wall((0, -y, 0), (x, 0, 0), (0, 0, -z))
        if self.kind != "court":
            self.wall((0, y, 0), (x, 0, 0), (0, 0, z))
        hole = float(self.random.uniform(0.1, 0.6)) if self.kind == "window" else None
        self.wall((-x, 0, 0), (0, 0, -z), (0, y, 0), hole)
        self.wall((x, 0, 0), (0, 0, z), (0, y, 0))
        self.wall((0, 0, -z), (x, 0, 0), (0, y, 0))
        self.wall((0, 0, z), (-x, 0, 0), (0, y, 0))
        if self.random.random() < 0.4:  # a wall within it, that light goes around
            self.wall((self.random.uniform(-0.5, 0.5) * x, -0.2 * y, 0), (0, 0, -0.5 * z), (0, 0.8 * y, 0))

    def furniture(self):
        random = self.random
        for _ in range(int(random.integers(2, 9))):
            at = (random.uniform(-0.8, 0.8, 3) * self.half).tolist()
            what = random.random()
            if what < 0.4:
                half = random.uniform(0.1, 0.5, 3)
                at[1] = float(half[1] - self.half[1])
                angle = random.uniform(0, math.pi) / 2
                self.add("box", shapes.box(half), self.material(), translation=at,
                         rotation=[0, math.sin(angle), 0, math.cos(angle)])
            elif what < 0.7:
                self.add("ball", sphere(float(random.uniform(0.1, 0.5))), self.material(0.6), translation=at)
            else:  # poles and bars, thinner than a pixel
                thin = float(random.uniform(0.002, 0.03))
                half = [thin, float(self.half[1]), thin] if random.random() < 0.5 else [float(self.half[0]), thin, thin]
                at[1 if half[1] > thin else 0] = 0.0
                self.add("pole", shapes.box(half), self.material(), translation=at)

    def panel(self):
        """An emissive rectangle: a lamp, a screen, a skylight, seen or not."""
        random = self.random
        size = random.uniform(0.03, 0.5, 2)
        at = random.uniform(-0.9, 0.9, 3) * self.half
        at[1] = abs(at[1])
        strength = float(10 ** random.uniform(-0.5, 2.5))
        glow = self.writer.material("glow", color=(0.2, 0.2, 0.2), emissiveFactor=[1, 1, 1], doubleSided=True,
                                    extensions={"KHR_materials_emissive_strength": {"emissiveStrength": strength}})
        self.writer.extensions.add("KHR_materials_emissive_strength")
        self.add("panel", shapes.quad(at, (size[0], 0, 0), (0, 0, size[1])), glow)

    def lights(self):
        random = self.random
        for _ in range(int(random.integers(1, 4))):
            at = (random.uniform(-0.8, 0.8, 3) * self.half).tolist()
            at[1] = abs(at[1])
            look = (random.uniform(-1, 1, 3) - (0, 1, 0)).tolist()
            color = tuple(random.uniform(0.4, 1, 3))
            kind = ("point", "spot", "directional")[int(random.integers(0, 3 if self.kind == "court" else 2))]
            outer = float(random.uniform(0.2, 1.2))
            self.writer.light(kind, kind, float(10 ** random.uniform(0, 2) / (20 if kind == "directional" else 1)),
                              position=at, look=look, color=color, cone=(0.7 * outer, outer))
        for _ in range(int(random.integers(0, 3))):
            self.panel()

    def camera(self):
        at = self.random.uniform(-0.8, 0.8, 3) * self.half
        look = self.random.uniform(-0.5, 0.5, 3) * self.half - at
        self.writer.camera("Camera", at.tolist(), look.tolist(), yfov=float(self.random.uniform(0.5, 1.4)))

    def write(self, path):
        for part in (self.room, self.furniture, self.lights, self.camera):
            part()
        self.writer.write_glb(path)


def main(words):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("count", type=int)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--first", type=int, default=1)
    options = parser.parse_args(words)
    options.folder.mkdir(parents=True, exist_ok=True)
    for number in range(options.first, options.first + options.count):
        Maker(number).write(options.folder / f"random_{number}.glb")


if __name__ == "__main__":
    main(sys.argv[1:])
