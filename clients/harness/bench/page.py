"""bench.html: one page that needs nothing beside it, no network and no script."""
import re
from html import escape

from .store import rung_text, settings_text
from .summary import (AGAINST, EQUAL_ERRORS, LAYERS, advice, curve, duration, equal_error,
                      equal_time, percent, techniques_of, warnings)

STYLE = """
:root{color-scheme:light}
body{margin:0 auto;max-width:60rem;padding:1.2rem 1rem 4rem;font:16px/1.5 system-ui,-apple-system,
"Segoe UI",Roboto,"DejaVu Sans",sans-serif;color:#223;background:#fff;overflow-wrap:break-word}
h1{font-size:1.7rem;line-height:1.2;margin:.4rem 0}
h2{font-size:1.35rem;margin:2.6rem 0 .4rem;border-top:2px solid #dde;padding-top:1.2rem}
h3{font-size:1.05rem;margin:1.6rem 0 .3rem}
p{margin:.4rem 0}
.small{color:#556;font-size:.87rem}
.advice{background:#f2f6fb;border-left:4px solid #0072b2;padding:.6rem .9rem;margin:.6rem 0;
border-radius:0 .4rem .4rem 0}
.advice b{display:block}
svg{width:100%;height:auto;max-width:46rem;display:block;margin:.4rem auto}
svg text{font-family:system-ui,-apple-system,"Segoe UI",Roboto,"DejaVu Sans",sans-serif!important}
.scroll{overflow-x:auto;margin:.5rem 0}
table{border-collapse:collapse;font-size:.92rem;font-variant-numeric:tabular-nums;min-width:100%}
th,td{text-align:right;padding:.3rem .6rem;border-bottom:1px solid #dde;vertical-align:top}
th:first-child,td:first-child{text-align:left;position:sticky;left:0;background:#fff}
thead th{border-bottom:2px solid #99a;font-weight:600;white-space:nowrap}
td{white-space:nowrap}
.no{color:#778;font-size:.84rem;white-space:normal;min-width:5.6rem}
.best{font-weight:700;color:#00558a}
.pictures{display:grid;grid-template-columns:repeat(auto-fill,minmax(9.5rem,1fr));gap:.8rem;
margin:.6rem 0}
figure{margin:0}
figure img{width:100%;height:auto;display:block;border-radius:.25rem;background:#eee}
figcaption{font-size:.82rem;line-height:1.3;margin-top:.25rem}
.wide{grid-template-columns:repeat(auto-fill,minmax(14rem,1fr))}
details{margin:.8rem 0}
summary{cursor:pointer;color:#00558a;font-weight:600}
code{font-family:ui-monospace,"DejaVu Sans Mono",monospace;font-size:.86em;overflow-wrap:anywhere}
ul{padding-left:1.2rem}
"""

TRUTHS = {"full": "the whole rendering equation", "model": "the technique’s own model"}

METHOD = """
<p>Time is that of a whole frame in a daemon that holds the scene: from the frame’s turn to its pixels
read back, everything made anew, shaders compiled before, nothing encoded. Points are medians, bars are
quartiles. <i>Camera moved</i> makes anew only what follows the camera. <i>auto</i> chooses by itself, or for the budget that is
told. Of <i>cycles</i> it is the rendering of two halves alone, in a process that holds the scene and its structure; its <i>full</i> materials
are Blender’s own, which differ from glTF’s by some per cent.</p>
<p>Error is the debiased relative RMSE: the reference’s own noise is taken out by comparing with two
independent halves of it; bars are 95 % intervals. <i>Full</i> is the whole rendering equation;
<i>model</i> is the part of it that the technique declares to solve, so what is left there is the fault of
its settings. The dashed line, the floor, is a model’s own error against the full equation: settings tend to it, and go
below only where their own error happens to cancel a part of it.
Times at equal error lie on each technique’s Pareto front, straight between points on logarithmic
axes.</p>
"""


