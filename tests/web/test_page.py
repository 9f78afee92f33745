"""The page against a daemon that draws marks (stand_in.py): what it asks for, and what it does with the answers."""
import math
import time

import numpy as np
import pytest

from browser import difference
from conftest import SCENES
import stand_in as stand_in_module
from stand_in import TOKEN
from stand_in_scene import Pinhole, report_of

FINAL = "document.getElementById('stage').dataset.final === 'true'"
TOAST = "document.getElementById('toasts').textContent"


def wait(true, timeout_s=30):
    end = time.monotonic() + timeout_s
    while not (value := true()):
        assert time.monotonic() < end, "not in time"
        time.sleep(0.02)
    return value


def updates(stand_in):
    return stand_in.requests("view_update")


def last_frame(stand_in):
    asked = stand_in.requests("view_open")[-1:] + [one for one in updates(stand_in) if one.HasField("frame")]
    return asked[-1].frame


def pose_now(stand_in):
    last = updates(stand_in)[-1]
    return last.pose if last.HasField("pose") else last.frame.pose


def still(page):
    """Waits until the picture is final and stays so, and returns its pixels."""
    stage = "document.getElementById('stage').dataset"
    number = None
    while number != (number := page.until(
            f"{FINAL} && {stage}.current === 'true' && {stage}.moving !== 'true' && {stage}.frames")):
        time.sleep(0.2)
    return page.pixels()


def light_node(scene, name):
    return next(i for i, node in enumerate(scene.nodes) if node.name == name)


@pytest.fixture
def page(new_page, stand_in, scene):
    """A page that shows the scene, at its final picture."""
    one = new_page(stand_in.url)
    one.until(FINAL)
    return one


def choose(page, name):
    page.run("document.getElementById('objects-section').open = true")
    value = page.until(f"[...document.querySelectorAll('#objects option')].find(o => o.text === '{name}')?.value")
    page.set("#objects select", value)
    page.until("getComputedStyle(document.querySelector('.gizmo')).display !== 'none'")


# --- the page itself ---

def test_without_scenes_it_asks_for_one(new_page, stand_in):
    page = new_page(stand_in.url)
    page.until("document.getElementById('connection').textContent === 'Connected'")
    assert page.run("getComputedStyle(document.getElementById('welcome')).display") == "grid"
    assert page.run("getComputedStyle(document.getElementById('layers')).display") == "none"


@pytest.mark.parametrize("how", ["drop", "choose"])
def test_a_file_becomes_a_scene_and_pixels(new_page, stand_in, how):
    page = new_page(stand_in.url)
    page.until("document.getElementById('connection').textContent === 'Connected'")
    file = SCENES / "cornell.glb"
    page.drop_files("#stage", [file]) if how == "drop" else page.choose_files("#file", [file])
    page.until(FINAL)
    assert len(stand_in.blobs) == 1 and list(stand_in.blobs.values())[0] == file.read_bytes()
    assert page.run("document.getElementById('scenes').selectedOptions[0].text") == "cornell.glb"
    assert len({tuple(pixel) for pixel in page.pixels()}) > 10
    assert page.run("location.hash").startswith("#scene=scene1")


def test_a_file_that_is_no_scene_is_refused_in_words(new_page, stand_in, tmp_path):
    page = new_page(stand_in.url)
    page.allowed = ("400",)
    (tmp_path / "bad.glb").write_bytes(b"nothing")
    page.choose_files("#file", [tmp_path / "bad.glb"])
    page.until(TOAST + ".includes('bad.glb: this is no glTF')")
    (tmp_path / "a.txt").write_bytes(b"nothing")
    page.choose_files("#file", [tmp_path / "a.txt"])
    page.until(TOAST + ".includes('a.txt: there is no .glb or .gltf')")
    assert page.run("document.getElementById('busy').hidden")


def test_a_gltf_comes_with_its_files(new_page, stand_in):
    page = new_page(stand_in.url)
    page.allowed = ("400",)  # the stand-in reads .glb alone
    page.choose_files("#file", [SCENES / "bare.gltf", SCENES / "bare.bin"])
    page.until(TOAST + ".includes('this is no glTF')")
    assert set(stand_in.blobs.values()) == {(SCENES / "bare.gltf").read_bytes(), (SCENES / "bare.bin").read_bytes()}


# --- the view ---

