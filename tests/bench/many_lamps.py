"""Frames under many spots: time of processors, memory, and error against references.

usage: many_lamps.py BUILD SPONZA.glb -o RESULT.json [--counts 1,16,64,256] [--size 256x256] [--runs 5] [--truth-spp 1024]
           [--truths FOLDER]

In a hall made here and in Sponza, with spots by maps and by rays as counts decide, and by maps alone where those fit:
processor time of a frame that is made anew (median), its passes, device memory. Of the largest count direct light
against the reference without bounces (medians and relative RMSE, of pixels and of means over 8x8; the truth's own noise
is in them), indirect light against `rsm` with 256 VPLs a spot. And 100 and 10,000 emitters, triangles and texels: the error of
`light_rays`=16, and its time (a quarter of the truth's samples; texels, which the reference finds by chance, against 1,024 rays,
and those against the reference).
FOLDER keeps truths for the next time.
"""
import argparse
import json
import os
import statistics
import sys
import tempfile
from pathlib import Path

import lamp_scenes
import numpy

from harness import exr
from harness.bench.store import machine
from harness.daemon import Daemon, RenderError

TECHNIQUES = ("direct", "multires_gather", "hisr")
TICK_MS = 1000 / os.sysconf("SC_CLK_TCK")
LUMINANCE = numpy.array([.2126, .7152, .0722])


def processor_ms(pid):
    words = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(words[11]) + int(words[12])) * TICK_MS


def time_of(daemon, scene, technique, settings, options):
    """All runs together, since ticks are long; passes by their medians."""
    daemon.report(scene, technique, settings, size=options.size, timeout_s=600)
    passes, before = {}, processor_ms(daemon.pid)
    for _ in range(options.runs):
        report = daemon.report(scene, technique, settings, size=options.size, extra=("--fresh", "all"), timeout_s=600)
        for one in report["passes"]:
            passes.setdefault(one["name"], []).append(one["ms"])
    return {"processor_ms": round((processor_ms(daemon.pid) - before) / options.runs, 1),
            "device_mib": round(report["memory_mib"]["gpu_peak"], 1), "vpls": report["counts"].get("vpls", 0),
            "passes_ms": {name: round(statistics.median(ms), 1) for name, ms in passes.items() if max(ms) > .5}}


