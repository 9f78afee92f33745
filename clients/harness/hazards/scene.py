"""Scenes for hazards: a glTF writer that scales, moves and brightens what it is given.

Lengths are written as `scale` times the numbers given, point and spot lights as `power` * scale^2
times theirs: the same picture, if the renderer keeps its digits. `offset` moves everything by a
node above all others.
"""
import functools

import numpy as np

from .. import shapes
from ..glb import Glb
from ..gltf import Writer, facing

UP, DOWN = (0, 1, 0), (0, -1, 0)


@functools.lru_cache(maxsize=4)
def _unit_sphere(triangles):
    return shapes.icosphere(triangles)


class Scene(Writer):
    def __init__(self, scale=1.0, power=1.0, offset=None):
        super().__init__()
        self.scale, self.power = scale, power
        self.root = None
        if offset is not None:
            self.root = Writer.node(self, "offset", translation=[float(v) for v in offset])

    def node(self, name, parent=None, **what):
        if "translation" in what:
            what["translation"] = [float(v) * self.scale for v in what["translation"]]
        return super().node(name, self.root if parent is None else parent, **what)

    def mesh(self, name, positions, normals, indices, material, uv=None):
        return super().mesh(name, np.asarray(positions, float) * self.scale, normals, indices,
                            material, uv)

    def light(self, name, kind, intensity, *arguments, **keywords):
        factor = self.power * (1 if kind == "directional" else self.scale ** 2)
        return super().light(name, kind, intensity * factor, *arguments, **keywords)

    def glb(self):
        if self.bytes:
            return super().glb()
        doc = self._json({})  # a buffer of no bytes is not glTF
        del doc["buffers"]
        return Glb(doc, b"").dumps()

    # --- surfaces ---

    def grey(self, albedo=0.5, **more):
        color = (albedo, albedo, albedo) if np.isscalar(albedo) else albedo
        return self.material("grey", color, **more)

    def add(self, shape, material, name="surface", with_uv=False, parent=None):
        return shapes.add(self, name, shape, material, with_uv, parent=parent)

    def quad(self, center, u, v, material, with_uv=False):
        return self.add(shapes.quad(center, u, v), material, with_uv=with_uv)

    def floor(self, half, material, height=0.0, cells=1):
        """Faces up; `cells` x `cells` squares."""
        side = half / cells
        at = [-half + (2 * i + 1) * side for i in range(cells)]
        parts = [shapes.quad((x, height, z), (side, 0, 0), (0, 0, -side)) for z in at for x in at]
        return self.add(shapes.joined(parts), material)

    def ceiling(self, half, material, height):
        return self.quad((0, height, 0), (half, 0, 0), (0, 0, half), material)

    def room(self, material, half=1.0, center=(0, 0, 0)):
        """A cube seen from inside."""
        positions, normals, indices, uv = shapes.box((half, half, half))
        inward = (np.asarray(positions) + center, -normals, indices[:, ::-1], uv)
        return self.add(inward, material)

    def block(self, material, half, center):
        positions, normals, indices, uv = shapes.box((half, half, half))
        return self.add((positions + np.asarray(center, float), normals, indices, uv), material)

    def sphere(self, material, radius, triangles, inward=True, center=(0, 0, 0)):
        points, faces = _unit_sphere(triangles)
        sign = -1 if inward else 1
        return self.add((radius * points + np.asarray(center, float), sign * points,
                         faces[:, ::-1] if inward else faces, None), material)

    # --- what lights and what looks ---

    def lamp(self, position=(0, 0, 0), intensity=1.0, look=DOWN):
        return self.light("lamp", "point", intensity, position, look)

    def sun(self, look=DOWN, intensity=1.0):
        return self.light("sun", "directional", intensity, (0, 0, 0), look)

    def spot(self, position, look, intensity=1.0, cone=(0.3, 0.5)):
        return self.light("spot", "spot", intensity, position, look, cone=cone)

    def eye(self, position, at, yfov=1.0, near=0.01, far=None):
        """A perspective camera at `position` that looks at `at`."""
        lens = {"yfov": yfov, "znear": near * self.scale}
        if far is not None:
            lens["zfar"] = far * self.scale
        camera = self._append("cameras", {"type": "perspective", "perspective": lens})
        look = np.asarray(at, float) - np.asarray(position, float)
        return self.node("eye", camera=camera, translation=list(position), rotation=facing(look))

    def window(self, at, normal, half=(1.0, 1.0), distance=0.02, up=None):
        """An orthographic camera over the point `at`, looking against `normal`: a pixel sees the
        surface straight on. half: (x, y) half sides of what it sees."""
        half = (half, half) if np.isscalar(half) else half
        normal = np.asarray(normal, float) / np.linalg.norm(normal)
        up = up if up is not None else ((0, 0, -1) if abs(normal[1]) > 0.9 else (0, 1, 0))
        s = self.scale
        lens = {"xmag": half[0] * s, "ymag": half[1] * s, "znear": 0.0, "zfar": 4 * distance * s}
        camera = self._append("cameras", {"type": "orthographic", "orthographic": lens})
        position = np.asarray(at, float) + distance * normal
        return self.node("window", camera=camera, translation=position.tolist(),
                         rotation=facing(-normal, up))

    def probe(self, at, normal, distance=0.02):
        """A window on hardly more than the point itself."""
        return self.window(at, normal, half=1e-4, distance=distance)
