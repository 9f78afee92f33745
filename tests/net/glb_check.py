"""A strict look at a .glb that the export wrote: what glTF 2.0 asks of the container, the document
and the bytes behind it. Raises with the JSON path of the first thing that is not so.

    python3 glb_check.py FILE.glb ...     says what each holds
"""
import json
import math
import struct
import sys

COMPONENTS = {5123: ("H", 2), 5125: ("I", 4), 5126: ("f", 4)}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
ATTRIBUTES = {"POSITION": "VEC3", "NORMAL": "VEC3", "TANGENT": "VEC4", "TEXCOORD_0": "VEC2",
              "TEXCOORD_1": "VEC2", "COLOR_0": "VEC4"}
TOP = {"asset", "extensionsUsed", "extensions", "scene", "scenes", "nodes", "meshes", "materials",
       "textures", "samplers", "images", "cameras", "accessors", "bufferViews", "buffers"}


class Broken(Exception):
    pass


def need(condition, path, what=""):
    if not condition:
        raise Broken(f"{path}: {what or 'is not so'}")


def no_constant(word):
    raise Broken(f"{word} is no JSON")


def no_duplicates(pairs):
    need(len({key for key, _ in pairs}) == len(pairs), "JSON", f"a key twice in {pairs!r:.80}")
    return dict(pairs)


def chunks_of(data):
    need(len(data) >= 20 and data[:4] == b"glTF", "header")
    version, length = struct.unpack_from("<II", data, 4)
    need(version == 2 and length == len(data), "header", f"version {version}, length {length}")
    at, chunks = 12, []
    while at < len(data):
        size, kind = struct.unpack_from("<I4s", data, at)
        need(size % 4 == 0 and at + 8 + size <= len(data), f"chunk {len(chunks)}", f"{size} bytes")
        chunks.append((kind, data[at + 8:at + 8 + size]))
        at += 8 + size
    need([kind for kind, _ in chunks] in ([b"JSON"], [b"JSON", b"BIN\0"]), "chunks")
    return chunks[0][1], chunks[1][1] if len(chunks) == 2 else b""