def off(image, truth):
    said = {}
    for name, side in (("pixel", 1), ("8x8", 8)):
        high, wide = truth.shape[0] // side * side, truth.shape[1] // side * side
        a, b = ((one[:high, :wide] @ LUMINANCE).reshape(high // side, side, wide // side, side).mean((1, 3))
                for one in (image, truth))
        lit = b > 1e-3 * b.mean()
        parts = abs(a - b)[lit] / b[lit]
        said[name] = {"median": round(100 * float(numpy.median(parts)), 2), "p90": round(100 * float(numpy.percentile(parts, 90)), 2),
                      "rel_rmse": round(100 * float(numpy.sqrt(((a - b) ** 2).mean()) / b.mean()), 2)}
    said["mean"] = round(100 * float(image.mean() / truth.mean() - 1), 2)
    return said


def layer_of(daemon, scene, technique, settings, layer, options):
    return daemon.render(scene, technique, settings, size=options.size, layers=("beauty", layer),
                         timeout_s=1200).layer(layer).astype(float)


def truth_of(daemon, path, spp, options):
    kept = options.truths / (path.stem + ".exr")
    if not kept.exists():
        daemon.render(path, "reference", {"spp": spp, "bounces": 0, "alpha": "mask"}, size=options.size,
                      layers=("beauty", "direct"), timeout_s=3000, keep=kept)
    return exr.layer(exr.read(kept.read_bytes())[0], "direct").astype(float)


def spots(name, count, path, how, options):
    with Daemon(arguments=("--gpu-memory", "512")) as daemon:
        scene = "scene:" + daemon.hold(path)["id"]
        for technique in TECHNIQUES:
            row = {"scene": name, "spots": count, "technique": technique, "lamps": how}
            try:
                row.update(time_of(daemon, scene, technique, {"lamps": how}, options))
            except RenderError as error:
                row["refused"] = str(error)
            yield row


def errors(daemon, name, count, path, options):
    scene = "scene:" + daemon.hold(path)["id"]
    truth = truth_of(daemon, path, options.truth_spp, options)
    for settings in ({}, {"light_rays": 32}, {"noise_filter": "off"}, {"lamps": "maps", "shadow_size": 512}):
        yield {"scene": name, "spots": count, "layer": "direct", "settings": settings,
               "off_percent": off(layer_of(daemon, scene, "direct", settings, "direct", options), truth)}
    fine = {"lamps": "maps", "shadow_size": 64, "vpls": 256, "vpl_budget": 256 * count}
    truth = layer_of(daemon, scene, "rsm", fine, "indirect", options)
    for technique, settings in (("multires_gather", {}), ("multires_gather", {"vpls": 4096, "vpl_budget": 4096}), ("hisr", {}),
                                ("multires_gather", {"lamps": "maps", "shadow_size": 64})):
        yield {"scene": name, "spots": count, "layer": "indirect", "technique": technique, "settings": settings,
               "off_percent": off(layer_of(daemon, scene, technique, settings, "indirect", options), truth)}


def held(daemon, folder, name, count, options):
    """A scene of so many emitters, and its truth."""
    path = folder / f"{name}{count}.glb"
    path.write_bytes(getattr(lamp_scenes, name)(count))
    return "scene:" + daemon.hold(path)["id"], truth_of(daemon, path, options.truth_spp // 8 * 2, options)


def emitters(daemon, folder, options):
    for count in (100, 10000):
        scene, truth = held(daemon, folder, "screens", count, options)
        yield {"scene": "screens", "emitters": count, **time_of(daemon, scene, "direct", {}, options),
               "off_percent": off(layer_of(daemon, scene, "direct", {}, "direct", options), truth)}


def texels(daemon, folder, options):
    for count in (100, 10000):
        scene, truth = held(daemon, folder, "panels", count, options)
        many = layer_of(daemon, scene, "direct", {"light_rays": 1024, "noise_filter": "off"}, "direct", options)
        yield {"scene": "panels", "emitters": count, **time_of(daemon, scene, "direct", {}, options),
               "off_percent": off(layer_of(daemon, scene, "direct", {}, "direct", options), many), "many_rays_off_percent": off(many, truth)}


def rows(options, folder):
    scenes = {"hall": lambda count: lamp_scenes.hall(count),
              "sponza": lambda count: lamp_scenes.with_spots(options.sponza, count, **lamp_scenes.SPONZA)}
    for name, made in scenes.items():
        for count in options.counts:
            path = folder / f"{name}{count}.glb"
            path.write_bytes(made(count))
            for how in ("auto", "maps"):
                yield from spots(name, count, path, how, options)
        with Daemon() as daemon:
            yield from errors(daemon, name, count, path, options)
    with Daemon() as daemon:
        yield from emitters(daemon, folder, options)
        yield from texels(daemon, folder, options)


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("build", type=lambda text: Path(text).resolve())
    parser.add_argument("sponza", type=Path)
    parser.add_argument("-o", "--out", required=True, type=Path)
    parser.add_argument("--counts", type=lambda text: [int(word) for word in text.split(",")], default=[1, 16, 64, 256])
    parser.add_argument("--size", type=lambda text: tuple(int(side) for side in text.split("x")), default=(256, 256))
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--truth-spp", type=int, default=1024)
    parser.add_argument("--truths", type=Path)
    options = parser.parse_args()
    os.environ["BOUNCE"] = str(options.build / "clients/cli/bounce")
    os.environ["BOUNCED"] = str(options.build / "server/bounced")
    result = {"machine": machine(), "command": "tests/bench/many_lamps.py BUILD SPONZA.glb " + " ".join(sys.argv[3:]), "rows": []}
    with tempfile.TemporaryDirectory() as folder:
        options.truths = options.truths or Path(folder)
        for row in rows(options, Path(folder)):
            result["rows"].append(row)
            print(json.dumps(row), flush=True)
    lines = ",\n  ".join(json.dumps(row) for row in result["rows"])
    head = json.dumps({key: result[key] for key in ("machine", "command")}, indent=1)
    options.out.write_text(f'{head[:-2]},\n "rows": [\n  {lines}\n ]\n}}\n')


if __name__ == "__main__":
    main()
