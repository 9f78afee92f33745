"""A film of water that moves above a floor, as edits stream its vertices in: `photon` and `many_light` beside the reference.

usage: water.py BUILD_DIR -o RESULT.json [--frames N] [--side N] [--spp N] [--strip FILE.png]

Three waves run over a surface of water with a lamp above it; each frame is an edit of all its vertices and a picture at `aa` 1, seed 0.
Of the light that surfaces send to the eye: J (films.py, temporal.py), how much a picture changes from frame to frame beyond what is
true, over the mean; `off_8x8_percent`, the root mean square over blocks of 8x8 pixels without the truth's noise, by its two halves, and
`mean`, both by the truth of each frame, in the mean over frames; and the time of a frame.
The floor is dark and without a lobe: light of a point that the water mirrors back to it has no reference, nor does its lobe's mean count.
"""
import pathlib
import sys
import time

import numpy

import by_hand
import films
import live

sys.path.append(str(by_hand.ROOT / "tests/python"))
import glass_scenes as made  # noqa: E402

WATER = {**made.GLASS, "extensions": {**made.GLASS["extensions"], "KHR_materials_ior": {"ior": 1.33}}}
FLOOR = {"pbrMetallicRoughness": {**made.GREY["pbrMetallicRoughness"], "baseColorFactor": [.2, .2, .2, 1]},
         "extensions": {"KHR_materials_ior": {"ior": 1}}}
SQUARES, HALF_M, DEPTH_M = 96, 2, .8
# Along x and y in waves over the width, their height in metres, and turns over a film of 60 frames.
WAVES = ((1, 2, .03, 2), (3, -1, .03, -3), (-2, 4, .025, 5))
FILM = 60
EYE = {"eye": (0, -1.9, .6), "target": (0, -.2, 0), "up": (0, 0, 1), "yfov": 1.1}
LAMP = {"type": "point", "intensity": 60}
BY = {"many_light": ("many_light", {}), "many_light, rung 4": ("many_light", 3), "photon": ("photon", {}), "photon, rung 3": ("photon", 2)}


def surface(frame):
    """Positions of the water's vertices, and normals by the waves' own slope."""
    x, y = numpy.meshgrid(*(numpy.linspace(-1, 1, SQUARES + 1),) * 2)
    height, slope_x, slope_y = (numpy.zeros_like(x) for _ in range(3))
    for along_x, along_y, high, turns in WAVES:
        phase = numpy.pi * (along_x * x + along_y * y) + 2 * numpy.pi * turns * frame / FILM
        height += high * numpy.sin(phase)
        slope_x += high * numpy.cos(phase) * numpy.pi * along_x / HALF_M
        slope_y += high * numpy.cos(phase) * numpy.pi * along_y / HALF_M
    normals = numpy.stack([-slope_x, -slope_y, numpy.ones_like(x)], 2)
    places = numpy.stack([HALF_M * x, HALF_M * y, DEPTH_M + height], 2)
    return numpy.float32(places).reshape(-1, 3), numpy.float32(normals / numpy.linalg.norm(normals, axis=2)[..., None]).reshape(-1, 3)


def grid():
    first = numpy.arange(SQUARES * (SQUARES + 1)).reshape(SQUARES, SQUARES + 1)[:, :-1].ravel()
    right, up = first + 1, first + SQUARES + 1
    return numpy.uint32(numpy.stack([first, right, up + 1, first, up + 1, up], 1).reshape(-1, 3))


def seen(scene, pose, side, technique, parameters, seed=0):
    frame = scene.render(size=(side, side), technique=technique, layers=["direct", "indirect"], pose=pose, seed=seed,
                         parameters=parameters)
    return sum(frame.layers[layer][..., :3].astype(float) for layer in ("direct", "indirect"))


def blocks(picture):
    side = len(picture) // 8
    return picture[:8 * side, :8 * side].reshape(side, 8, side, 8, 3).mean((1, 3))


class Shown:
    """What one technique has of all frames so far."""

    def __init__(self):
        self.squares, self.means, self.seconds = [], [], []

    def add(self, picture, halves, seconds):
        truth = (halves[0].mean() + halves[1].mean()) / 2
        a, b = (blocks(picture) - blocks(half) for half in halves)
        self.squares.append((a * b).mean() / truth ** 2)
        self.means.append(picture.mean() / truth)
        self.seconds.append(seconds)

    def row(self):
        return {"off_8x8_percent": round(100 * float(numpy.sqrt(max(numpy.mean(self.squares), 0))), 2), "mean": round(float(numpy.mean(self.means)), 4),
                "seconds": round(float(numpy.median(self.seconds)), 3)}


def film_of(scene, pose, options, ladders):
    film, shown = films.Film(), {name: Shown() for name in BY}
    water = next(o["id"] for o in scene.objects("mesh") if o["name"] == "water")
    for number in range(options.frames):
        places, normals = surface(number * FILM / options.frames)
        with scene.edit() as edit:
            edit.set_mesh_vertices(water, places, normals)
        halves = [seen(scene, pose, options.side, "reference", {"spp": options.spp}, seed) for seed in films.TRUTH_SEEDS]
        pictures = {}
        for name, (technique, asked) in BY.items():
            start = time.monotonic()
            picture = seen(scene, pose, options.side, technique, ladders[technique][asked] if asked else {})
            shown[name].add(picture, halves, time.monotonic() - start)
            pictures[name] = ("full", picture)
        film.add({"full": halves}, pictures)
    return film, shown


def main(words=None):
    asked = by_hand.parser(__doc__, has_scenes=False)
    asked.add_argument("--frames", type=by_hand.count, default=20)
    asked.add_argument("--side", type=by_hand.count, default=160)
    asked.add_argument("--spp", type=by_hand.count, default=128)
    asked.add_argument("--strip", type=pathlib.Path)
    options = by_hand.parse(asked, words)
    package = live.package(options.build)
    with package.private() as daemon:
        ladders = {one["name"]: [dict(word.split("=") for word in rung.split()) for rung in one["ladder"]] for one in daemon.techniques()}
        file = options.output.resolve().with_suffix(".water.gltf")
        file.write_text(made.gltf([(made.pane(0, HALF_M), FLOOR), ((*surface(0), grid()), WATER)], LAMP, (.4, .3, 3)).replace(
            '"meshes": [{', '"meshes": [{"name": "floor", ').replace('}, {"primitives"', '}, {"name": "water", "primitives"'))
        scene = daemon.scenes.add(file)
        film, shown = film_of(scene, package.Pose(**EYE), options, ladders)
        file.unlink()
    rows = [{**row, **shown[row["by"]].row()} for row in film.rows()]
    for row in rows:
        by_hand.say(row)
    by_hand.write({"command": f"water.py BUILD -o RESULT --frames {options.frames} --side {options.side} --spp {options.spp}",
                   "machine": live.machine(options.build), "rows": rows}, options.output)
    if options.strip:
        films.save([film.strip()], options.strip)


if __name__ == "__main__":
    main()
