"""Scenes whose light or camera moves: copies of a .glb, a frame each, with one node placed anew.

A frame number is a place on a straight path about where the node was: nothing turns, nothing speeds
up. Nodes that are moved must be roots of the scene, so that their place is one in the world.
"""
import math

import numpy

from harness.glb import Glb

# Of the scene's diagonal, from a frame to the next: three seconds of film cross a fifteenth of it.
STEP_PER_DIAGONAL = 1e-3


def turned(quaternion, vector):
    """The vector after the rotation that a node's quaternion (x, y, z, w) stands for."""
    axis, w = numpy.asarray(quaternion[:3], float), quaternion[3]
    vector = numpy.asarray(vector, float)
    across = 2 * numpy.cross(axis, vector)
    return vector + w * across + numpy.cross(axis, across)


def rolled(quaternion, degrees):
    """The same orientation after a turn about its own z axis: a spot's axis, a sun's direction."""
    x, y, z, w = quaternion
    s, c = math.sin(math.radians(degrees) / 2), math.cos(math.radians(degrees) / 2)
    return [x * c + y * s, y * c - x * s, z * c + w * s, w * c - z * s]


def diagonal_m(glb):
    """Of the bounds of all meshes, each as its node stands; of nodes without a matrix."""
    low, high = numpy.full(3, numpy.inf), numpy.full(3, -numpy.inf)
    for index in glb.roots():
        node = glb.doc["nodes"][index]
        if "mesh" not in node:
            continue
        for primitive in glb.doc["meshes"][node["mesh"]]["primitives"]:
            item = glb.doc["accessors"][primitive["attributes"]["POSITION"]]
            corners = numpy.array([[item[("min", "max")[i >> a & 1]][a] for a in range(3)]
                                   for i in range(8)]) * node.get("scale", [1, 1, 1])
            corners = [turned(node.get("rotation", [0, 0, 0, 1]), corner) for corner in corners]
            corners = numpy.array(corners) + node.get("translation", [0, 0, 0])
            low = numpy.minimum(low, corners.min(axis=0))
            high = numpy.maximum(high, corners.max(axis=0))
    return float(numpy.linalg.norm(high - low))


def light_node(glb):
    """The node of the one light that the scene must have."""
    nodes = [glb.doc["nodes"][i] for i in glb.roots()
             if "KHR_lights_punctual" in glb.doc["nodes"][i].get("extensions", {})]
    if len(nodes) != 1:
        raise ValueError(f"{len(nodes)} lights among the roots, one is wanted")
    return nodes[0]


def camera_node(glb):
    """The first camera's node, which is what a frame without --camera is seen from."""
    return next(glb.doc["nodes"][i] for i in glb.roots() if "camera" in glb.doc["nodes"][i])


def shift(node, metres):
    """Moves a node along its own x axis."""
    aside = turned(node.get("rotation", [0, 0, 0, 1]), [1, 0, 0])
    node["translation"] = [float(v) for v in
                           numpy.asarray(node.get("translation", [0, 0, 0])) + metres * aside]


def scene_at(glb, moving, frame, frames, roll_degrees=0.0):
    """A copy with the light or the camera (`moving`) where it is in a frame of `frames`.

    A roll turns a light about its own axis: a spot of one cone gives the same light, from another
    grid of virtual lights."""
    scene = glb.copy()
    step_m = STEP_PER_DIAGONAL * diagonal_m(glb)
    node = {"light": light_node, "camera": camera_node}[moving](scene)
    shift(node, step_m * (frame - (frames - 1) / 2))
    light = light_node(scene)
    light["rotation"] = rolled(light.get("rotation", [0, 0, 0, 1]), roll_degrees)
    return scene


def load(path):
    return Glb.load(path)
