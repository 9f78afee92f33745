"""Loads a .glb, changes its JSON and buffers, and saves it again.

Only what scenes in one file need: one binary chunk, no sparse accessors, no compressed meshes.
"""
import copy
import json
import struct
from pathlib import Path

import numpy as np

COMPONENTS = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32,
              5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
CODES = {np.dtype(kind): code for code, kind in COMPONENTS.items()}


class Glb:
    """`doc` is the JSON, to be changed in place; `binary` the one buffer, which only grows."""

    def __init__(self, doc, binary):
        self.doc = doc
        self.binary = bytearray(binary)

    @classmethod
    def loads(cls, data):
        magic, version, _ = struct.unpack_from("<4sII", data)
        if magic != b"glTF" or version != 2:
            raise ValueError("not a .glb of version 2")
        chunks, at = {}, 12
        while at < len(data):
            size, kind = struct.unpack_from("<I4s", data, at)
            chunks.setdefault(kind, data[at + 8:at + 8 + size])
            at += 8 + size
        return cls(json.loads(chunks[b"JSON"]), chunks.get(b"BIN\0", b""))

    @classmethod
    def load(cls, path):
        return cls.loads(Path(path).read_bytes())

    def copy(self):
        return Glb(copy.deepcopy(self.doc), self.binary)

    def dumps(self):
        body = bytes(self.binary) + b"\0" * (-len(self.binary) % 4)
        if body:
            self.doc["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.doc, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        out = struct.pack("<I4s", len(text), b"JSON") + text
        if body:
            out += struct.pack("<I4s", len(body), b"BIN\0") + body
        return struct.pack("<4sII", b"glTF", 2, 12 + len(out)) + out

    def save(self, path):
        Path(path).write_bytes(self.dumps())

    # --- what the JSON holds ---

    def every(self, key):
        """doc[key], [] where there is none."""
        return self.doc.get(key, [])

    def lights(self):
        return (self.doc.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", []))

    def primitives(self):
        """(mesh index, primitive) of all meshes."""
        return [(i, primitive) for i, mesh in enumerate(self.every("meshes"))
                for primitive in mesh["primitives"]]

    def roots(self):
        """Node indices of the scene that is shown."""
        return self.doc["scenes"][self.doc.get("scene", 0)].get("nodes", [])

    # --- buffers ---

    def view_bytes(self, index):
        view = self.doc["bufferViews"][index]
        at = view.get("byteOffset", 0)
        return bytes(self.binary[at:at + view["byteLength"]])

    def accessor(self, index):
        """A copy, count x width (or count, of scalars), in the type in which it is stored."""
        item = self.doc["accessors"][index]
        if "sparse" in item:
            raise ValueError(f"accessors[{index}] is sparse")
        kind, width = np.dtype(COMPONENTS[item["componentType"]]), WIDTHS[item["type"]]
        shape = (item["count"],) if width == 1 else (item["count"], width)
        if "bufferView" not in item:
            return np.zeros(shape, kind)
        view = self.doc["bufferViews"][item["bufferView"]]
        stride = view.get("byteStride") or width * kind.itemsize
        strides = (stride,) if width == 1 else (stride, kind.itemsize)
        at = view.get("byteOffset", 0) + item.get("byteOffset", 0)
        return np.ndarray(shape, kind, self.binary, at, strides).copy()

    def append(self, key, item):
        self.doc.setdefault(key, []).append(item)
        return len(self.doc[key]) - 1

    def add_view(self, data):
        self.binary += b"\0" * (-len(self.binary) % 4)
        at = len(self.binary)
        self.binary += data
        return self.append("bufferViews", {"buffer": 0, "byteOffset": at, "byteLength": len(data)})

    def add_accessor(self, array, normalized=False):
        """A new accessor in the array's own type. 8 and 16 bit vectors of width 3 are not for it:
        glTF wants each element to start at a multiple of four bytes."""
        array = np.ascontiguousarray(array)
        width = 1 if array.ndim == 1 else array.shape[1]
        item = {"bufferView": self.add_view(array.tobytes()), "componentType": CODES[array.dtype],
                "count": len(array), "type": TYPES[width]}
        if width == 3 and array.dtype == np.float32:
            item["min"] = [float(v) for v in array.min(axis=0)]
            item["max"] = [float(v) for v in array.max(axis=0)]
        if normalized:
            item["normalized"] = True
        return self.append("accessors", item)

    def add_png(self, data):
        """A new image; its index."""
        return self.append("images", {"bufferView": self.add_view(data), "mimeType": "image/png"})
