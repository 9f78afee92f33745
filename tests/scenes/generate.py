#!/usr/bin/env python3
"""The project's own test scenes.

    generate.py [NAME...]                         rewrites the committed scenes beside this file
    generate.py sphere --triangles N -o FILE      a closed inward-facing sphere, made on the fly

What each is for: README.md here. All numbers are ours; lengths in metres, light in cd and lux.
"""

import argparse
import math
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "clients"))

from harness import gltf  # noqa: E402
from harness.shapes import add, box, disc, icosphere, quad, turned  # noqa: E402

DOWN, UP = (0, -1, 0), (0, 1, 0)


class Writer(gltf.Writer):
    generator = "bounced tests/scenes/generate.py"


def cornell():
    """Two blocks in an open box of 2 x 2 x 2 m, lit by a spot under the ceiling."""
    w = Writer()
    white = w.material("white", (0.73, 0.73, 0.72))
    red = w.material("red", (0.62, 0.07, 0.06))
    green = w.material("green", (0.14, 0.46, 0.10))
    add(w, "Floor", quad((0, 0, 0), (1, 0, 0), (0, 0, -1)), white)
    add(w, "Ceiling", quad((0, 2, 0), (1, 0, 0), (0, 0, 1)), white)
    add(w, "Back", quad((0, 1, -1), (1, 0, 0), (0, 1, 0)), white)
    add(w, "Left", quad((-1, 1, 0), (0, 0, -1), (0, 1, 0)), red)
    add(w, "Right", quad((1, 1, 0), (0, 0, 1), (0, 1, 0)), green)
    add(w, "Tall", box((0.3, 0.6, 0.3), bottom=False), white, translation=[-0.36, 0.6, -0.34],
        rotation=turned(18))
    add(w, "Short", box((0.29, 0.29, 0.29), bottom=False), white, translation=[0.38, 0.29, 0.3],
        rotation=turned(-17))
    w.camera("Camera", (0, 1, 3.95), (0, 0, -1), yfov=0.66)
    w.light("Spot", "spot", 9.0, (0, 1.96, 0), DOWN, cone=(0.7, 1.15))
    return w


def cube_room():
    """[-1,1]^3, albedo 1/2, a point light of 1 cd in the middle (oracle D8)."""
    w = Writer()
    grey = w.material("half", (0.5, 0.5, 0.5))
    add(w, "Floor", quad((0, -1, 0), (1, 0, 0), (0, 0, -1)), grey)
    add(w, "Ceiling", quad((0, 1, 0), (1, 0, 0), (0, 0, 1)), grey)
    add(w, "Back", quad((0, 0, -1), (1, 0, 0), (0, 1, 0)), grey)
    add(w, "Front", quad((0, 0, 1), (-1, 0, 0), (0, 1, 0)), grey)
    add(w, "Left", quad((-1, 0, 0), (0, 0, -1), (0, 1, 0)), grey)
    add(w, "Right", quad((1, 0, 0), (0, 0, 1), (0, 1, 0)), grey)
    # The floor, pixel by pixel: x grows to the right, z grows downwards.
    w.camera("Floor camera", (0, 0.5, 0), DOWN, mag=(1, 1), up=(0, 0, -1))
    w.camera("Inside", (0.8, 0.7, 0.9), (-0.8, -0.9, -1), yfov=1.2)
    w.light("Light", "point", 1.0)
    return w


def floor_ceiling():
    """Point light of 1 cd 1 m over a floor of radius 20 m, ceiling at 2 m (oracle D4)."""
    w = Writer()
    grey = w.material("half", (0.5, 0.5, 0.5))
    add(w, "Floor", disc(20, 0, 256, True), grey)
    add(w, "Ceiling", disc(20, 2, 256, False), grey)
    w.camera("Floor camera", (0, 0.5, 0), DOWN, mag=(2.5, 2.5), up=(0, 0, -1))
    w.camera("Ceiling camera", (0, 1.5, 0), UP, mag=(2.5, 2.5), up=(0, 0, 1))
    w.light("Light", "point", 1.0, (0, 1, 0))
    return w


def wall_floor():
    """1 lx straight onto a wall 4 m wide and 2 m high that meets a floor (oracle D6)."""
    w = Writer()
    grey = w.material("half", (0.5, 0.5, 0.5))
    add(w, "Wall", quad((0, 1, 0), (2, 0, 0), (0, 1, 0)), grey)
    add(w, "Floor", quad((0, 0, 2), (2, 0, 0), (0, 0, -2)), grey)
    w.camera("Floor camera", (0, 1.5, 2), DOWN, mag=(2, 2), up=(0, 0, -1))
    w.camera("Wall camera", (0, 1, 3), (0, 0, -1), mag=(2, 2))
    w.light("Sun", "directional", 1.0, (0, 1, 3), (0, 0, -1))
    return w


