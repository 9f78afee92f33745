"""Scenes of glass and of what blends, made of triangles by hand, and how they are looked at."""
import base64
import json
import math

import bounced
import numpy

GLASS = {"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0},
         "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_volume": {"thicknessFactor": 1}}}
THIN = {**GLASS, "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}}
TINTED = {**THIN, "pbrMetallicRoughness": {**THIN["pbrMetallicRoughness"], "baseColorFactor": [.5, .8, 1, 1]}}
GREY = {"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 1, "baseColorFactor": [.5, .5, .5, 1]}}
LIGHTS = [{"type": "point", "intensity": 100}, {"type": "directional", "intensity": 10},
          {"type": "spot", "intensity": 100, "spot": {"innerConeAngle": .6, "outerConeAngle": .9}}]


def lamp(strength):
    """That reflects nothing of what comes back to it."""
    return {"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "roughnessFactor": 1, "metallicFactor": 0},
            "emissiveFactor": [1, 1, 1], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": strength}, "KHR_materials_ior": {"ior": 1}}}


def sphere(rings=48):
    """Positions, which are its normals too, and triangles of the unit sphere."""
    turns = 2 * rings
    places = [(math.sin(a) * math.cos(b), math.cos(a), -math.sin(a) * math.sin(b))
              for a in (math.pi * i / rings for i in range(rings + 1)) for b in (2 * math.pi * k / turns for k in range(turns + 1))]
    corners = [i * (turns + 1) + k for i in range(rings) for k in range(turns)]
    triangles = [t for c in corners for t in ((c, c + turns + 1, c + turns + 2), (c, c + turns + 2, c + 1))]
    return numpy.float32(places), numpy.float32(places), numpy.uint32(triangles)


def pane(z, half, facing=1):
    """A square across z, whose front is towards the viewer at +z, or away from it."""
    places = [(-half, -half, z), (half, -half, z), (half, half, z), (-half, half, z)]
    triangles = [(0, 1, 2), (0, 2, 3)] if facing > 0 else [(2, 1, 0), (3, 2, 0)]
    return numpy.float32(places), numpy.float32([(0, 0, facing)] * 4), numpy.uint32(triangles)


def walls():
    """Of a cube of side 2 whose window is at z = 1."""
    grey = {**GREY, "doubleSided": True}
    side = numpy.array([(-1, -1, -1), (-1, -1, 1), (-1, 1, 1), (-1, 1, -1)], numpy.float32)
    return [((numpy.roll(s * side, axis, 1), numpy.float32([numpy.roll((-s, 0, 0), axis)] * 4), numpy.uint32([(0, 1, 2), (0, 2, 3)])), grey)
            for axis in range(3) for s in (-1, 1) if (axis, s) != (2, -1)]


def gltf(parts, light=None, at=(0, 0, 4)):
    """A scene of (mesh, material) pairs, and of a light somewhere that shines towards -z."""
    data, views, accessors, meshes = b"", [], [], []
    for m, (mesh, _) in enumerate(parts):
        for array, kind, component in zip(mesh, ("VEC3", "VEC3", "SCALAR"), (5126, 5126, 5125)):
            views.append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes})
            accessors.append({"bufferView": len(views) - 1, "componentType": component, "type": kind,
                              "count": array.size if kind == "SCALAR" else len(array),
                              **({} if kind == "SCALAR" else {"min": array.min(0).tolist(), "max": array.max(0).tolist()})})
            data += array.tobytes()
        meshes.append({"primitives": [{"attributes": {"POSITION": 3 * m, "NORMAL": 3 * m + 1}, "indices": 3 * m + 2, "material": m}]})
    used = {name for _, material in parts for name in material.get("extensions", {})}
    nodes = [{"mesh": m} for m in range(len(parts))]
    if light:
        used.add("KHR_lights_punctual")
        nodes.append({"translation": list(at), "extensions": {"KHR_lights_punctual": {"light": 0}}})
    return json.dumps({
        **({"extensions": {"KHR_lights_punctual": {"lights": [light]}}} if light else {}),
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes, "meshes": meshes, "materials": [material for _, material in parts],
        "accessors": accessors, "bufferViews": views, "extensionsUsed": sorted(used),
        "buffers": [{"byteLength": len(data), "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}]})


SIZE = (32, 32)
BESIDE = {"eye": (3, 0, .95), "target": (0, 0, 0), "up": (0, 0, 1), "yfov": .7}  # below what is at z = 1 and more
# What else they would do is none of a test of direct light.
LOOK_THROUGH = {"direct": {}, "many_light": {"photons": 1024, "rays": 1, "far_rays": 2}, "ssbc": {"photons": 1024}, "photon": {"photons": 1024},
                "rsm": {"vpls": 16}, "isr": {}, "hisr": {"vpls": 64}, "multires_gather": {"vpls": 16}}


def add(client, folder, parts, sky=None, light=None, at=(0, 0, 4)):
    (folder / "scene.gltf").write_text(gltf(parts, light, at))
    return client.scenes.add(folder / "scene.gltf", **({"environment": bounced.Environment(radiance=sky)} if sky else {}))


# A few panes and balls, thirty pixels wide: defaults are for rooms.
SMALL = {"many_light": {"photons": 16384, "vpls": 1024, "walk_vpls": 1024, "cache_cells": 2048}, "photon": {"photons": 65536},
         "point_projection": {"points": 4096}}


def look(scene, technique="many_light", eye=(0, 0, 6), yfov=.3, size=SIZE, parameters=None, **asked):
    """Radiance, of the middle alone where that is all of one kind."""
    return scene.render(size=size, technique=technique, layers=["beauty"], pose=bounced.Pose(eye, (0, 0, 0), yfov=yfov),
                        parameters={**SMALL.get(technique, {}), **(parameters or {})}, **asked).layers["beauty"][..., :3].astype(float)
