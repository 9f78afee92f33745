"""Scenes by their numbers: always the same, and none like another."""
import json
import struct

import random_scenes


def document(path):
    data = path.read_bytes()
    return json.loads(data[20:20 + struct.unpack_from("<I", data, 12)[0]])


def test_a_number_is_a_scene(tmp_path):
    random_scenes.main(["6", str(tmp_path / "a")])
    random_scenes.main(["2", str(tmp_path / "b"), "--first", "4"])
    scenes = {path.name: path.read_bytes() for path in (tmp_path / "a").iterdir()}
    assert len(scenes) == 6 and len(set(scenes.values())) == 6
    for path in (tmp_path / "b").iterdir():
        assert scenes[path.name] == path.read_bytes()


def test_they_have_what_a_frame_cannot_hint_at(tmp_path):
    """Over some of them: panels that shine, poles thinner than a pixel, holes in walls, metals, checkers."""
    random_scenes.main(["12", str(tmp_path)])
    documents = [document(path) for path in tmp_path.iterdir()]
    names = [node["name"] for one in documents for node in one["nodes"]]
    materials = [material for one in documents for material in one["materials"]]
    assert {"panel", "pole", "ball", "box"} <= set(names)
    assert all("cameras" in one and "KHR_lights_punctual" in one["extensionsUsed"] for one in documents)
    assert any(material["pbrMetallicRoughness"]["metallicFactor"] == 1 for material in materials)
    assert any("baseColorTexture" in material["pbrMetallicRoughness"] for material in materials)
