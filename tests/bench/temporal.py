"""Temporal coherence (algorithms.md E8): how far a technique's picture moves that the light does not.

usage: temporal.py BUILD_DIR SCENES_DIR -o RESULT.json --cache DIR [--scenes NAME,NAME] [--frames N]
                   [--plot FILE.svg] [--strip FILE.jpg]

Prints its table for README.md. A light is moved along a straight path, a thousandth of the scene's
diagonal from each frame to the next (paths.py), before a camera that stands still. I are a
technique's pictures, A and B two independent halves of what is true (temporal_truth.py), R their
mean; indirect layer, brdf=lambert:

  J = sqrt(mean over pixels, channels, frames t > 0 of (dI - dA)(dI - dB)) / mean R,
      where dI = I_t - I_t-1

The noise of the halves drops out of the product. The interval is of 95 %, by drawing tiles of 16 x 16
pixels anew, all of a tile's frames with it. With a camera that moves, the difference of two frames is
of two places: there the error of the frames themselves is told, debiased alike, not J, and of every
fifth frame alone.
"""
import pathlib

import numpy

import by_hand
import paths
from harness import exr
from harness.daemon import Daemon
from temporal_truth import HALVES_ROLL_DEGREES, SETTINGS, Truth

SIZE, FRAMES, TILE_PX, RESAMPLES = (256, 256), 60, 16, 1000
SCENES = ("cornell_box_spot_side", "sponza_dabrovic")
TECHNIQUES = (("rsm", {"vpls": "256"}), ("rsm", {"vpls": "1024"}), ("rsm", {"vpls": "4096"}),
              ("isr", {}), ("isr", {"rsm_size": "1024", "cluster_levels": "4"}), ("hisr", {}),
              ("hisr", {"vpls": "1024"}))
GOAL = ("rsm", {"vpls": "4096"})  # `isr` and `hisr` at default parameters: at most its J
STRIP_FRAMES = 8
EVERY = {"light": 1, "camera": 5}  # frames of a path that are looked at


def label(technique, settings):
    return " ".join([technique, *(f"{k}={v}" for k, v in settings.items())])


# --- arithmetic ---------------------------------------------------------------------------------

def tile_sums(squares, tile_px=TILE_PX):
    """Sums over tiles of a height x width array, in one row."""
    height, width = squares.shape
    down, across = range(0, height, tile_px), range(0, width, tile_px)
    return numpy.add.reduceat(numpy.add.reduceat(squares, down, axis=0), across, axis=1).ravel()


def product(picture, halves):
    """Debiased squared difference, averaged over channels: height x width."""
    return ((picture - halves[0]) * (picture - halves[1])).mean(axis=2)


class Series:
    """Debiased squares of a row of pictures against a row of halves: by frame and by tile."""

    def __init__(self):
        self.frames, self.tiles, self.pixels = [], 0.0, 0

    def add(self, picture, halves):
        squares = product(picture, halves)
        self.frames.append(float(squares.mean()))
        self.tiles = self.tiles + tile_sums(squares)
        self.pixels = squares.size

    def _drawn(self):
        """Sums over tiles that are drawn anew; the same tiles in every series of a film."""
        count = len(self.tiles)
        drawn = numpy.random.default_rng(1).integers(0, count, (RESAMPLES, count))
        return self.tiles[drawn].sum(axis=1)

    def ratio(self, other):
        """Of the root mean squares of two series of one film, with its interval."""
        square = numpy.maximum(self._drawn(), 0) / numpy.maximum(other._drawn(), 1e-300)
        low, high = numpy.sqrt(numpy.percentile(square, (2.5, 97.5)))
        whole = max(sum(self.frames), 0) / max(sum(other.frames), 1e-300)
        return {"value": float(numpy.sqrt(whole)), "low": float(low), "high": float(high)}

    def figure(self, mean):
        """Root mean square over `mean`, with its interval; by frame, the root with the sign of what
        is under it, which noise may put below zero."""
        def root(square):
            return float(numpy.sign(square) * numpy.sqrt(abs(square)) / mean)
        squares = self._drawn() / (self.pixels * len(self.frames))
        low, high = numpy.percentile(squares, (2.5, 97.5))
        return {"value": root(numpy.mean(self.frames)), "low": root(low), "high": root(high),
                "frames": [root(square) for square in self.frames]}


# --- films --------------------------------------------------------------------------------------

def picture(daemon, scene, technique, settings):
    """Indirect layer of a scene that is no file yet."""
    file = daemon.folder / "scene.glb"
    scene.save(file)
    frame = daemon.render(file, technique, {"brdf": "lambert", **settings}, size=SIZE,
                          layers=("beauty", "indirect"), timeout_s=600)
    return exr.layer(frame.planes, "indirect").astype(numpy.float64)


