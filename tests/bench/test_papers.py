"""Figures of papers: plans, ratios and the page on made-up points; nothing is rendered."""
import argparse
import csv
import json
from pathlib import Path

import numpy
import pytest
import temporal

from harness.bench import options as bench_options
from harness.bench import papers
from harness.bench.papers import claims, command, errors, explain, measured, options, page, panels, scenes, store
from harness.bench.papers.figure import Figure, Group, Line, Panel, Run, Target
from harness.glb import Glb
from test_page import Checker

pytest.importorskip("matplotlib")

PASSES = ("gbuffer", "shadow_map", "direct", "rsm", "vpl_grid", "discontinuity", "fragments", "gather",
          "splat", "subsplats", "upsample", "composite")


def spread(ms):
    return {"median": ms, "q1": ms, "q3": ms}


def point(run, passes_ms=None, frame_ms=100.0, fragments=0.04, off=0.02):
    """What `measured` makes of a run: every pass takes 10 ms, if nothing else is said."""
    passes = passes_ms or {name: 10.0 for name in PASSES}
    wrong = {"rel_rmse": off, "rmse_max": off / 10, "trimmed": off / 2, "tones": off, "signed": 0.0}
    return {"label": run.label, "scene": run.scene.name, "technique": run.technique,
            "settings": run.all_settings, "size": run.size, "camera": run.camera,
            "time_ms": {"frame": spread(frame_ms), "gpu": spread(frame_ms), "runs": 3,
                        "passes": {name: spread(ms) for name, ms in passes.items()}},
            "counts": {"fragments": fragments * run.size ** 2, "vpls": 256, "triangles": run.size,
                       "subsplats": 1000, "subsplats_tested": 1500},
            "flags": [], "command": "bounce render ...", "error": {a: wrong for a in run.against},
            **({"motion": {"value": off, "low": off / 2, "high": 2 * off, "trimmed": off / 4, "half": off / 8, "true": .01}} if run.moves_as else {})}


def found_of(item, **more):
    return {group.name: {run.label: point(run, **more) for run in group.runs} for group in item.groups()}


def group_entry(figure, group, key="k"):
    return {"figure": figure, "name": group.name, "key": key, "command": "bounce bench <all>", "shrink": 1,
            "machine": {"cpu": "A processor", "cores": 2}, "device": {"name": "a device", "software": True},
            "build": "0.1.0", "date": "2026-01-02T03:04:05+00:00", "seconds": 1.0,
            "points": [point(run) for run in group.runs]}


every_figure = pytest.mark.parametrize("item", [papers.load_figure(n) for n in papers.FIGURES],
                                       ids=papers.FIGURES)


# --- plans ----------------------------------------------------------------------------------

@every_figure
def test_a_figure_makes_do_with_what_was_measured(item):
    whole = found_of(item)
    assert len({group.name for group in item.groups()}) == len(item.groups())
    parts = [whole, *({name: points} for name, points in whole.items())]
    for found in parts:
        assert all(panel.lines for panel in item.panels(found))
        assert all(isinstance(t.ours, float) for t in item.targets(found))
    assert item.targets({}) == []


@every_figure
def test_every_group_counts(item):
    """A group that neither a panel nor a ratio looks at would be measured for nothing."""
    for name, points in found_of(item).items():
        lines = [line for panel in item.panels({name: points}) for line in panel.lines if not line.paper]
        assert any(panels.drawn(line) for line in lines) or item.targets({name: points}), name


def test_a_group_refuses_runs_that_cannot_be_told_apart():
    run = Run("a", scenes.BOX, "rsm", {}, 64)
    with pytest.raises(AssertionError):
        Group("twice", (run, run))
    with pytest.raises(AssertionError):
        Group("against nothing", (Run("a", scenes.BOX, "rsm", {}, 64, against=("b",)),))
    with pytest.raises(AssertionError):
        Group("as nothing", (Run("a", scenes.BOX, "rsm", {}, 64, film=(scenes.BOX,), moves_as="b"),))


# --- ratios ---------------------------------------------------------------------------------

def target(item, found, id, words):
    return next(t for t in item.targets(found) if t.id == id and words in t.what)


