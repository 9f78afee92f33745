"""Edit to first pixel: from sending an edit to the first frame that shows it, kind by kind.

usage: edit_latency.py BUILD_DIR -o RESULT.json [--samples 200] [--others 50] [--size 256]
           [--techniques hisr,rsm] [--kinds "light moved;undo, redo"] [--scene FILE]

One client on a Unix socket, one view of the bundled Cornell box at default parameters (JPEG, two
credits), or with the kind "light moved" alone of another scene, whose first light moves, in a daemon on the software device. Time runs from before the batch is sent until the first
frame whose header names its revision, or that many transient batches, was received and read. The view
improves its picture all the while, as views do, and the next edit comes at a random moment of the first
tenth of a second after a frame: it interrupts a better picture. `refine=off` rows are of a view that
rests. Every kind begins with frames that do not count, so that programs are compiled.

Of each sample also: what the daemon took until the change was public (`accept`: latency less the
frame's age: socket, check, journal, publish), the frame itself (`render`: the report's total), its
encoding, and the rest of its age (`wait`: what gives way, threads that wake up).
"""
import argparse
import collections
import itertools
import json
import pathlib
import random
import time

import numpy

import by_hand
import live

# Light moved, on a usual machine, by scene and technique.
GOALS_MS = {("cornell", "auto"): {"p50": 90}, ("cornell", "hisr"): {"p50": 90, "p99": 200}, ("cornell", "multires_gather"): {"p50": 60, "p99": 150},
            ("sponza_dabrovic", "hisr"): {"p50": 300}}
WARM = 5
PAUSE_S = .1


def tetrahedron():
    """A small mesh to be added and streamed: positions of four faces, metres, and their triangles."""
    corners = .15 * numpy.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], float)
    faces = numpy.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    return corners[faces].reshape(-1, 3), numpy.arange(12).reshape(-1, 3)


def grid(side, number):
    """A sheet of side x side vertices, a metre wide, that waves."""
    along = numpy.linspace(-.5, .5, side)
    x, z = numpy.meshgrid(along, along)
    y = .05 * numpy.sin(9 * x + .37 * number)
    return numpy.stack([x, y, z], axis=-1).reshape(-1, 3)


def grid_triangles(side):
    first = (numpy.arange(side - 1)[:, None] * side + numpy.arange(side - 1)).reshape(-1)
    lower = numpy.stack([first, first + side, first + 1], axis=-1)
    upper = numpy.stack([first + 1, first + side, first + side + 1], axis=-1)
    return numpy.concatenate([lower, upper])


class Stage:
    """A scene, its view, and the edits: each kind is a method that gives the mark of the state that it
    makes, (revision, transient batches), or the view's sequence."""

    SHEET = 64  # vertices a side: 4,096 are streamed

    def __init__(self, bounced, client, path, technique, size, refine):
        self.bounced = bounced
        self.scene = client.scenes.add(path)
        self.lamp = live.lamp_of(self.scene)
        self.view = self.scene.view(size=(size, size), technique=technique, refine=refine)
        self.added = self.sheet = None
        self.undone = False
        self.number = 0  # of all edits, whatever their kind: what was shown once is reused if it comes again

    def until(self, mark):
        """The first frame that shows it."""
        while not shows(frame := self.view.next(60), mark):
            pass
        return frame

    def _batch(self, transient, fill):
        edit = self.scene.edit(transient=transient)
        fill(edit)
        return edit, lambda: self._mark(edit.apply())

    @staticmethod
    def _mark(result):
        return result.revision, result.transient

    def light_moved(self, number, transient):
        return self._batch(transient, lambda edit: live.move_lamp(edit, self.lamp, number))[1]

    def light_colour(self, number, transient):
        colour = (1, .5 + .4 * (number % 97) / 97, .7)
        return self._batch(transient, lambda edit: edit.set_light(live.SPOT_LIGHT, color=colour))[1]

    def object_moved(self, number, transient):
        x, _, z = live.place(number)
        return self._batch(transient, lambda edit: edit.set_transform(
            live.SHORT_NODE, translation=(.38 + .3 * x, .29, .3 + .3 * z)))[1]

    def material_colour(self, number, transient):
        colour = (.62, .07 + .4 * (number % 89) / 89, .06, 1)
        return self._batch(transient, lambda edit: edit.set_material(
            live.RED, base_color=colour))[1]

    def vertex_stream(self, number, transient):
        if not self.sheet:
            self._add_sheet()
        places = grid(self.SHEET, number)
        return self._batch(transient, lambda edit: edit.set_mesh_vertices(self.sheet, places))[1]

    def _add_sheet(self):
        with self.scene.edit() as edit:
            self.sheet = edit.add_mesh(self.bounced.Primitive(
                grid(self.SHEET, 0), grid_triangles(self.SHEET), material=live.RED))
            edit.add_node(mesh=self.sheet, translation=(0, 1.5, 0))

    def add_or_remove(self, number, transient):
        """In turns: a mesh and its node come, both go."""
        if self.added:
            mesh, node = self.added
            self.added = None

            def remove(edit):
                edit.remove_node(node)
                edit.remove_mesh(mesh)
            return self._batch(transient, remove)[1]

        def add(edit):
            positions, triangles = tetrahedron()
            mesh = edit.add_mesh(self.bounced.Primitive(positions, triangles))
            self.added = mesh, edit.add_node(mesh=mesh, translation=live.place(number)[:1] + (1, 0))
        return self._batch(transient, add)[1]

    def undo(self, number, _):
        """Of a moved light; every second one is its redo."""
        self.undone = not self.undone
        if not self.undone:
            return lambda: self._mark(self.scene.redo())
        self.until(self.light_moved(number, False)())
        return lambda: self._mark(self.scene.undo())

    def camera_moved(self, number, _):
        x, _, z = live.place(number)
        pose = self.bounced.Pose(eye=(x, 1, 3.95 + z), target=(0, 1, 0), yfov=.66)
        return lambda: self.view.update(pose=pose)


