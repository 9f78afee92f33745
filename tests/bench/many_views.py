"""A hundred views of ten scenes on one daemon, one client among them stalled: memory, rates, ages.

usage: many_views.py BUILD_DIR -o RESULT.json [--minutes 10] [--around 60] [--size 64]

Ten scenes that change every two seconds, half of them durably (the journal grows), half transiently with
a commit now and then. Nine connections have a view of each scene and read all that comes. A tenth opens
ten more, with all credits that there are, frames that are large, and reads nothing ever again; the limit
`idle_seconds` is out of the way, which would hang up on it after two minutes. Once a second: the daemon's
resident set, and what it says of its memory and of bytes that wait for peers.

The stalled client is there for `--minutes`; before it came and after it left, ages and rates are taken
for `--around` seconds: what it does to the others. The slope of the resident set is a straight line
through those minutes, and through their second half alone: what earlier frames made is kept until its
budget (512 MiB on a software device) is full. Intervals: runs of half a minute drawn again and again.
"""
import contextlib
import importlib
import re
import socket
import struct
import threading
import time
from pathlib import Path

import numpy

import by_hand
import live

SCENES, READERS = 10, 9
CHANGE_S = 2.0
COMMIT_EVERY = 5  # changes of a scene
BLOCK_S = 30
LIMITS = ("views_per_client=256", "requests_per_second=100000", "jobs_waiting=1024",
          "idle_seconds=86400")
# One technique a scene, in turns: maps, VPLs, a tree, blocks. Cheap ones: what is measured is how many
# frames there were, not how long each took.
SMALL = {"vpls": 64, "rsm_size": 64, "shadow_size": 128}
LOOKS = ({"technique": "direct", "parameters": {"shadow_size": 128}},
         *({"technique": name, "parameters": SMALL} for name in ("rsm", "hisr", "multires_gather", "isr")))


class Editor(threading.Thread):
    """Changes every scene once in CHANGE_S, evenly apart; remembers when which state was asked for."""

    def __init__(self, bounced, url, scene_ids):
        super().__init__(name="editor", daemon=True)
        self._client = bounced.connect(url)
        self._scenes = [self._client.scenes.get(one) for one in scene_ids]
        self.asked = {}  # (scene, revision, transient): seconds
        self.ending = threading.Event()
        self.fault = None

    def run(self):
        try:
            self._run()
        except Exception as fault:  # told at the end: without changes there is nothing to measure
            self.fault = fault

    def _run(self):
        start = time.monotonic()
        number = 0
        while not self.ending.wait(max(0, start + number * CHANGE_S / len(self._scenes) -
                                       time.monotonic())):
            self._change(number)
            number += 1
        self._client.close()

    def _change(self, number):
        index, turn = number % len(self._scenes), number // len(self._scenes)
        scene = self._scenes[index]
        edit = scene.edit(transient=index % 2 == 1)
        live.move_light(edit, turn)
        if turn % 7 == 3:
            edit.set_material(live.RED, base_color=(.62, .07 + .4 * (turn % 89) / 89, .06, 1))
        asked = time.monotonic()
        result = edit.apply()
        self.asked[index, result.revision, result.transient] = asked
        if index % 2 == 1 and turn % COMMIT_EVERY == COMMIT_EVERY - 1:
            asked = time.monotonic()
            result = scene.commit()
            self.asked[index, result.revision, result.transient] = asked


class Reader(threading.Thread):
    """One view that is read: when which state arrived."""

    def __init__(self, view, index, frames):
        super().__init__(daemon=True)
        self.view, self.index, self.frames = view, index, frames

    def run(self):
        with contextlib.suppress(Exception):  # closed, or the daemon is gone: main finds out
            while frame := self.view.next():
                self.frames.append((time.monotonic(), self.index, frame.report["revision"],
                                    frame.transient, frame.age_ms))


