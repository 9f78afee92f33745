"""Scenes of the figures: files of the scene set, the same with cameras or lights of our own, and
generated ones of which one number alone changes."""
import dataclasses
import math

import numpy

from ... import shapes
from ...glb import Glb
from ...gltf import Writer, facing


class Missing(Exception):
    """A file that is not in the folder of scenes; its text is one line."""


@dataclasses.dataclass(frozen=True)
class Scene:
    name: str
    file: str = ""        # in the folder of scenes; "" of a generated one
    make: object = None   # bytes of a .glb from that file's path, or from None
    arguments: tuple = ()

    @property
    def shown(self):
        """Its place without this machine's folders: $S is that of scenes."""
        return f"$MADE/{self.name}.glb" if self.make else f"$S/{self.file}"

    def open(self, folder, made):
        """The path of its .glb; scenes that are made go to the folder `made`."""
        source = folder / self.file if self.file else None
        if source and not source.is_file():
            raise Missing(f"{self.file} is not in {folder}")
        if not self.make:
            return source
        made.mkdir(parents=True, exist_ok=True)
        path = made / f"{self.name}.glb"
        path.write_bytes(self.make(source, *self.arguments))
        return path


def of_set(name):
    return Scene(name, f"{name}.glb")


CORNELL = of_set("cornell_box")
GLASS = of_set("glass_sphere_box")
RING = of_set("mnrt_ring")
BOX = of_set("cornell_box_spot_side")
DRAGON = of_set("cornell_dragon_bunny")
BUDDHA = of_set("buddha_room")
TEAPOT = of_set("teapot_box")
SPONZA = of_set("sponza_dabrovic")
SIBENIK = of_set("sibenik")
GARDEN = of_set("garden")


# --- cameras and lights of our own ------------------------------------------------------------

def _with_cameras(source, poses, yfov):
    glb = Glb.load(source)
    for number, (eye, target) in enumerate(poses):
        camera = glb.append("cameras", {"type": "perspective", "name": f"path{number}",
                                        "perspective": {"yfov": yfov, "znear": 0.01}})
        look = numpy.subtract(target, eye)
        node = glb.append("nodes", {"name": f"path{number}", "camera": camera,
                                    "translation": list(eye), "rotation": facing(look)})
        glb.roots().append(node)
    return glb.dumps()


def with_cameras(scene, poses, yfov=0.8):
    """Cameras "path0", "path1", ... at (eye, what it looks at)."""
    return Scene(f"{scene.name}_path", scene.file, _with_cameras, (poses, yfov))


def _with_moved_light(source, shift):
    glb = Glb.load(source)
    for node in glb.every("nodes"):
        if "KHR_lights_punctual" in node.get("extensions", {}):
            node["translation"] = [a + b for a, b in zip(node.get("translation", (0, 0, 0)), shift)]
    return glb.dumps()


def with_moved_light(scene, number, shift):
    """Every light `shift` metres from where it was."""
    return Scene(f"{scene.name}_light{number}", scene.file, _with_moved_light, (shift,))


def with_light_that_moves(scene, shift, frames):
    """A film: every light goes on by `shift` from frame to frame, half of the way before its place and half behind."""
    return tuple(Scene(f"{scene.name}_frame{n}", scene.file, _with_moved_light,
                       (tuple(s * (n - (frames - 1) / 2) for s in shift),)) for n in range(frames))


# --- generated --------------------------------------------------------------------------------

BALLS = ((-0.55, 0.3, -0.5, 0.3), (0.45, 0.35, -0.4, 0.35), (-0.1, 0.22, 0.2, 0.22),
         (0.6, 0.18, 0.4, 0.18), (-0.65, 0.2, 0.35, 0.2))  # x, y, z, radius in metres
LIGHT_CANDELA = 12.0  # of all lights together


def _room(writer):
    white, red, green = (writer.material(name, color) for name, color in
                         (("white", (.73, .73, .73)), ("red", (.65, .06, .06)), ("green", (.12, .48, .1))))
    walls = (("floor", (0, 0, 0), (1, 0, 0), (0, 0, -1), white),
             ("ceiling", (0, 2, 0), (1, 0, 0), (0, 0, 1), white),
             ("back", (0, 1, -1), (1, 0, 0), (0, 1, 0), white),
             ("left", (-1, 1, 0), (0, 0, -1), (0, 1, 0), red),
             ("right", (1, 1, 0), (0, 0, 1), (0, 1, 0), green))
    for name, center, u, v, material in walls:
        shapes.add(writer, name, shapes.quad(center, u, v), material)
    return white


def _balls(_, triangles_each, light_count):
    writer = Writer()
    white = _room(writer)
    points, faces = shapes.icosphere(triangles_each)
    ball = writer.mesh("ball", points, points, faces, white)
    for x, y, z, radius in BALLS:
        writer.node("ball", mesh=ball, translation=[x, y, z], scale=[radius] * 3)
    across = math.ceil(math.sqrt(light_count))
    for number in range(light_count):
        x, z = ((2 * (n + .5) / across - 1) * .7 for n in (number % across, number // across))
        writer.light(f"lamp{number}", "spot", LIGHT_CANDELA / light_count, (x, 1.95, z),
                     (-.3 * x - .2, -1, -.3 * z - .3), cone=(.6, .75))
    writer.camera("Camera", (0, 1, 3.9), (0, 0, -1), yfov=.686)
    return writer.glb()


def balls(triangles_each=5120, light_count=1):
    """A box with five balls of so many triangles each (20 times a power of 4), and lamps at its
    ceiling that share the same power: the picture hardly changes with either number."""
    return Scene(f"balls_{triangles_each}_{light_count}", make=_balls,
                 arguments=(triangles_each, light_count))
