"""What an edit costs where rays are traced: structures that follow it, and from the edit to new pixels.

usage: ray_follow.py BUILD_DIR -o RESULT.json [--triangles 10000,100000,1000000,10000000] [--samples 30]

`structures`: build_dir/tests/bench/ray_follow, which says what it makes and times. `pixels`: the bundled
Cornell box with ten balls of 100,000 triangles in it, in a daemon on the software device, 256x256, technique
rsm with indirect_visibility=rays. An object is moved, transiently, and a frame is asked for: from before the
edit is sent until the frame was received.
"""
import json
import math
import subprocess
import time

import numpy

import by_hand
import live

WARM = 3
SIDE = 225  # vertices a side of a ball: 100,352 triangles
LOOK = {"size": (256, 256), "technique": "rsm", "parameters": {"indirect_visibility": "rays"}}


def ball(number):
    along = numpy.linspace(0, 1, SIDE)
    u, v = numpy.meshgrid(2 * math.pi * along, math.pi * along)
    radius = .12 * (1 + .1 * numpy.sin(9 * u + number) * numpy.sin(7 * v))
    places = [radius * numpy.sin(v) * numpy.cos(u), radius * numpy.cos(v),
              radius * numpy.sin(v) * numpy.sin(u)]
    return numpy.stack(places, axis=-1).reshape(-1, 3)


def triangles():
    side = SIDE - 1
    first = (numpy.arange(side)[:, None] * SIDE + numpy.arange(side)).reshape(-1)
    lower = numpy.stack([first, first + SIDE, first + 1], axis=-1)
    upper = numpy.stack([first + 1, first + SIDE, first + SIDE + 1], axis=-1)
    return numpy.concatenate([lower, upper])


def fill(bounced, scene):
    """The nodes of the balls."""
    nodes = []
    for number in range(10):
        with scene.edit() as edit:
            mesh = edit.add_mesh(bounced.Primitive(ball(number), triangles(), material=live.RED))
            nodes.append(edit.add_node(mesh=mesh, translation=(
                .6 * math.cos(number), .4 + .1 * number, .6 * math.sin(number))))
    return nodes


def sample(scene, node, place):
    edit = scene.edit(transient=True)
    edit.set_transform(node, translation=place)
    asked = time.monotonic()
    edit.apply()
    accepted_ms = 1e3 * (time.monotonic() - asked)
    frame = scene.render(**LOOK)
    return 1e3 * (time.monotonic() - asked), accepted_ms, frame.report


def measure(scene, what, node, place_of, samples):
    found = [sample(scene, node, place_of(number)) for number in range(WARM + samples)][WARM:]
    reports = [report for _, _, report in found]
    passes = {one["name"]: float(numpy.median([
        p.get("ms", 0) for report in reports for p in report["passes"] if p["name"] == one["name"]]))
        for one in reports[-1]["passes"]}
    row = {"what": what, "latency_ms": live.percentiles([latency for latency, _, _ in found]),
           "accept_ms": float(numpy.median([accept for _, accept, _ in found])),
           "time_ms": {name: float(numpy.median([report["time_ms"].get(name, 0) for report in reports]))
                       for name in ("total", "load", "gpu", "readback")},
           "passes_ms": passes}
    by_hand.say(json.dumps(row))
    return row


def pixels(options):
    bounced = live.package(options.build)
    with live.daemon(options.build, "requests_per_second=100000") as daemon, \
            bounced.connect(daemon.url) as client:
        scene = client.scenes.add(live.SCENE)
        nodes = fill(bounced, scene)

        def across(number):
            return (.5 * math.sin(number), .29, .5 * math.cos(number))
        return [measure(scene, "a box of 10 triangles moved", live.SHORT_NODE, across, options.samples),
                measure(scene, "a ball of 100,352 triangles moved", nodes[0], across, options.samples)]


def structures(options):
    program = options.build / "tests/bench/ray_follow"
    made = subprocess.run([program, *options.triangles], check=True, stdout=subprocess.PIPE)
    return json.loads(made.stdout)


def main(words=None):
    parser = by_hand.parser(__doc__, has_scenes=False)
    parser.add_argument("--triangles", type=lambda text: text.split(","),
                        default="10000,100000,1000000,10000000".split(","))
    parser.add_argument("--samples", type=by_hand.count, default=30)
    options = live.parse(parser, words)
    result = {"command": f"ray_follow.py BUILD -o RESULT --triangles {','.join(options.triangles)} "
                         f"--samples {options.samples}",
              "machine": live.machine(options.build), "pixels": pixels(options)}
    by_hand.write(result, options.output)
    result["structures"] = structures(options)
    by_hand.write(result, options.output)


if __name__ == "__main__":
    main()