class Document:
    def __init__(self, data):
        text, self.binary = chunks_of(data)
        self.json = json.loads(text.decode("utf-8"), parse_constant=no_constant,
                               object_pairs_hook=no_duplicates)
        need(set(self.json) <= TOP, "document", f"has {set(self.json) - TOP}")
        self.values = {}
        self.used = set()

    def list(self, name):
        items = self.json.get(name, [])
        need(name not in self.json or items, name, "is empty")
        return items

    def index(self, value, name, path):
        need(type(value) is int and 0 <= value < len(self.list(name)), path, f"{value} in {name}")
        return value

    def extensions(self, item, path, allowed):
        found = item.get("extensions", {})
        need("extensions" not in item or found, path, "has extensions that are none")
        need(set(found) <= set(allowed), path, f"has {set(found)}")
        self.used |= set(found)
        return found

    # --- bytes ---

    def check_buffers(self):
        buffers = self.list("buffers")
        need(len(buffers) == (1 if self.binary else 0), "buffers")
        if buffers:
            need(buffers[0] == {"byteLength": len(self.binary)}, "buffers[0]")
        end = 0
        for i, view in enumerate(self.list("bufferViews")):
            path, start = f"bufferViews[{i}]", view.get("byteOffset", 0)
            self.index(view["buffer"], "buffers", path)
            need(start % 4 == 0 and start >= end and view["byteLength"] > 0, path)
            need("byteStride" not in view and view.get("target") in (None, 34962, 34963), path)
            end = start + view["byteLength"]
            need(end <= len(self.binary), path, f"ends at {end}")
            need(not any(self.binary[end:(end + 3) // 4 * 4]), path, "padding")
        need(end + 3 >= len(self.binary), "buffers[0]", "bytes that no view holds")

    def check_accessor(self, i, accessor):
        path = f"accessors[{i}]"
        view = self.list("bufferViews")[self.index(accessor["bufferView"], "bufferViews", path)]
        letter, size = COMPONENTS[accessor["componentType"]]
        width, count = WIDTHS[accessor["type"]], accessor["count"]
        need(count > 0 and count * width * size == view["byteLength"], path)
        need("byteOffset" not in accessor and "normalized" not in accessor, path)
        start = view.get("byteOffset", 0)
        flat = struct.unpack_from(f"<{count * width}{letter}", self.binary, start)
        need(all(map(math.isfinite, flat)), path, "is not finite")
        self.values[i] = (accessor, view.get("target"), width, flat)
        for key, take in (("min", min), ("max", max)):
            if key in accessor:
                columns = [take(flat[c::width]) for c in range(width)]
                stored = [struct.unpack("<f", struct.pack("<f", v))[0] for v in accessor[key]]
                need(columns == stored, f"{path}.{key}", f"is {stored}, should be {columns}")

    # --- meshes ---

    def check_primitive(self, path, primitive):
        attributes = primitive["attributes"]
        need({"POSITION", "NORMAL"} <= set(attributes) <= set(ATTRIBUTES), path, str(attributes))
        need("TEXCOORD_1" not in attributes or "TEXCOORD_0" in attributes, path)
        counts = set()
        for name, at in attributes.items():
            self.index(at, "accessors", path)
            accessor, target, width, flat = self.values[at]
            need((accessor["type"], accessor["componentType"], target) ==
                 (ATTRIBUTES[name], 5126, 34962), f"{path}.{name}")
            counts.add(accessor["count"])
            if name in ("NORMAL", "TANGENT"):
                for k in range(0, len(flat), width):
                    need(abs(math.hypot(*flat[k:k + 3]) - 1) < 5e-4, f"{path}.{name}", f"at {k}")
                    need(width == 3 or flat[k + 3] in (1, -1), f"{path}.{name}", f"at {k}")
            need(name != "COLOR_0" or 0 <= min(flat) <= max(flat) <= 1, f"{path}.{name}")
        need("min" in self.values[attributes["POSITION"]][0], path, "POSITION without bounds")
        need(len(counts) == 1, path, f"counts {counts}")
        self.index(primitive["indices"], "accessors", path)
        accessor, target, _, flat = self.values[primitive["indices"]]
        need(accessor["type"] == "SCALAR" and target == 34963 and len(flat) % 3 == 0, path)
        need(max(flat) < counts.pop() and max(flat) not in (0xffff, 0xffffffff), path, "indices")
        material = self.list("materials")[self.index(primitive["material"], "materials", path)]
        need("normalTexture" not in material or "TANGENT" in attributes, path, "has no tangents")
        for info, at in texture_infos(material, path):
            need(f"TEXCOORD_{info.get('texCoord', 0)}" in attributes, at, "has no coordinates")

    # --- materials ---

    def check_material(self, path, material):
        allowed = ["emissive_strength", "ior", "transmission", "unlit", "volume"]
        found = self.extensions(material, path, ["KHR_materials_" + name for name in allowed])
        pbr = material.get("pbrMetallicRoughness", {})
        factors = [*pbr.get("baseColorFactor", []), *material.get("emissiveFactor", []),
                   pbr.get("metallicFactor", 1), pbr.get("roughnessFactor", 1)]
        need(all(0 <= f <= 1 for f in factors), path, f"factors {factors}")
        need(material.get("alphaMode", "OPAQUE") in ("OPAQUE", "MASK", "BLEND"), path)
        need("alphaCutoff" not in material or "alphaMode" in material, path)
        ior = found.get("KHR_materials_ior", {}).get("ior", 1.5)
        need(ior == 0 or ior >= 1, path, f"ior {ior}")
        distance = found.get("KHR_materials_volume", {}).get("attenuationDistance", 1)
        need(distance > 0, path, f"attenuationDistance {distance}")
        for info, at in texture_infos(material, path):
            self.index(info["index"], "textures", at)
            self.extensions(info, at, ["KHR_texture_transform"])

    def check_pictures(self):
        for i, texture in enumerate(self.list("textures")):
            for key, name in (("source", "images"), ("sampler", "samplers")):
                if key in texture:
                    self.index(texture[key], name, f"textures[{i}].{key}")
        for i, sampler in enumerate(self.list("samplers")):
            need(sampler["magFilter"] in (9728, 9729), f"samplers[{i}]")
            need(sampler["minFilter"] in range(9984, 9988), f"samplers[{i}]")
            need({sampler["wrapS"], sampler["wrapT"]} <= {10497, 33071, 33648}, f"samplers[{i}]")
        for i, image in enumerate(self.list("images")):
            path = f"images[{i}]"
            need(image["mimeType"] == "image/png" and "uri" not in image, path)
            view = self.list("bufferViews")[self.index(image["bufferView"], "bufferViews", path)]
            need("target" not in view, path)
            need(self.binary[view["byteOffset"]:][:8] == b"\x89PNG\r\n\x1a\n", path, "is no PNG")

    # --- nodes ---

    def check_node(self, path, node):
        for key, name in (("mesh", "meshes"), ("camera", "cameras")):
            if key in node:
                self.index(node[key], name, f"{path}.{key}")
        need("matrix" not in node or (len(node["matrix"]) == 16 and
                                      node["matrix"][3::4] == [0, 0, 0, 1]), path, "matrix")
        found = self.extensions(node, path, ["KHR_lights_punctual", "KHR_node_visibility"])
        if "KHR_lights_punctual" in found:
            lights = self.json["extensions"]["KHR_lights_punctual"]["lights"]
            need(0 <= found["KHR_lights_punctual"]["light"] < len(lights), path, "light")

    def check_hierarchy(self):
        nodes, parents = self.list("nodes"), {}
        for i, node in enumerate(nodes):
            need("children" not in node or node["children"], f"nodes[{i}].children", "is empty")
            for child in node.get("children", []):
                self.index(child, "nodes", f"nodes[{i}].children")
                need(child not in parents, f"nodes[{child}]", "has two parents")
                parents[child] = i
        for i in range(len(nodes)):
            at, steps = i, 0
            while at in parents:
                at, steps = parents[at], steps + 1
                need(steps <= len(nodes), f"nodes[{i}]", "is its own ancestor")
        need(self.json["scene"] == 0 and len(self.list("scenes")) == 1, "scenes")
        roots = self.json["scenes"][0].get("nodes", [])
        need("nodes" not in self.json["scenes"][0] or roots, "scenes[0].nodes", "is empty")
        need(len(set(roots)) == len(roots), "scenes[0].nodes", "lists a node twice")
        for root in roots:
            need(self.index(root, "nodes", "scenes[0].nodes") not in parents, "scenes[0].nodes")

    def check_cameras_and_lights(self):
        for i, camera in enumerate(self.list("cameras")):
            lens = camera[camera["type"]]
            need(lens["znear"] < lens.get("zfar", math.inf), f"cameras[{i}]")
            need(all(value >= 0 for value in lens.values()), f"cameras[{i}]")
        root = self.extensions(self.json, "document",
                               ["BOUNCED_environment", "KHR_lights_punctual"])
        sky = root.get("BOUNCED_environment", {"radiance": [0, 0, 0]})
        need(len(sky["radiance"]) == 3 and min(sky["radiance"]) >= 0, "environment", "radiance")
        if "map" in sky:
            at = self.index(sky["map"]["accessor"], "accessors", "environment.map")
            accessor, target, width, flat = self.values[at]
            need((accessor["componentType"], target, width) == (5126, None, 3), "environment.map")
            need(len(flat) == 3 * sky["map"]["width"] * sky["map"]["height"], "environment.map")
            need(min(flat) >= 0, "environment.map", "is negative")
        for i, light in enumerate(root.get("KHR_lights_punctual", {}).get("lights", [])):
            path = f"lights[{i}]"
            need(light["type"] in ("directional", "point", "spot"), path)
            need(light["intensity"] >= 0 and min(light["color"]) >= 0, path)
            need(("spot" in light) == (light["type"] == "spot"), path)
            cone = light.get("spot", {"innerConeAngle": 0, "outerConeAngle": 1})
            need(0 <= cone["innerConeAngle"] < cone["outerConeAngle"] <= math.pi / 2, path)
            need(light.get("range", 1) > 0, path)

    def check(self):
        need(self.json["asset"]["version"] == "2.0", "asset.version")
        self.check_buffers()
        for i, accessor in enumerate(self.list("accessors")):
            self.check_accessor(i, accessor)
        for i, mesh in enumerate(self.list("meshes")):
            need(mesh["primitives"], f"meshes[{i}].primitives", "is empty")
            for p, primitive in enumerate(mesh["primitives"]):
                self.check_primitive(f"meshes[{i}].primitives[{p}]", primitive)
        for i, material in enumerate(self.list("materials")):
            self.check_material(f"materials[{i}]", material)
        self.check_pictures()
        for i, node in enumerate(self.list("nodes")):
            self.check_node(f"nodes[{i}]", node)
        self.check_hierarchy()
        self.check_cameras_and_lights()
        need(sorted(self.used) == self.json.get("extensionsUsed", []), "extensionsUsed",
             f"used are {sorted(self.used)}")
        return self.json


def texture_infos(material, path):
    """Every map of a material with its JSON path."""
    places = [material, material.get("pbrMetallicRoughness", {}),
              *material.get("extensions", {}).values()]
    return [(value, f"{path}.{key}") for place in places for key, value in place.items()
            if key.endswith("Texture")]


def check(data):
    """The document, if all is well."""
    return Document(bytes(data)).check()


if __name__ == "__main__":
    for name in sys.argv[1:]:
        with open(name, "rb") as file:
            document = check(file.read())
        print(name, {key: len(value) for key, value in document.items() if type(value) is list})
