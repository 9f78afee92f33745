"""papers.html: each figure beside the paper's ratios. One page that needs nothing beside it."""
import sys
from html import escape

from .. import plots
from ..page import STYLE, cell, more, said, table
from ..store import settings_text, write
from ..summary import duration, percent
from . import FIGURES, claims, explain, load_figure, panels
from .figure import fragments_share, frame_ms, indirect_ms, stage_ms

EXIT_NO_MATPLOTLIB = 2
OWN_STYLE = """
svg{max-width:60rem}
th:nth-child(2){text-align:left}
td.text{white-space:normal;min-width:14rem;text-align:left}
td.missed,td.met{white-space:normal;text-align:left;min-width:4.5rem}
td.why{white-space:normal;min-width:18rem;text-align:left;font-size:.87rem}
.claims th{text-align:left}
.claims tbody th{padding-top:.9rem}
.missed{color:#a33c00;font-weight:700}
"""

METHOD = """
<p>Ratios, not milliseconds: the papers ran on graphics cards of 2008. Frames of one group took turns,
everything was made anew each time, and the median counts; a ratio's two sides are always of one group.
<i>Stage</i> is the pass that gathers or splats; <i>indirect</i> is all but the passes that direct light
needs. Errors are those of the indirect layer: root mean square over the mean, beside it over the largest value.
Sizes and numbers of virtual lights are such that all figures together take less than half an hour on two
cores without a graphics card.</p>
"""
WHOSE = ("In brackets is what was asked for. The sentences were written of what is kept in tests/bench/results/papers, measured on two cores "
         "without a graphics card.")
SHRUNK = "<p class=\"missed\">Some sizes were divided, to see that all works: these figures say nothing.</p>"


def write_page(asked, store, say):
    """Every figure that was measured, now or before, or asked for. 0, or the exit code where
    matplotlib is missing, after one line that says so."""
    try:
        pyplot = plots.load()
    except plots.NoMatplotlib as fault:
        print(f"bench: {fault}", file=sys.stderr)
        return EXIT_NO_MATPLOTLIB
    there = {name for name, _ in store.groups} | set(asked.figures)
    figures = [load_figure(name) for name in FIGURES if name in there]
    sentences = explain.load()
    sections, told = [], {}
    for item in figures:
        found = store.found(item.name)
        told[item.name] = item.targets(found)
        drawn = item.panels(found) if found else ()
        drawing = ""
        if drawn:
            drawing = panels.drawing(pyplot, drawn, item.title, item.name)
            write(asked.output / f"{item.name}.svg", _alone(drawing))
        sections.append(section(item, found, drawing, sentences, notes_of(store, item)))
        for what in unexplained(item, found, sentences):
            say(f"{item.name}: no sentence explains {what}")
    shrunk = any(group["shrink"] > 1 for group in store.groups.values())
    top = claims_section(told, sentences, {name: notes_of(store, load_figure(name)) for name in told})
    write(asked.output / "papers.html", page(asked.title, origins(store), [top, *sections], shrunk))
    return 0


def _alone(drawing):
    return drawing.replace("<svg ", '<svg style="background:#fff" ', 1)


def notes_of(store, item):
    return [f"{note['group']}: {note['text']}" for note in store.notes if note["figure"] == item.name]


def unexplained(item, found, sentences):
    """Ids that want a sentence and have none: of what was missed, and of curves that were measured."""
    wanted = [t.id for t in item.targets(found) if t.met is False or t.id in item.curves]
    return [key for key in dict.fromkeys(wanted) if (item.name, key) not in sentences]


# --- claims -----------------------------------------------------------------------------------

def claims_section(told, sentences, notes):
    """A row for each claim. `told`: targets by figure, of those that are on the page."""
    verdicts, rows = [], []
    for claim in claims.CLAIMS:
        paper = claims.PAPERS[claim.id.partition(".")[0]]
        if not rows or claim.id.endswith(".1"):
            rows.append([f'<th colspan="5">{escape(paper)}</th>'])
        targets = told.get(claim.figure, [])
        verdicts.append(claims.verdict(claim, targets))
        rows.append(_claim_row(claim, targets, verdicts[-1], sentences, notes.get(claim.figure, [])))
    return "\n".join(['<h2 id="claims">Every claim, met or missed</h2>', f'<p class="small">{claims.counted(verdicts)} {WHOSE}</p>',
                      f'<div class="claims">{table(["id", "the paper", "ours", "", "why"], rows)}</div>'])


def _claim_row(claim, targets, verdict, sentences, notes):
    why = [sentences.get((claim.figure, claim.id), ""), claim.why_not, f"Test {claim.test}" if claim.test else ""]
    if verdict == claims.NOT_MEASURED:
        why = notes[:1]
    link = f'<td><a href="#{claim.figure}">{claim.id}</a></td>' if targets else cell(claim.id)
    return [link, cell(claim.says, "text"), f'<td class="text">{_ours(claims.targets_of(claim, targets))}</td>',
            cell(verdict, "missed" if verdict.startswith("missed") else "met"), cell(" ".join(w for w in why if w), "why")]


