#!/usr/bin/python3
"""A scripted edit session: a lamp is added, judged before it is, looked at, moved, taken back.

    PYTHONPATH=build/clients/python clients/python/examples/edit_session.py -o /tmp/session
"""
import argparse
from pathlib import Path

import bounced

CORNELL = Path(__file__).resolve().parents[3] / "tests/scenes/cornell.glb"


def options():
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("scene", nargs="?", default=CORNELL, help="a .glb or .gltf")
    words.add_argument("-o", "--output", type=Path, default=Path("session"), help="a folder")
    words.add_argument("--size", type=int, default=256, help="side in pixels")
    words.add_argument("--server", help="of a daemon that runs; else a private one is started")
    return words.parse_args()


def main():
    asked = options()
    asked.output.mkdir(parents=True, exist_ok=True)
    look = {"size": (asked.size, asked.size), "technique": "rsm", "encoding": "png", "exposure": 0}
    with bounced.connect(asked.server) if asked.server else bounced.private() as daemon:
        scene = daemon.scenes.add(asked.scene)
        scene.name_revision("as it came")
        scene.render(**look).save(asked.output / "0 before.png")

        # What would an edit cost? The same batch, checked only.
        for dry_run in (True, False):
            with scene.edit(message="a lamp", dry_run=dry_run,
                            frame=look if dry_run else None) as edit:
                lamp = edit.add_light(kind="point", color=(1, 0.8, 0.6), intensity=2)
                node = edit.add_node(name="lamp", light=lamp, translation=(0.5, 1.2, 0.5))
            if dry_run:
                print("would run again:", ", ".join(edit.result.invalidates))
        print(f"revision {edit.result.revision}: the lamp is light {lamp.id} in node {node.id}")
        scene.render(**look).save(asked.output / "1 lamp.png")

        # A drag: pixels change at once, and one revision remains of it.
        for step in range(5):
            with scene.edit(transient=True) as drag:
                drag.set_transform(node, translation=(0.5 - 0.25 * step, 1.2, 0.5))
            scene.render(**look)
        print("revision", scene.commit().revision, "holds the drag")
        scene.render(**look).save(asked.output / "2 dragged.png")

        scene.undo()
        scene.redo()
        scene.revert("as it came")
        scene.render(**look).save(asked.output / "3 after.png")
        for entry in scene.log():
            print(entry["revision"], entry["kind"],
                  bounced.plain(entry.get("message", "") + " " + "; ".join(entry["changes"])))
        scene.remove()


if __name__ == "__main__":
    main()
