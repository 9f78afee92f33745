"""What the tests of bounce stability share."""
import os
import pathlib
import subprocess
import sys

import pytest

BUILD = pathlib.Path(os.environ["BD_BUILD_DIR"])
SOURCE = pathlib.Path(os.environ["BD_SOURCE_DIR"])
BOUNCE = BUILD / "clients/cli/bounce"
BOUNCED = BUILD / "server/bounced"
IS_SANITIZED = b"__asan_init" in BOUNCED.read_bytes()
sys.path.insert(0, str(SOURCE / "tests"))
os.environ.update(BOUNCE=str(BOUNCE), BOUNCED=str(BOUNCED))

from skips import pytest_sessionfinish, skip_without_device  # noqa: E402,F401


@pytest.fixture(scope="session", autouse=True)
def device(tmp_path_factory):
    """Skips everything where no device works: the only reason to."""
    skip_without_device(BOUNCE, tmp_path_factory)


@pytest.fixture
def bounce(tmp_path):
    def run(*words, env=None):  # how long it may take, meson knows: more on a slow machine
        return subprocess.run([BOUNCE, *map(str, words)], capture_output=True, text=True,
                              check=False, cwd=tmp_path, env={**os.environ, **(env or {})})
    return run
