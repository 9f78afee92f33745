"""A data directory that an older daemon wrote: opened, rendered and replayed by today's.

    /usr/bin/python3 tests/house/old_journal.py BUILD_BEFORE BUILD_NOW [-o FILE.json]

The older daemon is given every small scene, one edit of each kind of object in each, an undo and a
redo. The newer one must find the same revisions with the same content, render the same bytes, and
replay every revision to the hash that the journal keeps. Exit 1 where it does not.
"""
import argparse
import hashlib
import json
import pathlib
import subprocess
import sys
import tempfile
import time
import warnings

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENE_BYTES_MAX = 4_000_000
FRAMES = 40
TIMEOUT_S = 30

CHANGES = {  # of the first objects of each kind: fields that every version's edits know
    "material": {"roughness": .3, "base_color": (.2, .5, .7, 1), "metallic": .1, "alpha_cutoff": .4},
    "light": {"color": (1, .5, .25), "intensity": 7},
    "texture": {"wrap_s": "clamp", "nearest": True},
    "camera": {"near": .02, "far": 900.},
    "node": {"translation": (.1, .2, .3)},
}


class Daemon:
    def __init__(self, build, folder):
        self.url = f"unix:{folder}/{build.name}.{time.monotonic_ns()}.sock"
        self.process = subprocess.Popen(
            [build / "server/bounced", "--device", "software", "--http", "none", "--data", folder / "data",
             "--listen", self.url], stderr=subprocess.DEVNULL)

    def connect(self, bounced):
        until = time.monotonic() + TIMEOUT_S
        while True:
            try:
                return bounced.connect(self.url)
            except bounced.Unreachable:
                if time.monotonic() > until:
                    raise
                time.sleep(.1)

    def end(self):
        self.process.terminate()
        self.process.wait(TIMEOUT_S)


def scene_files():
    for folder in (ROOT.parent / "shared/scenes", ROOT / "tests/scenes"):
        for path in sorted(folder.rglob("*.gl*")):
            if path.suffix in (".glb", ".gltf") and path.stat().st_size <= SCENE_BYTES_MAX:
                yield path


def change(scene):
    """How many edits it took."""
    edits = 0
    for kind, fields in CHANGES.items():
        for item in scene.objects(kind)[:2]:
            with scene.edit() as edit:
                getattr(edit, f"set_{kind}")(item["id"], **fields)
            edits += 1
    with scene.edit() as edit:
        light = edit.add_light(kind="spot", intensity=200, cone_outer=.6)
        edit.add_node(light=light, translation=(0, 1, 0))
        edit.add_material(name="new", emissive=(1, 2, 3), double_sided=True, transmission=.5)
        edit.add_camera(yfov=1.0, near=.1)
    scene.undo()
    scene.redo()
    with scene.edit() as edit:
        edit.set_environment(radiance=(.1, .2, .3))
    return edits + 4


def write(client, refusal):
    edits = 0
    for path in scene_files():
        try:
            scene = client.scenes.add(path)
        except refusal:
            continue
        edits += change(scene)
    return edits


def state(client):
    return {scene.id: (scene.info()["hash"], scene.info()["revision"]) for scene in client.scenes}


def frames(client, ids):
    render = {"size": (96, 64), "technique": "many_light", "encoding": "png"}
    return {scene_id: hashlib.sha256(client.scenes.get(scene_id).render(**render).data).hexdigest()
            for scene_id in ids}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("before", type=pathlib.Path)
    parser.add_argument("now", type=pathlib.Path)
    parser.add_argument("-o", metavar="FILE")
    told = parser.parse_args()
    sys.path[:0] = [str(told.now.resolve() / "clients/python")]
    import bounced
    warnings.simplefilter("ignore", bounced.MissingFileWarning)

    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        older = Daemon(told.before, folder)
        client = older.connect(bounced)
        edits = write(client, bounced.Error)
        was = state(client)
        seen = frames(client, list(was)[:FRAMES])
        older.end()
        newer = Daemon(told.now, folder)
        client = newer.connect(bounced)
        found = state(client)
        again = frames(client, seen)
        newer.end()
        replay = subprocess.run([told.now / "clients/cli/bounce", "replay", folder / "data", "--check"],
                                capture_output=True, text=True)
    result = {
        "scenes": len(was), "edits": edits, "scenes_that_differ": sum(found.get(key) != was[key] for key in was),
        "frames": len(seen), "frames_that_differ": sum(again[key] != seen[key] for key in seen),
        "replay": replay.stderr.strip().splitlines()[-1], "replay_exit_code": replay.returncode}
    print(json.dumps(result, indent=2))
    if told.o:
        pathlib.Path(told.o).write_text(json.dumps(result, indent=2) + "\n")
    return int(bool(result["scenes_that_differ"] or result["frames_that_differ"] or replay.returncode))


if __name__ == "__main__":
    sys.exit(main())
