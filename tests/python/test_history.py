"""Edits and history of a real daemon: what a batch does to its scene, and how it is taken back."""
import bounced
import numpy
import pytest
from conftest import SCENES


@pytest.fixture
def scene(daemon):
    scene = daemon.scenes.add(SCENES / "cornell.glb")
    try:
        with scene.edit(dry_run=True) as edit:
            edit.set_light(0, intensity=1)
    except bounced.Unsupported as error:
        pytest.skip(f"this daemon takes no edits: {error}")
    assert scene.revision == 1  # it was a dry run
    return scene


def add_lamp(scene, **options):
    with scene.edit(message="a lamp", **options) as edit:
        lamp = edit.add_light(kind="point", intensity=5, name="lamp")
        node = edit.add_node(light=lamp, translation=(0, 1, 0), name="holds it")
    return edit.result, lamp, node


def test_a_batch_adds_what_its_handles_name(scene):
    before = scene.info()
    result, lamp, node = add_lamp(scene)
    after = scene.info()
    assert result.revision == after["revision"] == 2 and result.ids == [lamp.id, node.id]
    assert result.hash == after["hash"] != before["hash"]
    assert after["counts"]["lights"] == before["counts"]["lights"] + 1
    lights = {item["id"]: item["light"] for item in scene.objects("light")}
    assert lights[lamp.id]["kind"] == "point" and lights[lamp.id]["intensity"] == 5
    held = {item["id"]: item["node"] for item in scene.objects("node")}[node.id]
    assert held["light"] == lamp.id
    with scene.edit() as edit:
        edit.set_light(lamp, intensity=7)
        edit.remove_node(node)
    assert scene.info()["counts"]["lights"] == before["counts"]["lights"]
    assert scene.render(size=(4, 4)).report["revision"] == 3


def test_undo_redo_revert_and_the_log(scene):
    hashes = {1: scene.info()["hash"]}
    scene.name_revision("as it came")
    hashes[2] = add_lamp(scene)[0].hash
    undone = scene.undo()
    redone = scene.redo()
    reverted = scene.revert("as it came")
    again = scene.revert(2)
    assert [r.revision for r in (undone, redone, reverted, again)] == [3, 4, 5, 6]
    assert [r.hash for r in (undone, redone, reverted, again)] == [
        hashes[1], hashes[2], hashes[1], hashes[2]]
    log = scene.log()
    kinds = [entry["kind"] for entry in log]
    assert kinds == ["import", "edit", "undo", "redo", "revert", "revert"]
    assert log[1]["message"] == "a lamp" and log[0]["names"] == ["as it came"]
    assert [entry["revision"] for entry in scene.log(after=4)] == [5, 6]
    scene.forget_name("as it came")
    with pytest.raises(bounced.NotFound):
        scene.revert("as it came")


def test_undo_takes_back_ones_own():
    """Two clients of one daemon, on the same light."""
    with bounced.private() as daemon:
        scene = daemon.scenes.add(SCENES / "cornell.glb")
        anna, bert = daemon.scenes.get(scene.id), daemon.scenes.get(scene.id)
        was = scene.objects("light")[0]["light"]["intensity"]
        daemon.by = "Anna"
        with anna.edit() as edit:
            edit.set_light(0, intensity=7)
        assert edit.result.author == daemon.author == "local Anna"
        daemon.by = "Bert"
        with bert.edit() as edit:
            edit.set_light(0, color=(1, 0, 0))
        daemon.by = "Anna"
        undone = anna.undo()
        assert (undone.author, undone.of) == ("local Anna", 2)
        light = scene.objects("light")[0]["light"]
        assert (light["intensity"], light["color"]) == (was, [1, 0, 0])
        with pytest.raises(bounced.Conflict, match="local Bert"):
            anna.undo()
        assert anna.undo(scope="all").of == 3
        assert [entry["author"] for entry in scene.log()] == [
            "local", "local Anna", "local Bert", "local Anna", "local Anna"]


