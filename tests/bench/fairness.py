"""A view's frames alone, and beside a batch of the image service.

usage: fairness.py BUILD_DIR SCENES_DIR -o RESULT.json [--seconds N] [--techniques hisr,rsm,rsm+rays]
       [--side N]

One daemon. One client has a view of 256x256 of the Cornell box and moves its lamp ten times a second,
by transient edits; a frame's time is from an edit's sending to the coming of the frame that shows it
(JPEG, over a socket). The view improves its picture between edits, as views do, and the client takes
what comes; `rsm+rays` is with indirect_visibility=rays. `alone`, then beside each batch in turns, each
from clients of their own: `rsm` (three clients, 1024x1024, 1,024 VPLs, everything anew), `reference`
(1024x1024), `import` (a .glb of a million triangles, each time another, rendered small) and `all` of
them.
What programs a technique needs is compiled before anything counts; `cold` is the `rsm` batch with a
technique that nobody used before, on a daemon whose shader cache is empty.
"""
import contextlib
import itertools
import json
import os
import pathlib
import statistics
import struct
import subprocess
import sys
import tempfile
import threading
import time

import by_hand
import live

SCENE = "cornell_box_spot_side"
LAMP = "SpotSide"
VIEW_SIZE = (256, 256)
BEATS_PER_S = 10
PATIENCE_S = 120
GOAL = 2.0  # p95 beside a batch, of that alone
GOLDEN = 0.6180339887498949  # times a count, modulo 1: never a height of the lamp that was there before
BATCH_VPLS = 1024
FILE_NUMBERS = itertools.count()  # of one run: the daemon keeps imports by what is in the file
TRIANGLES_SIDE = 708  # a grid of so many squares along each side: a million triangles


# --- the daemon -----------------------------------------------------------------------------------

@contextlib.contextmanager
def daemon(build):
    """The address of one that has a data folder of its own, and so an empty shader cache."""
    with tempfile.TemporaryDirectory() as folder:
        address = f"unix:{folder}/socket"
        words = [os.environ["BOUNCED"], "--http", "none", "--listen", address, "--data",
                 f"{folder}/data"]
        with open(f"{folder}/log", "w+b") as log:
            process = subprocess.Popen(words, stderr=log)
            try:
                until = time.monotonic() + PATIENCE_S
                while not pathlib.Path(address[5:]).exists():
                    if process.poll() is not None or time.monotonic() > until:
                        log.seek(0)
                        raise SystemExit(log.read().decode())
                    time.sleep(0.05)
                yield address
            finally:
                process.terminate()
                process.wait()


# --- the view -------------------------------------------------------------------------------------

class Mover:
    """Moves the lamp of a view's scene and waits for the frame that shows it."""

    def __init__(self, address, path, technique):
        import bounced
        self.client = bounced.connect(address, timeout_s=PATIENCE_S)
        self.scene = self.client.scenes.add(path)
        lamps = [o for o in self.scene.objects("node") if o.get("name") == LAMP]
        self.lamp = lamps[0]["id"]
        name, _, rays = technique.partition("+")
        parameters = {"indirect_visibility": rays} if rays else {}
        self.view = self.scene.view(size=VIEW_SIZE, technique=name, parameters=parameters, credits=2)
        self.count = 0

    def close(self):
        self.view.close()
        self.client.close()

    def step(self):
        """Milliseconds from an edit's sending to its frame, and that frame's report."""
        self.count += 1
        start = time.perf_counter()
        with self.scene.edit(transient=True) as edit:
            edit.set_transform(self.lamp, rotation=(-0.077, 0.4276, 0.0366, 0.9),
                               translation=(0.35, 1.2 + 0.1 * (self.count * GOLDEN % 1), 0.9))
        # After a second without a change the daemon makes one durable revision of those before.
        wanted = edit.result.revision, edit.result.transient
        while True:
            frame = self.view.next(PATIENCE_S)
            if (frame.report["revision"], frame.transient) >= wanted:
                return 1000 * (time.perf_counter() - start), frame.report

    def steps(self, seconds):
        times, reports = [], []
        began = time.monotonic()
        while time.monotonic() - began < seconds:
            begin = time.monotonic()
            ms, report = self.step()
            times.append(ms)
            reports.append(report)
            live.rest(self.view, 1 / BEATS_PER_S - (time.monotonic() - begin))
        return times, reports


