"""Changes to a scene that a metamorphic relation makes: each returns a changed copy.

What the picture does about it is the relation's own business (relations.py).
"""
import io

import numpy as np

from .gltf import png

LIGHTS = "KHR_lights_punctual"
STRENGTH = "KHR_materials_emissive_strength"


def prepared(glb):
    """The scene as every relation starts from it: no animations, cameras of unique names."""
    glb = glb.copy()
    glb.doc.pop("animations", None)
    for index, node in enumerate(glb.every("nodes")):
        if "camera" in node:
            node["name"] = f"{node.get('name', 'camera')}.{index}"
    return glb


def camera_names(glb):
    return [node["name"] for node in glb.every("nodes") if "camera" in node]


def corners(glb):
    """Smallest and largest world position of the vertices, after all placements."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for index, world in placements(glb):
        for primitive in glb.doc["meshes"][index]["primitives"]:
            item = glb.doc["accessors"][primitive["attributes"]["POSITION"]]
            ends = np.array([item["min"], item["max"]])
            box = np.array([[ends[i, 0], ends[j, 1], ends[k, 2], 1] for i in (0, 1)
                            for j in (0, 1) for k in (0, 1)]) @ world.T
            low, high = np.minimum(low, box[:, :3].min(0)), np.maximum(high, box[:, :3].max(0))
    return low, high


def rotation_matrix(q):
    x, y, z, w = np.asarray(q, float) / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def local_matrix(node):
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    matrix = np.eye(4)
    matrix[:3, :3] = rotation_matrix(node.get("rotation", (0, 0, 0, 1))) * node.get("scale", 1.0)
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def world_matrices(glb):
    """By node index, of the nodes in the scene that is shown."""
    matrices, waiting = {}, [(root, np.eye(4)) for root in glb.roots()]
    while waiting:
        index, parent = waiting.pop()
        node = glb.doc["nodes"][index]
        matrices[index] = parent @ local_matrix(node)
        waiting += [(child, matrices[index]) for child in node.get("children", [])]
    return matrices


def placements(glb):
    """(mesh index, world matrix) of every node that shows a mesh."""
    return [(glb.doc["nodes"][index]["mesh"], world)
            for index, world in world_matrices(glb).items() if "mesh" in glb.doc["nodes"][index]]


# --- the whole scene ---------------------------------------------------------------------------


def under_a_root(glb, **transform):
    """Everything, cameras and lights too, under one new node."""
    glb = glb.copy()
    root = glb.append("nodes", {"name": "relation root", "children": list(glb.roots()),
                                **transform})
    glb.doc["scenes"][glb.doc.get("scene", 0)]["nodes"] = [root]
    return glb


def _scale_keys(table, keys, factor):
    for key in keys:
        if key in table:
            table[key] *= factor


def scaled(glb, factor):
    """s times as large: intensities of point and spot lights s^2, all lengths s."""
    glb = under_a_root(glb, scale=[factor] * 3)
    for light in glb.lights():
        if light["type"] != "directional":
            light["intensity"] = light.get("intensity", 1.0) * factor * factor
        _scale_keys(light, ["range"], factor)
    for camera in glb.every("cameras"):
        _scale_keys(camera.get("perspective", {}), ["znear", "zfar"], factor)
        _scale_keys(camera.get("orthographic", {}), ["znear", "zfar", "xmag", "ymag"], factor)
    for material in glb.every("materials"):
        # thicknessFactor is in the mesh's space and grows with the node.
        volume = material.get("extensions", {}).get("KHR_materials_volume", {})
        _scale_keys(volume, ["attenuationDistance"], factor)
    return glb


def brightened(glb, factor):
    """All light times a factor: lights, and emission by its strength."""
    glb = glb.copy()
    for light in glb.lights():
        light["intensity"] = light.get("intensity", 1.0) * factor
    for material in glb.every("materials"):
        if any(material.get("emissiveFactor", ())):
            _use(glb, STRENGTH)
            strength = material.setdefault("extensions", {}).setdefault(STRENGTH, {})
            strength["emissiveStrength"] = strength.get("emissiveStrength", 1.0) * factor
    return glb


def _use(glb, extension):
    used = glb.doc.setdefault("extensionsUsed", [])
    if extension not in used:
        used.append(extension)


# --- order -------------------------------------------------------------------------------------


def _reorder(items, order):
    """items in a new order, and where each old index went."""
    went = {old: new for new, old in enumerate(order)}
    return [items[old] for old in order], went


def _light_of(node):
    return node.get("extensions", {}).get(LIGHTS)


def reordered(glb, seed=1):
    """Nodes, meshes, the primitives in them, and lights in another order; nothing else."""
    glb, rng = glb.copy(), np.random.default_rng(seed)
    doc = glb.doc
    for key, holder in (("nodes", doc), ("meshes", doc)):
        doc[key], went = _reorder(holder[key], list(map(int, rng.permutation(len(holder[key])))))
        _point_anew(doc, key, went, rng)
    for mesh in doc["meshes"]:
        rng.shuffle(mesh["primitives"])
    if glb.lights():
        table = doc["extensions"][LIGHTS]
        table["lights"], went = _reorder(table["lights"],
                                         list(range(len(table["lights"])))[::-1])
        for node in doc["nodes"]:
            if _light_of(node):
                _light_of(node)["light"] = went[_light_of(node)["light"]]
    return glb


def _point_anew(doc, key, went, rng):
    if key == "meshes":
        for node in doc["nodes"]:
            if "mesh" in node:
                node["mesh"] = went[node["mesh"]]
        return
    for holder, name in [(node, "children") for node in doc["nodes"]] + [
            (scene, "nodes") for scene in doc["scenes"]]:
        if name in holder:
            holder[name] = [went[old] for old in holder[name]]
            rng.shuffle(holder[name])


# --- colour ------------------------------------------------------------------------------------

COLOUR_TEXTURES = (("pbrMetallicRoughness", "baseColorTexture"), (None, "emissiveTexture"))


def _texels(data):
    """RGBA8 rows of an encoded picture."""
    from PIL import Image  # here: only pictures in a scene need it
    with Image.open(io.BytesIO(data)) as picture:
        return np.asarray(picture.convert("RGBA"))


def _colour_textures(material):
    for group, name in COLOUR_TEXTURES:
        table = material.get(group, {}) if group else material
        if name in table:
            yield table[name]


def pictures_as_png(glb, order=(0, 1, 2)):
    """Colour textures re-encoded, with their channels in another order.

    An unchanged order is for the other side of the comparison, so that both decode the same way.
    Each use gets a picture of its own: one may be data elsewhere (a normal map).
    """
    glb, done = glb.copy(), {}
    for material in glb.every("materials"):
        for reference in _colour_textures(material):
            index = reference["index"]
            if index not in done:
                texture = dict(glb.doc["textures"][index])
                image = glb.doc["images"][texture["source"]]
                texels = _texels(glb.view_bytes(image["bufferView"]))
                texture["source"] = glb.add_png(png(texels[..., [*order, 3]]))
                done[index] = glb.append("textures", texture)
            reference["index"] = done[index]
    return glb


def _permute_key(table, key, order):
    if key in table:
        table[key] = [table[key][i] for i in order] + list(table[key][3:])


def channels_permuted(glb, order):
    """Every colour with its channels in another order: new[i] = old[order[i]]."""
    glb = pictures_as_png(glb, order)
    for material in glb.every("materials"):
        _permute_key(material.get("pbrMetallicRoughness", {}), "baseColorFactor", order)
        _permute_key(material, "emissiveFactor", order)
        for table in material.get("extensions", {}).values():
            for key in ("attenuationColor", "specularColorFactor", "sheenColorFactor"):
                _permute_key(table, key, order)
    for light in glb.lights():
        _permute_key(light, "color", order)
    _permute_vertex_colours(glb, order)
    return glb


def _permute_vertex_colours(glb, order):
    done = {}
    for _, primitive in glb.primitives():
        attributes = primitive["attributes"]
        if "COLOR_0" not in attributes:
            continue
        index = attributes["COLOR_0"]
        if index not in done:
            colours, kind = glb.accessor(index), glb.doc["accessors"][index]
            alpha = colours[:, 3:] if colours.shape[1] == 4 else np.ones(
                (len(colours), 1), colours.dtype) * _one(colours.dtype)
            done[index] = glb.add_accessor(np.hstack([colours[:, list(order)], alpha]),
                                           kind.get("normalized", False))
        attributes["COLOR_0"] = done[index]


def _one(kind):
    return 1 if kind == np.float32 else np.iinfo(kind).max


# --- triangles ---------------------------------------------------------------------------------

FLAT_COSINE = 1 - 1e-6  # between the normals, and between the tangents, of a triangle's corners


def _unpacked(glb, index):
    """An attribute as floats: normalised integers are fractions."""
    values, item = glb.accessor(index), glb.doc["accessors"][index]
    if item.get("normalized"):
        return (values / np.float32(np.iinfo(values.dtype).max)).astype(np.float32)
    return values.astype(np.float32)


def _indices(glb, primitive, count):
    if "indices" in primitive:
        return glb.accessor(primitive["indices"]).astype(np.int64).reshape(-1, 3)
    return np.arange(count).reshape(-1, 3)


def _flat(attributes, faces):
    """Triangles over which normals and tangents do not turn: the same surface when subdivided."""
    flat = np.ones(len(faces), bool)
    for name in ("NORMAL", "TANGENT"):
        if name in attributes:
            a, b, c = (attributes[name][faces[:, k]][:, :3] for k in range(3))
            flat &= ((a * b).sum(1) > FLAT_COSINE) & ((a * c).sum(1) > FLAT_COSINE)
    return flat


def _split_faces(attributes, faces):
    """1 -> 4. Edges of one face each get a vertex of their own: seams need no care."""
    a, b, c = faces.T
    middles = {}
    for name, values in attributes.items():
        pairs = [(values[i].astype(np.float64) + values[j]) / 2
                 for i, j in ((a, b), (b, c), (c, a))]
        middles[name] = np.concatenate(pairs).astype(np.float32)
        if name == "TANGENT":  # its sign is no mean, and within a triangle it is the same
            middles[name][:, 3] = np.concatenate([values[i][:, 3] for i in (a, b, c)])
    first = len(next(iter(attributes.values())))
    ab, bc, ca = (first + k * len(faces) + np.arange(len(faces)) for k in range(3))
    out = np.concatenate([np.stack(t, 1) for t in
                          ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return {name: np.concatenate([values, middles[name]])
            for name, values in attributes.items()}, out


def subdivided(glb):
    """(the scene with its flat triangles cut in four, share of triangles that were cut)"""
    glb, cut, total = glb.copy(), 0, 0
    for _, primitive in glb.primitives():
        if primitive.get("mode", 4) != 4 or "targets" in primitive:
            continue
        attributes = {name: _unpacked(glb, index)
                      for name, index in primitive["attributes"].items()}
        faces = _indices(glb, primitive, len(attributes["POSITION"]))
        flat = _flat(attributes, faces)
        cut, total = cut + int(flat.sum()), total + len(faces)
        if not flat.any():
            continue
        attributes, split = _split_faces(attributes, faces[flat])
        primitive["indices"] = glb.add_accessor(
            np.concatenate([faces[~flat], split]).astype(np.uint32).ravel())
        primitive["attributes"] = {name: glb.add_accessor(values)
                                   for name, values in attributes.items()}
    return glb, cut / max(total, 1)


# --- lights ------------------------------------------------------------------------------------


def lights_halved(glb):
    """Each light twice in one place, at half the intensity."""
    glb = glb.copy()
    for light in glb.lights():
        light["intensity"] = light.get("intensity", 1.0) / 2
    for node in list(glb.doc["nodes"]):
        if _light_of(node):
            twin = glb.append("nodes", {"name": f"{node.get('name', 'light')} again",
                                        "extensions": {LIGHTS: dict(_light_of(node))}})
            node.setdefault("children", []).append(twin)
    return glb


def without_emission(glb):
    glb = glb.copy()
    for material in glb.every("materials"):
        material.pop("emissiveFactor", None)
        material.pop("emissiveTexture", None)
    return glb


def light_nodes(glb):
    """Indices of the shown nodes that place a light."""
    return sorted(index for index in world_matrices(glb)
                  if _light_of(glb.doc["nodes"][index]))


def with_lights(glb, keep):
    """Only the lights of these nodes."""
    glb = glb.copy()
    for index, node in enumerate(glb.doc["nodes"]):
        if _light_of(node) and index not in keep:
            del node["extensions"][LIGHTS]
    return glb


def with_a_lamp(glb, camera):
    """(the scene with one more light, its node): a point at the camera that gives 1 lx a quarter
    of the scene's diagonal away. At the camera: any other place may be inside a wall."""
    glb = glb.copy()
    low, high = corners(glb)
    distance = np.linalg.norm(high - low) / 4
    _use(glb, LIGHTS)
    lights = glb.doc.setdefault("extensions", {}).setdefault(LIGHTS, {}).setdefault("lights", [])
    lights.append({"name": "lamp", "type": "point", "intensity": float(distance ** 2),
                   "color": [1.0, 0.75, 0.5]})
    node = next(index for index, item in enumerate(glb.doc["nodes"])
                if item.get("name") == camera)
    world = world_matrices(glb)[node]
    lamp = glb.append("nodes", {"name": "lamp", "translation": [float(v) for v in world[:3, 3]],
                                "extensions": {LIGHTS: {"light": len(lights) - 1}}})
    glb.doc["scenes"][glb.doc.get("scene", 0)]["nodes"].append(lamp)
    return glb, lamp
