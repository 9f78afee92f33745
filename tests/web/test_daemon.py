"""The page and the daemon as they are: what it serves passes its own policy, and light reaches the screen."""
import contextlib
import json
import os
import re
import signal
import subprocess
import time
import urllib.request

import pytest

from browser import difference
from conftest import SCENES

BOUNCED = os.environ["BD_BOUNCED"]
SIZE = {"width": 420, "height": 420}  # a small picture is a quick one
TOAST = "document.getElementById('toasts').textContent"
STAGE = "document.getElementById('stage').dataset"


class Daemon:
    """One data directory and one port, whichever process serves them."""

    def __init__(self, folder):
        self.folder, self.port, self.process = folder, 0, None
        self.log = folder / "log"
        self.start()

    def start(self):
        self.process = subprocess.Popen(
            [BOUNCED, "--http", f"127.0.0.1:{self.port}", "--listen", f"unix:{self.folder}/s.sock",
             "--data", str(self.folder / "data"), "--device", "software"], stderr=open(self.log, "wb"))
        end = time.monotonic() + 60
        while not (found := re.search(r"http://127\.0\.0\.1:(\d+)", self.log.read_text())):
            if self.process.poll() == 6:
                pytest.skip("no device here: " + self.log.read_text())
            assert self.process.poll() is None and time.monotonic() < end, self.log.read_text()
            time.sleep(0.02)
        self.port = int(found[1])
        self.url = f"http://127.0.0.1:{self.port}/"

    def kill(self):
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()

    def stop(self):
        with contextlib.suppress(ProcessLookupError):
            self.process.terminate()
        assert self.process.wait(timeout=60) == 0, self.log.read_text()


@pytest.fixture(scope="module")
def daemon(tmp_path_factory):
    one = Daemon(tmp_path_factory.mktemp("daemon"))
    yield one
    one.stop()


@pytest.fixture
def page(new_page, daemon):
    one = new_page(daemon.url, **SIZE)
    one.until("document.querySelector('#technique option') !== null", 60)  # connected, and told of the techniques
    return one


def shown(page):
    """The pixels of a frame that shows what was asked for last."""
    page.until(f"{STAGE}.frames && {STAGE}.current === 'true'", 120)
    return page.pixels()


def scenes_of(page):
    with urllib.request.urlopen(page.run("location.origin") + "/v1/scenes") as reply:
        return [scene["id"] for scene in json.load(reply)["scenes"]]


def drop(page, name):
    """Drops a file and waits for the page to show the scene that it became: not one of that name that
    was there before. One synthetic drag in a dozen comes to nothing, so there are three."""
    page.until("document.getElementById('connection').textContent === 'Connected'", 60)
    known = scenes_of(page)
    is_new = (f"!{json.dumps(known)}.includes(document.getElementById('scenes').value) && "
              f"document.getElementById('scenes').selectedOptions[0]?.text === '{name}'")
    for attempt in range(3):
        page.drop_files("#stage", [SCENES / name])
        try:
            page.until(is_new, 20)
        except AssertionError:
            added = len(scenes_of(page)) - len(known)
            print("drop", attempt, "came to nothing;", added, "scenes added")
            continue
        return shown(page)
    raise AssertionError(f"{name} was dropped three times and is not shown")


def test_a_dropped_file_is_seen_and_techniques_differ(page):
    page.set("#technique select", "rsm")
    pixels = drop(page, "cornell.glb")
    assert len({tuple(pixel) for pixel in pixels}) > 50
    assert page.until(STAGE + ".technique") == "rsm"
    # Red to the left, green to the right.
    red = sum(r - g for r, g, _ in pixels)
    assert max(r - g for r, g, _ in pixels) > 30 and max(g - r for r, g, _ in pixels) > 15, red
    page.set("#technique select", "direct")
    page.until(STAGE + ".technique === 'direct'", 120)
    assert difference(pixels, page.pixels()) > 2
    names = page.run("[...document.querySelectorAll('.bars .name')].map(e => e.textContent)")
    assert "gbuffer" in names and "direct" in names and "rsm" not in names
    assert "rsm" in page.run("document.getElementById('cost').innerText")  # left out, and why


def test_another_layer_and_another_view_are_other_pixels(page):
    page.set("#technique select", "direct")
    before = drop(page, "cornell.glb")
    page.click("#layers label:nth-of-type(5)")
    albedo = shown(page)
    assert difference(before, albedo) > 5
    x, y = page.centre("#stage")
    page.drag((x, y), (x + 80, y + 10))
    assert difference(albedo, shown(page)) > 2
    assert page.run(TOAST) == ""


def test_the_layer_error_is_drawn(page):
    page.set("#technique select", "direct")
    drop(page, "cornell.glb")
    page.click("#layers label:last-of-type")
    page.until("!document.getElementById('error-map').hidden", 120)
    assert "of the reference" in page.run("document.getElementById('error-legend').innerText")
    assert page.run(TOAST) == ""