# --- batches --------------------------------------------------------------------------------------

def grid_glb(side, number):
    """A bumpy floor under a lamp and a camera; `number` makes it another file each time."""
    import numpy
    axis = numpy.linspace(-1, 1, side + 1, dtype=numpy.float32)
    x, z = numpy.meshgrid(axis, axis)
    y = 0.02 * numpy.sin(40 * x + number) * numpy.cos(40 * z)
    positions = numpy.stack([x, y, z], -1).reshape(-1, 3).astype("<f4")
    corner = (numpy.arange(side)[:, None] * (side + 1) + numpy.arange(side)[None, :]).reshape(-1)
    a, b, c, d = corner, corner + side + 1, corner + side + 2, corner + 1
    indices = numpy.stack([a, b, c, a, c, d], -1).reshape(-1).astype("<u4")
    body = positions.tobytes() + indices.tobytes()
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2]}],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [
            {"type": "spot", "intensity": 10, "spot": {"outerConeAngle": 0.7}}]}},
        "nodes": [{"mesh": 0},
                  {"translation": [0, 2, 0], "rotation": [-0.7071068, 0, 0, 0.7071068],
                   "extensions": {"KHR_lights_punctual": {"light": 0}}},
                  {"translation": [0, 2, 0.01], "rotation": [-0.7071068, 0, 0, 0.7071068],
                   "camera": 0}],
        "cameras": [{"type": "perspective",
                     "perspective": {"yfov": 0.9, "znear": 0.01, "aspectRatio": 1}}],
        "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(positions), "type": "VEC3",
             "min": positions.min(0).tolist(), "max": positions.max(0).tolist()},
            {"bufferView": 1, "componentType": 5125, "count": len(indices), "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": positions.nbytes},
                        {"buffer": 0, "byteOffset": positions.nbytes,
                         "byteLength": indices.nbytes}],
        "buffers": [{"byteLength": len(body)}]}
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body += bytes(-len(body) % 4)
    return (struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(body))
            + struct.pack("<I4s", len(text), b"JSON") + text
            + struct.pack("<I4s", len(body), b"BIN\0") + body)


class Batch:
    """Clients that ask for one picture after the other, until the block ends."""

    def __init__(self, address, jobs):
        self.address = address
        self.jobs = jobs
        self.done = [0] * len(jobs)
        self.ending = threading.Event()
        self.failures = []

    def __enter__(self):
        self.threads = [threading.Thread(target=self.run, args=pair)
                        for pair in enumerate(self.jobs)]
        for thread in self.threads:
            thread.start()
        return self

    def __exit__(self, *_):
        self.ending.set()
        for thread in self.threads:
            thread.join()
        if self.failures:
            raise self.failures[0]

    def run(self, index, job):
        import bounced
        try:
            with bounced.connect(self.address, timeout_s=PATIENCE_S) as client:
                for begin in job(client):
                    if not self.ended_in_time(begin()):
                        return
                    self.done[index] += 1
        except Exception as failure:  # of a thread: told when the block ends
            self.failures.append(failure)


    def ended_in_time(self, pending):
        """False where the batch ends first."""
        while not self.ending.is_set():
            with contextlib.suppress(TimeoutError):
                pending.result(0.2)
                return True
        pending.cancel()
        return False


def render_job(path, side, technique, parameters):
    def job(client):
        scene = client.scenes.add(path)
        while True:
            yield lambda: scene.render_later(size=(side, side), technique=technique, encoding="png",
                                             parameters=parameters, fresh="all")
    return job


def import_job(folder):
    """Each file is made when its turn comes, and gone after it."""
    def job(client):
        for number in FILE_NUMBERS:
            path = pathlib.Path(folder) / f"grid{number}.glb"
            path.write_bytes(grid_glb(TRIANGLES_SIDE, number))
            try:
                yield lambda: client.render_later(path, size=(64, 64), technique="direct",
                                                  encoding="png", parameters={"shadow_size": 64})
            finally:
                path.unlink()
    return job


