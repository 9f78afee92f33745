"""How many times slower than usual this machine is today: what time budgets are multiplied by.

usage: machine_speed.py BUILD

Renders the bundled Cornell box three times and takes the fastest gather pass, which is arithmetic on
all processors and nothing else. At least 1, at most 3; 1 if nothing can be rendered, which the tests
will tell better.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

# Two cores of an AMD EPYC, idle, software device, gcc release: 1,423 ms in the box with the side spot
# at 1024x1024, a quarter at this size, and 1.1 times as long in this scene (914 and 832 ms in one run).
USUAL_MS = 391
SLOWEST = 3


def gather_ms(build, folder):
    report = pathlib.Path(folder) / "report.json"
    scene = pathlib.Path(__file__).parent.parent / "tests/scenes/cornell.glb"
    subprocess.run([build + "/clients/cli/bounce", "render", scene, "-o", folder + "/frame.exr",
                    "--size", "512x512", "--technique", "rsm", "--set", "vpls=1024",
                    "--set", "brdf=lambert", "--report", report, "--quiet"],
                   check=True, timeout=120, stderr=subprocess.DEVNULL)
    passes = json.loads(report.read_text())["passes"]
    return next(one["ms"] for one in passes if one["name"] == "gather")


def main():
    try:
        with tempfile.TemporaryDirectory() as folder:
            least_ms = min(gather_ms(sys.argv[1], folder) for _ in range(3))
        factor = min(max(least_ms / USUAL_MS, 1), SLOWEST)
        print(f"gather {least_ms:.0f} ms, usually {USUAL_MS}: budgets x {factor:.2f}", file=sys.stderr)
    except (OSError, subprocess.SubprocessError, KeyError, StopIteration) as error:
        factor = 1
        print(f"the machine's speed is not known: {error}", file=sys.stderr)
    print(f"{factor:.2f}")


if __name__ == "__main__":
    main()
