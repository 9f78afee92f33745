"""What a dry run says would run again is what runs again: against the real renderer."""
import bounced
import pytest
from conftest import SCENES

LOOK = {"size": (32, 24), "technique": "multires_gather"}


def light_power(edit, objects):
    edit.set_light(0, intensity=7)


def light_moves(edit, objects):
    edit.set_transform(node_with(objects, "light", 0), translation=(0.2, 1.1, 0.3))


def one_light_moves(edit, objects):
    edit.set_transform(node_with(objects, "light", 1), translation=(0.1, 1.2, 0.2))


def surface_changes(edit, objects):
    edit.set_material(0, roughness=0.9)


def thing_moves(edit, objects):
    edit.set_transform(node_with(objects, "mesh", 0), translation=(0, 0.01, 0))


def camera_moves(edit, objects):
    edit.set_transform(node_with(objects, "camera", 0), translation=(0, 1, 3))


def light_added(edit, objects):
    edit.add_node(light=edit.add_light(kind="point", intensity=3), translation=(0, 1.5, 0))


def nothing_seen(edit, objects):
    edit.add_material(name="spare")


def node_with(objects, kind, index):
    return next(o["id"] for o in objects if o["kind"] == "node" and o["node"][kind] == index)


@pytest.fixture(scope="module")
def daemon():
    with bounced.private() as daemon:
        yield daemon


@pytest.mark.parametrize("change", [light_power, light_moves, one_light_moves, surface_changes,
                                    thing_moves, camera_moves, light_added, nothing_seen])
def test_the_renderer_does_what_the_dry_run_said(daemon, change):
    scene = daemon.scenes.add(SCENES / "two_lights.glb")
    objects = scene.objects()
    scene.render(**LOOK)
    with scene.edit(dry_run=True, frame=LOOK) as edit:
        change(edit, objects)
    said = edit.result
    with scene.edit() as edit:
        change(edit, objects)
    passes = {p["name"]: p["state"] for p in scene.render(**LOOK).report["passes"]}
    for name in said.invalidates:
        assert passes[name] == "ran", name
    for name in said.keeps:
        assert passes[name] == "reused", name
    assert set(said.invalidates) | set(said.keeps) >= {"gbuffer", "shadow_map", "rsm", "gather"}
    scene.remove()


def test_every_pass_of_every_technique_is_known(daemon):
    scene = daemon.scenes.add(SCENES / "two_lights.glb")
    names = [technique["name"] for technique in daemon.techniques()]
    assert len(names) > 5
    for name in names:
        with scene.edit(dry_run=True, frame={**LOOK, "technique": name}) as edit:
            edit.set_light(0, intensity=7)
        told = edit.result.invalidates + edit.result.keeps
        assert told and "other" not in told, (name, told)
    scene.remove()