def test_the_ratios_of_the_papers_table_come_out_of_its_milliseconds():
    item = papers.load_figure("gather_or_splat")
    found = {}
    for group in item.groups():
        if group.name == "sponza_dabrovic":
            full, gather, splat = group.runs
            found[group.name] = {
                "full": point(full),
                "gather": point(gather, {"gather": 3.0, "discontinuity": .5, "fragments": .2}, 9.9),
                "splat": point(splat, {"splat": 58.1, "discontinuity": 1.0, "fragments": .3}, 65.6)}
    for id, paper in (("B2.1", 19.4), ("B2.2", 16.1), ("B2.3", 6.63)):
        ratio = target(item, found, id, "sponza")
        assert ratio.ours == pytest.approx(paper, abs=.05) and ratio.paper == pytest.approx(ratio.ours)
        assert ratio.met


def test_indirect_resolution_leaves_the_window_as_it_is():
    item = papers.load_figure("resolution")
    group = next(g for g in item.groups() if g.name == "teapot_box")
    # Direct light takes as many ms as the picture has pixels a side, indirect light 100 at any size.
    made = {run.label: point(run, {"direct": float(run.size), "splat": 100.0}, 100.0 + run.size)
            for run in group.runs}
    assert target(item, {"teapot_box": made}, "B1.4", "teapot").ours == pytest.approx(1.0)
    whole = next(p for p in item.panels({"teapot_box": made}) if p.title == "The whole picture")
    assert whole.lines[0].points[-1] == (1024, pytest.approx(1124 / 228))