KINDS = {"light moved": Stage.light_moved, "light colour": Stage.light_colour,
         "object moved": Stage.object_moved, "material colour": Stage.material_colour,
         "object added or removed": Stage.add_or_remove,
         "undo, redo": Stage.undo, "camera moved": Stage.camera_moved,
         "vertex stream": Stage.vertex_stream}  # last: from then on its sheet is in the box
ONLY = {"undo, redo": "durable", "camera moved": "view"}


def shows(frame, mark):
    if isinstance(mark, int):
        return frame.sequence >= mark
    return (frame.report["revision"], frame.transient) >= mark


def sample(stage, kind, transient):
    """One edit: its latency and the frame that showed it."""
    stage.number += 1
    send = KINDS[kind](stage, stage.number, transient)
    live.rest(stage.view, PAUSE_S * random.random())
    asked = time.monotonic()
    frame = stage.until(send())
    return 1e3 * (time.monotonic() - asked), frame


def shares_ms(latency_ms, frame):
    times = frame.report["time_ms"]
    render, encode = times["total"], times["encode"]
    return {"accept": latency_ms - frame.age_ms, "wait": frame.age_ms - render - encode,
            "render": render, "encode": encode}


def passes_of(frames):
    """By name: how often it ran of all frames that have it, and its median time where it did."""
    seen = collections.defaultdict(list)
    for frame in frames:
        for one in frame.report["passes"]:
            seen[one["name"]].append((one["state"] == "ran", one.get("ms", 0)))
    return {name: {"ran": sum(ran for ran, _ in states) / len(states),
                   "ms": float(numpy.median([ms for ran, ms in states if ran] or [0]))}
            for name, states in seen.items()}


def row_of(samples):
    latencies = [latency for latency, _ in samples]
    shares = [shares_ms(*one) for one in samples]
    row = {"latency_ms": live.percentiles(latencies)}
    for name in ("p50", "p99"):
        share = float(name[1:])
        row["latency_ms"][name + "_interval"] = live.bootstrap(
            latencies, lambda series, picked, share=share: numpy.percentile(series[picked], share))
    row["medians_ms"] = {name: float(numpy.median([share[name] for share in shares]))
                         for name in shares[0]}
    row["passes"] = passes_of([frame for _, frame in samples])
    row["parameters"] = samples[-1][1].report["parameters"]
    return row


def measure(stage, kind, durability, count):
    found = [sample(stage, kind, durability == "transient") for _ in range(WARM + count)]
    if durability == "transient":
        stage.scene.commit()
    return row_of(found[WARM:])


def plan_of(techniques, kinds, samples, others):
    """What is measured, each once: technique, refine, kind, durability, samples."""
    rows = {}
    for technique in techniques:
        for kind, durability in itertools.product(kinds, ("durable", "transient")):
            durability = ONLY.get(kind, durability)
            rows[technique, True, kind, durability] = samples if kind == "light moved" else others
        if "light moved" in kinds:
            rows[technique, False, "light moved", "transient"] = samples
    return [(*row, count) for row, count in rows.items()]


