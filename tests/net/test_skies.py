"""Maps of the sky as they are found: lossy EXR of the shared data, Radiance pictures, and what is left of either
after damage. What became of one is read off the scene's export, texel by texel."""
import array
import os
import random
import struct
from pathlib import Path

import glb_check
import pytest
from conftest import SCENES

SKIES = Path(os.environ.get("BD_TEST_SKIES", SCENES.parent.parent.parent / "shared" / "skies"))
# Mean and largest value, from the skies' own README; but around the sun of `sky` its compression left 11 texels far below 0,
# which become 0: 0.78 instead of 0.70.
MEASURES = {"sky": (.784, 22672), "sunset": (.44, 801), "studio": (1.9, 3730), "night": (.064, 25)}


def sky_bytes(name):
    path = SKIES / f"{name}.exr"
    if not path.exists():
        pytest.skip("no shared skies here")
    return path.read_bytes()


def add(daemon, sky):
    return daemon.json("POST", "/v1/scenes", {
        "blob": daemon.put_blob((SCENES / "cornell.glb").read_bytes()), "name": "lit",
        "environment": {"map": daemon.put_blob(sky)}})


def texels(daemon, scene):
    status, _, exported = daemon.request("GET", f"/v1/scenes/{scene}/export")
    assert status == 200
    document = glb_check.check(exported)
    sky = document["extensions"]["BOUNCED_environment"]["map"]
    view = document["bufferViews"][document["accessors"][sky["accessor"]]["bufferView"]]
    chunk = exported.index(b"BIN\0") + 4
    at = chunk + view.get("byteOffset", 0)
    values = array.array("f", exported[at:at + 12 * sky["width"] * sky["height"]])
    return sky["width"], sky["height"], values


@pytest.mark.parametrize("name", MEASURES)
def test_real_skies(shared, name):
    status, scene = add(shared, sky_bytes(name))
    assert status == 201, scene
    width, height, values = texels(shared, scene["id"])
    mean, largest = MEASURES[name]
    assert (width, height) == (512, 256)
    assert abs(sum(values) / len(values) / mean - 1) < .02
    assert abs(max(values) / largest - 1) < .02
    assert any("environment_negative: 11 " in flag for flag in scene["flags"]) == (name == "sky")
    # Zenith on top: no sky is darker above than below the horizon.
    half = len(values) // 2
    assert sum(values[:half]) > sum(values[half:])


def test_what_is_left_of_a_sky_ends_nothing(shared):
    whole = sky_bytes("sky")
    choice = random.Random(5)
    answers = []
    for i in range(24):
        damaged = bytearray(whole)
        for _ in range(1 + i % 4):
            # The chunk's own head and rules follow the file's; half of the damage goes to those.
            damaged[choice.randrange(600 if i % 2 else len(whole))] ^= 1 << choice.randrange(8)
        if i % 6 == 5:
            del damaged[choice.randrange(len(damaged)):]
        status, answer = add(shared, bytes(damaged))
        answers.append(status)
        if status != 201:
            assert status == 400 and "environment.map" in answer["message"], answer
            assert "\n" not in answer["message"]
    assert answers.count(400) > 8, answers
    assert add(shared, whole)[0] == 201


PIXELS = [(128, 64, 32, 129), (255, 1, 0, 140), (0, 0, 0, 0), (9, 9, 9, 120),
          (1, 2, 3, 128), (200, 100, 50, 130), (10, 20, 30, 131), (77, 88, 99, 127)]


def radiance_file(rows=4):
    """Rows of eight pixels, in planes with runs where these help."""
    head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X 8\n" % rows
    row = b"\2\2\0\x08" + b"".join(bytes([8]) + bytes(p[plane] for p in PIXELS) for plane in range(4))
    return head + row * rows


def radiance_values():
    return [(p[c] + .5) * 2.0 ** (p[3] - 136) if p[3] else 0 for p in PIXELS for c in range(3)]