def test_lists_for_each_vpl_are_counted_where_there_are_any():
    item = papers.load_figure("per_vpl")
    group = item.groups()[0]
    assert group.needs == (("multires_splat", "radiance_threshold"),)
    made = {run.label: point(run, {"subsplats": 30.0, "splat": 2.56, "discontinuity": .1, "fragments": .1},
                             fragments=.25) for run in group.runs}
    large = made["lists 256"]
    large["counts"].update(fragments=1000, subsplats=256 * 65536 // 20, subsplats_tested=2000000)
    found = {"256 VPLs": made}
    assert target(item, found, "B1.1", "subsplats").ours == pytest.approx(.05)
    assert target(item, found, "B1.1", "subsplats").paper == pytest.approx(.0508, abs=1e-4)
    assert target(item, found, "B1.2", "256").ours == pytest.approx(1.5)  # 15 ns over 10
    assert target(item, found, "B1.3", "256").ours == pytest.approx(150)
    del large["counts"]["subsplats"]
    assert item.targets(found) == []


def group_of(item, name):
    return next(group for group in item.groups() if group.name == name)


def test_clusters_are_a_share_of_a_frame_and_sub_frames_several():
    item = papers.load_figure("points")
    clusters, frames = group_of(item, "clusters, cornell_box"), group_of(item, "sub-frames, cornell_box")
    found = {clusters.name: {"frame": point(clusters.runs[0], {"points": 5.0, "point_clusters": 2.0}, 100.0)},
             frames.name: {run.label: point(run, {"points": 50.0, "point_clusters": 10.0}, 100.0 * run.aa) for run in frames.runs}}
    assert target(item, found, "B4.3", "of a frame").ours == pytest.approx(.02) and not target(item, found, "B4.3", "of a frame").met
    assert target(item, found, "B4.5", "over one").ours == pytest.approx(4)
    assert target(item, found, "B4.5", "without points").ours == pytest.approx(340 / 40)


def test_what_a_picture_gives_back_is_of_what_the_clamp_takes():
    item = papers.load_figure("compensation")
    group = group_of(item, "given back, cornell_box")
    made = {run.label: point(run) for run in group.runs}
    assert target(item, {group.name: made}, "B3.3", "given back").ours == 0  # nothing was taken
    for iterations, left in enumerate((.2, .05, .02, .01, 0.0)):
        made[str(iterations)]["error"] = {"rays": {"signed": -left}}
    assert target(item, {group.name: made}, "B3.3", "given back").ours == pytest.approx(.9)
    assert target(item, {group.name: made}, "B3.4", "1 iteration").ours == pytest.approx(.75)


def test_a_target_is_met_at_its_bounds_and_missed_beyond():
    def met(ours):
        return Target("x", "", ours, least=.8, most=1.2).met
    assert [met(v) for v in (.79, .8, 1.2, 1.21)] == [False, True, True, False]
    assert Target("x", "", 1.0).met is None
    assert page.bound(Target("x", "", 1.0, least=.8, most=1.2)) == "≥ 0.8 and ≤ 1.2"
    assert page.bound(Target("x", "", 1.0, most=.05, percent=True)) == "≤ 5 %"


def test_the_best_threshold_is_the_least_error_among_few_fragments():
    item = papers.load_figure("eye_error")
    group = next(g for g in item.groups() if g.name == "sponza_dabrovic")
    made = {run.label: point(run, fragments=.08, off=.001) for run in group.runs}
    made["normal 0.9"] = point(group.runs[-2], fragments=.05, off=.03)
    made["normal 1.4"] = point(group.runs[-1], fragments=.03, off=.04)
    best = target(item, {"sponza_dabrovic": made}, "B2.5", "least RMS")
    assert best.ours == .03 and "normal 0.9" in best.what and not best.met
    del made["normal 0.9"], made["normal 1.4"]
    assert target(item, {"sponza_dabrovic": made}, "B2.5", "fewest").ours == pytest.approx(.08)


def test_errors_of_pictures():
    reference = numpy.ones((100, 100, 3))
    reference[0, 0] = 4
    picture = reference.copy()
    picture[:50] *= 1.1
    picture[5, 5] = 101.1  # the one pixel in ten thousand that `trimmed` leaves out
    found = errors.between(reference, picture)
    mean = 1 + 3e-4
    rest = 4998 * .1 ** 2 + .4 ** 2
    assert found["trimmed"] == pytest.approx((rest / 9999) ** .5 / mean)
    assert found["rel_rmse"] == pytest.approx(((rest + 100.1 ** 2) / 10000) ** .5 / mean)
    assert found["rmse_max"] == pytest.approx(found["rel_rmse"] * mean / 4)
    assert errors.between(reference, 3 * reference)["tones"] == pytest.approx(.5, abs=.01)  # 3 / 4 of 1 / 2
    assert found["signed"] == pytest.approx((499.8 + .4 + 100.1) / 10000 / mean)
    assert errors.between(0 * reference, picture) is None


def test_what_flickers_is_what_moves_and_should_not():
    rng = numpy.random.default_rng(2)
    still = rng.uniform(1, 3, (40, 56, 3))
    true = numpy.stack([still + .1 * number for number in range(5)])
    halves = [true + rng.normal(0, .2, true.shape) for _ in range(2)]
    exact = errors.of_motion([true, true], true)
    assert exact["value"] == exact["half"] == 0 and exact["true"] == pytest.approx(.1 / true.mean())
    film = true.copy()
    film[2, 0, 0] += 5  # one pixel of 2,240 flashes: two steps of four are off there
    film[1::2] += .3    # and the whole picture flickers
    found = errors.of_motion(halves, film)
    assert found["value"] == pytest.approx((.3 ** 2 + (2 * 4.85 ** 2 + 2 * .15 * 5) / 4 / 2240) ** .5 / true.mean(), rel=.2)
    assert errors.of_motion([true, true], film)["trimmed"] == pytest.approx(.3 / true.mean())
    assert errors.of_motion([true, true], film)["half"] == pytest.approx(.3 / true.mean())
    # As the study of films has it.
    series = temporal.Series()
    for number in range(1, 5):
        steps = [half[number] - half[number - 1] for half in halves]
        series.add(film[number] - film[number - 1], steps)
    by_series = series.figure(float(numpy.mean(halves)))
    assert found["value"] == pytest.approx(by_series["value"])
    assert (found["low"], found["high"]) == pytest.approx((by_series["low"], by_series["high"]))
    assert errors.of_motion([0 * true, 0 * true], film) is None


def test_clusters_are_steadier_by_their_flicker_over_that_of_a_grid():
    item = papers.load_figure("films")
    (group, _) = item.groups()
    made = {run.label: point(run, off=.06) for run in group.runs}
    made["isr"] = point(group.runs[-2], off=.03)
    made["hisr"] = point(group.runs[-1], off=.09)
    made["256 VPLs"] = point(group.runs[1], off=.01)
    found = {group.name: made}
    assert target(item, found, "B2.10", "of isr over").ours == pytest.approx(.5) and target(item, found, "B2.10", "of isr over").met
    assert target(item, found, "B2.10", "of hisr over").ours == pytest.approx(1.5) and not target(item, found, "B2.10", "of hisr over").met
    assert target(item, found, "B1.10", "flicker of 256").met and not target(item, found, "B1.10", "flicker of 1024").met


# --- measuring ------------------------------------------------------------------------------

class FakeStage:
    """Writes down who was asked; frames slow down with each one, as on a machine that gets busy."""

    def __init__(self):
        self.asked = []
        self.daemon = self

    def command(self, *_, **__):
        return ["bounce", "render"]

    def report(self):
        raise AssertionError("asked by `ask` alone")

    render = report

    def ask(self, what, path, technique, settings, size, **_):
        self.asked.append((what.__func__.__name__, technique, size[0]))
        ms = float(len(self.asked))
        told = {"time_ms": {"total": ms, "gpu": ms}, "passes": [], "counts": {"vpls": 1}, "flags": []}
        return told


def test_frames_of_a_group_take_turns():
    group = Group("two", (Run("a", scenes.BOX, "rsm", {}, 64), Run("b", scenes.BOX, "isr", {}, 32),
                          Run("once", scenes.BOX, "direct", {}, 16, timed=False)))
    stage = FakeStage()
    points = measured.of_group(stage, group, {scenes.BOX: "box.glb"}, 2, 3)
    assert [t for _, t, _ in stage.asked] == ["rsm", "isr", "direct", *["rsm", "isr"] * 3]
    assert [size for *_, size in stage.asked[:3]] == [32, 16, 8]
    assert [p["time_ms"]["frame"]["median"] for p in points] == [6.0, 7.0, 3.0]  # the first do not count
    assert [p["time_ms"]["runs"] for p in points] == [3, 3, 1]
    assert points[0]["settings"] == {"brdf": "lambert"}


class FilmStage(FakeStage):
    """A frame is as bright as its scene's path, which is a number."""

    def command(self, scene, *_, **__):
        return ["bounce", "render", scene]

    def ask(self, what, path, technique, settings, size, layers, **_):
        self.asked.append((technique, path, layers))
        told = super().ask(what, path, technique, settings, size)
        self.asked.pop()
        layers_of = {name: numpy.full((size[1], size[0], 3), 1.0 + path) for name in layers}
        return argparse.Namespace(report=told, layer=layers_of.get)


def test_a_film_is_its_scenes_one_after_the_other():
    film = scenes.with_light_that_moves(scenes.BOX, (.5, 0, 0), 3)
    assert [s.arguments[0][0] for s in film] == [-.5, 0, .5] and len({s.name for s in film}) == 3
    runs = (Run("truth", film[0], "reference", {}, 32, timed=False, film=film),
            Run("rsm", film[0], "rsm", {}, 32, timed=False, film=film, moves_as="truth"))
    stage = FilmStage()
    truth, rsm = measured.of_group(stage, Group("film", runs), {s: i for i, s in enumerate(film)}, 1, 3)
    assert stage.asked == [*(("reference", i, measured.HALVES) for i in range(3)), *(("rsm", i, ("indirect",)) for i in range(3))]
    assert "motion" not in truth and rsm["motion"]["value"] == 0 and rsm["motion"]["true"] == pytest.approx(1 / 2)
    assert rsm["time_ms"]["runs"] == 3 and rsm["command"].startswith("bounce render $MADE/cornell_box_spot_side_frame0.glb")


# --- scenes ---------------------------------------------------------------------------------

def test_balls_change_in_one_number_alone(tmp_path):
    few, many, lit = (Glb.load(scene.open(tmp_path, tmp_path / "made")) for scene in
                      (scenes.balls(80), scenes.balls(320), scenes.balls(80, light_count=4)))

    def triangles(glb):
        return sum(glb.doc["accessors"][glb.doc["meshes"][node["mesh"]]["primitives"][0]["indices"]]["count"]
                   for node in glb.every("nodes") if "mesh" in node) // 3
    assert (triangles(few), triangles(many), triangles(lit)) == (410, 1610, 410)
    assert [len(glb.lights()) for glb in (few, many, lit)] == [1, 1, 4]
    assert sum(light["intensity"] for light in lit.lights()) == pytest.approx(few.lights()[0]["intensity"])


def test_cameras_and_lights_are_put_where_they_should_be(tmp_path):
    made = tmp_path / "made"
    scenes.balls(80).open(tmp_path, made).rename(tmp_path / "box.glb")
    box = scenes.of_set("box")
    path = Glb.load(scenes.with_cameras(box, (((1, 2, 3), (1, 2, 0)), ((0, 1, 0), (5, 1, 0)))).open(tmp_path, made))
    names = {path.doc["cameras"][n["camera"]]["name"]: n for n in path.every("nodes") if "camera" in n}
    assert names["path0"]["translation"] == [1, 2, 3] and names["path0"]["rotation"] == [0, 0, 0, 1]
    assert names["path1"]["rotation"] == pytest.approx([0, -.5 ** .5, 0, .5 ** .5])  # -z to +x
    assert {path.doc["nodes"].index(n) for n in names.values()} <= set(path.roots())
    before, after = (next(n for n in Glb.load(s.open(tmp_path, made)).every("nodes") if n["name"] == "lamp0")
                     for s in (box, scenes.with_moved_light(box, 1, (1, 0, -2))))
    assert numpy.subtract(after["translation"], before["translation"]) == pytest.approx([1, 0, -2])


def test_a_missing_scene_is_named(tmp_path):
    with pytest.raises(scenes.Missing, match="sibenik.glb is not in"):
        scenes.SIBENIK.open(tmp_path, tmp_path)


# --- files and the page ---------------------------------------------------------------------

def kept_in(folder):
    kept = store.Store(folder)
    for name in papers.FIGURES:
        for group in papers.load_figure(name).groups():
            kept.groups[name, group.name] = group_entry(name, group)
    kept.save()
    return kept


def test_groups_are_kept_by_their_key(tmp_path):
    kept = kept_in(tmp_path)
    again = store.Store(tmp_path)
    assert list(again.groups.values()) == json.loads(json.dumps(list(kept.groups.values())))
    assert again.holds("tree", "cornell_box_spot_side", "k")
    assert not again.holds("tree", "cornell_box_spot_side", "another")
    again.forget("tree", "cornell_box_spot_side")
    assert "cornell_box_spot_side" not in store.Store(tmp_path).found("tree")
    again.keep_only("cost", {"lights"})
    assert set(store.Store(tmp_path).found("cost")) == {"lights"} and store.Store(tmp_path).found("tree")


def test_the_table_has_a_row_for_each_comparison(tmp_path):
    kept_in(tmp_path)
    with open(tmp_path / "papers.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == store.COLUMNS
    of_tree = [r for r in rows if (r["figure"], r["group"]) == ("tree", "cornell_box_spot_side")]
    runs = next(g for g in papers.load_figure("tree").groups() if g.name == "cornell_box_spot_side").runs
    assert len(of_tree) == sum(max(1, len(run.against)) for run in runs)
    assert float(rows[0]["frame_ms"]) == 100 and float(rows[0]["stage_ms"]) == 20
    assert float(rows[0]["indirect_ms"]) == 80  # eight passes of ten


def test_the_page_shows_every_figure_and_fetches_nothing(tmp_path, monkeypatch):
    kept = kept_in(tmp_path)
    kept.notes.append({"figure": "tree", "group": "leaves", "text": "skipped: <x>.glb is not in DIR"})
    monkeypatch.setattr(explain, "load", lambda: {("gather_or_splat", "B2.1"): "Both <take> as long."})
    said = []
    asked = argparse.Namespace(output=tmp_path, title="Papers & figures", figures=("tree",))
    assert page.write_page(asked, kept, said.append) == 0
    text = (tmp_path / "papers.html").read_text(encoding="utf-8")
    checker = Checker()
    checker.feed(text)
    checker.close()
    assert checker.open == [] and {"svg", "table", "details"} <= checker.seen
    assert len(checker.ids) == len(set(checker.ids)) and "script" not in checker.seen
    assert set(papers.FIGURES) <= set(checker.ids) and "say nothing" not in text
    assert all((tmp_path / f"{name}.svg").is_file() for name in papers.FIGURES)
    assert "Papers &amp; figures" in text and "&lt;x&gt;.glb is not in DIR" in text
    assert "Both &lt;take&gt; as long." in text
    # Made-up frames all take as long: gathering is no faster. Explained is not said again, B2.2 is.
    assert "Not explained yet: B2.2, B2.3" in text
    assert "gather_or_splat: no sentence explains B2.3" in said
    assert "gather_or_splat: no sentence explains B2.1" not in said
    assert "cost: no sentence explains pixels" in said  # a curve, which nothing can miss


# --- claims ---------------------------------------------------------------------------------

def test_every_claim_has_a_row_and_each_figure_tells_of_its_own():
    wanted = [f"B{paper}.{number}" for paper, count in enumerate((10, 11, 5, 6, 6), 1) for number in range(1, count + 1)]
    assert [claim.id for claim in claims.CLAIMS] == wanted
    told = {(name, t.id) for name in papers.FIGURES
            for t in papers.load_figure(name).targets(found_of(papers.load_figure(name))) if t.id.startswith("B")}
    assert {(claim.figure, claim.id) for claim in claims.CLAIMS if claim.figure} == told
    assert all(bool(claim.figure) != bool(claim.why_not) for claim in claims.CLAIMS)
    assert {claim.id.partition(".")[0] for claim in claims.CLAIMS} == set(claims.PAPERS)


def test_a_claim_is_met_where_all_that_was_asked_is():
    claim = claims.Claim("B9.1", "", "tree")
    def verdict(*met, of=claim):
        return claims.verdict(of, [Target("B9.1", "", 1.0, most=2.0 if m else 0.5) if m is not None else Target("B9.1", "", 1.0) for m in met])
    assert verdict(True, None, True) == "met" and verdict(False, None) == "missed" and verdict(True, False, False) == "missed in 2 of 3"
    assert verdict() == "not measured" and verdict(None) == "no number" and claims.verdict(claim, [Target("B9.2", "", 1.0, most=2)]) == "not measured"
    assert verdict(None, of=claims.Claim("B9.1", "", "tree", test="x: y.")) == "met by tests"
    assert claims.verdict(claims.Claim("B9.1", "", why_not="No."), []) == "not redrawn"
    assert claims.counted(["met", "met by tests", "missed", "missed in 1 of 2", "not redrawn", "not measured"]) == \
        "6 claims: 2 met, 1 in part, 1 missed, 2 not told."


def claim_rows(text):
    table = text[text.index('id="claims"'):].partition("</table>")[0]
    return {row.partition("</td>")[0].rpartition("<td>")[2].rpartition(">")[2] if "<a" not in row else row.partition("</a>")[0].rpartition(">")[2]: row
            for row in table.split("<tr>") if "<td" in row}


def test_the_table_says_what_was_asked_and_why_it_was_missed():
    item = papers.load_figure("eye_error")
    told = {"eye_error": item.targets(found_of(item, off=.01)), "films": []}
    rows = claim_rows(page.claims_section(told, {("eye_error", "B2.8"): "Fewer <fragments>."}, {"films": ["teapot_box: skipped: no <file>"]}))
    assert len(rows) == len(claims.CLAIMS)
    assert "stage, every pixel over blocks: 1 (≥ 21)" in rows["B2.8"] and ">missed<" in rows["B2.8"] and "Fewer &lt;fragments&gt;." in rows["B2.8"]
    assert "missed in 3 of 9" in rows["B2.5"] and "#eye_error" in rows["B2.5"]
    assert "error at thresholds of 0: 1&nbsp;% (≤ 0.001&nbsp;%)<br>" in rows["B2.5"]
    assert "not measured" in rows["B2.10"] and "skipped: no &lt;file&gt;" in rows["B2.10"]
    assert "not redrawn" in rows["B5.3"] and "cannot be redrawn" in rows["B5.3"] and "–" in rows["B5.3"]
    assert "not measured" in rows["B5.5"] and "Test" not in rows["B5.5"]


def test_sizes_that_were_divided_are_said():
    assert "say nothing" in page.page("", [], [], shrunk=True)


def test_bars_are_drawn_from_zero_and_gaps_left_out():
    from harness.bench import plots
    item = Figure("f", "", "", None, None)
    panel = Panel("Title", "", "y", (Line("ours", ((0, 2.0), (1, None))),
                                     Line("paper", ((1, 3.0),), paper=True)), names=("one", "two"))
    text = panels.drawing(plots.load(), [panel], item.title, "salt")
    assert text.startswith("<svg") and "one" in text and "Title" in text and 'id="salt-' in text
    assert panels.drawn(panel.lines[0]) == [(0, 2.0)]


# --- explanations ---------------------------------------------------------------------------

def test_explanations_are_sentences_by_figure_and_id():
    text = "# how\n\ntree B2.6: Leaves: too few.\ncost pixels: Linear.\n"
    assert explain.parsed(text) == {("tree", "B2.6"): "Leaves: too few.", ("cost", "pixels"): "Linear."}
    for wrong in ("tree: x", "tree B2.6 x", "tree B2.6: ", "tree B2.6: a\ntree B2.6: b"):
        with pytest.raises(ValueError, match="explanations.txt:"):
            explain.parsed(wrong)


def test_the_explanations_that_are_kept_belong_to_something():
    known = {(name, t.id) for name in papers.FIGURES
             for t in papers.load_figure(name).targets(found_of(papers.load_figure(name)))}
    assert set(explain.load()) <= known


# --- the command line -----------------------------------------------------------------------

@pytest.mark.parametrize("words, said", [
    (["--figures", "tree,nothing"], "nothing: must be all or of fly_through"), (["--figures", ""], "must be all or of"),
    (["--figures", "box.glb"], "box.glb: must be all or of"), (["--figures", "tree", "--runs", "0"], "--runs: 0: must be a number"),
    (["--figures", "tree", "--shrink", "x"], "--shrink: x: must be"), (["--figures", "tree", "box.glb"], "box.glb does not go with --figures"),
    (["--figures", "tree", "--technique", "rsm"], "--technique does not go with --figures"),
    (["--figures", "tree", "--size=64x64"], "--size=64x64 does not go with --figures"),
    (["--figures", "tree", "--scenes", "no/folder"], "--scenes no/folder: no such folder"), (["--figures"], "--figures needs --scenes DIR")])
def test_a_mistake_is_one_line(words, said, tmp_path, capsys):
    scenes_of = ["--scenes", str(tmp_path)] if words != ["--figures"] and "--scenes" not in words else []
    with pytest.raises(SystemExit) as fault:
        options.parse([*words, *scenes_of])
    text = capsys.readouterr().err
    assert fault.value.code == 2 and text.startswith("bounce bench: ") and text.count("\n") == 1 and said in text


def test_options_arrive(tmp_path):
    asked = options.parse(["--figures", "all", "--scenes", str(tmp_path), "--shrink", "4"])
    assert asked.figures == papers.FIGURES and asked.shrink == 4 and asked.runs == options.ROUNDS
    assert options.parse(["--figures=cost,tree", "--scenes", str(tmp_path)]).figures == ("cost", "tree")
    assert options.parse(["--figures", "--scenes", str(tmp_path)]).figures == papers.FIGURES
    assert options.wanted(["--figures=tree"]) and not options.wanted(["box.glb", "--title", "figures"])


def test_bench_tells_of_figures_and_keeps_to_scenes_of_its_own(capsys):
    with pytest.raises(SystemExit):
        bench_options.parse(["--help"])
    assert "--figures" in capsys.readouterr().out
    with pytest.raises(SystemExit) as fault:
        bench_options.parse(["--scenes", "."])
    assert fault.value.code == 2 and capsys.readouterr().err == "bounce bench: --scenes goes with --figures alone\n"


def test_what_was_typed_is_kept_without_folders():
    words = ["--figures", "all", "--scenes", "/a b/scenes", "--title=x y", "-o", "/somewhere/papers"]
    asked = argparse.Namespace(scenes=Path("/a b/scenes"), output=Path("/somewhere/papers"))
    assert command.shown(asked, words) == "bounce bench --figures all --scenes $S '--title=x y' -o papers"
    assert command.shown(asked, ["--figures", "--scenes=/a b/scenes"]) == "bounce bench --figures --scenes=$S"
