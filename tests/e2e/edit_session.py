"""A made-up session of edits on one scene, from a seed: every kind of operation, undo and redo,
reverts, names, drags that are committed.

The same seed on the same scene asks for the same things in the same order: what is asked for
follows from the seed and from the daemon's answers alone.
"""
import math
import pathlib
import random
import struct
import zlib

import bounced
import numpy

SCENES = pathlib.Path(__file__).parent / "../scenes"
PICTURE_PX = 8
IMPORTS_MAX = 6  # each brings a room


def png(rng):
    """A small picture."""
    rows = b"".join(b"\0" + rng.randbytes(3 * PICTURE_PX) for _ in range(PICTURE_PX))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(
            ">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", PICTURE_PX, PICTURE_PX, 8, 2, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) +
            chunk(b"IEND", b""))


class Session:
    """`run(count)` makes so many changes and gives the scene's hash after each of them. A change is
    one revision, or the few of a deformed mesh or of what is done again."""

    def __init__(self, scene, seed):
        self.scene = scene
        self.rng = random.Random(seed)
        self.hashes = []
        self.refused = 0
        self.done = {}  # how often each step was taken
        self._imports = 0
        self._names = []

    def run(self, count, after=lambda revision: None):
        """`after` is called with the revision that each change made."""
        steps = [step for step, weight in STEPS for _ in range(weight)]
        end = len(self.hashes) + count
        while len(self.hashes) < end:
            step = self.rng.choice(steps)
            self._objects = self.scene.objects()
            try:
                result = step(self)
            except bounced.Error as error:
                # In use, nothing to undo: the daemon's word, and so the same each time.
                assert error.code in ("bad_input", "conflict", "not_found", "usage"), error
                self.refused += 1
                continue
            if result is not None:
                self.done[step.__name__] = self.done.get(step.__name__, 0) + 1
                self.hashes.append(self.scene.info()["hash"])
                after(result.revision)
        return self.hashes

    # --- what there is, and numbers ---

    def some(self, kind):
        """The id of one; BadInput if there is none, which is as good as a refusal."""
        ids = [item["id"] for item in self._objects if item["kind"] == kind]
        if not ids:
            raise bounced.BadInput(f"no {kind}")
        return self.rng.choice(ids)

    def number(self, low, high):
        return self.rng.uniform(low, high)

    def numbers(self, count, low=0, high=1):
        return [self.number(low, high) for _ in range(count)]

    def place(self):
        return self.numbers(3, -0.4, 0.4)

    def turn(self):
        angle = self.number(0, math.pi)
        return (0, math.sin(angle / 2), 0, math.cos(angle / 2))

    def patch(self, count=4):
        """A wavy square of count^2 vertices."""
        grid = numpy.linspace(-0.3, 0.3, count)
        x, z = numpy.meshgrid(grid, grid)
        y = 1 + self.number(0, 0.2) * numpy.sin(self.number(3, 9) * x + self.number(0, 6) * z)
        positions = numpy.stack([x, y, z], -1).reshape(-1, 3)
        first = [row * count + column for row in range(count - 1) for column in range(count - 1)]
        indices = [(i, i + count, i + 1, i + 1, i + count, i + count + 1) for i in first]
        return positions, numpy.array(indices).reshape(-1, 3)

    # --- steps: each gives its last revision's result, or None ---

    def move(self):
        with self.scene.edit(message="a move") as edit:
            edit.set_transform(self.some("node"), translation=self.place(), rotation=self.turn())
        return edit.result

    def light(self):
        with self.scene.edit() as edit:
            edit.set_light(self.some("light"), intensity=self.number(0.5, 30),
                           color=self.numbers(3, 0.2, 1))
        return edit.result

    def lamp(self):
        with self.scene.edit(message="a lamp") as edit:
            kind = self.rng.choice(["point", "spot"])
            lamp = edit.add_light(kind=kind, intensity=self.number(1, 20),
                                  **({"cone_outer": 0.8} if kind == "spot" else {}))
            edit.add_node(light=lamp, translation=[0, 1.5, 0], rotation=(-0.7071, 0, 0, 0.7071))
        return edit.result

    def paint(self):
        with self.scene.edit() as edit:
            edit.set_material(self.some("material"), base_color=[*self.numbers(3), 1],
                              roughness=self.number(0.3, 1),
                              emissive=self.numbers(3, 0, 0.2) if self.number(0, 1) < 0.2 else None)
        return edit.result

    def tile(self):
        positions, indices = self.patch()
        with self.scene.edit() as edit:
            paint = edit.add_material(base_color=[*self.numbers(3), 1], double_sided=True)
            uv = positions[:, ::2] + 0.3
            mesh = edit.add_mesh(bounced.Primitive(positions, indices, uv0=uv, material=paint))
            edit.add_node(name="tile", mesh=mesh, translation=self.place())
        return edit.result

    def remake(self):
        positions, indices = self.patch(3)
        with self.scene.edit() as edit:
            edit.set_mesh(self.some("mesh"), bounced.Primitive(positions, indices))
        return edit.result

    def picture(self):
        with self.scene.edit() as edit:
            texture = edit.add_texture(image=png(self.rng), wrap_s="mirror")
            edit.add_material(name="pictured", base_color_texture=texture)
        return edit.result

    def hang(self):
        with self.scene.edit() as edit:
            edit.set_texture(self.some("texture"), image=png(self.rng))
            edit.set_material(self.some("material"), base_color_texture=self.some("texture"))
        return edit.result

    def camera(self):
        with self.scene.edit() as edit:
            edit.set_camera(self.some("camera"), yfov=self.number(0.4, 1.2))
        return edit.result

    def second_camera(self):
        with self.scene.edit() as edit:
            camera = edit.add_camera(yfov=0.9, near=0.01)
            edit.add_node(camera=camera, translation=[0, 1, 3])
        return edit.result

    def sky(self):
        with self.scene.edit() as edit:
            edit.set_environment(self.numbers(3, 0, 0.5))
        return edit.result

    def bring(self):
        if self._imports == IMPORTS_MAX:
            return None
        self._imports += 1
        with self.scene.edit(message="a file") as edit:
            node = edit.import_file(SCENES / self.rng.choice(["checker.glb", "wall_floor.glb"]))
            edit.set_transform(node, translation=self.place(), scale=(0.3, 0.3, 0.3))
        return edit.result

    def rearrange(self):
        with self.scene.edit() as edit:
            edit.set_node(self.some("node"), parent=self.some("node"), shown=True)
        return edit.result

    def remove(self):
        kind = self.rng.choice(["node", "mesh", "material", "texture", "light", "camera"])
        if kind == "node" and sum(item["kind"] == "node" for item in self._objects) < 8:
            return None
        with self.scene.edit(message="away with " + kind) as edit:
            getattr(edit, "remove_" + kind)(self.some(kind))
        return edit.result

    def drag(self):
        node = self.some("node")
        for at in range(3):
            with self.scene.edit(transient=True) as edit:
                edit.set_transform(node, translation=(0.1 * at, 0, 0))
        return self.scene.commit()

    def deform(self):
        positions, indices = self.patch()
        with self.scene.edit() as edit:
            mesh = edit.add_mesh(bounced.Primitive(positions, indices))
            edit.add_node(mesh=mesh)
        for _ in range(2):
            with self.scene.edit(transient=True) as edit:
                edit.set_mesh_vertices(mesh, self.patch()[0])
        return self.scene.commit()

    def undo(self):
        return self.scene.undo()

    def redo(self):
        for _ in range(self.rng.randint(1, 2)):
            self.scene.undo()
        return self.scene.redo()

    def revert(self):
        if self._names and self.number(0, 1) < 0.5:
            return self.scene.revert(self.rng.choice(self._names))
        newest = self.scene.revision
        return self.scene.revert(self.rng.randint(max(1, newest - 20), newest))

    def name(self):
        self._names.append(f"state {len(self._names)}")
        self.scene.name_revision(self._names[-1])


STEPS = [(Session.move, 8), (Session.light, 5), (Session.lamp, 2), (Session.paint, 6),
         (Session.tile, 3), (Session.remake, 1), (Session.picture, 2), (Session.hang, 2),
         (Session.camera, 1), (Session.second_camera, 1), (Session.sky, 1), (Session.bring, 1),
         (Session.rearrange, 1), (Session.remove, 4), (Session.drag, 3), (Session.deform, 2),
         (Session.undo, 6), (Session.redo, 3), (Session.revert, 2), (Session.name, 1)]