class Film:
    """The figures of one path through one scene, a frame at a time."""

    def __init__(self):
        self.motion = {label(*t): Series() for t in TECHNIQUES}
        self.error = {label(*t): Series() for t in TECHNIQUES}
        self.true_motion, self.means, self.floor = Series(), [], []
        self.before = None

    def add(self, halves, pictures):
        self.means.append((halves[0].mean() + halves[1].mean()) / 2)
        for name, image in pictures.items():
            self.error[name].add(image, halves)
        if self.before:
            moved = [now - then for now, then in zip(halves, self.before[0])]
            self.floor.append(((moved[0] - moved[1]) ** 2).mean() / 4)
            self.true_motion.add(numpy.zeros_like(moved[0]), moved)
            for name, image in pictures.items():
                self.motion[name].add(image - self.before[1][name], moved)
        self.before = halves, pictures

    def result(self, moving):
        mean = float(numpy.mean(self.means))
        rows = []
        for technique, settings in TECHNIQUES:
            name = label(technique, settings)
            rows.append({"technique": technique,
                         "settings": " ".join(f"{k}={v}" for k, v in settings.items()),
                         "frame_error": self.error[name].figure(mean)})
            if moving == "light":
                rows[-1]["J"] = self.motion[name].figure(mean)
                rows[-1]["J_over_goal"] = self.motion[name].ratio(self.motion[label(*GOAL)])
        found = {"mean_cd_m2": mean, "techniques": rows}
        if moving == "light":
            found["true_motion"] = self.true_motion.figure(mean)
            found["J_of_truth_noise"] = float(numpy.sqrt(numpy.mean(self.floor)) / mean)
        return found


def measure(daemon, build, cache, path, moving, frames, strip, say):
    """One path's entry of the result; `strip` is given every frame's pictures."""
    glb = paths.load(path)
    version = daemon.report(path, "rsm", extra=("--plan",))["build"]
    truth = Truth(build, cache, glb, moving, frames, SIZE, version)
    film = Film()
    for number in range(0, frames, EVERY[moving]):
        scene = paths.scene_at(glb, moving, number, frames)
        pictures = {label(*t): picture(daemon, scene, *t) for t in TECHNIQUES}
        halves = truth.frame(number)
        film.add(halves, pictures)
        strip(path.stem, moving, number, frames, halves, pictures)
        if number % 10 == 0:
            say(f"{path.stem}, {moving}: frame {number} of {frames}")
    return {"scene": path.stem, "moving": moving, "frames": frames,
            "every": EVERY[moving], "truth": truth.hash,
            **film.result(moving)}


# --- pictures -----------------------------------------------------------------------------------

class Strip:
    """Eight frames of a film: what is true, and for each technique its picture and, below, how far
    its step from the frame before was from the true one: red too bright, blue too dark."""

    MOST = 0.1  # of the mean: full colour
    WANTED = ("light",)
    NAMES_PX = 110  # beside the pictures

    def __init__(self):
        self.columns, self.before, self.scene = [], None, None

    def __call__(self, scene, moving, number, frames, halves, pictures):
        self.scene = self.scene or scene
        if scene != self.scene or moving not in self.WANTED:
            return
        true = (halves[0] + halves[1]) / 2
        chosen = {round((i + 0.5) * frames / STRIP_FRAMES) for i in range(STRIP_FRAMES)}
        if self.before and number in chosen:
            self.columns.append(self._column(true, pictures))
        self.before = true, pictures

    def _column(self, true, pictures):
        from harness.bench import thumbs
        exposure = thumbs.exposure_of(true)
        cells = [thumbs.displayed(true, exposure)]
        for name, image in pictures.items():
            step = (image - self.before[1][name]) - (true - self.before[0])
            share = numpy.clip(step.mean(axis=2) / (self.MOST * true.mean()), -1, 1)[..., None]
            hot, cold = numpy.array([0.8, 0.1, 0.1]), numpy.array([0.1, 0.2, 0.8])
            cells.append(thumbs.displayed(image, exposure))
            cells.append(1 - abs(share) * (1 - numpy.where(share > 0, hot, cold)))
        return numpy.concatenate([_halved(cell) for cell in cells])

    def save(self, file):
        """Rows of pictures as they are named, their names at the left."""
        from harness.bench import plots
        pyplot = plots.load()
        pyplot.switch_backend("agg")
        image = numpy.concatenate(self.columns, axis=1)
        names = ["truth"]
        for t in TECHNIQUES:
            names += [label(*t).replace(" ", "\n"), "its error\nof motion"]
        height = image.shape[0] / len(names)
        whole = image.shape[1] + self.NAMES_PX
        figure = pyplot.figure(figsize=(whole / 100, image.shape[0] / 100), dpi=100)
        axes = figure.add_axes((self.NAMES_PX / whole, 0, image.shape[1] / whole, 1))
        axes.imshow(image, interpolation="nearest", aspect="auto")
        axes.set_axis_off()
        for row, name in enumerate(names):
            axes.annotate(name, (0, (row + 0.5) * height), xytext=(-6, 0), textcoords="offset points",
                          ha="right", va="center", fontsize=8, annotation_clip=False)
        figure.savefig(file, pil_kwargs={"quality": 85})
        pyplot.close(figure)