def test_an_export_is_what_the_daemon_has(page, tmp_path):
    page.set("#technique select", "direct")
    drop(page, "cornell.glb")
    page.downloads_to(tmp_path)
    page.run("document.getElementById('export').closest('details').open = true")
    page.click("#export")
    end = time.monotonic() + 60
    while not (tmp_path / "cornell.glb").is_file():
        assert time.monotonic() < end, page.run(TOAST)
        time.sleep(0.05)
    scene = page.run("location.origin + '/v1/scenes/' + document.getElementById('scenes').value")
    with urllib.request.urlopen(scene + "/export") as reply:
        assert (tmp_path / "cornell.glb").read_bytes() == reply.read()


def test_a_gltf_with_its_file(page):
    page.choose_files("#file", [SCENES / "bare.gltf", SCENES / "bare.bin"])
    page.until("document.getElementById('scenes').selectedOptions[0]?.text === 'bare.gltf'", 60)
    assert len({tuple(pixel) for pixel in shown(page)}) > 3


def test_a_file_that_cannot_be_read_is_refused_in_words(page, tmp_path):
    page.allowed = ("400",)
    (tmp_path / "bad.glb").write_bytes(b"glTF nonsense")
    page.choose_files("#file", [tmp_path / "bad.glb"])
    assert page.until(TOAST, 60)


def test_a_light_is_edited(page):
    page.set("#technique select", "direct")
    before = drop(page, "cornell.glb")
    page.run("document.getElementById('objects-section').open = true")
    value = page.until("[...document.querySelectorAll('#objects option')].find(o => o.text === 'Spot')?.value")
    page.set("#objects select", value)
    # Automatic exposure would hide it.
    page.run("document.getElementById('look').closest('details').open = true")
    page.click("#look input[type=checkbox]")
    revision = int(page.run(STAGE + ".revision"))
    page.set("#objects .field:has(input[type=range]) input.number", "0.5")
    page.until(f"Number({STAGE}.revision) > {revision}", 60)
    dark = page.pixels()
    assert sum(map(sum, dark)) < 0.7 * sum(map(sum, before))
    page.click("#undo")
    page.until(f"Number({STAGE}.revision) > {revision + 1}", 60)
    assert sum(map(sum, page.pixels())) > 1.2 * sum(map(sum, dark))


def test_it_outlives_a_killed_daemon(page, daemon):
    page.allowed = ("WebSocket", "ERR_CONNECTION", "Failed to load")
    page.set("#technique select", "direct")
    before = drop(page, "cornell.glb")
    scene = page.run("document.getElementById('scenes').value")
    daemon.kill()
    page.until("document.getElementById('connection').textContent !== 'Connected'")
    daemon.start()
    page.until("document.getElementById('connection').textContent === 'Connected'", 60)
    assert difference(before, shown(page)) < 2
    assert page.run("document.getElementById('scenes').value") == scene
    page.set("#technique select", "rsm")
    page.until(STAGE + ".technique === 'rsm'", 120)


def test_two_take_back_their_own(new_page, daemon):
    """Both change the same lamp; who was first takes back what was hers, and the other hears of it."""
    pages = []
    for name in ("Anna", "Bert"):
        page = new_page(daemon.url, **SIZE)
        page.until("document.getElementById('connection').textContent === 'Connected'", 60)
        page.set("#technique select", "direct")
        drop(page, "cornell.glb") if not pages else page.set("#scenes", pages[0].run("document.getElementById('scenes').value"))
        page.set("details input[autocomplete=nickname]", name)
        page.run("document.getElementById('objects-section').open = true")
        page.set("#objects select", page.until(
            "[...document.querySelectorAll('#objects option')].find(o => o.text === 'Spot')?.value"))
        pages.append(page)
    anna, bert = pages
    number, color = "#objects .field:has(input[type=range]) input.number", "#objects input[type=color]"
    before = bert.until(f"document.querySelector('{number}').value")
    anna.set(number, "3")
    bert.until(TOAST + ".includes('Anna changed light 0')", 60)
    bert.until(f"document.querySelector('{number}').value === '3'", 60)
    bert.set(color, "#ff0000")
    anna.until(TOAST + ".includes('Bert changed light 0')", 60)
    anna.click("#undo")
    bert.until(TOAST + ".includes('Anna took back the change of revision 2')", 60)
    bert.until(f"document.querySelector('{number}').value === '{before}'", 60)
    assert bert.run(f"document.querySelector('{color}').value") == "#ff0000"
    for page in pages:  # what was asked for has come, whoever asked
        page.until("document.getElementById('refining-text').textContent.startsWith('Finished')", 120)
