"""When a pytest run counts as skipped. Imported by the conftest.py of each folder."""
import os
import subprocess

import pytest

SKIPPED = 77  # meson's word for it
DEVICE = 6  # bounce's exit code where no device works


def pytest_sessionfinish(session, exitstatus):
    """A run in which nothing ran must not read as passed."""
    stats = session.config.pluginmanager.get_plugin("terminalreporter").stats
    if exitstatus == 0 and not stats.get("passed"):
        session.exitstatus = SKIPPED


def skip_without_device(bounce, tmp_path_factory):
    """Skips where no device works, and fails where something else is wrong."""
    env = {**os.environ, "XDG_RUNTIME_DIR": str(tmp_path_factory.mktemp("run"))}
    result = subprocess.run([bounce, "devices"], env=env, capture_output=True, timeout=120,
                            check=False)
    if result.returncode == DEVICE:
        pytest.skip("no device here: " + result.stderr.decode())
    assert result.returncode == 0, result.stderr.decode()