def test_the_view_begins_at_the_scenes_camera(page, stand_in, scene):
    asked = stand_in.requests("view_open")[0]
    assert asked.frame.camera == "0" and asked.credits == 2 and asked.frame.encoding == "jpeg"
    assert page.run("document.getElementById('cameras').selectedOptions[0].text") == "Left"
    # The first movement goes on from there.
    page.run("document.getElementById('stage').focus()")
    page.key("+")
    still(page)
    pose, camera = pose_now(stand_in), scene.world(light_node(scene, "Left"))
    forward = np.subtract(pose.target, pose.eye)
    assert np.allclose(forward / np.linalg.norm(forward), -camera[:3, 2], atol=1e-5)
    assert np.allclose(np.cross(np.subtract(pose.eye, camera[:3, 3]), forward), 0, atol=1e-5)
    assert pose.yfov == pytest.approx(0.8)
    page.set("#cameras", "1")
    wait(lambda: last_frame(stand_in).camera == "1")


def test_lights_are_marked_where_the_picture_has_them(page, stand_in, scene):
    page.run("document.getElementById('stage').focus()")
    page.key("Home")
    still(page)
    marks = page.run("""[...document.querySelectorAll('.mark')].filter(m => m.getAttribute('display') !== 'none')
        .map(m => { const b = m.querySelector('.back').getBoundingClientRect(),
                          s = document.getElementById('stage').getBoundingClientRect();
                    return [(b.x + b.width / 2 - s.x) / s.width, (b.y + b.height / 2 - s.y) / s.height]; })""")
    width, height = last_frame(stand_in).size
    view = Pinhole(pose_now(stand_in), width, height)
    expected = [view.at(scene.place(light_node(scene, name))) for name in ("Spot", "Sun")]
    seen = [(x / width, y / height) for x, y in expected if 0 < x < width and 0 < y < height]
    assert len(marks) == len(seen) >= 1
    assert np.allclose(sorted(marks), sorted(seen), atol=0.004)


def test_dragging_turns_the_camera(page, stand_in):
    page.run("document.getElementById('stage').focus()")
    page.key("Home")
    before = still(page)
    pose = pose_now(stand_in)
    x, y = page.centre("#stage")
    page.drag((x, y), (x + 150, y + 30))
    after = still(page)
    assert difference(before, after) > 1
    moved = pose_now(stand_in)
    distance = math.dist(pose.eye, pose.target)
    assert math.dist(moved.eye, moved.target) == pytest.approx(distance) and math.dist(moved.eye, pose.eye) > 0.2
    assert np.allclose(moved.target, pose.target)
    # At rest it is asked for in full.
    assert last_frame(stand_in).jpeg_quality == 92


@pytest.mark.parametrize("slow_step", [0, 2])
def test_movement_is_coarse_where_a_frame_is_slow_not_its_refinement(new_page, stand_in, scene, monkeypatch, slow_step):
    def report(scene, request, step):
        made = report_of(scene, request, step)
        made.time_ms.total = 700 if step == slow_step else 18
        return made
    monkeypatch.setattr(stand_in_module, "report_of", report)
    page = new_page(stand_in.url)
    still(page)  # until then the stage may change by a line
    full = list(last_frame(stand_in).size)
    x, y = page.centre("#stage")
    page.drag((x, y), (x + 60, y))
    still(page)
    asked = [list(one.frame.size) for one in updates(stand_in) if one.HasField("frame") and one.frame.jpeg_quality < 92]
    assert asked and asked[0] == (full if slow_step else [round(side / 2) for side in full])
    assert list(last_frame(stand_in).size) == full


def test_wheel_and_keys_move_the_camera(page, stand_in):
    page.run("document.getElementById('stage').focus()")
    page.key("Home")
    still(page)
    pose = pose_now(stand_in)
    x, y = page.centre("#stage")
    page.mouse("mouseWheel", x, y, button="none", deltaX=0, deltaY=-300)
    wait(lambda: updates(stand_in))
    page.run("document.getElementById('stage').focus()")
    for key in ("w", "ArrowLeft", "+"):
        count = len(updates(stand_in))
        page.key(key)
        wait(lambda: len(updates(stand_in)) > count)
    still(page)
    last = pose_now(stand_in)
    assert math.dist(last.eye, last.target) < 0.7 * math.dist(pose.eye, pose.target)


def test_technique_layer_and_parameter_reach_the_picture(page, stand_in):
    before = still(page)
    page.set("#technique select", "direct")
    page.until("document.getElementById('stage').dataset.technique === 'direct'")
    darker = still(page)
    assert difference(before, darker) > 20
    page.click("#layers label:nth-of-type(3)")
    wait(lambda: list(last_frame(stand_in).layers) == ["indirect"])
    assert difference(darker, still(page)) > 5
    page.run("document.querySelector('#technique details').open = true")
    page.set("#technique input.number", "77")
    wait(lambda: [(one.key, one.value) for one in last_frame(stand_in).parameters] == [("vpls", "77")])
    page.set("#technique input[type=range]", "2", "input")
    wait(lambda: ("vpls", "4096") in [(one.key, one.value) for one in last_frame(stand_in).parameters])
    assert page.run("document.querySelector('#technique output').textContent") == "3 of 3"


