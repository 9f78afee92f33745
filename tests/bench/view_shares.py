"""Clients whose views of one scene orbit all at once: how many frames each gets, and how far apart.

usage: view_shares.py BUILD_DIR SCENES_DIR -o RESULT.json [--scenes NAME,NAME] [--clients 1,4] [--seconds N] [--side N]

One daemon, technique `auto`. Each client moves the camera of a view of its own as soon as it has a frame, by a degree about the
scene's middle, and takes frames as they come. Of each client, in the same seconds: frames, and milliseconds from frame to frame.
`least_share` is the fewest frames that one got over the most.
"""
import math
import sys
import threading
import time

import by_hand
import live

SCENES = ("cornell_box", "sponza_dabrovic")
WARM_S, STEP_RADIANS = 2, math.radians(1)


def pose_at(bounced, middle, radius_m, step):
    angle = step * STEP_RADIANS
    eye = (middle[0] + radius_m * math.sin(angle), middle[1], middle[2] + radius_m * math.cos(angle))
    return bounced.Pose(eye, tuple(middle))


def middle_of(scene):
    info = scene.info()
    low, high = info["bounds_min"], info["bounds_max"]
    return [(a + b) / 2 for a, b in zip(low, high)], 0.3 * min(high[0] - low[0], high[2] - low[2])


class Client(threading.Thread):
    """Orbits until it is told to stop; `times` are those at which frames came."""

    def __init__(self, bounced, url, scene_id, number, side):
        super().__init__()
        self._bounced, self._url, self._scene_id, self._number, self._side = bounced, url, scene_id, number, side
        self.times, self.stops = [], threading.Event()

    def run(self):
        with self._bounced.connect(self._url) as client:
            scene = client.scenes.get(self._scene_id)
            middle, radius_m = middle_of(scene)
            first = 90 * self._number  # no two look alike
            with scene.view(size=(self._side, self._side), pose=pose_at(self._bounced, middle, radius_m, first)) as view:
                for step in range(first, first + 1_000_000):
                    view.next(60)
                    self.times.append(time.monotonic())
                    if self.stops.is_set():
                        return
                    view.update(pose=pose_at(self._bounced, middle, radius_m, step + 1))


def measure(bounced, daemon, scene, clients, seconds, side):
    threads = [Client(bounced, daemon.url, scene.id, number, side) for number in range(clients)]
    for thread in threads:
        thread.start()
    time.sleep(WARM_S)
    began = time.monotonic()
    time.sleep(seconds)
    ended = time.monotonic()
    for thread in threads:
        thread.stops.set()
    for thread in threads:
        thread.join()
    kept = [[t for t in thread.times if began <= t <= ended] for thread in threads]
    frames = [len(times) for times in kept]
    gaps = [live.percentiles([1e3 * (b - a) for a, b in zip(times, times[1:])]) for times in kept]
    return {"clients": clients, "frames": frames, "least_share": round(min(frames) / max(max(frames), 1), 3), "gaps_ms": gaps}


def main(words=None):
    made = by_hand.parser(__doc__)
    by_hand.add_names(made, SCENES)
    made.add_argument("--clients", default="1,4")
    made.add_argument("--seconds", type=by_hand.count, default=10)
    made.add_argument("--side", type=by_hand.count, default=192)
    options = by_hand.parse(made, words, names=SCENES)
    bounced = live.package(options.build)
    result = {"command": f"view_shares.py BUILD SCENES -o RESULT --clients {options.clients} --seconds {options.seconds} --side {options.side}",
              "machine": live.machine(options.build), "rows": []}
    with live.daemon(options.build) as daemon:
        for name in options.names:
            with bounced.connect(daemon.url) as client:
                scene = client.scenes.add(options.scenes / f"{name}.glb")
                for clients in map(int, options.clients.split(",")):
                    row = {"scene": name, **measure(bounced, daemon, scene, clients, options.seconds, options.side)}
                    result["rows"].append(row)
                    by_hand.say(f"{name} {row}")
    by_hand.write(result, options.output)


if __name__ == "__main__":
    sys.exit(main())
