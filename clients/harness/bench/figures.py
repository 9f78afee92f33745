"""Gathers a page's figures and pictures from a finished run, and writes it."""
import subprocess
import sys
import tempfile
from pathlib import Path

from .. import exr
from . import plots, rungs, thumbs
from .page import page, scene_section
from .store import rung_text, write
from .summary import (AGAINST, HEADLINE_ERROR, LAYERS, curve, duration, front_rows, percent,
                      plotted, techniques_of)

EXIT_NO_MATPLOTLIB = 2


def write_page(bench):
    """0, or the exit code where matplotlib is missing, after one line that says so."""
    try:
        pyplot = plots.load()
    except plots.NoMatplotlib as fault:
        print(f"bench: {fault}", file=sys.stderr)
        return EXIT_NO_MATPLOTLIB
    result = bench.result
    sections = [scene_section(result, scene, svgs(pyplot, result, scene["name"], f"s{i}"),
                              _pictures(bench, scene)) for i, scene in enumerate(result["scenes"])]
    write(bench.store.folder / "bench.html", page(result, sections))
    plots.overview(pyplot, result, bench.store.folder / "bench.svg")
    return 0


def svgs(pyplot, result, scene, salt):
    """By what they show."""
    found = {}
    for against in AGAINST:
        for layer in LAYERS:
            if any(plots.drawn(result, scene, t, against, layer) for t in techniques_of(result, scene)):
                found["curve", against, layer] = plots.error_against_time(
                    pyplot, result, scene, against, layer, f"{salt}{against}{layer}")
    for item in result["decomposition"]:
        if item["scene"] == scene and item["layer"] == "beauty":
            found["steps", item["technique"]] = plots.step_bars(
                pyplot, result, item, f"{salt}{item['technique']}")
    bars = plots.pass_bars(pyplot, result, scene, f"{salt}passes")
    return {**found, **({("passes",): bars} if bars else {})}


def chosen(rows):
    """The cheapest point of a front, the first good enough for the headline, and the best."""
    path = front_rows(rows)
    if not path:
        return []
    enough = next((row for row in path if row[1] <= HEADLINE_ERROR), path[len(path) // 2])
    return [row for i, row in enumerate(path) if i == 0 or row is path[-1] or row is enough]


def _pictures(bench, scene):
    """(uri, alt, first line, second line, class) of the reference, of each technique's chosen points
    and of its best point's error map; nothing for files that are no longer there."""
    path = bench.paths[scene["name"]]
    reference = bench.references.held(path, rungs.FULL)
    if not reference:
        return []
    linear = exr.layer(reference.planes, "beauty")
    exposure = thumbs.exposure_of(linear)
    found = [(thumbs.jpeg_uri(linear, exposure), "reference", "full reference",
              f"{reference.spp} samples a pixel", "")]
    for technique in techniques_of(bench.result, scene["name"]):
        rows = chosen(curve(bench.result, scene["name"], technique))
        for ms, error, point in rows:
            file = bench.store.pictures / point["pictures"][0]
            linear = exr.layer(exr.read(file.read_bytes())[0], "beauty")
            found.append((thumbs.jpeg_uri(linear, exposure), f"{technique}, {percent(error)}",
                          f"{technique} {rung_text(point)}",
                          f"{percent(error)} in {duration(ms)}", ""))
        if rows:
            point = rows[-1][2]
            uri = _error_map(bench, reference, bench.store.pictures / point["pictures"][0])
            error = percent(plotted(point["error"]["full"]["beauty"]))
            if uri:
                found.append((uri, f"{technique}, error map", f"{technique}: where it is wrong",
                              f"{rung_text(point)}, {error}", "wide"))
    return found


def _error_map(bench, reference, picture):
    daemon = bench.stage.daemon
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "map.png"
        words = [daemon.bounce, "compare", str(reference.path), str(picture), "--map", str(file)]
        done = subprocess.run(words, capture_output=True, env=daemon.env, check=False, timeout=120)
        if done.returncode != 0 or not file.is_file():
            return None
        return thumbs.data_uri("image/png", file.read_bytes())
