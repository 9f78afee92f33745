"""Age of frames shown: a viewer that takes 20 frames a second from a scene that changes 60 times.

usage: frame_age.py BUILD_DIR -o RESULT.json [--seconds 20] [--credits 2,1,3]

The light of the bundled Cornell box is moved 60 times a second, transiently, from a connection of its
own. A viewer takes a frame of its view every 50 ms. A frame's age is the time from when the change that
it shows was asked for until the viewer takes it: socket, rendering, encoding, sending and waiting for
the viewer's next beat, all counted. Three daemons or links:

    direct     the renderer on the software device, technique direct with a small
               shadow map, 128x128
    gradient   a scheduler that takes 5 ms a frame and renders nothing, 256x256
    slow link  the same, read through a pipe of 30 frames a second

and, for each, numbers of credits: what may be under way to the viewer at once.
"""
import json
import socket
import threading
import time

import by_hand
import live

GOAL_MS = 60  # with two credits
SOURCE_HZ, VIEWER_HZ, LINK_HZ = 60, 20, 30
WARM_S = 2
FAKE_MS = {"BD_FAKE_FRAME_MS": "5"}
CASES = {"direct": dict(program=None, env={}, size=128, technique="direct", slow=False,
                       parameters={"shadow_size": 256}),
         "gradient": dict(program=live.GRADIENT, env=FAKE_MS, size=256, technique="rsm", slow=False),
         "slow link": dict(program=live.GRADIENT, env=FAKE_MS, size=256, technique="rsm", slow=True)}


class Pipe:
    """A socket before a daemon's: what the daemon sends passes at so many bytes a second at most, and
    hardly anything is kept on the way. A context; `url` is what to connect to."""

    PIECE_BYTES = 4096

    def __init__(self, folder, url, bytes_per_s):
        self._path = folder / "pipe.sock"
        self._behind = url.removeprefix("unix:")
        self._pause_s = self.PIECE_BYTES / bytes_per_s
        self._socks = []

    @property
    def url(self):
        return f"unix:{self._path}"

    def __enter__(self):
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(str(self._path))
        self._listener.listen()
        threading.Thread(target=self._serve, daemon=True).start()
        return self

    def __exit__(self, *_):
        for sock in (*self._socks, self._listener):
            sock.close()
        self._path.unlink()

    def _serve(self):
        near, _ = self._listener.accept()
        far = socket.socket(socket.AF_UNIX)
        far.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, self.PIECE_BYTES)
        near.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, self.PIECE_BYTES)
        far.connect(self._behind)
        self._socks = [near, far]
        threading.Thread(target=self._pass, args=(near, far, 0), daemon=True).start()
        self._pass(far, near, self._pause_s)

    def _pass(self, source, sink, pause_s):
        due = time.monotonic()
        try:
            while piece := source.recv(self.PIECE_BYTES):
                due = max(due, time.monotonic()) + pause_s * len(piece) / self.PIECE_BYTES
                sink.sendall(piece)
                time.sleep(max(0, due - time.monotonic()))
        except OSError:
            pass  # the other end is gone


def watch(view, source, seconds):
    """Takes a frame each beat: (when, transient, what the daemon says of its age, replaced)."""
    taken = []
    start = time.monotonic()
    beat = 0
    while beat < seconds * VIEWER_HZ:
        frame = view.next(60)
        now = time.monotonic()
        taken.append((now, frame.transient, frame.age_ms, frame.replaced))
        # A beat that was missed is gone: the next one is on the clock again.
        beat = max(beat + 1, int((now - start) * VIEWER_HZ) + 1)
        time.sleep(max(0, start + beat / VIEWER_HZ - time.monotonic()))
    return [(now, source.asked_at(transient), age_ms, replaced)
            for now, transient, age_ms, replaced in taken if now - start > WARM_S]


def row_of(taken, seconds):
    known = [one for one in taken if one[1] is not None]
    return {"age_ms": live.percentiles([1e3 * (now - asked) for now, asked, _, _ in known]),
            "age_when_sent_ms": live.percentiles([age_ms for _, _, age_ms, _ in known]),
            "frames_per_second": len(taken) / (seconds - WARM_S),
            "replaced": sum(replaced for *_, replaced in taken),
            "of_unknown_change": len(taken) - len(known)}


def frame_bytes(scene, look):
    with scene.view(refine=False, **look) as view:
        frame = view.next(60)
        return len(frame.data) + 1024  # and its header


def measure_one(bounced, daemon, case, credits, seconds):
    with bounced.connect(daemon.url) as client:
        scene = client.scenes.add(live.SCENE)
        look = {"size": (case["size"],) * 2, "technique": case["technique"],
                "parameters": case.get("parameters", {})}
        link_bytes_per_s = LINK_HZ * frame_bytes(scene, look) if case["slow"] else 1 << 40
        with Pipe(daemon.folder, daemon.url, link_bytes_per_s) as pipe, \
                live.Source(bounced, daemon.url, scene.id, SOURCE_HZ) as source, \
                bounced.connect(pipe.url if case["slow"] else daemon.url) as viewer:
            with viewer.scenes.get(scene.id).view(credits=credits, **look) as view:
                row = row_of(watch(view, source, seconds), seconds)
            row["beats_missed_by_the_source"] = source.missed
        scene.remove()
    return row


HEAD = ("| from | credits | p50, ms | p95, ms | max, ms | when sent, p50 | frames a second |\n"
        "|---|---|---|---|---|---|---|")


def line_of(row):
    age, sent = row["age_ms"], row["age_when_sent_ms"]
    return (f"| {row['case']} | {row['credits']} | {age['p50']:.0f} | {age['p95']:.0f} | "
            f"{age['max']:.0f} | {sent['p50']:.0f} | {row['frames_per_second']:.1f} |")


def run(options):
    bounced = live.package(options.build)
    result = {"machine": live.machine(options.build), "goal_ms": GOAL_MS, "seconds": options.seconds,
              "source_hz": SOURCE_HZ, "viewer_hz": VIEWER_HZ, "link_hz": LINK_HZ, "rows": []}
    by_hand.say(HEAD)
    for name, case in CASES.items():
        with live.daemon(options.build, program=case["program"], env=case["env"]) as daemon:
            for credits in options.credits:
                row = {"case": name, "credits": credits,
                       **measure_one(bounced, daemon, case, credits, options.seconds)}
                result["rows"].append(row)
                by_hand.say(line_of(row))
    return result


def main(words=None):
    parser = by_hand.parser(__doc__, has_scenes=False)
    parser.add_argument("--seconds", type=by_hand.count, default=20)
    parser.add_argument("--credits", default=(2, 1, 3),
                        type=lambda text: tuple(by_hand.count(one) for one in text.split(",")))
    options = live.parse(parser, words)
    if options.seconds <= WARM_S:
        parser.error(f"--seconds: more than {WARM_S}, which do not count")
    if not (options.build / live.GRADIENT).is_file():
        parser.error(f"BUILD_DIR: there is no {live.GRADIENT}")
    result = run(options)
    result["command"] = (f"frame_age.py BUILD -o RESULT --seconds {options.seconds} --credits "
                         f"{','.join(map(str, options.credits))}")
    by_hand.write(result, options.output)
    two = [row for row in result["rows"] if row["credits"] == 2]
    print(json.dumps({row["case"]: row["age_ms"] for row in two}, indent=1))


if __name__ == "__main__":
    main()
