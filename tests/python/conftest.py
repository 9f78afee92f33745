"""What the tests of the Python client share: a daemon without a renderer, and a made-up one."""
import os
import pathlib
import re
import signal
import subprocess
import sys
import time

import pytest

HERE = pathlib.Path(__file__).parent
SCENES = HERE.parent / "scenes"
EXAMPLES = HERE / "../../clients/python/examples"
PACKAGE = os.environ["BD_PYTHON_DIR"]
BOUNCED = os.environ["BOUNCED"]
sys.dont_write_bytecode = True
sys.path[:0] = [PACKAGE, str(HERE), str(HERE / "..")]

import bounced  # noqa: E402
from fake_peer import FakePeer  # noqa: E402
from skips import pytest_sessionfinish  # noqa: E402,F401


@pytest.fixture
def daemon():
    """A client of a private daemon of its own."""
    with bounced.private() as client:
        yield client


@pytest.fixture
def scene(daemon):
    return daemon.scenes.add(SCENES / "cornell.glb")


@pytest.fixture
def peer():
    """A made-up daemon: `peer.client` talks to it."""
    with FakePeer() as made_up:
        yield made_up


class Served:
    """A daemon on sockets of its own."""

    def __init__(self, folder, token=None, options=()):
        self.path = str(folder / "s.sock")
        words = [BOUNCED, "--http", "127.0.0.1:0", "--listen", "unix:" + self.path,
                 "--listen", "tcp:127.0.0.1:0", "--data", str(folder / "data"), *options]
        if token:
            (folder / "tokens").write_text(token + "\n")
            (folder / "tokens").chmod(0o600)
            words += ["--token-file", str(folder / "tokens")]
        self.log = folder / "log"
        with open(self.log, "wb") as log:
            self.process = subprocess.Popen(words, stderr=log)
        until = time.monotonic() + 30
        while not (found := self._ports()) and time.monotonic() < until:
            assert self.process.poll() is None, self.log.read_text()
            time.sleep(0.01)
        self.http, self.tcp = found

    def _ports(self):
        log = self.log.read_text()
        http = re.search(r"http://127\.0\.0\.1:(\d+)", log)
        tcp = re.search(r"listening on 127\.0\.0\.1:(\d+)", log)
        if http and tcp and os.path.exists(self.path):
            return http[0], "tcp:127.0.0.1:" + tcp[1]
        return None

    def stop(self):
        self.process.send_signal(signal.SIGTERM)
        assert self.process.wait(timeout=20) == 0, self.log.read_text()


@pytest.fixture
def serve(tmp_path):
    """Starts daemons on sockets."""
    started = []

    def start(**options):
        folder = tmp_path / f"served{len(started)}"
        folder.mkdir()
        started.append(Served(folder, **options))
        return started[-1]

    yield start
    for served in started:
        served.stop()
