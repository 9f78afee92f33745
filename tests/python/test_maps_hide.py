"""Imperfect shadow maps of what is not whole and of what moves, with the real renderer: as rays see it, they hide."""
import struct
import zlib

import bounced
import numpy
import pytest
from conftest import SCENES

ALL = {"vpls": 256, "rays": 256, "brdf": "lambert"}
MAPS = {"indirect_visibility": "ism", "ism_points": 32768}
# A wall across the room, whole from front to back.
ACROSS = numpy.array([[0, .02, -1], [0, .02, 1], [0, 1.6, 1], [0, 1.6, -1]], float)
LYING = numpy.array([[-1, .02, -1], [-1, .02, 1], [0, .02, 1], [0, .02, -1]], float)


def picture_of(opaque):
    """PNG, RGBA, white: what is opaque, a row of pixels after the other."""
    rows = numpy.full((*opaque.shape, 4), 255, numpy.uint8)
    rows[..., 3] = numpy.where(opaque, 255, 0)
    data = b"".join(b"\0" + row.tobytes() for row in rows)

    def chunk(name, body):
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
    head = struct.pack(">IIBBBBB", opaque.shape[1], opaque.shape[0], 8, 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(data)) + chunk(b"IEND", b"")


def indirect(scene, **asked):
    return scene.render(size=(48, 48), technique="rsm", layers=["indirect"], parameters={**ALL, **asked}).layers["indirect"].astype(float)


def off(scene, picture):
    """Relative RMSE against rays to all virtual lights."""
    rays = indirect(scene, indirect_visibility="rays")
    return float(numpy.sqrt(((picture - rays) ** 2).mean()) / rays.mean())


@pytest.fixture
def room():
    """The room, and a wall in it with its mesh and material."""
    with bounced.private() as client:
        scene = client.scenes.add(SCENES / "cornell.glb")
        with scene.edit() as edit:
            texture = edit.add_texture(image=picture_of(numpy.ones((2, 2), bool)), nearest=True)
            material = edit.add_material(double_sided=True, base_color=(.5, .5, .5, 1), base_color_texture=texture)
            mesh = edit.add_mesh(bounced.Primitive(ACROSS, [[0, 1, 2], [0, 2, 3]], uv0=[[0, 0], [1, 0], [1, 1], [0, 1]], material=material))
            edit.add_node(mesh=mesh)
        yield scene, mesh, material, texture


def test_what_is_cut_out_by_a_picture_hides_nothing(room):
    scene, _, material, texture = room
    whole = indirect(scene, **MAPS)
    assert off(scene, indirect(scene, indirect_visibility="none")) > 2 * off(scene, whole)
    with scene.edit() as edit:
        edit.set_texture(texture.id, image=picture_of(numpy.arange(8)[None] == 3), nearest=True)
        edit.set_material(material.id, alpha_mode="mask", alpha_cutoff=.5)
    cut = indirect(scene, **MAPS)
    assert off(scene, cut) < .1 and off(scene, whole) > 2 * off(scene, cut)


def test_what_is_bent_hides_from_where_it_is(room):
    scene, mesh, *_ = room
    with scene.edit() as edit:
        edit.set_mesh_vertices(mesh.id, LYING)
    lying = indirect(scene, **MAPS)
    assert off(scene, lying) < .1
    with scene.edit() as edit:
        edit.set_mesh_vertices(mesh.id, ACROSS)
    across = indirect(scene, **MAPS)
    assert off(scene, across) < .2 and off(scene, lying) > 2 * off(scene, across)
