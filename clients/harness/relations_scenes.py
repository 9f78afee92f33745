"""The scenes that relations run on: one of our own with a bit of everything, and real ones."""
import os
from pathlib import Path

import numpy as np

from .gltf import Writer
from .glb import Glb
from .shapes import add, box, disc, icosphere, quad, turned

# Cheap and diverse: plain walls; two kinds of light over a great range of sizes; maps and normal
# maps; alpha and instances; a large textured building.
HANDFUL = ("workshop", "cornell_box_spot_side", "rtxgi_two_rooms", "damaged_helmet",
           "sponza_dabrovic", "garden")
QUICK = ("workshop", "cornell_box_spot_side")


def folder():
    """Where the scene set is: $BD_SHARED_DIR/scenes, or beside this repository."""
    beside = Path(__file__).resolve().parents[2] / "../shared"
    return Path(os.environ.get("BD_SHARED_DIR", beside)).resolve() / "scenes"


def names(which):
    """"quick", "handful", "all", or a list with commas."""
    if which == "quick":
        return QUICK
    if which == "handful":
        return HANDFUL
    if which == "all":
        return ("workshop", *sorted(path.stem for path in folder().glob("*.glb")))
    return tuple(which.split(","))


def load(name):
    """The Glb; None where a real scene is not on this machine."""
    if name == "workshop":
        return workshop()
    path = folder() / f"{name}.glb"
    return Glb.load(path) if path.exists() else None


def _checks(first, second, cells):
    mask = (np.add.outer(np.arange(cells), np.arange(cells)) % 2)[..., None]
    return np.where(mask, first, second)


def _colour_corners(glb, mesh, colours):
    attributes = glb.doc["meshes"][mesh]["primitives"][0]["attributes"]
    attributes["COLOR_0"] = glb.add_accessor(np.asarray(colours, np.float32))


def _room(w):
    grey = w.material("grey", (0.7, 0.68, 0.62))
    board = w.material("board", pbr={"baseColorTexture": {"index": w.texture(
        _checks((220, 190, 120, 255), (60, 90, 160, 255), 8))}})
    add(w, "Floor", quad((0, 0, 0), (2.1, 0, 0), (0, 0, -1.9)), board, True)
    add(w, "Back", quad((0.1, 1.3, -1.9), (2.2, 0, 0), (0, 1.3, 0)), grey)
    add(w, "Left", quad((-2.1, 1.3, 0), (0, 0, -1.9), (0, 1.3, 0)),
        w.material("red", (0.7, 0.12, 0.08), doubleSided=True))


def _things(w):
    gloss = w.material("gloss", (0.3, 0.5, 0.7), roughness=0.35)
    metal = w.material("metal", (0.9, 0.7, 0.4), roughness=0.3, metallic=1.0)
    holes = w.texture(_checks((255, 255, 255, 255), (255, 255, 255, 0), 4), nearest=True)
    fence = w.material("fence", (0.5, 0.7, 0.3), alphaMode="MASK", alphaCutoff=0.5,
                       doubleSided=True, pbr={"baseColorTexture": {"index": holes}})
    shape = box((0.3, 0.3, 0.3))
    first = add(w, "Plain", shape, gloss, translation=[-1.03, 0.3, 0.41], rotation=turned(23))
    mesh = w.doc["nodes"][first]["mesh"]
    group = w.node("Group", translation=[0.93, 0, -0.37], scale=[-1, 1.4, 1])
    w.node("Mirrored", group, mesh=mesh, translation=[0, 0.3, 0], rotation=turned(31))
    points, faces = icosphere(80)
    add(w, "Ball", (0.35 * points, points, faces, None), metal, translation=[0.2, 0.35, 0.73])
    add(w, "Fence", quad((-0.1, 0.55, -0.6), (0.6, 0, 0.17), (0, 0.5, 0)), fence, True)
    panel = w.material("panel", (0.2, 0.2, 0.2), emissiveFactor=[0.9, 0.6, 0.2])
    add(w, "Panel", quad((1.4, 1.7, -1.87), (0.3, 0, 0), (0, 0.2, 0)), panel)
    return add(w, "Disc", disc(0.4, 0.013, 24, True), w.material("tinted"),
               translation=[0.9, 0, 0.9])


def workshop():
    """A corner of a room: maps, a cut-out, vertex colours, instances, metal, emission, three kinds
    of light. No edge runs through pixel centres by symmetry."""
    w = Writer()
    _room(w)
    tinted = _things(w)
    w.camera("Camera", (1.9, 1.63, 3.37), (-1.83, -1.02, -3.41), yfov=0.83)
    w.light("Spot", "spot", 30.0, (1.1, 2.47, 1.3), (-0.9, -2.4, -1.6), (1, 0.9, 0.7), (0.2, 0.7))
    w.light("Lamp", "point", 3.0, (-0.7, 1.51, 0.9), color=(0.6, 0.8, 1))
    w.light("Sun", "directional", 0.8, (0, 3, 0), (-0.5, -1, -0.7), (1, 1, 0.9))
    glb = Glb.loads(w.glb())
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    rim = np.stack([0.5 + 0.4 * np.cos(turn + k) for k in (0, 2, 4)], 1)
    _colour_corners(glb, glb.doc["nodes"][tinted]["mesh"], np.vstack([[[0.8, 0.8, 0.8]], rim]))
    glb.lights()[1]["range"] = 4.0
    return glb