def _ours(targets):
    """What was asked for, over all scenes: a line for each ratio; what was found, where nothing was asked."""
    alike = {}
    for t in [t for t in targets if t.met is not None] or targets:
        alike.setdefault((t.what.partition(": ")[0], t.percent), []).append(t)
    lines = []
    for (what, in_percent), those in alike.items():
        ends = [number(value, in_percent) for value in (min(t.ours for t in those), max(t.ours for t in those))]
        asked = ", ".join(dict.fromkeys(bound(t) for t in those if t.met is not None))
        lines.append(said(f"{what}: {' to '.join(dict.fromkeys(ends))}" + (f" ({asked})" if asked else "")))
    return "<br>".join(lines) or "–"


# --- a figure ---------------------------------------------------------------------------------

def section(item, found, drawing, sentences, notes):
    targets = item.targets(found)
    parts = [f'<h2 id="{item.name}">{escape(item.title)}</h2>',
             f'<p class="small"><i>The paper:</i> {escape(item.says)}</p>', drawing]
    parts += [f'<p class="small">{escape(note)}</p>' for note in notes]
    if targets:
        parts.append(target_table(targets))
    parts += [_explanation(key, sentence) for (name, key), sentence in sentences.items()
              if name == item.name]
    missing = unexplained(item, found, sentences)
    if missing:
        parts.append(f'<p class="missed">Not explained yet: {", ".join(missing)}</p>')
    parts.append(more("Every point", *(_points_table(*group) for group in found.items())))
    return "\n".join(part for part in parts if part)


def _explanation(key, sentence):
    return f'<div class="advice"><b>{escape(key)}</b>{said(sentence)}</div>'


def number(value, in_percent):
    if value is None:
        return "–"
    if isinstance(value, str):
        return value
    if in_percent:
        return percent(value)
    return f"{value:,.0f}" if value >= 1000 else f"{value:.3g}"


def bound(target):
    ends = [f"{sign} {number(end, target.percent)}" for sign, end in
            (("≥", target.least), ("≤", target.most)) if end is not None]
    return " and ".join(ends) or "–"


def target_table(targets):
    rows = []
    for t in targets:
        verdict = {None: "", True: "met", False: "missed"}[t.met]
        of_paper = t.ours / t.paper if isinstance(t.paper, (int, float)) and t.paper else None
        rows.append([cell(t.id), cell(t.what, "text"), cell(number(t.paper, t.percent)),
                     cell(number(t.ours, t.percent)), cell(number(of_paper, False)),
                     cell(bound(t)), cell(verdict, "missed" if t.met is False else "")])
    return table(["id", "ratio", "paper", "ours", "ours / paper", "target", ""], rows)


def _points_table(name, points):
    rows = []
    for p in points.values():
        errors = ", ".join(f"{percent(e['rel_rmse'])} ({percent(e['rmse_max'])} of the largest) "
                           f"against {a}" for a, e in p["error"].items() if e)
        if p.get("motion"):
            errors = (f"from frame to frame {percent(p['motion']['value'])} ({percent(p['motion']['low'])} to "
                      f"{percent(p['motion']['high'])}) beside what is true, which moves by {percent(p['motion']['true'])}")
        share = percent(fragments_share(p)) if "fragments" in p["counts"] else "–"
        rows.append([cell(p["label"]), cell(f"{p['scene']}, {p['technique']} {settings_text(p['settings'])}"),
                     cell(f"{p['size']}x{p['size']}"), cell(share), cell(str(p["counts"].get("vpls", "–"))),
                     cell(duration(frame_ms(p))), cell(duration(indirect_ms(p))),
                     cell(duration(stage_ms(p))), cell(str(p["time_ms"]["runs"])), cell(errors or "–")])
    return f'<p class="small">{escape(name)}</p>' + table(
        ["point", "of", "size", "fragments", "VPLs", "frame", "indirect", "stage", "runs", "error"], rows)


# --- the page ---------------------------------------------------------------------------------

def origins(store):
    """What was measured with what, once each."""
    lines = {}
    for group in store.groups.values():
        device, machine = group["device"], group["machine"]
        software = ", software" if device.get("software") else ""
        text = (f"{machine['cpu']}, {machine['cores']} cores · {device['name']}{software} · "
                f"build {group['build']} · {group['command']}")
        lines.setdefault(text, []).append(group["date"])
    return [(text, min(dates), max(dates)) for text, dates in lines.items()]


def page(title, sources, sections, shrunk=False):
    made = "".join(f'<p class="small">{escape(first)} to {escape(last)}: {escape(text)}</p>'
                   for text, first, last in sources)
    made += SHRUNK if shrunk else ""
    return "\n".join([
        '<!doctype html><html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width,initial-scale=1">',
        f"<title>{escape(title)}</title><style>{STYLE}{OWN_STYLE}</style></head><body>",
        f"<h1>{escape(title)}</h1>", made, METHOD, *sections, "</body></html>\n"])
