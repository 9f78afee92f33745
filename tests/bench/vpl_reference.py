"""The VPL reference, rung R4 (algorithms.md E9): made by vpl_reference.c, kept under a hash of what
decides it; and what techniques' pictures miss against it.

usage: vpl_reference.py BUILD_DIR SCENES_DIR -o RESULT.json --cache DIR [--scenes NAME,NAME]
                        [--plot FILE.svg]

A picture is compared at 8,192 of its pixels, chosen with known probabilities (vpl_pixels.h), each
weighed by one over its own. d is the squared difference of indirect radiance, averaged over channels:

  relative RMSE   sqrt(mean d) / mean R    over the picture's pixels, those without a surface included
  interval        95 %, by drawing as many of those pixels anew, 2,000 times
  leaves alone    the same of fewer VPLs, summed at the same pixels in double precision
  light side      the same between two pictures with the same leaves: `hisr` and the sum over all of
                  them at the same blocks, `multires_gather`

RESULT.json is written scene by scene; scenes that it has and that are not asked for stay in it. Prints
its table for README.md.
"""
import hashlib
import json
import os
import pathlib
import subprocess

import numpy

import by_hand
from harness import exr
from harness.bench.measure import digest
from harness.daemon import Daemon

SIZE, PIXELS, SEED = (1024, 1024), 8192, 1
VPLS = {"vpls": "1048576"}
SCENES = ("cornell_box_spot_side", "sponza_dabrovic", "sibenik", "cornell_dragon_bunny", "garden")
COMBINED_GOAL, LIGHT_SIDE_GOAL = 0.05, 0.03
RESAMPLES = 2000
RECORD = numpy.dtype([("x", "u4"), ("y", "u4"), ("probability", "f8"), ("irradiance_lx", "f8", 3),
                      ("radiance_cd_m2", "f8", 3)])

# What trees' cuts are taken at, and `multires_gather` by default is not.
BLOCKS_OF_TREES = {"depth_test": "minmax", "depth_threshold": "0.05", "finest": "1",
                   "light_threshold": "inf"}
ALL_LEAVES = ("multires_gather", {"vpls": "65536", **BLOCKS_OF_TREES})
# What `multires_gather` has by default.
BLOCKS_BY_LIGHT = {"depth_test": "step", "depth_threshold": "0.01", "finest": "2",
                   "light_threshold": "0.05"}
# What is compared with R4: technique and what is set beside brdf=lambert.
PICTURES = (
    ("rsm", {}),
    ("multires_gather", {}),
    ("multires_gather", {"vpls": "65536"}),
    ALL_LEAVES,
    ("isr", {}),
    ("isr", {"rsm_size": "1024", "cluster_levels": "4"}),
    ("hisr", {"vpls": "1024"}),
    ("hisr", {}),
    ("hisr", {"tau": "0.01"}),
    ("hisr", BLOCKS_BY_LIGHT),
    ("hisr", {"vpls": "262144"}),
    ("hisr", {"vpls": "1048576"}),
)
# Fewer VPLs, summed as the reference sums them: what leaves alone miss.
LEAVES = ({"vpls": "65536"}, {"vpls": "262144"})
# Cuts of trees, and all leaves at the same blocks.
LIGHT_SIDES = tuple((tree, ALL_LEAVES) for tree in (("hisr", {}), ("hisr", {"tau": "0.01"})))


# --- the reference ------------------------------------------------------------------------------

def settings_words(settings):
    return [f"{key}={value}" for key, value in sorted(settings.items())]


def reference_hash(scene, size, pixels, seed, settings, version, camera=""):
    content = hashlib.sha256(pathlib.Path(scene).read_bytes()).hexdigest()
    return digest(content, size, pixels, seed, settings_words(settings), version, camera)


def read_records(path):
    """The line of JSON and the records, an array of RECORD."""
    with open(path, "rb") as file:
        return json.loads(file.readline()), numpy.frombuffer(file.read(), RECORD)


def make_records(build, scene, out, size, pixels, seed, settings, threads=0, camera=""):
    """`pixels` 0: all that are lit."""
    program = pathlib.Path(build) / "tests/bench/vpl_reference"
    part = pathlib.Path(f"{out}.part")
    try:
        subprocess.run([program, scene, part, "x".join(map(str, size)), camera, str(pixels), str(seed),
                        str(threads), *settings_words(settings)], check=True, capture_output=True)
        os.replace(part, out)
    finally:
        part.unlink(missing_ok=True)


