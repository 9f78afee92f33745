"""deploy/quickstart as a new user meets it, with a build that is there already and a renderer that
draws gradients: ports that are taken, scenes that are not there, its last screen."""
import http.client
import os
import pathlib
import shutil
import socket
import subprocess
import time

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ["BD_BUILD_DIR"])

FAKES = {
    # Everything is installed.
    "dpkg-query": "echo installed\n",
    "meson": "mkdir -p build; touch build/build.ninja\n",
    "ninja": f"""echo built >>build/ninja.log
mkdir -p build/server build/clients/cli
[ -f build/server/bounced ] || cp {BUILD}/tests/net/bounced_gradient build/server/bounced
[ -f build/clients/cli/bounce ] || cp {BUILD}/clients/cli/bounce build/clients/cli/bounce
""",
}


class Tree:
    """A source tree of which quickstart needs three files."""

    def __init__(self, folder):
        self.folder, self.run = folder / "tree", folder / "tree/build/run"
        for path in ("deploy/quickstart", "deploy/packages.sh", "tests/scenes/cornell.glb"):
            (self.folder / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / path, self.folder / path)
        fakes = folder / "bin"
        fakes.mkdir()
        for name, script in FAKES.items():
            (fakes / name).write_text("#!/bin/sh\n" + script)
            (fakes / name).chmod(0o755)
        self.env = {**os.environ, "PATH": f"{fakes}:{os.environ['PATH']}"}
        self.env.pop("BOUNCED_HTTP", None)

    def __call__(self, *words, address=None):
        env = {**self.env, **({"BOUNCED_HTTP": address} if address else {})}
        return subprocess.run(["deploy/quickstart", *words], cwd=self.folder, env=env, timeout=50,
                              capture_output=True, text=True, check=False)

    def pid(self):
        return int((self.run / "pid").read_text())

    def was_built(self):
        return (self.folder / "build/ninja.log").exists()


@pytest.fixture
def tree(tmp_path):
    made = Tree(tmp_path)
    yield made
    made("stop")


@pytest.fixture
def taken():
    """A port that another program listens on."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield server.getsockname()[1]


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


def screen(result):
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout.rstrip().splitlines()


def viewer(result):
    """The address on the last line of the screen."""
    name, url = screen(result)[-1].split()
    assert name == "viewer"
    return url.removeprefix("http://").rstrip("/")


def answers(address):
    host, port = address.rsplit(":", 1)
    connection = http.client.HTTPConnection(host, int(port), timeout=10)
    connection.request("GET", "/healthz")
    return connection.getresponse().status == 200


def test_a_missing_scene_is_told_before_the_build(tree):
    start = time.monotonic()
    result = tree("nowhere.glb")
    assert result.returncode == 2 and "nowhere.glb" in result.stderr
    assert not tree.was_built() and time.monotonic() - start < 5
    assert tree(str(tree.folder)).returncode == 2  # a folder is no scene
    assert not tree.was_built()


def test_the_last_screen(tree):
    result = tree(address=f"127.0.0.1:{free_port()}")
    lines = screen(result)
    picture = tree.folder / "build/first-frame.png"
    assert lines[-2].split() == ["picture", str(picture)] and picture.read_bytes()[:4] == b"\x89PNG"
    assert answers(viewer(result))
    assert len(lines) < 12 and "{" not in result.stdout
    assert (tree.folder / "build/first-frame.json").exists()


def test_a_taken_port_is_seen_and_the_next_one_remembered(tree, taken):
    first = tree(address=f"127.0.0.1:{taken}")
    address = viewer(first)
    host, port = address.rsplit(":", 1)
    assert host == "127.0.0.1" and taken < int(port) <= taken + 100
    assert f"127.0.0.1:{taken} is taken" in first.stdout.split("building")[0]  # before the build
    assert answers(address) and (tree.run / "address").read_text().strip() == address
    pid = tree.pid()
    # Without a word about it, the same daemon at the same place.
    again = tree()
    assert viewer(again) == address and tree.pid() == pid and "running already" in again.stdout
    # A newer program: another daemon, the same place.
    os.utime(tree.folder / "build/server/bounced", (time.time() + 60, time.time() + 60))
    newer = tree()
    assert viewer(newer) == address and tree.pid() != pid and answers(address)


def test_another_address_is_another_daemon(tree):
    first, second = free_port(), free_port()
    assert viewer(tree(address=f"127.0.0.1:{first}")) == f"127.0.0.1:{first}"
    assert viewer(tree(address=f"127.0.0.1:{second}")) == f"127.0.0.1:{second}"
    with pytest.raises(OSError):
        answers(f"127.0.0.1:{first}")


@pytest.mark.parametrize("address", ["7480x", "127.0.0.1", "127.0.0.1:", "127.0.0.1:http"])
def test_what_is_no_address(tree, address):
    result = tree(address=address)
    assert result.returncode == 2 and "HOST:PORT" in result.stderr and not tree.was_built()
