"""A hundred thousand lamps: rendered where they need no maps, refused in a line where they do, and the daemon goes on."""
import json
import struct

import bounced
import pytest
from conftest import SCENES

LAMPS = 100_000


def under_lamps(path):
    """The Cornell box, with points close below its ceiling instead of its lamps."""
    data = path.read_bytes()
    size, = struct.unpack_from("<I", data, 12)
    doc = json.loads(data[20:20 + size])
    for node in doc["nodes"]:
        node.get("extensions", {}).pop("KHR_lights_punctual", None)
    doc["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 1e-4}]}}
    doc["extensionsUsed"] = ["KHR_lights_punctual"]
    first = len(doc["nodes"])
    doc["nodes"] += [{"translation": [.8 * (i * .754877666 % 1) - .4, .9, .8 * (i * .56984029 % 1) - .4],
                      "extensions": {"KHR_lights_punctual": {"light": 0}}} for i in range(LAMPS)]
    doc["scenes"][0]["nodes"] += range(first, first + LAMPS)
    text = json.dumps(doc, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + size:]
    return struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest)) + struct.pack("<I4s", len(text), b"JSON") + text + rest


def test_a_hundred_thousand_lamps_do_not_end_the_daemon(tmp_path):
    path = tmp_path / "lamps.glb"
    path.write_bytes(under_lamps(SCENES / "cornell.glb"))
    with bounced.private() as daemon:
        scene = daemon.scenes.add(path)
        look = {"size": (32, 32), "layers": ["direct"]}
        for technique in ("direct", "multires_gather", "hisr"):
            frame = scene.render(**look, technique=technique)
            passes = {one["name"] for one in frame.report["passes"]}
            assert "lamps" in passes and "shadow_map" not in passes
            assert {"pass": "shadow_map", "reason": "many punctual lights: by rays"} in frame.report["omitted"]
            assert frame.layers["direct"].mean() > 0
        # Each more of what one alone gives, within the noise.
        few = scene.render(**look, technique="direct", parameters={"light_rays": 64}).layers["direct"].mean()
        assert abs(frame.layers["direct"].mean() / few - 1) < .02
        with pytest.raises(bounced.Error) as refused:
            scene.render(**look, technique="direct", parameters={"lamps": "maps", "shadow_size": 8192})
        assert "\n" not in str(refused.value) and "memory" in str(refused.value)
        assert scene.render(**look, technique="direct").layers["direct"].mean() > 0