def anchor(result, scene):
    """Names of scenes are of any form, ids are not."""
    return f"scene{[s['name'] for s in result['scenes']].index(scene)}"


def table(head, rows):
    """`rows` hold ready HTML."""
    heads = "".join(f"<th>{escape(text)}</th>" for text in head)
    body = "".join("<tr>" + "".join(row) + "</tr>" for row in rows)
    return (f'<div class="scroll"><table><thead><tr>{heads}</tr></thead><tbody>{body}</tbody>'
            "</table></div>")


def said(text):
    """Escaped, and no line ends between a number and its unit."""
    return re.sub(r"(\d) (%|(?:ms|s|min)\b)", r"\1&nbsp;\2", escape(text))


def cell(text, kind=""):
    return f'<td class="{kind}">{said(text)}</td>' if kind else f"<td>{said(text)}</td>"


def _equal_error_table(result, scene, against, layer):
    rows = equal_error(result, scene, against, layer)
    columns = list(zip(*([c["ms"] for c in row["cells"]] for row in rows)))
    least = [min((ms for ms in column if ms is not None), default=None) for column in columns]
    body = []
    for row in rows:
        cells = [cell(row["technique"])]
        for item, best in zip(row["cells"], least):
            kind = "no" if item["ms"] is None else "best" if item["ms"] == best else ""
            cells.append(cell(item["text"], kind))
        body.append(cells)
    return table(["time at", *(percent(e) for e in EQUAL_ERRORS)], body)


def _equal_time_table(result, scene, against, layer):
    times, rows = equal_time(result, scene, against, layer)
    if not times:
        return ""
    body = [[cell(row["technique"]),
             *(cell(c["text"], "no" if c["error"] is None else "") for c in row["cells"]),
             cell("–" if row["slope"] is None else f"time^{row['slope']:.2f}")] for row in rows]
    return table(["error in", *(duration(ms) for ms in times), "falls as"], body)


def _points_table(result, scene):
    head = ["point", "new frame", "quartiles", "device", "camera moved",
            *(f"{layer}, {against}" for against in AGAINST for layer in LAYERS)]
    body = []
    for technique in techniques_of(result, scene):
        for _, _, p in curve(result, scene, technique):
            time = p["time_ms"]
            cells = [cell(f"{technique} {rung_text(p)}"),
                     cell(duration(time["frame"]["median"])),
                     cell(f"{duration(time['frame']['q1'])} – {duration(time['frame']['q3'])}"),
                     cell(duration(time["gpu"]["median"]) if time["gpu"]["median"] else "–"),
                     cell(duration(time["camera_moved"]["median"]))]
            cells += [cell(_error_text(p["error"].get(a, {}).get(layer)))
                      for a in AGAINST for layer in LAYERS]
            body.append(cells)
    return table(head, body)


def _error_text(error):
    if not error or error["value"] is None:
        return "–"
    if error["low"] is None or error["high"] is None:
        return percent(error["value"])
    return f"{percent(error['value'])} ({percent(error['low'])} – {percent(error['high'])})"


def _figure(uri, alt, caption):
    return (f'<figure><img src="{uri}" alt="{escape(alt)}" loading="lazy">'
            f"<figcaption>{caption}</figcaption></figure>")


def _pictures(scene, pictures):
    """`pictures`: (uri, alt, first line, second line, "" or "wide") each; wide ones come after."""
    grids = []
    for kind in ("", "wide"):
        figures = [_figure(uri, f"{scene}: {alt}", f"<b>{escape(first)}</b><br>{said(second)}")
                   for uri, alt, first, second, k in pictures if k == kind]
        if figures:
            grids.append(f'<div class="pictures {kind}">{"".join(figures)}</div>')
    return "".join(grids)


def more(title, *parts):
    inside = "".join(part for part in parts if part)
    return f"<details><summary>{escape(title)}</summary>{inside}</details>" if inside else ""


