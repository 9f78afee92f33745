"""What the daemon may do once it serves, and that it serves all the same.

What each fence holds back is tests/unit/confine's; here they are around the whole daemon, every thread
of it, and the children that it starts for imports.
"""
import ctypes
import pathlib
import signal
import subprocess
import time

import pytest

from conftest import ANSWER_S, BOUNCED

SECCOMP_FILTER = 2


def has_landlock():
    libc = ctypes.CDLL(None, use_errno=True)
    return libc.syscall(444, None, 0, 1) >= 1


def of_threads(daemon, key):
    """{value} of a line of every thread's status."""
    found = set()
    for path in pathlib.Path(f"/proc/{daemon.process.pid}/task").glob("*/status"):
        lines = dict(line.split(":", 1) for line in path.read_text().splitlines() if ":" in line)
        found.add(int(lines[key]))
    return found


@pytest.mark.parametrize("words", [(), ("--sandbox", "on"), ("--sandbox=log",)])
def test_every_thread_is_behind_it(start, words):
    if "on" in words and not has_landlock():
        pytest.skip("this kernel has no Landlock")
    daemon = start(*words)
    assert of_threads(daemon, "NoNewPrivs") == {1}
    assert of_threads(daemon, "Seccomp") == {SECCOMP_FILTER}
    # An import is a child, started behind the fences and confined further by itself.
    daemon.add_scene()
    assert len(daemon.json("GET", "/v1/scenes")[1]["scenes"]) == 1
    daemon.stop()
    assert not pathlib.Path(daemon.socket_path).exists()


def test_off_keeps_privileges_alone(start):
    daemon = start("--sandbox", "off")
    assert of_threads(daemon, "NoNewPrivs") == {1}
    assert of_threads(daemon, "Seccomp") == {0}


@pytest.mark.parametrize("words", [("--sandbox", "maybe"), ("--sandbox", ""), ("--sandbox",)])
def test_other_words_are_refused(words):
    ran = subprocess.run([BOUNCED, *words], capture_output=True, text=True, timeout=20, check=False)
    assert ran.returncode == 2 and "--sandbox" in ran.stderr



def test_files_that_are_read_again(start, tmp_path):
    """Editors write beside a file and rename: the folder is what is allowed, not the file of the start."""
    folder = tmp_path / "etc"
    folder.mkdir()
    file, config = folder / "tokens", folder / "config"
    write(file, "first-first-first\n")
    write(config, f"token-file {file}\n")
    daemon = start("--sandbox", "on" if has_landlock() else "auto", "--config", str(config))
    assert status_of(daemon, "first-first-first") == 200
    write(file, "second-second-second\n")
    write(config, f"token-file {file}\npublic-name box.example\n")
    daemon.process.send_signal(signal.SIGHUP)
    until = time.monotonic() + ANSWER_S
    while "read again" not in daemon.log_path.read_text() and time.monotonic() < until:
        time.sleep(.01)
    assert status_of(daemon, "second-second-second") == 200, daemon.log_path.read_text()
    assert status_of(daemon, "first-first-first") == 401


def write(file, text):
    beside = file.with_suffix(".new")
    beside.write_text(text)
    beside.chmod(0o600)
    beside.rename(file)


def status_of(daemon, token):
    return daemon.request("GET", "/v1/techniques", headers={"Authorization": f"Bearer {token}"})[0]