def batches(scene, side, folder):
    rsm = [render_job(scene, side, "rsm", {"vpls": BATCH_VPLS})] * 3
    reference = [render_job(scene, side, "reference", {"spp": 16})]
    imports = [import_job(folder)]
    return {"rsm": rsm, "reference": reference, "import": imports,
            "all": rsm + reference + imports}


# --- the figures ----------------------------------------------------------------------------------

def quantile(times, share):
    """The smallest that no less than this share are at or below."""
    ordered = sorted(times)
    return ordered[max(0, -(-len(ordered) * share // 1).__int__() - 1)]


def summary(times, reports):
    return {"frames": len(times), "p50_ms": quantile(times, 0.5), "p95_ms": quantile(times, 0.95),
            "worst_ms": max(times),
            "rendering_p50_ms": statistics.median(r["time_ms"]["total"] for r in reports)}


def beside(address, mover, jobs, seconds):
    with Batch(address, jobs) as batch:
        mover.steps(2)  # until the batch is under way
        result = summary(*mover.steps(seconds))
    result["pictures_of_batch"] = sum(batch.done)
    return result


def measure(address, path, technique, options):
    by_hand.say(f"{technique}:")
    mover = Mover(address, path, technique)
    result = {"technique": technique, "beside": {}}
    try:
        mover.steps(2)
        alone = [summary(*mover.steps(options.seconds))]
        with tempfile.TemporaryDirectory() as folder:
            for name, jobs in batches(path, options.side, folder).items():
                if name not in options.batches:
                    continue
                beside(address, mover, jobs, 3)  # its programs
                result["beside"][name] = beside(address, mover, jobs, options.seconds)
        alone.append(summary(*mover.steps(options.seconds)))
    finally:
        mover.close()
    # Before and after: the machine's speed drifts.
    result["alone"] = {key: statistics.mean(a[key] for a in alone) for key in alone[0]}
    for name, entry in result["beside"].items():
        entry["p95_of_alone"] = entry["p95_ms"] / result["alone"]["p95_ms"]
        by_hand.say(f"  {name}: p50 {entry['p50_ms']:.0f}, p95 {entry['p95_ms']:.0f} ms, "
                    f"{entry['p95_of_alone']:.2f} times that alone "
                    f"({result['alone']['p95_ms']:.0f} ms); worst {entry['worst_ms']:.0f} ms, "
                    f"{entry['pictures_of_batch']} pictures of the batch")
    return result


def cold(path, options):
    """The worst frames while a batch compiles what nobody used before."""
    with daemon(options.build) as address:
        mover = Mover(address, path, "direct")
        try:
            mover.steps(2)
            alone = summary(*mover.steps(options.seconds))
            jobs = [render_job(path, 256, "multires_splat", {"vpls": 256})]
            with Batch(address, jobs):
                entry = summary(*mover.steps(options.seconds))
        finally:
            mover.close()
    by_hand.say(f"cold: p95 {entry['p95_ms']:.0f} ms, worst {entry['worst_ms']:.0f} ms; "
                f"alone {alone['p95_ms']:.0f} ms")
    return {"technique": "direct", "batch": "multires_splat", "alone": alone, "beside": entry,
            "p95_of_alone": entry["p95_ms"] / alone["p95_ms"]}


def main(words=None):
    made = by_hand.parser(__doc__)
    made.add_argument("--seconds", type=by_hand.count, default=20)
    made.add_argument("--side", type=by_hand.count, default=1024, help="of the batch's pictures")
    made.add_argument("--techniques", type=lambda text: text.split(","), default=["hisr", "rsm", "rsm+rays"])
    made.add_argument("--batches", type=lambda text: text.split(","),
                      default=["rsm", "reference", "import", "all"])
    made.add_argument("--no-cold", action="store_true")
    options = by_hand.parse(made, words, names=(SCENE,))
    sys.path.insert(0, str(options.build / "clients/python"))
    path = options.scenes / f"{SCENE}.glb"
    result = {"machine": live.machine(options.build), "view": VIEW_SIZE, "batch_side": options.side,
              "seconds": options.seconds, "p95_goal": GOAL, "techniques": []}
    with daemon(options.build) as address:
        for technique in options.techniques:
            result["techniques"].append(measure(address, path, technique, options))
    if not options.no_cold:
        result["cold"] = cold(path, options)
    by_hand.write(result, options.output)


if __name__ == "__main__":
    main()
