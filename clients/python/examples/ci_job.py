#!/usr/bin/python3
"""A check for continuous integration: has the picture of a scene changed?

Renders the scene and compares it with the picture that a former run kept. Exit codes are those of
bounce: 0 alike, 1 changed, 3 nothing to compare with (--keep makes it), 4 and above for faults.

    PYTHONPATH=build/clients/python clients/python/examples/ci_job.py --golden room.exr --keep
    PYTHONPATH=build/clients/python clients/python/examples/ci_job.py --golden room.exr
"""
import argparse
import json
import sys
from pathlib import Path

import numpy

import bounced

CORNELL = Path(__file__).resolve().parents[3] / "tests/scenes/cornell.glb"
EXIT_CODES = {"usage": 2, "deadline": 5, "busy": 5, "no_memory": 5, "device": 6, "device_lost": 6,
              "unreachable": 7, "unauthorized": 7}


def options():
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("scene", nargs="?", default=CORNELL, help="a .glb or .gltf")
    words.add_argument("--golden", type=Path, default=Path("golden.exr"))
    words.add_argument("--keep", action="store_true", help="keep this picture as the golden one")
    words.add_argument("--tolerance", type=float, default=0.01, help="relative RMSE")
    words.add_argument("--report", type=Path, help="the frame's report as JSON")
    words.add_argument("--technique", default="auto")
    words.add_argument("--size", type=int, default=256, help="side in pixels")
    words.add_argument("--server", help="of a daemon that runs; else a private one is started")
    return words.parse_args()


def relative_rmse(reference, picture):
    """Over all channels and pixels, of the reference's mean."""
    return numpy.sqrt(numpy.mean((picture - reference) ** 2)) / numpy.mean(reference)


def judge(asked, frame):
    if asked.keep:
        frame.save(asked.golden)
        print(f"kept as {asked.golden}")
        return 0
    if not asked.golden.exists():
        print(f"{asked.golden} is not there; --keep makes it", file=sys.stderr)
        return 3
    golden = bounced.read_exr(asked.golden)["beauty"]
    if golden.shape != frame.rgba.shape:
        print(f"{golden.shape} and {frame.rgba.shape} pixels", file=sys.stderr)
        return 1
    error = relative_rmse(golden[..., :3], frame.rgba[..., :3])
    print(f"relative RMSE {100 * error:.3f} %, allowed {100 * asked.tolerance:.3f} %")
    return 0 if error <= asked.tolerance else 1


def main():
    asked = options()
    try:
        with bounced.connect(asked.server) if asked.server else bounced.private() as daemon:
            frame = daemon.render(asked.scene, size=(asked.size, asked.size), seed=0,
                                  technique=asked.technique, deadline_ms=120000)
    except bounced.Error as error:
        print(error, file=sys.stderr)
        return EXIT_CODES.get(error.code, 4)
    for flag in frame.report["flags"]:
        print("flag:", bounced.plain(flag), file=sys.stderr)
    if asked.report:
        asked.report.write_text(json.dumps(frame.report, indent=2))
    return judge(asked, frame)


if __name__ == "__main__":
    sys.exit(main())