class Stalled:
    """A connection that opens views of every scene and reads no more."""

    def __init__(self, url, scene_ids, size):
        pb = importlib.import_module("bounced.messages").pb
        self._sock = socket.socket(socket.AF_UNIX)
        self._sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        self._sock.connect(url.removeprefix("unix:"))
        hello = pb.Envelope(request_id=1)
        hello.hello.min = hello.hello.max = 1
        self._send(hello)
        for number, (scene, look) in enumerate(looks(scene_ids), start=2):
            opening = pb.Envelope(request_id=number)
            opening.view_open.scene, opening.view_open.credits = scene, 16
            frame = opening.view_open.frame
            frame.size.extend((2 * size, 2 * size))
            frame.technique, frame.encoding = look["technique"], "half"
            for key, value in look["parameters"].items():
                frame.parameters.add(key=key, value=str(value))
            self._send(opening)

    def _send(self, envelope):
        header = envelope.SerializeToString()
        self._sock.sendall(struct.pack("<II", 4 + len(header), len(header)) + header)

    def close(self):
        self._sock.close()


def looks(scene_ids):
    return [(scene, LOOKS[i % len(LOOKS)]) for i, scene in enumerate(scene_ids)]


# --- once a second ------------------------------------------------------------------------------

def resident_kib(pid):
    status = Path(f"/proc/{pid}/status").read_text()
    return int(re.search(r"VmRSS:\s+(\d+)", status)[1])


class Meter(threading.Thread):
    """The daemon's memory, once a second, from outside and in its own words."""

    def __init__(self, bounced, daemon):
        super().__init__(name="meter", daemon=True)
        self._client, self._pid = bounced.connect(daemon.url), daemon.pid
        self.ending = threading.Event()
        self.rows = []  # seconds, KiB, stats
        self.fault = None

    def run(self):
        try:
            self._run()
        except Exception as fault:  # told by latest: without rows there is nothing to say of memory
            self.fault = fault

    def _run(self):
        while not self.ending.wait(1):
            self.rows.append((time.monotonic(), resident_kib(self._pid), self._client.stats()))
        self._client.close()

    def latest(self):
        """The last row; the fault that there will be no other."""
        if self.fault:
            raise self.fault
        return self.rows[-1]


# --- what it comes to ---------------------------------------------------------------------------

def slope(series, picked):
    """KiB a minute of rows (seconds, KiB)."""
    minutes, kib = series[picked, 0] / 60, series[picked, 1]
    return numpy.polyfit(minutes, kib, 1)[0]


