"""The reference's time beside Embree's own for the same rays (reference_speed.c).

usage: reference_speed.py BUILD_DIR SCENES_DIR -o RESULT.json [--samples N]

The goals are ratios of at most 2 on Sponza and the conference room and 4 on the Cornell box.
"""
import argparse
import json
import pathlib
import subprocess

from by_hand import machine

CASES = [("sponza_dabrovic", "192x144", 2), ("conference_room", "192x144", 2),
         ("cornell_box", "192x192", 4)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build")
    parser.add_argument("scenes")
    parser.add_argument("-o", required=True)
    parser.add_argument("--samples", type=int, default=8)
    options = parser.parse_args()
    rows = []
    for scene, size, goal in CASES:
        out = subprocess.run([pathlib.Path(options.build) / "tests/bench/reference_speed",
                              pathlib.Path(options.scenes) / f"{scene}.glb", size, "Camera",
                              str(options.samples)], check=True, capture_output=True)
        rows.append({**json.loads(out.stdout), "ratio_goal": goal})
        print(json.dumps(rows[-1]), flush=True)
    result = {"machine": machine(),
              "command": f"reference_speed.py BUILD SCENES --samples {options.samples}",
              "cases": rows}
    pathlib.Path(options.o).write_text(json.dumps(result, indent=1) + "\n")


main()
