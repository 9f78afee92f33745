"""What the end-to-end tests share: where the build is, and a way to run bounce."""
import json
import os
import pathlib
import subprocess
import sys
import time

import pytest

HERE = pathlib.Path(__file__).parent
BUILD = pathlib.Path(os.environ["BD_BUILD_DIR"])
BOUNCE = BUILD / "clients/cli/bounce"
SHARED = pathlib.Path(os.environ.get("BD_SHARED_DIR", HERE / "../../../shared"))
sys.path[:0] = [str(HERE / "../../clients"), str(HERE / "..")]

from skips import pytest_sessionfinish  # noqa: E402,F401


class Bounce:
    """Runs bounce in a folder of its own, with no daemon to be found by accident."""

    def __init__(self, folder):
        self.folder = folder
        self.env = {**os.environ, "XDG_RUNTIME_DIR": str(folder / "run")}
        self.env.pop("BOUNCED", None)

    def start(self, *words, **options):
        return subprocess.Popen([BOUNCE, *map(str, words)], cwd=self.folder, env=self.env,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options)

    def __call__(self, *words, timeout=60):
        process = self.start(*words)
        out, err = process.communicate(timeout=timeout)
        return subprocess.CompletedProcess(words, process.returncode, out, err.decode())


class FakeBounce(Bounce):
    """The same against fake_daemon.py."""

    def __init__(self, folder):
        super().__init__(folder)
        self.log = folder / "fake.log"
        self.env.update(BOUNCED=str(HERE / "fake_daemon.py"), FAKE_LOG=str(self.log),
                        PYTHONDONTWRITEBYTECODE="1")

    def mode(self, mode):
        self.env["FAKE_MODE"] = mode

    def asked(self, body=None):
        """What the daemon was asked, in order."""
        if not self.log.exists():
            return []
        entries = [json.loads(line) for line in self.log.read_text().splitlines()]
        return [e for e in entries if body is None or e.get("body") == body]


@pytest.fixture
def bounce(tmp_path):
    return Bounce(tmp_path)


@pytest.fixture
def fake(tmp_path):
    return FakeBounce(tmp_path)


@pytest.fixture
def running(fake):
    """A fake daemon on the default socket."""
    folder = fake.folder / "run"
    folder.mkdir(parents=True)
    path = folder / "bounced.sock"
    with subprocess.Popen([fake.env["BOUNCED"], str(path)], env=fake.env) as daemon:
        deadline = time.monotonic() + 20
        while not path.exists() and time.monotonic() < deadline:
            time.sleep(0.02)
        time.sleep(0.05)
        yield fake
        daemon.kill()
