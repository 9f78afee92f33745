#!/usr/bin/python3
"""A camera once around a scene: one PNG a step, several under way at once.

    PYTHONPATH=build/clients/python clients/python/examples/turntable.py -o /tmp/turntable
"""
import argparse
from pathlib import Path

import numpy

import bounced

CORNELL = Path(__file__).resolve().parents[3] / "tests/scenes/cornell.glb"
UNDER_WAY = 4


def options():
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("scene", nargs="?", default=CORNELL, help="a .glb or .gltf")
    words.add_argument("-o", "--output", type=Path, default=Path("turntable"), help="a folder")
    words.add_argument("--size", type=int, default=256, help="side in pixels")
    words.add_argument("--steps", type=int, default=24)
    words.add_argument("--technique", default="auto")
    words.add_argument("--server", help="of a daemon that runs; else a private one is started")
    return words.parse_args()


def poses(info, count):
    """Around the middle of the scene, from a little above, far enough to see all of it."""
    low, high = numpy.array(info["bounds_min"]), numpy.array(info["bounds_max"])
    middle, radius = (low + high) / 2, numpy.linalg.norm(high - low) / 2
    yfov = 0.7
    distance = radius / numpy.sin(yfov / 2)
    for angle in numpy.arange(count) * 2 * numpy.pi / count:
        direction = numpy.array((numpy.sin(angle), 0.3, numpy.cos(angle)))
        eye = middle + distance * direction / numpy.linalg.norm(direction)
        yield bounced.Pose(eye=eye, target=middle, yfov=yfov)


def main():
    asked = options()
    asked.output.mkdir(parents=True, exist_ok=True)
    with bounced.connect(asked.server) if asked.server else bounced.private() as daemon:
        scene = daemon.scenes.add(asked.scene)
        under_way = []
        for step, pose in enumerate(poses(scene.info(), asked.steps)):
            # One exposure for all, or the pictures would flicker.
            under_way.append((step, scene.render_later(
                pose=pose, size=(asked.size, asked.size), technique=asked.technique, aa=4,
                exposure=0, encoding="png")))
            if len(under_way) == UNDER_WAY:
                save(asked.output, *under_way.pop(0))
        for step, frame in under_way:
            save(asked.output, step, frame)
        scene.remove()


def save(folder, step, pending):
    frame = pending.result()
    frame.save(folder / f"{step:03}.png")
    reused = [entry["name"] for entry in frame.report["passes"] if entry["state"] == "reused"]
    print(f"{step:03}.png {frame.report['time_ms']['total']:.0f} ms, reused: {', '.join(reused)}")


if __name__ == "__main__":
    main()
