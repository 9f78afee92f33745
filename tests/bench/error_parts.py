"""How far techniques are off the whole rendering equation, without rays and with them, and what of it is their model.

usage: error_parts.py BUILD SCENE... -o RESULT.json [--size 128x96] [--spp 192] [--truths FOLDER] [--only TECHNIQUE,...]

All in per cent of the truth's mean, relative RMSE with the references' noise taken out by their halves
(`bounce compare`), and beside it by how much the mean is off. For each scene:

  model       what no setting removes: `lights` that do not light (lamps with a size, skies), `bounces` after
              the first, `senders` (lobes and glass on the way), `visibility` that is left out; each from one
              reference to the next, in that order
  techniques  beauty and indirect layer at the defaults, with indirect_visibility=none and, where it is read, rays;
              against the whole equation, and as `one_bounce` against the reference before its visibility is left out

FOLDER keeps references for the next time.
"""
import argparse
import json
import sys
import tempfile
from pathlib import Path

from bounce import Bounce, Failed
from harness.bench.store import machine

LAYERS = ("indirect", "beauty")
# Each leaves out more than the one before.
REFERENCES = {
    "full": [],
    "lights": ["--lights", "punctual"],
    "bounces": ["--lights", "punctual", "--bounces", "1"],
    "senders": ["--model-of", "rsm", "--indirect-visibility", "on"],
    "visibility": ["--model-of", "rsm"],
}


def techniques_of(bounce):
    told = json.loads(bounce("techniques", "--json"))
    return [one for one in told["techniques"] if one["name"] != "reference"]


def make_references(bounce, scene, folder, options):
    files = {}
    for name, words in REFERENCES.items():
        files[name] = folder / f"{scene.stem}.{name}.exr"
        bounce("reference", scene, "-o", files[name], "--size", options.size, "--spp", options.spp, "--seed", 77, "-q", *words)
    return files


def model_parts(bounce, files, layer):
    """Of the full picture's mean."""
    parts, names = {}, list(REFERENCES)
    for before, after in zip(names, names[1:]):
        step, scale = bounce.off(files[before], files[after], layer), 1.0
        if before != "full":
            whole = bounce.off(files["full"], files[before], layer)
            scale = None if whole is None else 1 + whole[1] / 100
        parts[after] = None if step is None or scale is None else round(step[0] * scale, 1)
    return parts


def technique_row(bounce, scene, technique, visibility, files, folder, options):
    out = folder / "frame.exr"
    sets = ["--set", f"indirect_visibility={visibility}"] if visibility else []
    try:
        bounce("render", scene, "-o", out, "--size", options.size, "--technique", technique, "-q", "--layers",
               ",".join(LAYERS), *sets)
    except Failed as failed:  # a picture that is blank: nothing that it knows lights the scene
        return {"failed": str(failed)}
    row = {}
    for name, truth in ("full", files["full"]), ("one_bounce", files["senders"]):
        row[name] = {}
        for layer in LAYERS:
            off = bounce.off(truth, out, layer)
            row[name][layer] = None if off is None else {"rmse": round(off[0], 1), "mean": round(off[1], 1)}
    return row


def scene_row(bounce, scene, techniques, folder, options):
    files = make_references(bounce, scene, options.truths or folder, options)
    row = {"scene": scene.stem, "model": {layer: model_parts(bounce, files, layer) for layer in LAYERS}, "techniques": {}}
    for technique in techniques:
        reads = {one["key"] for one in technique["parameters"]}
        for visibility in ("none", "rays") if "indirect_visibility" in reads else (None,):
            name = technique["name"] + (f" {visibility}" if visibility else "")
            row["techniques"][name] = technique_row(bounce, scene, technique["name"], visibility, files, folder, options)
    return row


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("build", type=lambda text: Path(text).resolve())
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("-o", "--out", required=True, type=Path)
    parser.add_argument("--size", default="128x96")
    parser.add_argument("--spp", type=int, default=192)
    parser.add_argument("--truths", type=Path)
    parser.add_argument("--only", type=lambda text: set(text.split(",")))
    options = parser.parse_args()
    bounce = Bounce(options.build)
    techniques = [one for one in techniques_of(bounce) if not options.only or one["name"] in options.only]
    result = {"command": "tests/bench/error_parts.py " + " ".join(map(str, sys.argv[1:])), "machine": machine(), "rows": []}
    with tempfile.TemporaryDirectory() as folder:
        for scene in options.scenes:
            result["rows"].append(scene_row(bounce, scene, techniques, Path(folder), options))
            print(json.dumps(result["rows"][-1]), flush=True)
            options.out.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
