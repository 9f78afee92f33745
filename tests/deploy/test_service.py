"""deploy/bounced.service, by systemd's own analysis."""
import pathlib
import re
import shutil
import subprocess

import pytest

UNIT = pathlib.Path(__file__).resolve().parents[2] / "deploy/bounced.service"
# What is left are sockets, the graphics device, a compiler of shaders, and the host's files to read.
EXPOSURE_MAX = 1.5


def analyze(*words):
    if not shutil.which("systemd-analyze"):
        pytest.skip("systemd-analyze is not here")
    ran = subprocess.run(["systemd-analyze", "--no-pager", *map(str, words)], capture_output=True, text=True,
                         check=False, timeout=30)
    # A systemd too old for it.
    if "unrecognized option" in ran.stderr:
        pytest.skip(ran.stderr)
    return ran


def test_its_words_are_known(tmp_path):
    # The program lies where the unit was told to look; here, any will do.
    unit = tmp_path / "bounced.service"
    unit.write_text(UNIT.read_text().replace("/usr/local/bin/bounced", "/bin/true"))
    ran = analyze("verify", unit)
    assert ran.returncode == 0 and not ran.stderr, ran.stderr


def test_exposure():
    ran = analyze("security", "--offline=true", UNIT)
    found = re.search(r"Overall exposure level for bounced.service: ([\d.]+)", ran.stdout)
    assert found, ran.stdout + ran.stderr
    print(found[0])
    assert float(found[1]) <= EXPOSURE_MAX


@pytest.mark.parametrize("line", ["DynamicUser=yes", "ProtectSystem=strict", "NoNewPrivileges=yes",
                                  "SystemCallFilter=@system-service", "MemoryMax=75%",
                                  "StateDirectoryMode=0700", "CapabilityBoundingSet="])
def test_what_must_be_in_it(line):
    assert line in UNIT.read_text().splitlines()


def test_the_filter_lets_the_sandbox_be_set_up():
    """What the daemon's own fences are made of, and the import child's."""
    allowed = " ".join(re.findall(r"^SystemCallFilter=([^~].*)$", UNIT.read_text(), re.M)).split()
    for call in ("seccomp", "landlock_create_ruleset", "landlock_add_rule", "landlock_restrict_self",
                 "prlimit64", "setpriority", "ioprio_set", "sched_setscheduler"):
        assert call in allowed