def slope_from(series, from_s):
    late = series[series[:, 0] >= from_s]
    block = min(BLOCK_S, max(1, len(late) // 4))
    return {"from_s": float(from_s), "kib_first": late[0, 1], "kib_last": late[-1, 1],
            "kib_per_min": float(slope(late, numpy.arange(len(late)))),
            "interval": live.bootstrap(late, slope, block)}


def slopes_of(series):
    """Of all of it and of its second half; rows are (seconds, KiB)."""
    return {"whole": slope_from(series, 0), "second_half": slope_from(series, series[-1, 0] / 2)}


def memory_of(rows, begin, end):
    series = numpy.array([(at - begin, kib) for at, kib, _ in rows if begin <= at <= end], float)
    told = [stats for at, _, stats in rows if begin <= at <= end]
    return {"rss_kib_max": series[:, 1].max(), "slope": slopes_of(series),
            "unsent_bytes": live.percentiles([one.get("unsent_bytes", 0) for one in told]),
            "gpu_memory_mib": live.percentiles([one["gpu_memory_mib"] for one in told])}


def phase_of(frames, asked, begin, end):
    """Ages at arrival, and frames a second of each view, of what arrived in between."""
    ages, sent, rates = [], [], []
    for reader in frames:
        inside = [one for one in reader if begin <= one[0] < end]
        rates.append(len(inside) / (end - begin))
        for at, *state, age_ms in inside:
            sent.append(age_ms)
            if tuple(state) in asked:
                ages.append(1e3 * (at - asked[tuple(state)]))
    rates.sort()
    return {"seconds": end - begin, "age_ms": live.percentiles(ages),
            "age_when_sent_ms": live.percentiles(sent),
            "frames_per_second_a_view": {"least": rates[0], "median": float(numpy.median(rates)),
                                         "most": rates[-1]},
            "frames": len(sent)}


class Show:
    """All of it: scenes, readers, editor, meter."""

    def __init__(self, bounced, daemon, size):
        self.bounced, self.daemon = bounced, daemon
        self._clients = [bounced.connect(daemon.url) for _ in range(READERS)]
        self.scene_ids = [self._clients[0].scenes.add(live.SCENE, name=f"box {i}").id
                          for i in range(SCENES)]
        self.frames = []
        for client in self._clients:
            for i, (scene, look) in enumerate(looks(self.scene_ids)):
                view = client.scenes.get(scene).view(size=(size, size), refine=False, **look)
                self.frames.append([])
                Reader(view, i, self.frames[-1]).start()
        self.editor = Editor(bounced, daemon.url, self.scene_ids)
        self.meter = Meter(bounced, daemon)
        self.editor.start()
        self.meter.start()

    def close(self):
        self.editor.ending.set()
        self.meter.ending.set()
        self.editor.join()
        self.meter.join()
        for client in self._clients:
            client.close()
        if fault := self.editor.fault or self.meter.fault:
            raise fault


def wait_s(seconds, meter):
    """Says a line a minute."""
    until = time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0:
        time.sleep(min(60, left))
        _, kib, stats = meter.latest()
        by_hand.say(f"{time.strftime('%H:%M:%S')} {kib} KiB, {stats.get('unsent_bytes', 0)} bytes "
                    f"unsent, {stats['jobs_done']} frames, {stats['connections']} connections")
    return time.monotonic()


def run(options):
    bounced = live.package(options.build)
    result = {"machine": live.machine(options.build), "scenes": SCENES,
              "views": SCENES * (READERS + 1), "size": options.size}
    with live.daemon(options.build, *LIMITS) as daemon:
        show = Show(bounced, daemon, options.size)
        try:
            time.sleep(10)  # programs are compiled, every view has had its first frames
            marks = [time.monotonic(), wait_s(options.around, show.meter)]
            stalled = Stalled(daemon.url, show.scene_ids, options.size)
            marks.append(wait_s(60 * options.minutes, show.meter))
            connections = show.meter.latest()[2]["connections"]
            stalled.close()
            marks.append(wait_s(options.around, show.meter))
        finally:
            show.close()
        before, during, after = (phase_of(show.frames, show.editor.asked, *pair)
                                 for pair in zip(marks, marks[1:]))
        result |= {"before": before, "stalled": during, "after": after,
                   "stalled_until_the_end": connections == READERS + 3,
                   "memory": memory_of(show.meter.rows, marks[1], marks[2]),
                   "rss_kib_by_second": [[round(at - marks[1], 1), kib]
                                         for at, kib, _ in show.meter.rows]}
    return result


# --- telling it ---------------------------------------------------------------------------------

HEAD = ("| | ages p50, ms | p95, ms | p99, ms | frames a second a view: least, median, most |\n"
        "|---|---|---|---|---|")


def lines_of(result):
    for name in ("before", "stalled", "after"):
        phase = result[name]
        age, rate = phase["age_ms"], phase["frames_per_second_a_view"]
        yield (f"| {name} | {age['p50']:.0f} | {age['p95']:.0f} | {age['p99']:.0f} | "
               f"{rate['least']:.2f}, {rate['median']:.2f}, {rate['most']:.2f} |")


def summary(result):
    memory = result["memory"]
    for name, line in memory["slope"].items():
        low, high = line["interval"]
        yield (f"RSS, {name}: {line['kib_first'] / 1024:.1f} to {line['kib_last'] / 1024:.1f} MiB, "
               f"{line['kib_per_min']:+.0f} KiB/min [{low:+.0f}, {high:+.0f}]")
    yield (f"held for the stalled client at most {memory['unsent_bytes']['max'] / (1 << 20):.2f} MiB; "
           f"there until the end: {result['stalled_until_the_end']}")


def main(words=None):
    parser = by_hand.parser(__doc__, has_scenes=False)
    parser.add_argument("--minutes", type=by_hand.count, default=10)
    parser.add_argument("--around", type=by_hand.count, default=60)
    parser.add_argument("--size", type=by_hand.count, default=64)
    options = live.parse(parser, words)
    result = run(options)
    result["command"] = (f"many_views.py BUILD -o RESULT --minutes {options.minutes} --around "
                         f"{options.around} --size {options.size}")
    by_hand.write(result, options.output)
    for line in (HEAD, *lines_of(result), *summary(result)):
        by_hand.say(line)


if __name__ == "__main__":
    main()