def reference(build, cache, scene, version, settings=None, size=SIZE, pixels=PIXELS, seed=SEED):
    """(hash, line, records), made now if the cache has none."""
    settings = settings or VPLS
    name = reference_hash(scene, size, pixels, seed, settings, version)
    file = pathlib.Path(cache) / f"r4-{name}.bin"
    file.parent.mkdir(parents=True, exist_ok=True)
    if not file.is_file():
        make_records(build, scene, file, size, pixels, seed, settings)
    return (name, *read_records(file))


# --- errors -------------------------------------------------------------------------------------

class Sample:
    """Pixels with their probabilities, of a picture with so many in all."""

    def __init__(self, records, size):
        self.weight = 1 / records["probability"]
        self.total = size[0] * size[1]
        rng = numpy.random.default_rng(SEED)
        self.drawn = [rng.integers(0, len(records), len(records)) for _ in range(RESAMPLES)]

    def _relative(self, squares, truths):
        """sqrt(mean d) / mean R of terms that are weighed already."""
        mean = truths.sum() / self.total
        return float(numpy.sqrt(squares.sum() / self.total) / mean) if mean > 0 else None

    def error(self, picture, truth):
        """Of two arrays, pixels x 3."""
        difference = picture - truth
        squares = self.weight * (difference ** 2).mean(axis=1)
        truths = self.weight * truth.mean(axis=1)
        drawn = [self._relative(squares[at], truths[at]) for at in self.drawn]
        low, high = numpy.percentile(drawn, (2.5, 97.5))
        signed = (self.weight * difference.mean(axis=1)).sum() / truths.sum()
        worst = numpy.sort(squares)[::-1]
        return {"rel_rmse": self._relative(squares, truths), "low": float(low), "high": float(high),
                "signed": float(signed),
                "worst_ten_pixels_share": float(worst[:10].sum() / max(worst.sum(), 1e-300))}


def picture_at(daemon, scene, records, technique, settings):
    """Indirect radiance at the records' pixels, and the report."""
    frame = daemon.render(scene, technique, {"brdf": "lambert", **settings}, size=SIZE,
                          layers=("beauty", "indirect"), timeout_s=900)
    indirect = exr.layer(frame.planes, "indirect").astype(numpy.float64)
    return indirect[records["y"], records["x"]], frame.report


def row_of(technique, settings, report, error):
    return {"technique": technique, "settings": " ".join(settings_words(settings)),
            "vpls": report["counts"]["vpls"], "fragments": report["counts"].get("fragments"), **error}


def leaves_alone(build, cache, path, version, records, sample):
    rows = []
    for settings in LEAVES:
        _, line, few = reference(build, cache, path, version, settings)
        if not all((few[axis] == records[axis]).all() for axis in ("x", "y")):
            raise SystemExit(f"{path.stem}: {settings}: not the reference's pixels")
        rows.append({"technique": "rsm", "settings": " ".join(settings_words(settings)),
                     "vpls": line["vpls"],
                     **sample.error(few["radiance_cd_m2"], records["radiance_cd_m2"])})
    return rows


def measure(daemon, build, cache, path, say):
    """One scene's entry of the result."""
    held = f"scene:{daemon.hold(path)['id']}"
    version = daemon.report(held, "rsm", extra=("--plan",))["build"]
    name, line, records = reference(build, cache, path, version)
    sample, truth, seen, rows = Sample(records, SIZE), records["radiance_cd_m2"], {}, []
    for technique, settings in PICTURES:
        indirect, report = picture_at(daemon, held, records, technique, settings)
        seen[technique, *settings_words(settings)] = indirect, report["counts"]["vpls"]
        rows.append(row_of(technique, settings, report, sample.error(indirect, truth)))
        say(f"{path.stem}: {technique} {rows[-1]['settings']}: {rows[-1]['rel_rmse']:.4f}")
    sides = []
    for (tree, tree_set), (flat, flat_set) in LIGHT_SIDES:
        (cut, leaves), (whole, vpls) = (seen[name, *settings_words(settings)] for name, settings
                                        in ((tree, tree_set), (flat, flat_set)))
        if leaves != vpls:
            raise SystemExit(f"{tree} has {leaves} leaves, {flat} {vpls} VPLs: not the same light")
        error = sample.error(cut, whole)
        sides.append({"technique": tree, "settings": " ".join(settings_words(tree_set)), **error})
    mean = sample.error(numpy.zeros_like(truth), truth)  # of nothing: its interval is R4's own
    return {"scene": path.stem, "reference": {"hash": name, **line}, "combined": rows,
            "leaves": leaves_alone(build, cache, path, version, records, sample),
            "light_side": sides, "all_dark": mean}


