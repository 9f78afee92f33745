"""What the viewer's tests share: one Chromium, and pages in it that may not complain."""
import os
import pathlib
import sys

import pytest

sys.dont_write_bytecode = True
sys.path.insert(0, os.environ["BD_PB2_DIR"])
sys.path.insert(0, str(pathlib.Path(__file__).parent))
sys.path.insert(0, str(pathlib.Path(__file__).parents[1]))

import browser as chromium  # noqa: E402
from skips import pytest_sessionfinish  # noqa: E402, F401

SCENES = pathlib.Path(__file__).parents[1] / "scenes"


def pytest_collection_modifyitems(items):
    if chromium.CHROMIUM:
        return
    for item in items:
        item.add_marker(pytest.mark.skip(reason="there is no Chromium (Debian's package chromium)"))


@pytest.fixture(scope="session")
def browser():
    one = chromium.Browser()
    yield one
    one.close()


@pytest.fixture
def new_page(browser, request):
    """Opens pages; each ends without a complaint: no error, no exception, nothing that its policy forbade."""
    if "stand_in" in request.fixturenames:
        request.getfixturevalue("stand_in")  # begun first, so that it ends last: no page calls for it in vain
    pages = []

    def go(url, **keywords):
        pages.append(chromium.Page(browser, **keywords))
        pages[-1].open(url)
        return pages[-1]

    yield go
    for page in pages:
        page.close()
        faults = [fault for fault in page.faults if not any(word in fault for word in page.allowed)]
        assert faults == []


@pytest.fixture
def stand_in():
    from stand_in import StandIn
    server = StandIn()
    yield server
    server.close()


@pytest.fixture
def scene(stand_in):
    """The stand-in with a scene of two lights, a group and a mirrored box in it."""
    stand_in.add((SCENES / "two_lights.glb").read_bytes(), "two_lights.glb")
    return next(iter(stand_in.scenes.values()))
