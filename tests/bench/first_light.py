"""Figures of whole commands: a cold process, and a second frame from the same daemon.

usage: first_light.py BUILD_DIR [-o RESULT.json] [--runs N] [--scenes DIR]

Prints one JSON object: for each case the median and the extremes of the wall clock in seconds, the
highest resident memory of bounce and its daemon together in MiB, and the report of the median run.
The drivers' shader cache is warm: each case runs once before it counts. With --scenes, also the
scenes of that folder that the goals name; otherwise the bundled ones alone.
"""
import argparse
import json
import os
import pathlib
import statistics
import subprocess
import tempfile
import time

from by_hand import machine

HERE = pathlib.Path(__file__).resolve().parent
CORNELL = ["--size", "512x512", "--set", "vpls=256", "--aa", "1"]
SPONZA = ["--size", "1024x768", "--set", "vpls=256", "--aa", "1"]
LIGHT_SIDE = {"shadow_map", "rsm", "vpl_grid"}


def resident_mib(pid):
    """High-water marks of a process and its children, summed; 0 once it is gone."""
    try:
        status = pathlib.Path(f"/proc/{pid}/status").read_text()
        children = pathlib.Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    except OSError:
        return 0.0
    own = sum(int(line.split()[1]) / 1024 for line in status.splitlines()
              if line.startswith("VmHWM"))
    return own + sum(resident_mib(child) for child in children)


def run_once(words, env):
    """Wall clock, memory and report of one bounce render."""
    with tempfile.TemporaryDirectory() as folder:
        report = pathlib.Path(folder) / "report.json"
        start = time.monotonic()
        process = subprocess.Popen([*words, "-o", f"{folder}/frame.png", "--report", report,
                                    "--quiet"], env=env, stderr=subprocess.DEVNULL)
        highest = 0.0
        while process.poll() is None:
            highest = max(highest, resident_mib(process.pid))
            time.sleep(0.005)
        seconds = time.monotonic() - start
        if process.returncode != 0:
            raise SystemExit(f"{words}: exit code {process.returncode}")
        return seconds, highest, json.loads(report.read_text())


def cold_process(bounce, scene, options, env, count):
    words = [bounce, "render", scene, *options]
    run_once(words, env)
    runs = sorted((run_once(words, env) for _ in range(count)), key=lambda run: run[0])
    walls = [run[0] for run in runs]
    return {"command": " ".join(map(str, ["bounce", "render", scene.name, *options])),
            "wall_s": {"median": statistics.median(walls), "min": walls[0], "max": walls[-1]},
            "resident_mib": max(run[1] for run in runs), "report": runs[len(runs) // 2][2]}


def camera_side_ms(report):
    return sum(p["ms"] for p in report["passes"] if p["name"] not in LIGHT_SIDE)


def start_daemon(build, env, folder):
    socket = f"{folder}/bench.sock"
    daemon = subprocess.Popen([build / "server/bounced", "--http", "127.0.0.1:0", "--listen",
                               f"unix:{socket}", "--data", f"{folder}/data"], env=env,
                              stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 30
    while not os.path.exists(socket):
        if time.monotonic() > deadline or daemon.poll() is not None:
            raise SystemExit("bounced does not listen")
        time.sleep(0.01)
    return daemon, ["--server", f"unix:{socket}"]


def two_frames(build, scene, options, env, order):
    """Reports of two cameras of one scene, in order, from one fresh daemon."""
    bounce = build / "clients/cli/bounce"
    with tempfile.TemporaryDirectory() as folder:
        daemon, server = start_daemon(build, env, folder)
        try:
            added = subprocess.run([bounce, "scene", "add", scene, "--json", *server], check=True,
                                   capture_output=True, env=env)
            held = json.loads(added.stdout)
            return [run_once([bounce, "render", "scene:" + held["id"], *options, "--camera",
                              held["cameras"][index], *server], env)[2] for index in order]
        finally:
            daemon.terminate()
            daemon.wait(timeout=30)


def second_frame(build, scene, options, env, count):
    """A camera's frame after another's, against the camera-side passes of its own first frame.

    Medians over `count` daemons for each order."""
    seconds = [two_frames(build, scene, options, env, (0, 1))[1] for _ in range(count)]
    firsts = [two_frames(build, scene, options, env, (1, 0))[0] for _ in range(count)]
    total = statistics.median(r["time_ms"]["total"] - r["time_ms"]["encode"] for r in seconds)
    first = statistics.median(camera_side_ms(r) for r in firsts)
    return {"scene": scene.name, "first_camera_side_ms": first, "second_total_ms": total,
            "second_over_first": total / first, "second": seconds[0]}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--scenes", type=pathlib.Path)
    options = parser.parse_args()
    build = options.build.resolve()
    own = HERE.parent / "scenes"
    cases = [("bundled_cornell", own / "cornell.glb", CORNELL)]
    views = [("bundled_two_lights", own / "two_lights.glb", CORNELL)]
    if options.scenes:
        cases += [("cornell_box", options.scenes / "cornell_box.glb", CORNELL),
                  ("sponza", options.scenes / "sponza_dabrovic.glb", SPONZA)]
        views.append(("sponza", options.scenes / "sponza_dabrovic.glb", SPONZA))
    result = {"machine": machine(), "runs": options.runs, "cold_process": {}, "second_frame": {}}
    with tempfile.TemporaryDirectory() as folder:
        env = {**os.environ, "XDG_RUNTIME_DIR": folder}
        for name, scene, words in cases:
            result["cold_process"][name] = cold_process(build / "clients/cli/bounce", scene, words,
                                                        env, options.runs)
        for name, scene, words in views:
            result["second_frame"][name] = second_frame(build, scene, words, env, options.runs)
    text = json.dumps(result, indent=1)
    print(text)
    if options.output:
        options.output.write_text(text + "\n")


if __name__ == "__main__":
    main()