def test_what_is_refused_changes_nothing(scene):
    add_lamp(scene)
    for kind, field, options, change in (
            (bounced.Conflict, "base_revision", {"base_revision": 1}, {"intensity": 1}),
            (bounced.Error, "ops[0].set_light.intensity", {}, {"intensity": -1})):
        with pytest.raises(kind) as caught:
            with scene.edit(**options) as edit:
                edit.set_light(0, **change)
        assert caught.value.field == field
    assert scene.revision == 2


def test_the_same_id_gets_the_first_answer(scene):
    first, _, _ = add_lamp(scene, client_edit_id="once")
    second, lamp, _ = add_lamp(scene, client_edit_id="once")
    assert second.repeated_id and second.revision == first.revision == scene.revision
    assert lamp.id == first.ids[0]


def test_a_drag_is_one_revision(scene):
    for intensity in (2, 3, 4):
        with scene.edit(transient=True) as edit:
            edit.set_light(0, intensity=intensity)
        assert edit.result.transient > 0 and edit.result.revision == 1
    assert scene.info().get("transient", 0) > 0
    assert scene.commit().revision == 2
    assert scene.info().get("transient", 0) == 0
    assert scene.objects("light")[0]["light"]["intensity"] == 4
    scene.undo()
    assert scene.objects("light")[0]["light"]["intensity"] != 4


@pytest.mark.parametrize("limit", [1 << 24, 4096])
def test_meshes_from_arrays(limit):
    """In the payload, and as blobs where messages are small."""
    with bounced.private(limits={"message_bytes": limit}) as daemon:
        scene = daemon.scenes.add(SCENES / "cornell.glb")
        before = scene.info()["counts"]["triangles"]
        side = numpy.linspace(-1, 1, 20, dtype=numpy.float32)
        x, z = numpy.meshgrid(side, side)
        positions = numpy.stack([x, numpy.zeros_like(x), z], axis=-1).reshape(-1, 3)
        corner = (numpy.arange(19)[:, None] * 20 + numpy.arange(19)).reshape(-1)
        indices = numpy.concatenate([corner[:, None] + (0, 20, 1), corner[:, None] + (1, 20, 21)])
        try:
            with scene.edit() as edit:
                sheet = edit.add_mesh(bounced.Primitive(positions, indices), name="sheet")
                edit.add_node(mesh=sheet, translation=(0, 1, 0))
        except bounced.Unsupported as error:
            pytest.skip(f"this daemon takes no edits: {error}")
        assert scene.info()["counts"]["triangles"] == before + 2 * 19 * 19
        flat = edit.result.hash
        with scene.edit(transient=True) as wave:
            wave.set_mesh_vertices(sheet, positions + (0, 0.1, 0))
        assert scene.commit().hash != flat


def test_watches_and_views_follow(scene):
    with scene.watch() as watch, scene.view(size=(4, 4), refine=False) as view:
        while not view.next(20).final:
            pass
        add_lamp(scene)
        event = watch.next(20)
        assert (event["kind"], event["revision"]) == ("edited", 2) and event["changes"]
        frame = view.next(20)
        while not (frame.final and frame.report["revision"] == 2):
            frame = view.next(20)


def test_an_export_is_the_scene(daemon, scene, tmp_path):
    as_it_came = scene.export()
    add_lamp(scene)
    exported = scene.export(tmp_path / "out.glb")
    assert (tmp_path / "out.glb").read_bytes() == exported != as_it_came
    again = daemon.scenes.add(tmp_path / "out.glb")
    assert again.info()["hash"] == scene.info()["hash"] and again.export() == exported
    assert scene.export(revision=1) == as_it_came
    scene.name_revision("came", 1)
    assert scene.export(revision="came") == as_it_came
    with pytest.raises(bounced.NotFound):
        scene.export(revision="never")


def test_a_file_under_a_node(scene):
    before = scene.info()["counts"]
    with scene.edit() as edit:
        node = edit.import_file(SCENES / "cornell.glb", name="a second one")
        edit.set_transform(node, translation=(3, 0, 0))
    after = scene.info()["counts"]
    assert after["triangles"] == 2 * before["triangles"]
    named = {item["id"]: item.get("name") for item in scene.objects("node")}
    assert named[node.id] == "a second one"