def test_choices_are_kept(new_page, stand_in, scene):
    page = new_page(stand_in.url)
    page.until(FINAL)
    page.set("#technique select", "direct")
    page.until("document.getElementById('stage').dataset.technique === 'direct'")
    page.open(stand_in.url)
    page.until("document.getElementById('stage').dataset.technique === 'direct'")


def test_exposure_is_taken_over_from_the_server(page, stand_in):
    assert last_frame(stand_in).exposure == "auto"
    page.run("document.getElementById('look').parentElement.open = true")
    page.click("#look input[type=checkbox]")
    wait(lambda: last_frame(stand_in).exposure == "1.25")
    page.set("#look input[type=range]", "-2", "input")
    wait(lambda: last_frame(stand_in).exposure == "-2")


def test_credits_are_given_back_one_a_frame(page, stand_in):
    still(page)
    x, y = page.centre("#stage")
    page.drag((x, y), (x + 60, y))
    still(page)
    view = stand_in.clients[0].views[1]
    assert view.frames > 4
    wait(lambda: view.credits == 2)
    assert sum(credit.count for credit in stand_in.requests("view_credit")) == view.frames


def test_cost_shows_passes_reuse_and_what_was_left_out(page):
    rows = page.run("[...document.querySelectorAll('.bars li')].map(li => [li.dataset.state, li.innerText])")
    named = {text.split("\n")[0].split("\t")[0].strip(): state for state, text in rows}
    assert named == {"gbuffer": "ran", "shadow_map": "reused", "rsm": "reused", "vpl_grid": "reused", "gather": "ran",
                     "tonemap": "ran", "encode": "rest"}
    assert "glossy no glossy surface" in page.run("document.getElementById('cost').innerText")
    widths = page.run("[...document.querySelectorAll('.fill')].map(f => parseFloat(f.style.width))")
    assert widths[4] == 100 and 0 < widths[0] < 50 and widths[1] == 0


def test_error_is_measured_at_rest(page, stand_in):
    still(page)
    assert not stand_in.requests("render")
    page.click("#error input[type=checkbox]")
    page.until("document.getElementById('error').innerText.includes('%')")
    asked = stand_in.requests("render")[0].frame
    assert (asked.check, asked.camera, asked.encoding) == (256, "0", "none")
    assert asked.against == page.run("document.querySelector('#error select').value")
    assert list(asked.size) == list(last_frame(stand_in).size)
    page.until("document.querySelectorAll('.plot .dot').length >= 1")
    x, y = page.centre("#stage")
    page.drag((x, y), (x + 60, y))
    still(page)
    wait(lambda: stand_in.requests("render")[-1].frame.HasField("pose"))
    assert stand_in.requests("render")[-1].frame.pose == pose_now(stand_in)
    page.set("#cameras", "1")
    wait(lambda: stand_in.requests("render")[-1].frame.camera == "1")


