"""Shapes for generated scenes: (positions, normals, indices, texture coordinates or None)."""
import math

import numpy as np


def quad(center, u, v):
    """A rectangle with half-edges u, v; its normal is u x v, its texture's v runs against v."""
    center, u, v = (np.asarray(a, float) for a in (center, u, v))
    normal = np.cross(u, v)
    normal /= np.linalg.norm(normal)
    positions = np.array([center - u - v, center + u - v, center + u + v, center - u + v])
    uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], float)
    return positions, np.tile(normal, (4, 1)), np.array([[0, 1, 2], [0, 2, 3]]), uv


def joined(parts):
    """Several (positions, normals, indices, uv) as one."""
    positions, normals, indices, uvs, first = [], [], [], [], 0
    for p, n, i, t in parts:
        positions.append(p)
        normals.append(n)
        indices.append(i + first)
        uvs.append(t)
        first += len(p)
    return (np.concatenate(positions), np.concatenate(normals), np.concatenate(indices),
            np.concatenate(uvs))


def box(half, bottom=True):
    """Outward-facing, around the origin."""
    x, y, z = half
    sides = [quad((x, 0, 0), (0, 0, -z), (0, y, 0)), quad((-x, 0, 0), (0, 0, z), (0, y, 0)),
             quad((0, y, 0), (x, 0, 0), (0, 0, -z)), quad((0, 0, z), (x, 0, 0), (0, y, 0)),
             quad((0, 0, -z), (-x, 0, 0), (0, y, 0))]
    if bottom:
        sides.append(quad((0, -y, 0), (x, 0, 0), (0, 0, z)))
    return joined(sides)


def disc(radius, height, segments, faces_up):
    angle = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    rim = np.stack([radius * np.cos(angle), np.full(segments, height), -radius * np.sin(angle)], 1)
    positions = np.concatenate([[[0, height, 0]], rim])
    around = np.arange(segments)
    indices = np.stack([np.zeros(segments, int), 1 + around, 1 + (around + 1) % segments], 1)
    if not faces_up:
        indices = indices[:, ::-1]
    normals = np.tile([0, 1 if faces_up else -1, 0], (segments + 1, 1))
    return positions, normals, indices, np.zeros((segments + 1, 2))


def icosphere(triangles):
    """The subdivided icosahedron with at least `triangles` faces, on the unit sphere."""
    g = (1 + math.sqrt(5)) / 2
    points = np.array([(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g),
                       (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)])
    faces = np.array([(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9),
                      (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2),
                      (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10),
                      (8, 6, 7), (9, 8, 1)])
    points = points / np.linalg.norm(points[0])
    while len(faces) < triangles:
        edges = np.sort(np.concatenate([faces[:, (0, 1)], faces[:, (1, 2)], faces[:, (2, 0)]]), 1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        middles = points[unique].sum(axis=1)
        middles /= np.linalg.norm(middles, axis=1, keepdims=True)
        ab, bc, ca = (len(points) + part for part in np.split(inverse.ravel(), 3))
        a, b, c = faces.T
        faces = np.concatenate([np.stack(t, 1) for t in
                                ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))])
        points = np.concatenate([points, middles])
    return points, faces


def turned(degrees):
    """The quaternion of a turn about y."""
    half = math.radians(degrees) / 2
    return [0, round(math.sin(half), 9), 0, round(math.cos(half), 9)]


def add(writer, name, shape, material, with_uv=False, **placing):
    """A node with a mesh of its own; `placing` is what glTF writes at a node."""
    positions, normals, indices, uv = shape
    mesh = writer.mesh(name, positions, normals, indices, material, uv if with_uv else None)
    return writer.node(name, mesh=mesh, **placing)
