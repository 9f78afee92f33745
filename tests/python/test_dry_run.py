"""What a dry run says would run again is what runs again, and what is kept changes no byte: against
the real renderer."""
import bounced
import pytest
from conftest import SCENES
from every_edit import EDITS, material

LOOK = {"size": (24, 16), "layers": ["direct", "indirect", "emission"]}
SMALL = {"shadow_size": 64, "rsm_size": 32, "vpls": 256, "photons": 1024}
SEEN_BY_ALL = {"gbuffer", "composite", "readback"}


# One each: what an earlier test left in the memo would be taken over.
@pytest.fixture
def daemon():
    with bounced.private() as daemon:
        yield daemon


def states(frame):
    return {p["name"]: p["state"] for p in frame.report["passes"]}


# A tree, clusters, glossy receivers by blocks and by pixels, rays, lamps without maps: between them every stage.
@pytest.mark.parametrize("technique,parameters", [
    ("hisr", {"vpls": 1024}), ("isr", {}), ("multires_splat", {"vpls": 64}), ("rsm", {}),
    ("rsm", {"indirect_visibility": "rays", "rays": 9, "indirect_bounces": 3, "vpls": 64}),
    ("multires_gather", {"indirect_visibility": "rays", "rays": 9}), ("hisr", {"vpls": 64, "indirect_visibility": "rays", "rays": 9}),
    ("rsm", {"indirect_visibility": "ism", "rays": 9, "ism_points": 500, "vpls": 64}), ("ssbc", {"indirect_visibility": "ism", "ism_size": 16, "ism_points": 500, "vpls": 64, "walk_vpls": 64, "cache_cells": 256}),
    ("direct", {"drawing": "rays"}), ("multires_gather", {"drawing": "rays"}),
    ("many_light", {"walk_vpls": 256, "cache_cells": 256}),
    ("multires_gather", {"lamps": "rays", "light_rays": 2}), ("hisr", {"lamps": "rays", "indirect_bounces": 2, "vpls": 1024})])
def test_the_renderer_does_what_the_dry_run_said(daemon, technique, parameters):
    compare(daemon, technique, parameters)


# Half of a surface is glass, and is seen through. What is unlit is none: stages come and go, which the memo still has.
@pytest.mark.parametrize("technique, parameters", [("direct", {}), ("hisr", {"vpls": 64})])
def test_of_glass_too(daemon, technique, parameters):
    compare(daemon, technique, {"light_rays": 8, **parameters}, begin=material(transmission=.5, roughness=.2),
            edits={name: change for name, change in EDITS.items() if name not in ("unlit", "lit again")})


def compare(daemon, technique, parameters, begin=None, edits=EDITS):
    (read,) = ({p["key"] for p in t["parameters"]} for t in daemon.techniques() if t["name"] == technique)
    small = {key: value for key, value in SMALL.items() if key in read}
    look = {**LOOK, "technique": technique, "parameters": {**small, **parameters}}
    scene = daemon.scenes.add(SCENES / "two_lights.glb")
    objects = scene.objects()
    if begin:
        with scene.edit() as edit:
            begin(edit, objects)
    scene.render(**look)
    for name, change in edits.items():
        with scene.edit(dry_run=True, frame=look) as edit:
            change(edit, objects)
        said = edit.result
        with scene.edit() as edit:
            change(edit, objects)
        frame = scene.render(**look)
        passes = states(frame)
        assert {p for p, s in passes.items() if s == "ran"} == set(said.invalidates), name
        assert {p for p, s in passes.items() if s == "reused"} == set(said.keeps), name
        assert SEEN_BY_ALL <= set(passes), name
        anew = scene.render(**look, fresh="all")
        assert set(states(anew).values()) == {"ran"}, name
        for layer, pixels in anew.layers.items():
            assert frame.layers[layer].tobytes() == pixels.tobytes(), (name, layer)
    scene.remove()


# What no light map, block or list depends on runs none of them again.
def test_what_is_not_read_is_not_run_again(daemon):
    scene = daemon.scenes.add(SCENES / "two_lights.glb")
    objects = scene.objects()
    look = {**LOOK, "technique": "multires_gather"}
    light = {"shadow_map", "rsm", "vpl_grid"}
    blocks = {"discontinuity", "fragments", "surfaces"}
    kept = {
        "light's power": {"gbuffer", "shadow_map", "rsm"} | blocks,
        "light moved": {"gbuffer"} | blocks,
        "roughness": light | blocks,
        "roughness, glossy": light | blocks,
        "metalness": {"shadow_map"} | blocks,
        "colour": {"shadow_map"} | blocks,
        "emission": light | blocks | {"direct"},  # what emits is reflected
        "refraction": light | blocks,
        "environment": {"gbuffer", "direct"} | light | blocks,
        "camera moved": light,
        "nothing seen": {"gbuffer", "direct", "gather", "upsample"} | light | blocks,
    }
    for name, passes in kept.items():
        with scene.edit(dry_run=True, frame=look) as edit:
            EDITS[name](edit, objects)
        assert passes <= set(edit.result.keeps), name
    scene.remove()


