"""What the tests of bounce stability share."""
import os
import pathlib
import subprocess

import pytest

BUILD = pathlib.Path(os.environ["BD_BUILD_DIR"])
SOURCE = pathlib.Path(os.environ["BD_SOURCE_DIR"])
BOUNCE = BUILD / "clients/cli/bounce"
BOUNCED = BUILD / "server/bounced"
IS_SANITIZED = b"__asan_init" in BOUNCED.read_bytes()
os.environ.update(BOUNCE=str(BOUNCE), BOUNCED=str(BOUNCED))


@pytest.fixture(scope="session", autouse=True)
def device(tmp_path_factory):
    """Skips everything where no device works: the only reason to."""
    env = {**os.environ, "XDG_RUNTIME_DIR": str(tmp_path_factory.mktemp("run"))}
    result = subprocess.run([BOUNCE, "devices"], env=env, capture_output=True, timeout=120,
                            check=False)
    if result.returncode == 6:
        pytest.skip("no device here: " + result.stderr.decode())
    assert result.returncode == 0, result.stderr.decode()


@pytest.fixture
def bounce(tmp_path):
    def run(*words, env=None, timeout=380):
        return subprocess.run([BOUNCE, *map(str, words)], capture_output=True, text=True,
                              timeout=timeout, check=False, cwd=tmp_path,
                              env={**os.environ, **(env or {})})
    return run


def pytest_sessionfinish(session, exitstatus):
    """77 is meson's word for skipped: a run in which nothing ran must not read as passed."""
    stats = session.config.pluginmanager.get_plugin("terminalreporter").stats
    if exitstatus == 0 and not stats.get("passed"):
        session.exitstatus = 77