def plot(result, file):
    """Relative RMSE of each picture, a group a scene, with intervals and the goal."""
    from harness.bench import plots
    pyplot = plots.load()
    figure, axes = pyplot.subplots(figsize=(9, 4.2))
    labels = [f"{t} {' '.join(settings_words(s))}".strip() for t, s in PICTURES]
    for i, entry in enumerate(result["scenes"]):
        rows = entry["combined"]
        places = [i + (k - (len(rows) - 1) / 2) * 0.8 / len(rows) for k in range(len(rows))]
        for k, (place, row) in enumerate(zip(places, rows)):
            color = plots.COLORS[k % len(plots.COLORS)]
            marker = plots.MARKERS[(k + k // len(plots.COLORS)) % len(plots.MARKERS)]
            error = row["rel_rmse"]
            axes.errorbar([place], [error], yerr=[[error - row["low"]], [row["high"] - error]],
                          fmt=marker, color=color, ms=5, elinewidth=1.2,
                          label=labels[k] if i == 0 else None)
    axes.axhline(COMBINED_GOAL, color="#667", lw=1, ls="--")
    axes.set_yscale("log")
    plots.logarithmic(axes.yaxis, (1, 2, 5))
    plots.percents(axes.yaxis)
    axes.set_xticks(range(len(result["scenes"])), [e["scene"] for e in result["scenes"]], fontsize=8)
    axes.set_ylabel("relative RMSE against R4")
    axes.grid(axis="y")
    axes.legend(fontsize=8, ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.1))
    figure.savefig(file, bbox_inches="tight", metadata={"Date": None, "Creator": None})


def percent(figure):
    return f"{100 * figure['rel_rmse']:.2g} [{100 * figure['low']:.2g}, {100 * figure['high']:.2g}]"


def table(result):
    """Markdown: a row for each picture, a column for each scene; in percent."""
    scenes = result["scenes"]
    rows = ["| | " + " | ".join(entry["scene"] for entry in scenes) + " |",
            "|---|" + "---|" * len(scenes)]
    for kind, what in (("leaves", "leaves alone, `"), ("combined", "`"),
                       ("light_side", "light side alone, `")):
        for i, row in enumerate(scenes[0][kind]):
            name = f"{row['technique']} {row['settings']}".rstrip()
            rows.append(f"| {what}{name}` | "
                        + " | ".join(percent(entry[kind][i]) for entry in scenes) + " |")
    return "\n".join(rows)


def run(build, scenes, cache, names=SCENES, earlier=(), keep=lambda result: None,
        say=lambda line: None):
    """`earlier`: entries of other scenes. `keep` is given the result after each scene."""
    result = {"machine": by_hand.machine(),
              "command": "vpl_reference.py BUILD SCENES -o RESULT --cache DIR", "size": SIZE,
              "settings": "brdf=lambert " + " ".join(settings_words(VPLS)),
              "goals": {"combined": COMBINED_GOAL, "light_side": LIGHT_SIDE_GOAL},
              "scenes": [entry for entry in earlier if entry["scene"] not in names]}
    with Daemon() as daemon:
        for name in names:
            path = pathlib.Path(scenes) / f"{name}.glb"
            result["scenes"].append(measure(daemon, build, cache, path, say))
            keep(result)
    return result


def main(words=None):
    parser = by_hand.parser(__doc__)
    parser.add_argument("--cache", type=pathlib.Path, required=True)
    by_hand.add_names(parser, SCENES)
    parser.add_argument("--plot", type=pathlib.Path)
    options = by_hand.parse(parser, words)
    earlier = json.loads(options.output.read_text())["scenes"] if options.output.is_file() else ()
    result = run(options.build, options.scenes, options.cache, options.names, earlier,
                 lambda found: by_hand.write(found, options.output), by_hand.say)
    print(table(result))
    if options.plot:
        plot(result, options.plot)


if __name__ == "__main__":
    main()