def scene_section(result, scene, figures, pictures):
    """`figures`: SVG texts by (kind, ...) as made by the caller; those that are missing are left
    out."""
    name = scene["name"]
    parts = [f'<h2 id="{anchor(result, name)}">{escape(name)}</h2>',
             f'<p class="small">{"x".join(map(str, scene["size"]))} px, camera '
             f'{escape(scene["camera"])}, {scene["triangles"]} triangles</p>',
             figures.get(("curve", "full", "beauty"), ""),
             _equal_error_table(result, name, "full", "beauty"), _pictures(name, pictures)]
    steps = [svg for key, svg in figures.items() if key[0] == "steps"]
    if steps:
        parts.append("<h3>What lies between a technique and the whole rendering equation</h3>")
        parts.append('<p class="small">Each bar is one restriction alone. Root mean squares do not '
                     "add up: steps may cancel or help each other (bench.json has their Gram "
                     "matrix).</p>")
        for key, svg in figures.items():
            if key[0] == "steps":
                parts.append(f'<p class="small">{escape(key[1])}</p>{svg}')
    parts.append("<h3>Error against the technique’s own model</h3>")
    parts += [figures.get(("curve", "model", "beauty"), ""),
              _equal_error_table(result, name, "model", "beauty")]
    parts.append(more("Indirect light alone", *(
        part for against in AGAINST for part in (
            f'<p class="small">against {TRUTHS[against]}</p>',
            figures.get(("curve", against, "indirect"), ""),
            _equal_error_table(result, name, against, "indirect")))))
    parts.append(more("Error at equal time", _equal_time_table(result, name, "full", "beauty")))
    parts.append(more("Time of each pass", figures.get(("passes",), "")))
    parts.append(more("Every point", _points_table(result, name)))
    return "\n".join(part for part in parts if part)


def _head(result):
    machine, device = result["machine"], result["device"]
    common = settings_text(result.get("settings", {}))
    software = ", software" if device.get("software") else ""
    return (f'<h1>{escape(result["title"])}</h1>'
            f'<p class="small">{escape(result["date"])} · {escape(machine["cpu"])}, '
            f'{machine["cores"]} cores · {escape(device.get("name", "no device"))}{software} · '
            f'build {escape(result["build"])}{escape(f" · all with {common}" if common else "")}</p>')


def _foot(result):
    lines = warnings(result)
    notes = "".join(f"<li>{escape(line)}</li>" for line in lines)
    sources = "".join(
        f'<tr>{cell(r["scene"])}{cell(r["settings"] or "full")}{cell(str(r["spp"]))}'
        + "".join(cell(percent(r["noise"][layer]) if r["noise"][layer] is not None else "–")
                  for layer in LAYERS) + "</tr>" for r in result["references"])
    listed = ('<div class="scroll"><table><thead><tr><th>scene</th><th>reference</th><th>samples</th>'
              "<th>noise of beauty</th><th>of indirect</th></tr></thead>"
              f"<tbody>{sources}</tbody></table></div>")
    return (f"<h2>How this was measured</h2>{METHOD}"
            f'<p class="small"><code>{escape(result["command"])}</code></p>'
            + more("References", listed) + more(f"Notes ({len(lines)})", f"<ul>{notes}</ul>"))


def page(result, sections):
    """The whole page; `sections` are those of the scenes, in order."""
    answers = "".join(
        f'<div class="advice"><b><a href="#{anchor(result, s["name"])}">{escape(s["name"])}</a></b>'
        f'{said(advice(result, s["name"]))}</div>' for s in result["scenes"])
    return "\n".join([
        '<!doctype html><html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width,initial-scale=1">',
        f'<title>{escape(result["title"])}</title><style>{STYLE}</style></head><body>',
        _head(result), answers, *sections, _foot(result), "</body></html>\n"])
