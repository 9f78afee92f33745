"""Edits against the passes that they run again: each kind of edit and technique.

usage: edit_passes.py BUILD_DIR -o RESULT.json [--techniques rsm,hisr]

Edits of tests/python/every_edit.py, one after the other on two_lights.glb at 24 x 16 pixels, in a daemon
of its own for each technique. After each, what the report of the next frame calls `ran`, without
`composite` and `readback`, which run in every frame.
"""
import argparse
import json
import os
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
EVERY_FRAME = {"composite", "readback"}


def passes_of(bounced, edits, technique):
    look = {"size": (24, 16), "technique": technique}
    ran = {}
    with bounced.private() as daemon:
        scene = daemon.scenes.add(ROOT / "tests/scenes/two_lights.glb")
        objects = scene.objects()
        scene.render(**look)
        for name, change in edits.items():
            with scene.edit() as edit:
                change(edit, objects)
            passes = scene.render(**look).report["passes"]
            ran[name] = [p["name"] for p in passes
                         if p["state"] == "ran" and p["name"] not in EVERY_FRAME]
            planned = sum(p["name"] not in EVERY_FRAME for p in passes)
        return {"passes": planned, "ran": ran}


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("build")
    parser.add_argument("-o", "--out", required=True)
    parser.add_argument("--techniques", default="direct,rsm,multires_gather,multires_splat,isr,hisr")
    options = parser.parse_args()
    build = pathlib.Path(options.build).resolve()
    os.environ["BOUNCED"] = str(build / "server/bounced")
    sys.path[:0] = [str(build / "clients/python"), str(ROOT / "tests/python")]
    import bounced
    from every_edit import EDITS
    result = {"command": "tests/bench/edit_passes.py " + " ".join(sys.argv[1:]),
              "techniques": {name: passes_of(bounced, EDITS, name)
                             for name in options.techniques.split(",")}}
    pathlib.Path(options.out).write_text(json.dumps(result, indent=1) + "\n")
    for name in EDITS:
        counts = "  ".join(f"{technique} {len(t['ran'][name])}/{t['passes']}"
                           for technique, t in result["techniques"].items())
        print(f"{name:20} {counts}")


if __name__ == "__main__":
    main()
