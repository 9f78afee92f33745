"""What the figures of live scenes share: a daemon, a box whose parts are edited, and how times are told.

The clock is this machine's: client and daemon are both on it, and time.monotonic() is the same for both.
"""
import contextlib
import importlib
import itertools
import math
import os
import pathlib
import sys
import threading
import time

import numpy

import by_hand
import machine_speed
from harness.daemon import Daemon

SCENE = by_hand.ROOT / "tests/scenes/cornell.glb"
# What the bundled box has, by name in the file.
SPOT_NODE, TALL_NODE, SHORT_NODE = 8, 5, 6
RED, SPOT_LIGHT = 1, 0
FACING_DOWN = (-math.sqrt(.5), 0, 0, math.sqrt(.5))
GRADIENT = "tests/net/bounced_gradient"  # the daemon with a scheduler that renders nothing


def package(build):
    """The Python client of a build."""
    folder = str(build / "clients/python")
    if folder not in sys.path:
        sys.path.insert(0, folder)
    return importlib.import_module("bounced")


@contextlib.contextmanager
def daemon(build, *limits, program=None, env=()):
    """A daemon on the software device, on a socket of its own: gives the harness's Daemon."""
    words = ["--device", "software"]
    for limit in limits:
        words += ["--limit", limit]
    before = dict(os.environ)
    os.environ.update(env)
    try:
        made = Daemon(arguments=words)
        if program:
            made.bounced = str(build / program)
        with made:
            yield made
    finally:
        os.environ.clear()
        os.environ.update(before)


def machine(build):
    """That of every result, and how slow it is today against the one that goals are meant for."""
    made = by_hand.machine()
    work_ms, usual_ms = machine_speed.work_ms(build), machine_speed.USUAL_MS
    return {**made, "work_ms": work_ms, "usual_work_ms": usual_ms, "times_slower": work_ms / usual_ms,
            "budget_factor": machine_speed.budget_factor(work_ms)}


# --- a scene that changes -----------------------------------------------------------------------

def place(number):
    """Of the box's light, metres: a circle below the ceiling, no two of 9973 frames alike."""
    angle = 2 * math.pi * (number % 9973) / 61.7
    return (.25 * math.cos(angle), 1.96, .25 * math.sin(angle))


def lamp_of(scene):
    """The node of a scene's first light that hangs from none, and its matrix."""
    node = next(one for one in scene.objects("node") if one["node"]["light"] >= 0 and one["node"]["parent"] < 0)
    return node["id"], numpy.reshape(node["world_from_node"], (4, 4)).T


def move_lamp(edit, lamp, number):
    """About where it was, on a circle of 25 cm that lies flat."""
    node, matrix = lamp[0], lamp[1].copy()
    x, _, z = place(number)
    matrix[:3, 3] += (x, 0, z)
    edit.set_transform(node, matrix=matrix)


def move_light(edit, number):
    edit.set_transform(SPOT_NODE, translation=place(number), rotation=FACING_DOWN)


class Source:
    """Moves the light so many times a second, transiently, and remembers when it asked for what.

    A context: a thread of its own with a connection of its own. A frame with `transient` n shows the
    state that the n-th of these edits made; nothing else edits the scene.
    """

    def __init__(self, bounced, url, scene_id, rate_hz):
        self._client = bounced.connect(url)
        self._scene = self._client.scenes.get(scene_id)
        self._rate_hz = rate_hz
        self._asked = {}  # by what the daemon counts: seconds, time.monotonic
        self._ending = False
        self.missed = 0  # beats that came while an edit was still on its way
        self._thread = threading.Thread(target=self._run, name="source", daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._ending = True
        self._thread.join()
        self._client.close()

    def _run(self):
        start = time.monotonic()
        for number in itertools.count():
            wait_s = start + number / self._rate_hz - time.monotonic()
            if self._ending:
                return
            if wait_s < -1 / self._rate_hz:
                self.missed += 1
                continue
            time.sleep(max(wait_s, 0))
            edit = self._scene.edit(transient=True)
            move_light(edit, number)
            asked = time.monotonic()
            self._asked[edit.apply().transient] = asked

    def asked_at(self, transient):
        """When the state that a frame shows was asked for; None of one before the first. Ask at the
        end: an answer may come behind the frame."""
        return self._asked.get(transient)


def rest(view, pause_s):
    """Takes frames as they come for so long."""
    until = time.monotonic() + pause_s
    while (left := until - time.monotonic()) > 0:
        try:
            view.next(left)
        except TimeoutError:
            return


# --- telling times ------------------------------------------------------------------------------

def percentiles(values, *, more=()):
    """p50 p95 p99 max of what is in milliseconds, and how many; whatever else is named."""
    ordered = numpy.asarray(values, float)
    if not ordered.size:
        return {"count": 0}
    out = {f"p{p:g}": float(numpy.percentile(ordered, p)) for p in (50, 95, 99, *more)}
    return {"count": int(ordered.size), **out, "max": float(ordered.max())}


def bootstrap(values, statistic, block=1, rounds=2000, seed=1):
    """The 95 % interval of a statistic of a series, whose values may hang together over `block` of
    them: runs of that length are drawn, each as often as another."""
    series = numpy.asarray(values, float)
    draw = numpy.random.default_rng(seed)
    starts_max = len(series) - block + 1
    runs = math.ceil(len(series) / block)
    found = []
    for _ in range(rounds):
        starts = draw.integers(0, starts_max, runs)
        picked = (starts[:, None] + numpy.arange(block)).ravel()[:len(series)]
        found.append(statistic(series, picked))
    low, high = numpy.percentile(found, (2.5, 97.5))
    return [float(low), float(high)]


def parse(parser, words):
    options = by_hand.parse(parser, words)
    if not (options.build / "clients/python/bounced_pb2.py").is_file():
        parser.error("BUILD_DIR: there is no clients/python/bounced_pb2.py; ninja makes it")
    return options


def folder_of(data):
    """The file system that a folder's journal lies on: what a durable edit waits for."""
    best = ("", "?")
    for line in pathlib.Path("/proc/mounts").read_text().splitlines():
        _, point, kind = line.split()[:3]
        if str(data).startswith(point.rstrip("/") + "/") and len(point) >= len(best[0]):
            best = (point, kind)
    return best[1]