def test_the_layer_error_shows_where_the_picture_is_wrong(page, stand_in):
    still(page)
    page.click("#layers label:last-of-type")
    page.until("!document.getElementById('error-map').hidden", 20)
    asked = [one.frame for one in stand_in.requests("render")]
    assert {one.technique for one in asked} == {"multires_gather", "reference"}
    assert {one.encoding for one in asked} == {"half"} and max(max(one.size) for one in asked) <= 192
    assert list(last_frame(stand_in).layers) == ["beauty"]
    page.until("document.getElementById('error-legend').innerText.includes('64 samples')")
    row = page.run("(() => { const c = document.getElementById('error-map'); "
                   "return [...c.getContext('2d').getImageData(0, c.height / 2, c.width, 1).data]; })()")
    left, right = row[len(row) // 16 * 4:], row[len(row) // 16 * 12:]
    assert sum(left[:3]) > 250 and sum(right[:3]) < 60
    page.run("document.getElementById('stage').focus()")
    page.key("+")
    page.until("!document.getElementById('error-map').hidden", 20)
    wait(lambda: stand_in.requests("render")[-1].frame.pose == pose_now(stand_in))


def test_the_layer_error_shows_what_it_has_while_it_traces(page, stand_in):
    stand_in.samples_most = 2
    page.click("#layers label:last-of-type")
    page.until("!document.getElementById('error-map').hidden")
    words = page.until("/tracing/.test(document.getElementById('error-legend').innerText) && "
                       "document.getElementById('error-legend').innerText")
    assert "with 2 samples a pixel" in words and "tracing 4 samples" in words
    stand_in.samples_most = 16
    page.until("document.getElementById('error-legend').innerText.includes('16 samples a pixel')")
    stand_in.samples_most = 64
    page.until("document.getElementById('error-legend').innerText.includes('64 samples a pixel')")
    assert "tracing" not in page.run("document.getElementById('error-legend').innerText")


def test_refinement_is_seen(new_page, stand_in, scene, monkeypatch):
    monkeypatch.setattr(stand_in_module, "STEPS", 1 << 20)  # it never ends
    page = new_page(stand_in.url)
    page.until("/step [2-9]/.test(document.getElementById('refining-text').textContent)")
    assert page.run("document.getElementById('refining').dataset.state") == "busy"
    assert page.run("document.getElementById('refining-bar').matches(':indeterminate')")
    monkeypatch.setattr(stand_in_module, "STEPS", 3)
    page.set("#technique select", "direct")
    page.until("document.getElementById('refining-text').textContent === 'Finished after 3 steps'")
    assert page.run("document.getElementById('refining').dataset.state") == "done"


def test_who_strays_is_told_and_home_brings_back(page, stand_in):
    shown = "getComputedStyle(document.getElementById('astray')).display !== 'none'"
    page.run("document.getElementById('stage').focus()")
    page.key("Home")
    assert not page.run(shown)
    for _ in range(60):
        page.key("-")
    page.until(shown)
    assert "Nothing of the scene" in page.run("document.getElementById('astray').innerText")
    page.key("Home")
    page.until("!(" + shown + ")")
    for _ in range(60):
        page.key("w", modifiers=8)  # through it, and out at the other end
    page.until(shown)
    page.click("#astray-home")
    page.until("!(" + shown + ")")
    still(page)
    assert np.linalg.norm(np.subtract(pose_now(stand_in).eye, pose_now(stand_in).target)) > 1


# --- edits ---

def all_in_sight(page):
    page.run("document.getElementById('stage').focus()")
    page.key("Home")
    return still(page)


def mark_of(page, name):
    page.until("document.querySelectorAll('.mark').length > 0")
    at = page.run(f"[...document.querySelectorAll('.mark')].findIndex(m => m.ariaLabel.includes({name!r})) + 1")
    return f".mark:nth-of-type({at})"


def test_a_lights_mark_is_its_handle(page, stand_in, scene):
    all_in_sight(page)
    node = light_node(scene, "Spot")
    place, mark = scene.place(node), mark_of(page, "Spot")
    page.click(mark)
    assert page.until(f"document.querySelector('{mark}').getAttribute('aria-pressed') === 'true'")
    assert not stand_in.requests("edit_batch")
    page.click("#stage")  # which chooses something else, or nothing
    x, y = page.centre(mark + " .back")
    page.drag((x, y), (x + 70, y + 20))
    wait(lambda: scene.revision == 2)
    assert len(stand_in.requests("edit_commit")) == 1
    moved = scene.place(node) - place
    still(page)
    assert np.linalg.norm(moved) > 0.1
    # It is under the pointer, and did not jump on the way.
    assert math.dist(page.centre(mark + " .back"), (x + 70, y + 20)) < 2
    width, height = last_frame(stand_in).size
    view = Pinhole(pose_now(stand_in), width, height)
    assert moved @ view.forward == pytest.approx(0, abs=1e-6)


def test_a_mark_answers_to_arrow_keys(page, scene):
    all_in_sight(page)
    node = light_node(scene, "Spot")
    place = scene.place(node)
    page.run(f"document.querySelector('{mark_of(page, 'Spot')}').focus()")
    page.key("ArrowUp")
    wait(lambda: scene.revision == 2)
    assert scene.place(node)[1] > place[1]


def test_an_edit_says_whose_it_is_and_undo_is_ones_own(page, stand_in, scene):
    choose(page, "Spot")
    page.set("#objects .field:has(input[type=range]) input.number", "7")
    wait(lambda: scene.revision == 2)
    by = stand_in.requests("edit_batch")[0].by
    assert by.startswith("viewer ") and stand_in.requests("edit_commit")[0].by == by
    assert page.run(TOAST) == ""  # one knows what one does
    page.click("#undo")
    page.until(TOAST + ".includes('You took back the change of revision 2: light 0')")
    asked = stand_in.requests("edit_undo")[0]
    assert (asked.scope, asked.by) == ("mine", by)
    page.run("document.getElementById('history').parentElement.open = true")
    page.until("document.querySelector('.log .who')?.textContent === " + repr(by))
    page.run("[...document.querySelectorAll('details button')].find(b => b.textContent.includes('anybody')).click()")
    wait(lambda: len(stand_in.requests("edit_undo")) == 2)
    assert stand_in.requests("edit_undo")[1].scope == "all"


def test_what_others_do_is_told_by_name(page, stand_in, scene):
    stand_in.tell(scene.id, "edited", author="local Bert", batch="edit", changes=["light 1", "node 2"])
    page.until(TOAST + ".includes('Bert changed light 1 and 1 more')")
    stand_in.tell(scene.id, "edited", author="alice pad", batch="undo", of=3, changes=["light 0"])
    page.until(TOAST + ".includes('alice (pad) took back the change of revision 3: light 0')")
    page.run("document.getElementById('history').parentElement.open = true")
    page.set("details input[autocomplete=nickname]", "Anna")
    choose(page, "Spot")
    page.set("#objects .field:has(input[type=range]) input.number", "7")
    wait(lambda: stand_in.requests("edit_batch"))
    assert stand_in.requests("edit_batch")[-1].by == "Anna"
    page.open(stand_in.url)
    assert page.until("document.querySelector('details input[autocomplete=nickname]').value") == "Anna"


def test_dragging_a_handle_moves_a_light(page, stand_in, scene):
    page.run("document.getElementById('stage').focus()")
    page.key("Home")
    before = still(page)
    choose(page, "Spot")
    node = light_node(scene, "Spot")
    place = scene.place(node)
    x, y = page.centre(".grip.x .tip")
    page.drag((x, y), (x + 80, y))
    wait(lambda: stand_in.requests("edit_commit"))
    wait(lambda: scene.revision == 2)
    moved = scene.place(node) - place
    assert abs(moved[0]) > 0.1 and np.allclose(moved[1:], 0, atol=1e-9)
    transient = [one for one in stand_in.requests("edit_batch")]
    assert transient and all(one.durability == "transient" for one in transient)
    assert len(stand_in.requests("edit_commit")) == 1
    assert difference(before, still(page)) > 0.1
    handle, mark = page.centre(".grip.plane"), page.centre(".mark[aria-pressed=true]")
    assert math.dist(handle, mark) < 2
    page.click("#undo")
    wait(lambda: scene.revision == 3)
    assert np.allclose(scene.place(node), place)
    page.click("#redo")
    wait(lambda: scene.revision == 4)
    assert np.allclose(scene.place(node), place + moved)
    assert difference(before, still(page)) > 0.1


def test_the_sun_is_aimed(page, stand_in, scene):
    page.run("document.getElementById('stage').focus()")
    page.key("Home")
    still(page)
    choose(page, "Sun")
    node = light_node(scene, "Sun")
    before = scene.world(node)
    x, y = page.centre(".grip.aim .tip")
    page.drag((x, y), (x + 50, y - 30))
    wait(lambda: stand_in.requests("edit_commit") and scene.revision == 2)
    after = scene.world(node)
    assert np.allclose(after[:3, 3], before[:3, 3]) and after[:3, 2] @ before[:3, 2] < 0.99
    assert np.allclose(after[:3, :3] @ after[:3, :3].T, np.eye(3), atol=1e-6)


def test_handles_and_lights_answer_to_keys(page, stand_in, scene):
    page.run("document.getElementById('stage').focus()")
    page.key("Home")
    still(page)
    page.run("document.querySelector('.mark').focus()")
    page.key("Enter")
    page.until("document.querySelector('.mark').getAttribute('aria-pressed') === 'true'")
    place = scene.place(light_node(scene, "Spot"))
    page.run("document.querySelector('.grip.y').focus()")
    page.key("ArrowUp")
    page.key("ArrowUp")
    wait(lambda: scene.revision == 2)
    assert scene.place(light_node(scene, "Spot"))[1] > place[1]


def test_a_lights_intensity_changes_the_picture_and_faults_are_told(page, stand_in, scene):
    before = still(page)
    choose(page, "Spot")
    page.set("#objects .field:has(input[type=range]) input.number", "500")
    wait(lambda: scene.revision == 2)
    assert scene.lights[0].intensity == 500
    assert difference(before, still(page)) > 3
    page.set("#objects .field:has(input[type=range]) input.number", "-1")
    page.until(TOAST + ".includes('ops[0].set_light.intensity: must be at least 0')")
    assert scene.revision == 2


def test_a_typed_coordinate_moves_along_its_axis_alone(page, stand_in, scene):
    node = light_node(scene, "Spot")
    place = [1.23456789, 3.0000123, -0.98765432]
    scene.nodes[node].transform.translation[:] = place
    stand_in.tell(scene.id, "edited")
    choose(page, "Spot")
    box = "#objects .triple input:nth-child({})"
    page.until(f"document.querySelector('{box.format(1)}').value === '1.23'")
    page.set(box.format(2), "2.5")
    wait(lambda: scene.revision == 2)
    assert list(scene.place(node)) == [place[0], 2.5, place[2]]
    for text in ("", "  ", "high"):
        page.set(box.format(3), text)
        assert page.run(f"document.querySelector('{box.format(3)}').value") == "-0.988"
    time.sleep(0.3)
    assert scene.revision == 2 and list(scene.place(node)) == [place[0], 2.5, place[2]]


def test_clicking_the_picture_chooses_what_is_there(page, stand_in, scene):
    page.run("document.getElementById('stage').focus()")
    page.key("Home")
    still(page)
    node = light_node(scene, "Stretched")
    width, height = last_frame(stand_in).size
    at = Pinhole(pose_now(stand_in), width, height).at(scene.place(node, np.add(*scene.meshes[scene.nodes[node].mesh]) / 2))
    left, top, wide, high = page.run("(() => { const b = document.getElementById('stage').getBoundingClientRect(); "
                                     "return [b.x, b.y, b.width, b.height]; })()")
    x, y = left + wide * at[0] / width, top + high * at[1] / height
    page.mouse("mousePressed", x, y)
    page.mouse("mouseReleased", x, y)
    assert page.until("document.querySelector('#objects select').selectedOptions[0].text") == "Stretched"
    assert page.run("document.getElementById('objects-section').open")


def test_history_is_listed_and_undo_of_nothing_is_told(page, stand_in, scene):
    page.click("#undo")
    page.until(TOAST + ".includes('nothing to undo')")
    choose(page, "Spot")
    page.set("#objects .field:has(input[type=range]) input.number", "5")
    wait(lambda: scene.revision == 2)
    page.until("document.querySelectorAll('.log li').length === 2")
    page.run("document.getElementById('history').parentElement.open = true")
    page.click("#history button")
    wait(lambda: scene.revision == 3)
    assert scene.lights[0].intensity != 5
    page.until("document.querySelectorAll('.log li').length === 3")
    assert stand_in.requests("edit_revert")[0].client_edit_id


# --- the scene as a file ---

def test_a_scene_is_exported_by_key(page, scene, tmp_path):
    page.downloads_to(tmp_path)
    scene.flags = ["left_out_unused_vertices 3"]
    page.run("document.getElementById('export').closest('details').open = true")
    page.run("document.getElementById('export').focus()")
    page.key(" ", code="Space")
    wait((tmp_path / "two_lights.glb").is_file)
    wait(lambda: (tmp_path / "two_lights.glb").read_bytes() == scene.glb)
    page.until(TOAST + ".includes('left_out_unused_vertices 3')")
    page.until("document.getElementById('busy').hidden")


def test_an_export_that_is_refused_is_told(page, stand_in):
    page.allowed = ("401",)
    stand_in.is_locked = True
    page.run("document.getElementById('export').closest('details').open = true")
    page.click("#export")
    page.until(TOAST + ".includes('a token is needed')")
    page.until("document.getElementById('busy').hidden")


# --- connections that break ---

def test_it_comes_back_by_itself_and_goes_on(page, stand_in, scene):
    first = still(page)
    stand_in.cut()
    page.until("document.getElementById('connection').textContent !== 'Connected'")
    page.until("document.getElementById('connection').textContent === 'Connected'", 30)
    wait(lambda: len(stand_in.requests("hello")) == 2)
    assert stand_in.requests("hello")[1].resume == "session 1"
    wait(lambda: len(stand_in.requests("view_open")) == 2)
    assert difference(first, still(page)) < 0.5
    page.set("#technique select", "direct")
    page.until("document.getElementById('stage').dataset.technique === 'direct'")


def test_a_session_that_is_kept_goes_on_with_its_view(page, stand_in):
    first = still(page)
    stand_in.cut(is_kept=True)
    page.set("#technique select", "direct")
    wait(lambda: len(stand_in.requests("hello")) == 2, 20)
    page.until("document.getElementById('stage').dataset.technique === 'direct'")
    assert difference(first, still(page)) > 20
    assert len(stand_in.requests("view_open")) == len(stand_in.requests("scene_watch")) == 1
    view = stand_in.clients[0].views[1]
    wait(lambda: view.credits == 2)


@pytest.mark.parametrize("kind", ["edit_batch", "edit_commit"])
def test_an_edit_whose_answer_was_lost_is_asked_again_with_its_name(page, stand_in, scene, kind):
    choose(page, "Spot")
    stand_in.lost = kind
    if kind == "edit_batch":
        page.click("#objects .fields input[type=checkbox]")
    else:
        page.set("#objects .field:has(input[type=range]) input.number", "7")
    wait(lambda: len(stand_in.requests(kind)) == 2, 20)
    first, again = stand_in.requests(kind)
    assert first.client_edit_id and first == again
    page.until("document.getElementById('connection').textContent === 'Connected'")
    page.set("#technique select", "direct")  # all that was asked before is answered
    page.until("document.getElementById('stage').dataset.technique === 'direct'")
    assert scene.revision == 2 and page.run(TOAST) == ""


@pytest.mark.parametrize("kind", ["techniques", "scene_list", "scene_watch"])
def test_a_set_up_that_broke_is_begun_again(new_page, stand_in, scene, kind):
    stand_in.lost = kind
    page = new_page(stand_in.url)
    page.until(FINAL)
    assert len(stand_in.requests("hello")) == 2 and stand_in.requests("hello")[1].resume
    stand_in.add((SCENES / "cornell.glb").read_bytes(), "late.glb")  # which the watch tells of
    page.until("[...document.getElementById('scenes').options].some(one => one.text === 'late.glb')")


def test_a_view_whose_opening_was_lost_is_opened_once(new_page, stand_in, scene):
    stand_in.lost = "view_open"
    page = new_page(stand_in.url)
    page.until(FINAL)
    first = next(one for one in stand_in.asked if one.WhichOneof("body") == "view_open")
    wait(lambda: stand_in.requests("cancel"))
    assert stand_in.requests("cancel")[0].request_id == first.request_id
    assert len(stand_in.requests("view_open")) == 2 and len(stand_in.clients[0].views) == 1


def test_what_is_chosen_while_a_view_is_refused_is_opened(new_page, stand_in, scene):
    stand_in.refused_late["view_open"] = 1.5
    page = new_page(stand_in.url)
    wait(lambda: stand_in.requests("view_open"))
    time.sleep(0.5)  # what else asks for a picture at the beginning has done so
    page.set("#technique select", "direct")
    page.until(TOAST + ".includes('no view_open this time')")
    page.until("document.getElementById('stage').dataset.technique === 'direct'")
    assert len(stand_in.requests("view_open")) == 2


def test_a_server_that_says_nothing_is_not_waited_for(page, stand_in):
    stand_in.is_answering.clear()
    stand_in.cut()
    page.until("document.getElementById('connection').textContent !== 'Connected'")
    page.until("document.getElementById('connection').textContent === 'Connected'", 12)


def test_a_scene_is_opened_that_an_older_list_does_not_have(new_page, stand_in, scene):
    stand_in.delays_s["scene_list"] = 0.7
    page = new_page(stand_in.url)
    page.until("document.getElementById('connection').textContent === 'Connected'")
    page.choose_files("#file", [SCENES / "cornell.glb"])
    page.until("document.getElementById('scenes').selectedOptions[0]?.text === 'cornell.glb'")
    time.sleep(1)
    assert page.run("document.getElementById('scenes').selectedOptions[0].text") == "cornell.glb"
    page.until(FINAL)
    assert stand_in.requests("view_open")[-1].scene == "scene2"


def test_the_picture_of_the_scene_before_is_not_current(page, stand_in, scene):
    stand_in.add((SCENES / "cornell.glb").read_bytes(), "other.glb")
    page.until("document.getElementById('scenes').options.length === 2")
    before = page.run("document.getElementById('scenes').value")
    stand_in.delays_s["scene_get"] = 1
    page.set("#scenes", next(one for one in stand_in.scenes if one != before))
    page.click("#layers label:nth-of-type(5)")  # asks for a picture, before the scene is known
    stand_in.tell(before, "edited")  # and the view of the one before has another
    time.sleep(0.3)
    assert page.run("document.getElementById('stage').dataset.current") == "false"
    page.until(f"{FINAL} && document.getElementById('stage').dataset.current === 'true'")
    assert stand_in.requests("view_open")[-1].scene != before


def test_a_token_in_the_address_is_traded_and_gone(new_page, stand_in):
    stand_in.is_locked = True
    page = new_page(stand_in.url + "#token=" + TOKEN)
    page.until("document.getElementById('connection').textContent === 'Connected'")
    assert stand_in.tokens == ["Bearer " + TOKEN]
    assert TOKEN not in page.run("location.href + JSON.stringify(localStorage)")


def test_a_token_is_asked_for(new_page, stand_in, scene):
    stand_in.is_locked = True
    page = new_page(stand_in.url)
    page.allowed = ("401", "WebSocket")
    page.until("document.getElementById('login').open")
    page.run("document.getElementById('token').value = 'wrong wrong wrong wrong'")
    page.click("#login-form button")
    page.until(TOAST + ".includes('not accepted')")
    page.run(f"document.getElementById('token').value = '{TOKEN}'")
    page.click("#login-form button")
    page.until(FINAL)
    assert not page.run("document.getElementById('login').open")


# --- for everyone ---

def test_everything_has_a_name_and_can_be_reached_by_tab(page):
    nameless = page.run("""[...document.querySelectorAll('button, select, input:not([type=file])')]
        .filter(e => !(e.labels?.length || e.textContent.trim() || e.getAttribute('aria-label') || e.ariaHidden === 'true'))
        .map(e => e.outerHTML)""")
    assert nameless == []
    page.run("document.getElementById('export').closest('details').open = true")
    page.run("document.body.focus()")
    reached = {}
    for _ in range(60):
        page.key("Tab")
        # A layer's round button is hidden, and its words are outlined instead.
        name, outline = page.run("""(() => { const e = document.activeElement;
            const seen = e.name === 'layer' ? e.nextElementSibling : e;
            return [e.id || e.name || e.tagName, getComputedStyle(seen).outlineStyle]; })()""")
        reached[name] = outline
    for name in ("scenes", "open", "undo", "stage", "layer", "export", "remove"):
        assert reached.get(name, "none") != "none", reached


def test_nothing_is_wider_than_the_screen(page):
    for details in ("technique", "look", "objects"):
        page.run(f"document.getElementById('{details}').closest('details').open = true")
    choose(page, "Spot")
    for width, height in ((360, 640), (390, 844), (760, 500), (1280, 800), (2560, 1440)):
        page.resize(width, height)
        page.until(f"innerWidth === {width}")
        assert page.run("document.documentElement.scrollWidth") <= width
        wide = page.run("""[...document.querySelectorAll('.panel')].flatMap(panel => [...panel.querySelectorAll('*')]
            .filter(e => e.clientWidth && e.getBoundingClientRect().right > panel.getBoundingClientRect().right - 13)
            .map(e => e.outerHTML.slice(0, 90)))""")
        assert wide == []
        assert page.run("document.getElementById('stage').clientHeight") >= 0.3 * height


@pytest.mark.parametrize("size", [(390, 844), (844, 390)])
def test_a_finger_hits_everything_and_the_layers_scroll(new_page, stand_in, scene, size):
    page = new_page(stand_in.url, width=size[0], height=size[1], is_touch=True)
    page.until(FINAL)
    page.run("document.querySelectorAll('aside details').forEach(one => one.open = true)")
    choose(page, "Spot")
    small = page.run("""[...document.querySelectorAll('button, select, summary, input, .segments span, a, .mark, .grip')]
        .filter(e => e.getClientRects().length && e.name !== 'layer')
        .map(e => [e, e.getBoundingClientRect()]).filter(([e, b]) => Math.min(b.width, b.height) < 43.5)
        .map(([e, b]) => [e.outerHTML.slice(0, 60), b.width, b.height])""")
    assert small == []
    if size[0] > 760:
        return
    bar = "document.getElementById('layers')"
    assert page.run(f"{bar}.scrollWidth > {bar}.clientWidth")
    x, y = page.centre("#layers")
    page.swipe((x + 100, y), (x - 150, y))
    assert page.until(f"{bar}.scrollLeft") > 50
    assert page.run("document.querySelector('#layers label:last-of-type').getBoundingClientRect().right <= innerWidth")
    page.click("#layers label:last-of-type")
    page.until("!document.getElementById('error-legend').hidden")


@pytest.mark.parametrize("is_dark", [True, False])
def test_text_can_be_read_in_either_scheme(new_page, stand_in, scene, is_dark):
    page = new_page(stand_in.url, is_dark=is_dark)
    page.until(FINAL)
    ratios = page.run("""(() => {
        const light = c => { const v = c.match(/[\\d.]+/g).map(Number).slice(0, 3).map(x => x / 255)
            .map(x => x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);
            return 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2]; };
        const ground = e => { for (; e; e = e.parentElement) { const b = getComputedStyle(e).backgroundColor;
            if (!/^rgba.*, 0\\)|transparent/.test(b)) return b; } };
        return [...document.querySelectorAll('aside .note, aside label, aside h2, .bars .ms, #frame, button.primary')]
            .filter(e => e.offsetParent && e.textContent.trim()).map(e => {
            const [a, b] = [light(getComputedStyle(e).color), light(ground(e))].sort((x, y) => y - x);
            return [(a + 0.05) / (b + 0.05), e.textContent.slice(0, 30)]; });
    })()""")
    assert len(ratios) > 10 and min(ratios)[0] >= 4.5, min(ratios)
