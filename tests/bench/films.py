"""Films of what a view shows while something moves: `many_light` beside `hisr`, whose light is steady (temporal.py).

usage: films.py BUILD_DIR SCENES_DIR -o RESULT.json [--scenes NAME,NAME] [--frames N] [--size WxH] [--strip FILE.png]
                [--by TECHNIQUE,TECHNIQUE] [--moving light,object]

A light, and a root node with a mesh, go a thousandth of the scene's diagonal from frame to frame, each in a film of its own.
J (temporal.py) of the indirect layer: how much a picture changes from frame to frame beyond what is true, over the mean;
`hisr` against the reference of its own model, `many_light`, or who else is named, against the whole equation, at the cheapest
rung, which views have of what moves, at the next one, and at the fourth. Two references of other seeds, the same in every frame, are the halves.
"""
import pathlib
import sys

import numpy

import by_hand
import live
import paths
from temporal import Series

SCENES = ("cornell_box_spot_side", "sponza_dabrovic")
SIZE, FRAMES, TRUTH_SPP, TRUTH_SEEDS = (128, 96), 12, 64, (77, 78)
TRUTHS = {"full": {}, "hisr": {"model_of": "hisr"}}
RUNGS = (0, 1, 3)
MOVING = ("light", "object")


def object_node(glb):
    """The root with the smallest mesh: what a user would take hold of."""
    def extent(node):
        item = glb.doc["accessors"][glb.doc["meshes"][node["mesh"]]["primitives"][0]["attributes"]["POSITION"]]
        return numpy.linalg.norm(numpy.subtract(item["max"], item["min"]) * node.get("scale", [1, 1, 1]))
    nodes = [glb.doc["nodes"][i] for i in glb.roots() if "mesh" in glb.doc["nodes"][i]]
    solid = [node for node in nodes if extent(node) > 0.05 * paths.diagonal_m(glb)]
    return min(solid or nodes, key=extent)


def scene_at(glb, moving, frame, frames):
    scene = glb.copy()
    node = {"light": paths.light_node, "object": object_node}[moving](scene)
    paths.shift(node, paths.STEP_PER_DIAGONAL * paths.diagonal_m(glb) * (frame - (frames - 1) / 2))
    return scene


class Stage:
    """A daemon's scene for each frame, one after the other."""

    def __init__(self, daemon, size, folder):
        self.daemon, self.size, self.file = daemon, size, folder / "frame.glb"

    def show(self, scene):
        scene.save(self.file)
        self.scene = self.daemon.scenes.add(self.file)

    def indirect(self, technique, parameters, seed=0):
        frame = self.scene.render(size=self.size, technique=technique, layers=["indirect"], seed=seed,
                                  parameters={"brdf": "lambert", **parameters})
        return frame.layers["indirect"][..., :3].astype(float)


class Film:
    def __init__(self):
        self.motion, self.truth_motion, self.means, self.before, self.columns = {}, {}, {}, None, []

    def add(self, truths, pictures):
        for of, halves in truths.items():
            self.means.setdefault(of, []).append((halves[0].mean() + halves[1].mean()) / 2)
        if self.before:
            for of, halves in truths.items():
                moved = [now - then for now, then in zip(halves, self.before[0][of])]
                self.truth_motion.setdefault(of, Series()).add(numpy.zeros_like(moved[0]), moved)
                for name, (against, image) in pictures.items():
                    if against == of:
                        self.motion.setdefault(name, (of, Series()))[1].add(image - self.before[1][name][1], moved)
        self.before = truths, pictures
        self.columns.append([(truths["full"][0] + truths["full"][1]) / 2, *(image for _, image in pictures.values())])

    def rows(self):
        for name, (of, series) in self.motion.items():
            mean = float(numpy.mean(self.means[of]))
            told, true = series.figure(mean), self.truth_motion[of].figure(mean)
            yield {"by": name, "against": of, **{f"J_{end}_percent": round(100 * told[end], 2) for end in ("value", "low", "high")},
                   "true_motion_percent": round(100 * true["value"], 2)}

    def strip(self):
        """A column a frame, truth on top, then each technique in order."""
        return numpy.concatenate([numpy.concatenate(column) for column in self.columns[:: max(1, len(self.columns) // 6)]], axis=1)


def film_of(stage, glb, moving, frames, ladders):
    film = Film()
    for number in range(frames):
        stage.show(scene_at(glb, moving, number, frames))
        truths = {of: [stage.indirect("reference", {"spp": TRUTH_SPP, **settings}, seed) for seed in TRUTH_SEEDS]
                  for of, settings in TRUTHS.items()}
        pictures = {"hisr": ("hisr", stage.indirect("hisr", {}))}
        for technique, ladder in ladders.items():
            for rung in RUNGS:
                pictures[f"{technique}, rung {rung}"] = ("full", stage.indirect(technique, ladder[rung]))
        film.add(truths, pictures)
    return film


def save(strips, file):
    from PIL import Image
    from harness.bench import thumbs
    shown = [thumbs.displayed(strip, thumbs.exposure_of(strip)) for strip in strips]
    wide = max(image.shape[1] for image in shown)
    sheet = numpy.concatenate([numpy.pad(image, ((0, 0), (0, wide - image.shape[1]), (0, 0))) for image in shown])
    Image.fromarray((255 * numpy.clip(sheet, 0, 1)).astype("uint8")).save(file)


def main(words=None):
    made = by_hand.parser(__doc__)
    by_hand.add_names(made, SCENES)
    made.add_argument("--frames", type=by_hand.count, default=FRAMES)
    made.add_argument("--size", type=lambda text: tuple(int(side) for side in text.split("x")), default=SIZE)
    made.add_argument("--strip", type=pathlib.Path)
    made.add_argument("--by", type=lambda text: text.split(","), default=["many_light"])
    made.add_argument("--moving", type=lambda text: text.split(","), default=list(MOVING))
    options = by_hand.parse(made, words, names=SCENES)
    rows, strips = [], []
    with live.package(options.build).private() as daemon:
        ladders = {one["name"]: [dict(word.split("=") for word in rung.split()) for rung in one["ladder"]]
                   for one in daemon.techniques() if one["name"] in options.by}
        stage = Stage(daemon, options.size, options.output.resolve().parent)
        for name in options.names:
            for moving in options.moving:
                film = film_of(stage, paths.load(options.scenes / f"{name}.glb"), moving, options.frames, ladders)
                rows += [{"scene": name, "moving": moving, **row} for row in film.rows()]
                strips.append(film.strip())
                for row in rows[-len(film.motion):]:
                    by_hand.say(row)
    stage.file.unlink(missing_ok=True)
    size = "x".join(map(str, options.size))
    command = f"films.py BUILD SCENES -o RESULT --size {size} --frames {options.frames} --scenes {','.join(options.names)} --by {','.join(options.by)} --moving {','.join(options.moving)}"
    by_hand.write({"command": command, "machine": live.machine(options.build), "rows": rows}, options.output)
    if options.strip:
        save(strips, options.strip)


if __name__ == "__main__":
    sys.exit(main())
