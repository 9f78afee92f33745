"""A small glTF writer for generated scenes: arrays in, .glb or .gltf with a .bin out.

Deterministic: the same calls give the same bytes.
"""

import json
import struct
import zlib
from pathlib import Path

import numpy as np

FLOAT, UINT = 5126, 5125
SHAPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}


def png(rgba):
    """RGBA8 rows from the top, as an uncompressed-filter PNG."""
    rgba = np.asarray(rgba, np.uint8)
    rows = b"".join(b"\0" + row.tobytes() for row in rgba)

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = struct.pack(">IIBBBBB", rgba.shape[1], rgba.shape[0], 8, 6, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows, 9))
            + chunk(b"IEND", b""))


def facing(direction, up=(0, 1, 0)):
    """The quaternion of a camera or light that looks along `direction`: its -z goes there."""
    z = -np.asarray(direction, float)
    z /= np.linalg.norm(z)
    x = np.cross(up, z)
    if np.linalg.norm(x) < 1e-9:
        x = np.array([1.0, 0, 0])
    x /= np.linalg.norm(x)
    m = np.stack([x, np.cross(z, x), z], axis=1)
    w = np.sqrt(max(0, 1 + m[0, 0] + m[1, 1] + m[2, 2])) / 2
    if w > 1e-6:
        q = [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], 4 * w * w]
        q = np.array(q) / (4 * w)
    else:  # half a turn about the axis of the largest diagonal element
        i = int(np.argmax(np.diag(m)))
        q = np.zeros(4)
        q[:3] = (m[:, i] + np.eye(3)[:, i]) / 2
        q[:3] /= np.linalg.norm(q[:3])
    return [float(round(v, 9)) for v in q]


class Writer:
    generator = "bounced clients/harness"

    def __init__(self):
        self.bytes = bytearray()
        self.doc = {"asset": {"version": "2.0", "generator": self.generator},
                    "scene": 0, "scenes": [{"nodes": []}], "nodes": [], "meshes": [],
                    "materials": [], "accessors": [], "bufferViews": [], "buffers": []}
        self.extensions = set()

    def _append(self, key, item):
        self.doc.setdefault(key, []).append(item)
        return len(self.doc[key]) - 1

    def view(self, data):
        self.bytes += b"\0" * (-len(self.bytes) % 4)
        item = {"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(data)}
        self.bytes += data
        return self._append("bufferViews", item)

    def accessor(self, array, component=FLOAT):
        array = np.ascontiguousarray(array, np.float32 if component == FLOAT else np.uint32)
        width = 1 if array.ndim == 1 else array.shape[1]
        item = {"bufferView": self.view(array.tobytes()), "componentType": component,
                "count": len(array), "type": SHAPES[width]}
        if width == 3 and component == FLOAT:
            item["min"] = [float(v) for v in array.min(axis=0)]
            item["max"] = [float(v) for v in array.max(axis=0)]
        return self._append("accessors", item)

    def material(self, name, color=(1, 1, 1), alpha=1.0, roughness=1.0, metallic=0.0, **more):
        pbr = {"baseColorFactor": [*color, alpha], "metallicFactor": metallic,
               "roughnessFactor": roughness}
        pbr.update(more.pop("pbr", {}))
        return self._append("materials", {"name": name, "pbrMetallicRoughness": pbr, **more})

    def texture(self, rgba, nearest=False):
        image = self._append("images", {"bufferView": self.view(png(rgba)), "mimeType": "image/png"})
        sampler = self._append("samplers", {"magFilter": 9728 if nearest else 9729,
                                            "minFilter": 9728 if nearest else 9729})
        return self._append("textures", {"source": image, "sampler": sampler})

    def mesh(self, name, positions, normals, indices, material, uv=None):
        attributes = {"POSITION": self.accessor(positions), "NORMAL": self.accessor(normals)}
        if uv is not None:
            attributes["TEXCOORD_0"] = self.accessor(uv)
        primitive = {"attributes": attributes, "material": material,
                     "indices": self.accessor(np.ravel(indices), UINT)}
        return self._append("meshes", {"name": name, "primitives": [primitive]})

    def node(self, name, parent=None, **what):
        index = self._append("nodes", {"name": name, **what})
        if parent is None:
            self.doc["scenes"][0]["nodes"].append(index)
        else:
            self.doc["nodes"][parent].setdefault("children", []).append(index)
        return index

    def camera(self, name, position, look, yfov=None, mag=None, up=(0, 1, 0)):
        if yfov is not None:
            lens = {"type": "perspective", "perspective": {"yfov": yfov, "znear": 0.01}}
        else:
            lens = {"type": "orthographic", "orthographic": {
                "xmag": mag[0], "ymag": mag[1], "znear": 0.0, "zfar": 100.0}}
        camera = self._append("cameras", {"name": name, **lens})
        return self.node(name, camera=camera, translation=list(position),
                         rotation=facing(look, up))

    def light(self, name, kind, intensity, position=(0, 0, 0), look=(0, 0, -1), color=(1, 1, 1),
              cone=None):
        light = {"name": name, "type": kind, "intensity": intensity, "color": list(color)}
        if kind == "spot":
            light["spot"] = {"innerConeAngle": cone[0], "outerConeAngle": cone[1]}
        self.extensions.add("KHR_lights_punctual")
        lights = self.doc.setdefault("extensions", {}).setdefault(
            "KHR_lights_punctual", {"lights": []})["lights"]
        lights.append(light)
        return self.node(name, translation=list(position), rotation=facing(look),
                         extensions={"KHR_lights_punctual": {"light": len(lights) - 1}})

    def _json(self, buffer):
        doc = {key: value for key, value in self.doc.items() if value != []}
        doc["buffers"] = [buffer]
        if self.extensions:
            doc["extensionsUsed"] = sorted(self.extensions)
        return doc

    def glb(self):
        """The whole .glb as bytes."""
        body = bytes(self.bytes) + b"\0" * (-len(self.bytes) % 4)
        text = json.dumps(self._json({"byteLength": len(self.bytes)}),
                          separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        out = struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(body))
        out += struct.pack("<I4s", len(text), b"JSON") + text
        out += struct.pack("<I4s", len(body), b"BIN\0") + body
        return out

    def write_glb(self, path):
        Path(path).write_bytes(self.glb())

    def write_gltf(self, path):
        path = Path(path)
        binary = path.with_suffix(".bin")
        binary.write_bytes(bytes(self.bytes))
        doc = self._json({"byteLength": len(self.bytes), "uri": binary.name})
        path.write_text(json.dumps(doc, indent=1) + "\n")
