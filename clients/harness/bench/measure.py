"""What one point costs and what it looks like: frames from a private daemon, timed by their reports.

Run time is that of a whole frame in a daemon that holds the scene: from the request's turn to the
pixels read back, without the compilation of shaders, which the warm-up pays, and without the encoding
of a file. Every timed frame takes nothing over from earlier ones (`fresh`), or only what does not
follow the camera: what a frame costs after everything moved, and after the camera did.
"""
import dataclasses
import hashlib
from pathlib import Path

from ..daemon import DaemonDied, RenderTimeout
from .stats import quartiles

FRAME_SECONDS = 900
# No halves: `bounce compare` would take the noise of technique `reference` out of its own picture.
LAYERS = ("beauty", "direct", "indirect", "emission")


@dataclasses.dataclass
class Scene:
    """A file, and what the daemon that holds it says of it."""
    path: Path
    answer: dict

    @property
    def name(self):
        return self.path.stem

    @property
    def hash(self):
        return self.answer["hash"]


class Stage:
    """Scenes in a daemon, each given once; given again to the one that follows a daemon's death."""

    def __init__(self, daemon, size, camera):
        self.daemon = daemon
        self.size = size
        self.camera = camera
        self._held = {}

    def scene(self, path):
        if path not in self._held:
            self._held[path] = Scene(path, self.daemon.hold(path))
        return self._held[path]

    def ask(self, what, path, technique, settings, **more):
        """`what` is Daemon.report or Daemon.render."""
        more = {"size": self.size, "camera": self.camera, "timeout_s": FRAME_SECONDS, **more}
        try:
            return what(f"scene:{self.scene(path).answer['id']}", technique, settings, **more)
        except (DaemonDied, RenderTimeout):
            self._held.clear()  # the daemon that held them is gone
            raise


def whole_frame_ms(report):
    """Of a report, the time of what a new frame does again, wherever the scene came from."""
    time = report["time_ms"]
    other = ("load", "compile", "check", "encode")
    return time["total"] - sum(time.get(key, 0.0) for key in other)


def spread(values):
    low, median, high = quartiles(values)
    return {"median": median, "q1": low, "q3": high}


def times_of(reports):
    """Median and quartiles over frames: whole, on the device, and each pass."""
    passes = {}
    for report in reports:
        ran = {p["name"]: p["ms"] for p in report["passes"] if p["state"] == "ran"}
        for name, ms in ran.items():
            passes.setdefault(name, []).append(ms)
    return {"frame": spread([whole_frame_ms(r) for r in reports]),
            "gpu": spread([r["time_ms"].get("gpu", 0.0) for r in reports]),
            "passes": {name: spread(values) for name, values in passes.items()},
            "runs": len(reports)}


def timed(stage, path, contestant, settings, runs, seed):
    """Times of new frames and of frames after the camera moved, and the last report.

    One frame of either kind warms up; then they take turns, so that what slows the machine down
    for a while slows both. Who keeps nothing between frames knows one kind."""
    def frame(fresh):
        return stage.ask(stage.daemon.report, path, contestant.asked, settings, seed=seed,
                         layers=("beauty", "indirect"), extra=("--fresh", fresh))

    kinds = ("all",) if contestant.keeps_nothing else ("all", "camera")
    for kind in kinds:
        frame(kind)
    rounds = [[frame(kind) for kind in kinds] for _ in range(runs)]
    anew, moved = [[r[end] for r in rounds] for end in (0, -1)]
    return {**times_of(anew), "camera_moved": times_of(moved)["frame"]}, anew[-1]


def pictures(stage, path, technique, settings, seeds, keep):
    """Renders the technique's picture for each seed; those seeds whose pictures count.

    A technique that answers two seeds with the same pixels is deterministic: one picture says all.
    Each is made anew: what a budget of time is good for must not be an earlier point's picture.
    `keep(seed)` is where the file goes."""
    first = None
    for number, seed in enumerate(seeds):
        frame = stage.ask(stage.daemon.render, path, technique, settings, seed=seed, layers=LAYERS,
                          keep=keep(seed), extra=("--fresh", "all"))
        if first and _same_pixels(first, frame):
            keep(seed).unlink()
            return seeds[:number]
        first = first or frame
    return list(seeds)


def _same_pixels(one, other):
    return all((one.planes[name] == other.planes[name]).all() for name in one.planes)


def digest(*parts):
    """A short name for what the parts say."""
    return hashlib.sha256("\n".join(map(str, parts)).encode()).hexdigest()[:16]
