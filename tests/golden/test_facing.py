"""What raster and reference make of normals that point against their winding: the same (struct
bd_primitive in server/scene/model/scene.h says what).

Four squares side by side, lit from where the camera is, each with normals that lean to a side:
single-sided and double-sided ones, seen from the front and from the rear.
"""
import json
import os
import pathlib
import struct
import subprocess

import pytest

BUILD = pathlib.Path(os.environ["BD_BUILD_DIR"])
BOUNCE = BUILD / "clients/cli/bounce"


def squares(sign, rear_too):
    """A .glb; `sign` turns all normals round."""
    data = b"".join(struct.pack("<3f", *p) for p in ((-.5, -.5, 0), (.5, -.5, 0), (.5, .5, 0), (-.5, .5, 0)))
    data += struct.pack("<3f", 0.6 * sign, 0, 0.8 * sign) * 4 + struct.pack("<6H", 0, 1, 2, 0, 2, 3)
    nodes, rear = [], [0, 1, 0, 0]  # half a turn about y
    for i in range(4):
        nodes.append({"mesh": i % 2, "translation": [1.1 * (i - 1.5), 0, 0],
                      **({"rotation": rear} if i >= 2 and rear_too else {})})
    nodes += [{"camera": 0, "translation": [0, 0, 5]},
              {"translation": [1, 2, 4], "extensions": {"KHR_lights_punctual": {"light": 0}}}]
    attributes = {"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2}
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(6))}], "nodes": nodes,
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 1000}]}},
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.9, "znear": 0.1}}],
        "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0}, "doubleSided": d} for d in (False, True)],
        "meshes": [{"primitives": [{**attributes, "material": i}]} for i in range(2)],
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": [{"buffer": 0, "byteOffset": at, "byteLength": size}
                        for at, size in ((0, 48), (48, 48), (96, 12))],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
                       "min": [-.5, -.5, 0], "max": [.5, .5, 0]},
                      {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3"},
                      {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"}]}
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    return (struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(data)) +
            struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data)


def render(folder, name, glb, technique, *options):
    (folder / "scene.glb").write_bytes(glb)
    image = folder / f"{name}.exr"
    report = folder / f"{name}.json"
    subprocess.run([BOUNCE, "render", folder / "scene.glb", "-o", image, "--report", report, "--size", "64x48", "--aa", "1",
                    "--technique", technique, "--layers", "direct", "--quiet", *options],
                   check=True, env={**os.environ, "XDG_RUNTIME_DIR": str(folder)}, timeout=120)
    return image, json.loads(report.read_text())


def difference(one, other):
    out = subprocess.run([BOUNCE, "compare", one, other, "--layer", "direct", "--json"], capture_output=True, check=True)
    return json.loads(out.stdout)["rel_rmse"]["value"]


@pytest.mark.parametrize("rear_too", [False, True])
def test_normals_against_their_winding(tmp_path, rear_too):
    right, _ = render(tmp_path, "right", squares(1, rear_too), "direct")
    turned, report = render(tmp_path, "turned", squares(-1, rear_too), "direct")
    assert "normals_against_winding: 4" in report["flags"], report["flags"]
    reference, _ = render(tmp_path, "reference", squares(-1, rear_too), "reference")
    assert difference(reference, turned) < 0.02
    # They mean the light of their negatives.
    assert difference(right, turned) == 0
