"""Whether this machine's graphics driver works behind the daemon's fences (server/confine/).

usage: sandbox.py BOUNCED BOUNCE SCENE -o RESULT.json

For each setting of --sandbox one daemon: a scene comes in, every technique that is no mere comparison
renders it, the device's shaders compiled anew. Said of each: whether all of it worked, what the daemon logged, which fences
were up. Of `log` also which system calls the filter would have refused, where the kernel's log can be
read. Exits 0 if `on` worked: then the filter may be on by default for this class of device.
"""
import argparse
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

SETTINGS = ("off", "auto", "log", "on")
SIZE = "64x64"
STEP_SECONDS = 60


def refused_calls(pid):
    """{number: times}, by the kernel's log; None where that is not ours to read."""
    try:
        ran = subprocess.run(["dmesg"], capture_output=True, text=True, timeout=20, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    found = {}
    for number in re.findall(rf"type=1326 .*\bpid={pid} .*syscall=(\d+)", ran.stdout):
        found[number] = found.get(number, 0) + 1
    return found


def fences(pid):
    lines = pathlib.Path(f"/proc/{pid}/status").read_text(encoding="utf-8")
    return {name: int(value) for name, value in
            re.findall(r"^(NoNewPrivs|Seccomp|Seccomp_filters):\s+(\d+)$", lines, re.M)}


def tried(words, env):
    try:
        ran = subprocess.run(words, capture_output=True, text=True, timeout=STEP_SECONDS, env=env,
                             check=False)
    except subprocess.TimeoutExpired:
        return {"words": words[1:], "code": None, "said": f"not within {STEP_SECONDS} s"}, ""
    return {"words": words[1:], "code": ran.returncode,
            **({"said": ran.stderr[-2000:]} if ran.returncode else {})}, ran.stdout


def techniques(listed):
    """Names, by `bounce techniques --json`."""
    known = json.loads(listed)["techniques"] if listed else []
    return [technique["name"] for technique in known if not technique.get("for_comparison")]


def one(options, setting, folder):
    socket = folder / "s.sock"
    # Every daemon meets a driver without compiled shaders.
    env = {**os.environ, "MESA_SHADER_CACHE_DIR": str(folder / "shaders"),
           "__GL_SHADER_DISK_CACHE_PATH": str(folder / "shaders")}
    (folder / "shaders").mkdir()
    log = folder / "log"
    with open(log, "wb") as stderr:
        daemon = subprocess.Popen([options.bounced, "--http", "none", "--listen", f"unix:{socket}",
                                   "--data", folder / "data", "--sandbox", setting],
                                  stderr=stderr, env=env)
    found = {"setting": setting, "steps": []}
    until = time.monotonic() + 60
    while not socket.exists() and daemon.poll() is None and time.monotonic() < until:
        time.sleep(.05)
    if socket.exists():
        server = ["--server", f"unix:{socket}"]
        found.update(fences(daemon.pid))
        step, listed = tried([options.bounce, "techniques", "--json", *server], env)
        found["steps"].append(step)
        for name in techniques(listed):
            found["steps"].append(tried(
                [options.bounce, "render", options.scene, "--technique", name, "--size", SIZE,
                 *(["--set", "spp=4"] if name == "reference" else []),
                 "-o", folder / f"{name}.png", "--quiet", *server], env)[0])
    daemon.send_signal(signal.SIGTERM)
    try:
        found["code"] = daemon.wait(60)
    except subprocess.TimeoutExpired:
        daemon.kill()
        found["code"] = daemon.wait()
    found["log"] = log.read_text(errors="replace")[-4000:]
    if setting == "log":
        found["refused_calls"] = refused_calls(daemon.pid)
    found["works"] = (found["code"] == 0 and len(found["steps"]) > 1
                      and all(step["code"] == 0 for step in found["steps"]))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in ("bounced", "bounce", "scene"):
        parser.add_argument(name)
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
    options = parser.parse_args()
    results = []
    for setting in SETTINGS:
        with tempfile.TemporaryDirectory() as folder:
            results.append(one(options, setting, pathlib.Path(folder)))
        print(setting, "works" if results[-1]["works"] else "DOES NOT WORK", flush=True)
    options.output.write_text(json.dumps(results, indent=1, default=str) + "\n")
    return 0 if results[-1]["works"] else 1


if __name__ == "__main__":
    sys.exit(main())
