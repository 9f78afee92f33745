"""Environments with scenes and one-shot renders: what is taken, and what is refused by name."""
import json
import math

import bounced_pb2
import glb_check
import pytest
from conftest import SCENES, blob_name, frame
from test_framed import envelope

GLB = (SCENES / "cornell.glb").read_bytes()


def add(daemon, environment):
    blob = daemon.put_blob(GLB)
    return daemon.json("POST", "/v1/scenes",
                       {"blob": blob, "name": "lit", "environment": environment})


def exr(daemon, **changes):
    """An EXR with R, G, B of its own making: the gradient, or whatever the renderer shows."""
    scene = daemon.add_scene()
    size = changes.get("size", "8x4")
    status, _, data = daemon.request("GET", f"/v1/scenes/{scene}/frame.exr?size={size}")
    assert status == 200
    return daemon.put_blob(data)


def test_a_sky_makes_another_snapshot(shared):
    status, bare = add(shared, {"radiance": [0.0, 0.0, 0.0]})
    assert status == 201, bare
    status, grey = add(shared, {"radiance": [0.5, 0.5, 0.5]})
    assert status == 201, grey
    status, again = add(shared, {"radiance": [0.5, 0.5, 0.5]})
    status, mapped = add(shared, {"radiance": [0.5, 0.5, 0.5], "map": exr(shared)})
    assert status == 201, mapped
    assert grey["hash"] == again["hash"]
    assert len({bare["hash"], grey["hash"], mapped["hash"]}) == 3


def test_a_map_alone_counts_as_it_is(shared):
    sky = exr(shared)
    _, alone = add(shared, {"map": sky})
    _, factor = add(shared, {"map": sky, "radiance": [1, 1, 1]})
    assert alone["hash"] == factor["hash"]


@pytest.mark.parametrize("environment,status,field", [
    ({}, 400, "environment.radiance"),
    ({"radiance": [1, 2]}, 400, "environment.radiance"),
    ({"radiance": [1, 2, 3, 4]}, 400, "environment.radiance"),
    ({"radiance": [1, -0.5, 1]}, 400, "environment.radiance"),
    ({"radiance": [1, 1e39, 1]}, 400, "environment.radiance"),
    ({"radiance": 1}, 400, "environment.radiance"),
    ({"radiance": ["a", 1, 1]}, 400, "environment.radiance[0]"),
    ({"map": "sky.exr"}, 400, "environment.map"),
    ({"map": "sha256:" + "0" * 64}, 404, None),
    ({"map": blob_name(GLB)}, 400, "environment.map"),
])
def test_faults_name_their_field(shared, environment, status, field):
    got, error = add(shared, environment)
    assert got == status, error
    if field:
        assert error["details"]["field"] == field and error["message"]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, -1.0])
def test_numbers_that_json_cannot_say(shared, value):
    client = shared.framed()
    sky = bounced_pb2.Environment(radiance=[1, value, 1])
    blob = client.put_blob(GLB)
    answer, _ = client.ask(envelope(scene_add=bounced_pb2.SceneAdd(blob=blob, environment=sky)))
    assert answer.error.code == "usage", answer
    assert answer.error.details.field == "environment.radiance"
    answer, _ = client.ask(envelope(render=bounced_pb2.Render(blob=blob, environment=sky,
                                                              frame=frame())))
    assert answer.error.details.field == "environment.radiance"


def test_one_shot_under_a_sky(shared):
    client = shared.framed()
    blob = client.put_blob(GLB)
    hashes = set()
    for radiance in ([0.25] * 3, [0.5] * 3, [0.25] * 3):
        sky = bounced_pb2.Environment(radiance=radiance)
        answer, _ = client.ask(envelope(render=bounced_pb2.Render(blob=blob, environment=sky,
                                                                  frame=frame())))
        hashes.add(answer.render_reply.report.scene)
    assert len(hashes) == 2, answer


def one_shot(daemon, query):
    status, _, text = daemon.request("POST", f"/v1/render?size=16x16&encoding=json&{query}", GLB,
                                     {"Content-Type": "model/gltf-binary"})
    return status, json.loads(text)


def test_one_shot_over_http_under_a_sky(shared):
    sky = exr(shared)
    hashes = []
    for query in ("", "environment=0.5,0.5,0.5", "environment=0.5,0.5,0.5&aa=2",
                  f"environment={sky}", f"environment={sky}&environment=0.5,0.5,0.5"):
        status, report = one_shot(shared, query)
        assert status == 200, report
        hashes.append(report["scene"])
    assert hashes[1] == hashes[2] and len(set(hashes)) == 4


@pytest.mark.parametrize("value,field", [
    ("1,2", "environment"), ("1,-0.5,1", "environment.radiance"), ("nan,1,1", "environment.radiance"),
    ("sha256:00", "environment.map"), (blob_name(GLB), "environment.map"),
])
def test_faults_of_a_query_name_their_field(shared, value, field):
    shared.put_blob(GLB)
    status, error = one_shot(shared, f"environment={value}")
    assert status == 400 and error["details"]["field"] == field, error


def test_a_held_scene_has_its_own_over_http(shared):
    scene = shared.add_scene()
    status, _, text = shared.request("GET", f"/v1/scenes/{scene}/frame.png?environment=1,1,1")
    assert status == 400 and json.loads(text)["details"]["field"] == "environment"


def test_a_held_scene_has_its_own(shared):
    client = shared.framed()
    scene = shared.add_scene()
    sky = bounced_pb2.Environment(radiance=[1, 1, 1])
    answer, _ = client.ask(envelope(render=bounced_pb2.Render(scene=scene, environment=sky,
                                                              frame=frame())))
    assert answer.error.code == "usage" and answer.error.details.field == "environment"


def test_a_sky_goes_along_with_an_export(shared):
    for sky in ({"radiance": [0.5, 0.25, 3]}, {"map": exr(shared)}):
        scene = add(shared, sky)[1]
        status, head, exported = shared.request("GET", f"/v1/scenes/{scene['id']}/export")
        assert status == 200 and "Bounced-Flag" not in head
        document = glb_check.check(exported)
        assert "BOUNCED_environment" in document["extensionsUsed"]
        blob = shared.put_blob(exported)
        assert shared.json("POST", "/v1/scenes", {"blob": blob})[1]["hash"] == scene["hash"]
        beside = {"blob": blob, "environment": {"radiance": [0.5, 0.5, 0.5]}}
        plain = add(shared, {"radiance": [0.5, 0.5, 0.5]})[1]
        assert shared.json("POST", "/v1/scenes", beside)[1]["hash"] == plain["hash"]