def checker():
    """A checkered floor, and over it a mask of which exactly half is cut away (hazard 62)."""
    w = Writer()
    cell = (np.add.outer(np.arange(8), np.arange(8)) % 2)[..., None]
    colors = np.where(cell, (230, 230, 220, 255), (40, 60, 160, 255))
    holes = np.where(cell, (255, 255, 255, 255), (255, 255, 255, 0))
    board = w.material("board", pbr={"baseColorTexture": {"index": w.texture(colors, True)}})
    mask = w.material("mask", (0.8, 0.5, 0.2), alphaMode="MASK", alphaCutoff=0.5, doubleSided=True,
                      pbr={"baseColorTexture": {"index": w.texture(holes, True)}})
    add(w, "Floor", quad((0, 0, 0), (2, 0, 0), (0, 0, -2)), board, True)
    add(w, "Mask", quad((0, 0.5, 0), (1, 0, 0), (0, 0, -1)), mask, True)
    w.camera("Camera", (0, 2.6, 3.2), (0, -2.4, -3.2), yfov=0.9)
    w.camera("From above", (0, 4, 0), DOWN, mag=(2, 2), up=(0, 0, -1))
    w.light("Light", "point", 12.0, (0, 2.5, 0))
    return w


def two_lights():
    """Two cameras, a spot and a sun; one mesh shown plain, stretched and mirrored."""
    w = Writer()
    white = w.material("white", (0.75, 0.75, 0.75))
    gloss = w.material("gloss", (0.8, 0.3, 0.1), roughness=0.4)
    metal = w.material("metal", (0.9, 0.8, 0.5), roughness=0.3, metallic=1.0)
    add(w, "Floor", quad((0, 0, 0), (3, 0, 0), (0, 0, -3)), white)
    shape = box((0.4, 0.4, 0.4))
    first = add(w, "Plain", shape, gloss, translation=[-1.2, 0.4, 0])
    mesh = w.doc["nodes"][first]["mesh"]
    group = w.node("Group", translation=[1.2, 0, 0], scale=[-1, 1, 1])
    w.node("Mirrored", group, mesh=mesh, translation=[0, 0.4, 0], rotation=turned(30))
    w.node("Stretched", mesh=mesh, translation=[0, 0.8, -1], scale=[0.5, 2, 1])
    add(w, "Metal", box((0.3, 0.3, 0.3)), metal, translation=[0, 0.3, 0.9], rotation=turned(45))
    w.camera("Left", (-3, 2, 3), (3, -1.6, -3), yfov=0.8)
    w.camera("Right", (3, 2, 3), (-3, -1.6, -3), yfov=0.8)
    w.light("Spot", "spot", 20.0, (1, 3, 1), (-1, -3, -1), (1, 0.9, 0.8), (0.3, 0.6))
    w.light("Sun", "directional", 1.5, (0, 3, 0), (0.4, -1, -0.5), (0.8, 0.9, 1))
    return w


def orthographic():
    """Seen along -z by an orthographic camera of half-width 2 and half-height 1.5."""
    w = Writer()
    white = w.material("white", (0.7, 0.7, 0.7))
    blue = w.material("blue", (0.2, 0.3, 0.8))
    add(w, "Back", quad((0, 0, -2), (4, 0, 0), (0, 4, 0)), white)
    add(w, "Near", box((0.5, 0.5, 0.5)), blue, translation=[-1, 0, 1])
    add(w, "Far", box((0.5, 0.5, 0.5)), blue, translation=[1, 0, -1])
    w.camera("Camera", (0, 0, 4), (0, 0, -1), mag=(2, 1.5))
    w.light("Light", "point", 15.0, (0, 1, 3))
    return w


def bare():
    """No camera and no light: what the default rig is for. A .gltf with its .bin beside it."""
    w = Writer()
    clay = w.material("clay", (0.7, 0.5, 0.4), roughness=0.8)
    add(w, "Ground", quad((0, 0, 0), (2, 0, 0), (0, 0, -2)), clay)
    add(w, "Block", box((0.5, 0.5, 0.5)), clay, translation=[0, 0.5, 0], rotation=turned(30))
    return w


def sphere(triangles, radius, albedo, flux):
    """Closed, facing inwards, light in the middle (oracle D3)."""
    w = Writer()
    points, faces = icosphere(triangles)
    grey = w.material("wall", (albedo,) * 3)
    add(w, "Sphere", (radius * points, -points, faces[:, ::-1], None), grey)
    w.camera("Camera", (0.2 * radius, 0.1 * radius, 0.4 * radius), (0, 0, -1), yfov=1.4)
    w.light("Light", "point", flux / (4 * math.pi))
    return w


COMMITTED = {"cornell": cornell, "cube_room": cube_room, "floor_ceiling": floor_ceiling,
             "wall_floor": wall_floor, "checker": checker, "two_lights": two_lights,
             "orthographic": orthographic}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*", help="scenes to write; all committed ones by default")
    parser.add_argument("--triangles", type=int, default=81920, help="sphere: at least so many")
    parser.add_argument("--radius", type=float, default=2.0)
    parser.add_argument("--albedo", type=float, default=0.5)
    parser.add_argument("--flux", type=float, default=100.0, help="sphere: lm of its light")
    parser.add_argument("-o", "--output", type=Path, help="sphere: the file")
    args = parser.parse_args()
    if args.names == ["sphere"]:
        if not args.output:
            parser.error("sphere needs -o FILE")
        sphere(args.triangles, args.radius, args.albedo, args.flux).write_glb(args.output)
        return
    for name in args.names or [*COMMITTED, "bare"]:
        if name == "bare":
            bare().write_gltf(HERE / "bare.gltf")
        elif name in COMMITTED:
            COMMITTED[name]().write_glb(HERE / f"{name}.glb")
        else:
            parser.error(f"no scene {name}")


if __name__ == "__main__":
    main()