def _halved(image):
    """Means of 2 x 2 pixels."""
    height, width = image.shape[0] // 2, image.shape[1] // 2
    return image[:2 * height, :2 * width].reshape(height, 2, width, 2, 3).mean(axis=(1, 3))


def plot(result, file):
    """What each frame adds to J, a panel a scene."""
    from harness.bench import plots
    pyplot = plots.load()
    films = [entry for entry in result["films"] if entry["moving"] == "light"]
    figure, panels = pyplot.subplots(len(films), 1, figsize=(8, 3 * len(films)), squeeze=False)
    for axes, entry in zip(panels[:, 0], films):
        for index, row in enumerate(entry["techniques"]):
            axes.plot(range(1, entry["frames"]), row["J"]["frames"],
                      color=plots.COLORS[index], lw=1.4,
                      label=f"{row['technique']} {row['settings']}".strip()
                            + f"  ({100 * row['J']['value']:.2g} %)")
        axes.plot(range(1, entry["frames"]), entry["true_motion"]["frames"],
                  color="#667", lw=1, ls="--", label="what is true moves by")
        axes.set_yscale("log", nonpositive="mask")
        plots.logarithmic(axes.yaxis, (1, 2, 5))
        plots.percents(axes.yaxis)
        axes.set_title(entry["scene"], fontsize=10)
        axes.set_xlabel("frame")
        axes.set_ylabel("of the mean")
        axes.grid(axis="y")
        axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.01, 0.5))
    figure.tight_layout()
    figure.savefig(file, bbox_inches="tight", metadata={"Date": None, "Creator": None})


def percent(figure):
    return f"{100 * figure['value']:.2g} % [{100 * figure['low']:.2g}, {100 * figure['high']:.2g}]"


def table(result):
    """Markdown: a row for each film and technique."""
    rows = [f"| scene | technique | J | J / that of `{result['goal']}` | frames' error, moving light "
            "| moving camera |", "|---|---|---|---|---|---|"]
    errors = {(film["scene"], i): row["frame_error"] for film in result["films"]
              if film["moving"] == "camera" for i, row in enumerate(film["techniques"])}
    for film in result["films"]:
        for i, row in enumerate(film["techniques"] if film["moving"] == "light" else ()):
            ratio, camera = row["J_over_goal"], errors.get((film["scene"], i))
            rows.append(f"| {film['scene']} | `{row['technique']} {row['settings']}".rstrip() + "` | "
                        f"{percent(row['J'])} | {ratio['value']:.2f} [{ratio['low']:.2f}, "
                        f"{ratio['high']:.2f}] | {percent(row['frame_error'])} | "
                        f"{percent(camera) if camera else ''} |")
    return "\n".join(rows)


def run(build, scenes, cache, names=SCENES, frames=FRAMES, strip=None, say=lambda line: None):
    result = {"machine": by_hand.machine(), "size": SIZE, "goal": label(*GOAL),
              "truth": {"vpl_reference": SETTINGS, "halves_roll_degrees": HALVES_ROLL_DEGREES},
              "step_per_diagonal": paths.STEP_PER_DIAGONAL, "films": []}
    strip = strip or (lambda *_: None)
    with Daemon() as daemon:
        for name in names:
            for moving in ("light", "camera"):
                path = pathlib.Path(scenes) / f"{name}.glb"
                result["films"].append(measure(daemon, build, cache, path, moving, frames, strip, say))
    return result


def main(words=None):
    parser = by_hand.parser(__doc__)
    parser.add_argument("--cache", type=pathlib.Path, required=True)
    by_hand.add_names(parser, SCENES)
    parser.add_argument("--frames", type=by_hand.count, default=FRAMES)
    parser.add_argument("--plot", type=pathlib.Path)
    parser.add_argument("--strip", type=pathlib.Path)
    options = by_hand.parse(parser, words)
    strip = Strip()
    result = run(options.build, options.scenes, options.cache, options.names, options.frames, strip,
                 by_hand.say)
    result["command"] = ("temporal.py BUILD SCENES -o RESULT --cache DIR "
                         f"--scenes {','.join(options.names)} --frames {options.frames}")
    by_hand.write(result, options.output)
    print(table(result))
    if options.plot:
        plot(result, options.plot)
    if options.strip:
        strip.save(options.strip)


if __name__ == "__main__":
    main()
