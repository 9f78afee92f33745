"""Cycles, where Blender is installed: the same file, camera and pixels, in halves that share no random number.

What runs inside Blender is cycles_in_blender.py. Its time is that of rendering alone, in a process that has the scene
and its structure. Behind the reference's filter its halves take the place of the reference's own, and the reference's
guides and time of filtering are taken.
"""
import functools
import json
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy

from .. import exr, glb
from ..daemon import RenderError
from .measure import spread
from .rungs import FULL

SETTINGS = ("spp", "brdf")
PROGRAM = "blender"
INSIDE = Path(__file__).with_name("cycles_in_blender.py")
START_SECONDS, SECONDS = 60, 1800
LIGHT = ("direct", "indirect", "emission")
LOBES = ("Diff", "Gloss", "Trans")


@functools.cache
def version():
    """Of the Blender that is installed; "" where there is none."""
    if not shutil.which(PROGRAM):
        return ""
    done = subprocess.run([PROGRAM, "--version"], capture_output=True, text=True, check=False, timeout=START_SECONDS)
    words = done.stdout.split()
    return words[1] if done.returncode == 0 and len(words) > 1 else ""


def halves_of(path, camera, settings, size, seed):
    """(two pictures as planes, milliseconds that each took): of half the samples each."""
    spp = max(int(settings["spp"]) // 2, 1)
    with tempfile.TemporaryDirectory() as folder:
        shots = [{"spp": spp, "seed": 2 * seed + half, "file": f"{folder}/{half}.exr"} for half in (0, 1)]
        job = {"scene": str(path.resolve()), "camera": camera, "yfov": _yfov(path, camera), "size": list(size),
               "lambert": settings.get("brdf") == "lambert", "shots": shots, "answer": f"{folder}/answer.json"}
        answer = _run(job, Path(folder) / "job.json")
        return [_planes(Path(shot["file"]), size) for shot in shots], [1e3 * shot["s"] for shot in answer["shots"]]


class Cycles:
    """Measures it in the scenes of a run. Raw and filtered pictures are of the same halves."""

    def __init__(self, stage, references):
        self.stage = stage
        self.references = references
        self._halves = {}
        self._filter_ms = {}

    def measured(self, path, camera, is_filtered, settings, seeds, keep):
        """Times, of a picture for each seed; the pictures go to `keep(seed)`."""
        times = []
        for seed in seeds:
            halves, ms = self._halves_of(path, camera, settings, seed)
            keep(seed).write_bytes(as_file(self._filtered(path, halves) if is_filtered else mean_of(halves)))
            times.append(sum(ms) + (self._filter_time(path) if is_filtered else 0))
        return {"frame": spread(times), "gpu": spread([0.0]), "passes": {}, "runs": len(times),
                "camera_moved": spread(times)}

    def _halves_of(self, path, camera, settings, seed):
        key = (path, camera, tuple(sorted(settings.items())), seed)
        if key not in self._halves:
            self._halves[key] = halves_of(path, camera, settings, self.stage.size, seed)
        return self._halves[key]

    def _filtered(self, path, halves):
        reference = self.references.get(path, FULL)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "halves.exr"
            file.write_bytes(in_place_of_halves(reference.path, halves))
            planes = self.references.filtered(reference, file)
        return {layer: exr.layer(planes, layer) for layer in ("beauty", *LIGHT)}

    def _filter_time(self, path):
        """What the filter takes the daemon, of a picture of this size."""
        if path not in self._filter_ms:
            report = self.stage.ask(self.stage.daemon.report, path, "reference", {"spp": "2", "noise_filter": "on"})
            self._filter_ms[path] = sum(p["ms"] for p in report["passes"] if p["name"] == "filter")
        return self._filter_ms[path]


def _yfov(path, camera):
    doc = json.loads(path.read_bytes()) if path.suffix == ".gltf" else glb.Glb.load(path).doc
    nodes = [n for n in doc.get("nodes", ()) if "camera" in n]
    node = next((n for n in nodes if n.get("name") == camera), nodes[0] if nodes else None)
    lens = doc["cameras"][node["camera"]].get("perspective") if node else None
    if not lens:
        raise RenderError("cycles: no perspective camera in the file", str(path))
    return lens["yfov"]


def _run(job, file):
    file.write_text(json.dumps(job), encoding="utf-8")
    words = [PROGRAM, "-b", "--factory-startup", "-noaudio", "-P", str(INSIDE), "--", str(file)]
    try:
        done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=SECONDS)
    except subprocess.TimeoutExpired:
        raise RenderError(f"cycles: no picture within {SECONDS} s", " ".join(words)) from None
    answer = Path(job["answer"])
    if done.returncode or not answer.is_file():
        said = (done.stderr.strip() or done.stdout.strip() or "no answer").splitlines()[-1]
        raise RenderError(f"cycles: {said}", " ".join(words), done.returncode)
    return json.loads(answer.read_text(encoding="utf-8"))


def _planes(file, size):
    """By the names that the daemon's layers have."""
    raw, _ = exr.read(file.read_bytes())

    def of(name):
        planes = [raw.get(f"ViewLayer.{name}.{c}") for c in "RGB"]
        return numpy.zeros((size[1], size[0], 3)) if planes[0] is None else numpy.stack(planes, -1).astype(float)

    found = {"direct": sum(of(f"{lobe}Dir") * of(f"{lobe}Col") for lobe in LOBES),
             "indirect": sum(of(f"{lobe}Ind") * of(f"{lobe}Col") for lobe in LOBES),
             "emission": of("Emit") + of("Env")}
    found["beauty"] = sum(found[layer] for layer in LIGHT)
    return found


def as_file(planes):
    """Of the layers of light: the bytes of an EXR file that `bounce compare` reads."""
    return exr.write({("" if layer == "beauty" else f"{layer}.") + c: planes[layer][..., i]
                      for layer in ("beauty", *LIGHT) for i, c in enumerate("RGB")})


def mean_of(halves):
    return {layer: (halves[0][layer] + halves[1][layer]) / 2 for layer in halves[0]}


def in_place_of_halves(reference, halves):
    """The bytes of a reference's file whose light is that of other halves."""
    planes, strings = exr.read(reference.read_bytes())
    mean = mean_of(halves)
    for layer in ("beauty", *LIGHT):
        for i, c in enumerate("RGB"):
            planes[("" if layer == "beauty" else f"{layer}.") + c] = mean[layer][..., i]
            for name, half in zip("ab", halves):
                planes[f"half_{name}." + ("" if layer == "beauty" else f"{layer}.") + c] = half[layer][..., i]
    return exr.write(planes, {key: value for key, value in strings.items() if key != "type"})
