"""Rows about files that hold what a renderer cannot use."""
import struct

import numpy as np

from .. import shapes
from .row import row
from .scene import Scene


def _finish(scene):
    scene.quad((0, 1, -1), (1, 0, 0), (0, 1, 0), scene.grey((0.7, 0.3, 0.2)))
    scene.lamp((0.2, 1.2, 0.3))
    scene.eye((0.6, 1, 1.8), (0, 0.5, -0.5), 0.8)
    return scene


def _grid(cells=4):
    side = 1 / cells
    at = [-1 + (2 * i + 1) * side for i in range(cells)]
    return shapes.joined([shapes.quad((x, 0, z), (side, 0, 0), (0, 0, -side))
                          for z in at for x in at])


@row(19, "degenerate triangles")
def degenerate(case):
    """A thousand points, lines and needles in the mesh: the same picture, the same count."""
    positions, normals, indices, _ = _grid()
    views = []
    for has_junk in (False, True):
        scene = Scene()
        grey = scene.grey()
        here = indices
        if has_junk:
            rng = np.random.default_rng(19)
            a, b = rng.integers(0, len(positions), (2, 1000))
            junk = np.stack([a, np.where(np.arange(1000) % 2, a, b), b], 1)
            here = np.concatenate([indices[:7], junk, indices[7:]])
        scene.add((positions, normals, here, None), grey)
        views.append(case.render(case.save(_finish(scene), "junk" if has_junk else "clean"),
                                 (33, 33)))
    base, odd = views
    case.same(odd, base, 0)
    counts = [view.report["counts"]["triangles"] for view in views]
    case.expect(counts[0] == counts[1], odd, f"{counts[0]} triangles", str(counts[1]))
    case.flagged(odd, "degenerate_triangles")


@row(20, "NaN and infinite attributes")
def not_a_number(case):
    """A vertex without a place takes its triangles with it, and nothing else."""
    for attribute, bad in (("POSITION", np.nan), ("POSITION", np.inf), ("NORMAL", np.nan),
                           ("TEXCOORD_0", np.nan)):
        scene = Scene()
        texture = scene.texture(np.full((2, 2, 4), 200, np.uint8))
        material = scene.grey(pbr={"baseColorTexture": {"index": texture}})
        scene.add(_grid(), material, with_uv=True)
        mesh = scene.doc["meshes"][0]["primitives"][0]
        view = scene.doc["bufferViews"][scene.doc["accessors"][mesh["attributes"][attribute]]
                                        ["bufferView"]]
        struct.pack_into("<f", scene.bytes, view["byteOffset"] + 4, bad)
        picture = case.render(case.save(_finish(scene), f"{attribute.lower()}-{bad}"), (33, 33))
        case.expect(picture.light("direct").max() > 0, picture, "the rest of the scene", "nothing")
        case.flagged(picture, "nonfinite_vertices", "repaired_normals", "nonfinite_texcoords")


@row(21, "normals that are no unit vectors")
def normals_of_any_length(case):
    """Ten times as long: the same picture. Zero: that of the triangle."""
    positions, normals, indices, _ = _grid()
    views = []
    for factor in (1.0, 10.0, 1e-3, 0.0):
        scene = Scene()
        scene.add((positions, factor * normals, indices, None), scene.grey())
        views.append(case.render(case.save(_finish(scene), f"{factor:g}"), (33, 33)))
    for odd in views[1:]:
        case.same(odd, views[0], 1e-6)
    case.flagged(views[3], "repaired_normals")