def test_a_radiance_picture_is_a_sky(shared):
    status, scene = add(shared, radiance_file())
    assert status == 201, scene
    width, height, values = texels(shared, scene["id"])
    assert (width, height) == (8, 4)
    assert list(values) == [struct.unpack("f", struct.pack("f", v))[0] for v in radiance_values() * 4]


def test_an_edit_sets_it_too(shared):
    scene = shared.add_scene()
    sky = shared.put_blob(radiance_file(2))
    status, answer = shared.json("POST", f"/v1/scenes/{scene}/edits",
                                 {"ops": [{"set_environment": {"map": sky}}]})
    assert status == 200, answer
    assert texels(shared, scene)[:2] == (8, 2)


def edit(daemon, scene, **environment):
    return daemon.json("POST", f"/v1/scenes/{scene}/edits", {"ops": [{"set_environment": environment}]})


def sky_in_export(daemon, scene):
    status, _, exported = daemon.request("GET", f"/v1/scenes/{scene}/export")
    assert status == 200
    return exported, glb_check.check(exported)["extensions"]["BOUNCED_environment"]


def test_a_sky_is_turned_alone_and_keeps_its_turn(shared):
    scene = shared.add_scene()
    sky = shared.put_blob(radiance_file(2))
    assert edit(shared, scene, map=sky, radiance=[1, 2, 3])[0] == 200
    assert "rotation" not in sky_in_export(shared, scene)[1]
    assert edit(shared, scene, rotation=[0, 3, 0, 4])[0] == 200
    exported, told = sky_in_export(shared, scene)
    assert told["radiance"] == [1, 2, 3] and told["map"]["width"] == 8
    assert told["rotation"] == pytest.approx([0, .6, 0, .8])
    status, again = shared.json("POST", "/v1/scenes", {"blob": shared.put_blob(exported), "name": "again"})
    assert status == 201, again
    assert sky_in_export(shared, again["id"])[1]["rotation"] == pytest.approx([0, .6, 0, .8])
    assert edit(shared, scene, map=sky)[0] == 200
    assert "rotation" not in sky_in_export(shared, scene)[1]
    assert shared.json("POST", f"/v1/scenes/{scene}/undo", {})[0] == 200
    assert sky_in_export(shared, scene)[1]["rotation"] == pytest.approx([0, .6, 0, .8])


@pytest.mark.parametrize("rotation,words", [([0, 0, 0, 0], "zero"), ([0, 1, 0], "four numbers, not 3"),
                                            ([0, 1e16, 0, 1], "-1e+15 to 1e+15")])
def test_turns_that_are_none(shared, rotation, words):
    status, answer = edit(shared, shared.add_scene(), radiance=[1, 1, 1], rotation=rotation)
    assert status == 400 and answer["details"]["field"] == "ops[0].set_environment.rotation", answer
    assert words in answer["message"]


def test_a_file_has_no_environment_to_turn(shared):
    status, answer = shared.json("POST", "/v1/scenes", {
        "blob": shared.put_blob((SCENES / "cornell.glb").read_bytes()), "environment": {"rotation": [0, 1, 0, 1]}})
    assert status == 400 and answer["details"]["field"] == "environment.rotation", answer


@pytest.mark.parametrize("damage,word", [
    (lambda f: f[:-1], "row 3"), (lambda f: f.replace(b"rgbe", b"xyze"), "xyze"),
    (lambda f: f.replace(b"-Y 4 +X 8", b"-Y 4 +X 9000"), "8192"),
    (lambda f: f.replace(b"-Y 4 +X 8", b"-Y 8000 +X 8"), "truncated"),
    (lambda f: f[:20], "head"),
])
def test_broken_radiance_pictures(shared, damage, word):
    status, answer = add(shared, damage(radiance_file()))
    assert status in (400, 413), answer
    assert answer["details"]["field"] == "environment.map"
    assert word in answer["message"], answer