def run(options):
    bounced = live.package(options.build)
    random.seed(1)
    result = {"machine": live.machine(options.build), "command": command_of(options),
              "size": options.size, "scene": options.scene.stem, "rows": []}
    with live.daemon(options.build, "requests_per_second=100000") as daemon, \
            bounced.connect(daemon.url) as client:
        result["device"] = client.device
        result["journal_on"] = live.folder_of(daemon.folder)
        plan = plan_of(options.techniques, options.kinds, options.samples, options.others)
        for (technique, refine), group in itertools.groupby(plan, lambda one: one[:2]):
            stage = Stage(bounced, client, options.scene, technique, options.size, refine)
            for _, _, kind, durability, count in group:
                row = {"technique": technique, "refine": refine, "kind": kind,
                       "durability": durability, **measure(stage, kind, durability, count)}
                result["rows"].append(row)
                result["verdict"] = list(verdict(result))
                by_hand.write(result, options.output)  # of a run that is cut short, what there is
                by_hand.say(line_of(row))
            stage.view.close()
            stage.scene.remove()
    return result


# --- telling it ---------------------------------------------------------------------------------

HEAD = ("| technique | kind | | p50, ms | p99, ms | accept, wait, render, encode | ran again |\n"
        "|---|---|---|---|---|---|---|")


def line_of(row):
    times, medians = row["latency_ms"], row["medians_ms"]
    ran = [name for name, one in row["passes"].items() if one["ran"] > .5]
    durability = row["durability"] + ("" if row["refine"] else ", refine=off")
    shares = ", ".join(f"{medians[name]:.0f}" for name in ("accept", "wait", "render", "encode"))
    return (f"| `{row['technique']}` | {row['kind']} | {durability} | {times['p50']:.0f} | "
            f"{times['p99']:.0f} | {shares} | {' '.join(ran)} |")


def verdict(result):
    """The goal's row beside the goal: as measured, and what the machine's slowness would explain."""
    factor = result["machine"]["times_slower"]
    for row in result["rows"]:
        goals = GOALS_MS.get((result["scene"], row["technique"]), {}) if row["kind"] == "light moved" else {}
        for name, goal in goals.items():
            raw = row["latency_ms"][name]
            yield (f"{row['technique']}, light moved, {row['durability']}{'' if row['refine'] else ', refine=off'}: "
                   f"{name} {raw:.0f} ms, goal {goal} ms on a usual machine; this one is "
                   f"{factor:.2f} times slower: {goal * factor:.0f} ms here: "
                   f"{'met' if raw <= goal * factor else 'missed'}")


def kinds_of(text):
    """Names of KINDS, between semicolons, in KINDS' order: its last one changes the scene."""
    named = text.split(";")
    unknown = set(named) - set(KINDS)
    if unknown:
        raise argparse.ArgumentTypeError(f"{unknown.pop()}: one of {'; '.join(KINDS)}")
    return tuple(kind for kind in KINDS if kind in named)


def command_of(options):
    words = (f"edit_latency.py BUILD -o RESULT --samples {options.samples} --others {options.others} "
             f"--size {options.size} --techniques {','.join(options.techniques)}")
    if options.kinds != tuple(KINDS):
        words += f" --kinds '{';'.join(options.kinds)}'"
    return words + (f" --scene {options.scene.name}" if options.scene != live.SCENE else "")


def main(words=None):
    parser = by_hand.parser(__doc__, has_scenes=False)
    parser.add_argument("--samples", type=by_hand.count, default=200)
    parser.add_argument("--others", type=by_hand.count, default=50)
    parser.add_argument("--size", type=by_hand.count, default=256)
    parser.add_argument("--techniques", type=lambda text: tuple(text.split(",")),
                        default=("hisr", "rsm"))
    parser.add_argument("--kinds", type=kinds_of, default=tuple(KINDS))
    parser.add_argument("--scene", type=pathlib.Path, default=live.SCENE)
    options = live.parse(parser, words)
    if options.scene != live.SCENE and options.kinds != ("light moved",):
        parser.error("--scene: of another scene, --kinds 'light moved' alone is known")
    by_hand.say(HEAD)
    result = run(options)
    print(json.dumps(result["verdict"], indent=1))


if __name__ == "__main__":
    main()