# Nor is geometry where lamps have no maps.
def test_lamps_by_rays_run_no_geometry_again(daemon):
    scene = daemon.scenes.add(SCENES / "two_lights.glb")
    objects = scene.objects()
    look = {**LOOK, "technique": "multires_gather", "parameters": {"lamps": "rays"}}
    passes = states(scene.render(**look))
    assert {"lamps", "area_light", "light_paths", "bvh"} <= set(passes)
    assert not {"shadow_map", "direct", "rsm", "vpl_grid"} & set(passes)
    seen = {"bvh", "gbuffer", "discontinuity", "fragments", "surfaces"}
    lit = {"lamps", "area_light", "light_paths", "gather"}
    for name, run, kept in (("light's power", lit, seen), ("light moved", lit, seen),
                            ("camera moved", {"area_light", "gather"}, {"bvh", "lamps", "light_paths"}),
                            ("roughness", {"area_light"}, {"lamps", "light_paths", "bvh"})):
        with scene.edit(dry_run=True, frame=look) as edit:
            EDITS[name](edit, objects)
        assert run <= set(edit.result.invalidates), name
        assert kept <= set(edit.result.keeps), name
    scene.remove()


# What the next trace takes over is the acceleration structure alone, and pictures are those of a daemon
# that never knew the scene before.
def test_a_reference_is_prepared_by_geometry(daemon, tmp_path):
    look = {**LOOK, "technique": "reference", "parameters": {"spp": 2}}
    scene = daemon.scenes.add(SCENES / "two_lights.glb")
    objects = scene.objects()
    scene.render(**look)
    rebuilt = set()
    with bounced.private() as another:
        for name, change in EDITS.items():
            with scene.edit(dry_run=True, frame=look) as edit:
                change(edit, objects)
            if "bvh" in edit.result.invalidates:
                rebuilt.add(name)
            with scene.edit() as edit:
                change(edit, objects)
            frame = scene.render(**look)
            assert (states(frame)["bvh"] == "ran") == (name in rebuilt), name
            scene.export(tmp_path / "now.glb")
            anew = another.scenes.add(tmp_path / "now.glb").render(**look)
            for layer, pixels in anew.layers.items():
                assert frame.layers[layer].tobytes() == pixels.tobytes(), (name, layer)
    assert rebuilt == {"alpha", "object moved"}
    scene.remove()


# The boxes of the Cornell box move within it: what stays is shared, and its triangles have other numbers.
def test_rays_that_follow_an_edit_change_no_byte(daemon):
    look = {**LOOK, "size": (48, 48), "technique": "rsm",
            "parameters": {"indirect_visibility": "rays", "rays": 9}}
    scene = daemon.scenes.add(SCENES / "cornell.glb")
    last = scene.render(**look).layers["indirect"].tobytes()
    for number in range(6):
        with scene.edit() as edit:
            edit.set_transform(5 + number % 2, translation=(.1 * number - .2, .3, .4 - .15 * number))
        frame = scene.render(**look)
        assert states(frame)["bvh"] == "ran"
        assert frame.layers["indirect"].tobytes() != last, number
        last = frame.layers["indirect"].tobytes()
        assert scene.render(**look, fresh="all").layers["indirect"].tobytes() == last, number
    scene.remove()


def test_every_pass_of_every_technique_is_known(daemon):
    scene = daemon.scenes.add(SCENES / "two_lights.glb")
    names = [technique["name"] for technique in daemon.techniques()]
    assert len(names) > 5
    for name in names:
        look = {**LOOK, "technique": name, "aa": 1 if name == "reference" else 4}
        with scene.edit(dry_run=True, frame=look) as edit:
            edit.set_light(0, intensity=7)
        told = edit.result.invalidates + edit.result.keeps
        plan = scene.render(**look, plan_only=True).report
        planned = plan["passes"]
        assert "no punctual light shines" not in {left["reason"] for left in plan["omitted"]}, name  # two do
        assert told and sorted(told) == sorted(p["name"] for p in planned), (name, told)
        assert (set(told) == {"bvh", "trace"}) == (name == "reference"), (name, told)
    scene.remove()


# Whose light paths are clamped, or soft, or in a tree; whose maps are of a list in order: each finds what the one before it left.
def test_techniques_take_over_nothing_of_another_kind(daemon):
    scene = daemon.scenes.add(SCENES / "two_lights.glb")
    small = {"vpls": 256, "brdf": "lambert"}
    walked, maps = {**small, "walk_vpls": 256, "photons": 1024}, {**small, "indirect_visibility": "ism", "ism_size": 16, "ism_points": 500}
    asked = [("many_light", walked), ("ssbc", {**walked, "clamp": "inf"}), ("ssbc", walked), ("many_light", {**walked, **maps}),
             ("ssbc", {**walked, **maps}), ("rsm", {**maps, "rays": 9}), ("rsm", {**maps, "rays": 4096}), ("hisr", {**maps, "rays": 9}),
             ("multires_gather", {**maps, "rays": 9}), ("rsm", {**small, "indirect_bounces": 3}), ("hisr", {**small, "indirect_bounces": 3})]
    for technique, parameters in asked + asked[::-1]:
        look = {**LOOK, "technique": technique, "parameters": parameters}
        kept, anew = scene.render(**look), scene.render(**look, fresh="all")
        for layer, pixels in anew.layers.items():
            assert kept.layers[layer].tobytes() == pixels.tobytes(), (technique, parameters, layer)
