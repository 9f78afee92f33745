"""What is made from a result: answers, tables, CSV, and a page that needs nothing beside it."""
import csv
import html.parser
import json
import re
import xml.etree.ElementTree

import numpy
import pytest

from harness.bench import figures, options, plots, rungs, store, summary, thumbs
from harness.bench.compare import headline, over_seeds
from harness.bench.page import page, scene_section
from harness.techniques import Model, Technique
from made_up import point, result

pytest.importorskip("matplotlib")

EMPTY = {"area", "base", "br", "col", "hr", "img", "input", "link", "meta", "source"}


# --- answers --------------------------------------------------------------------------------

def test_advice_names_the_technique_its_cost_and_what_stops_the_others():
    said = summary.advice(result(), "box")
    assert said.startswith("For 2 % error use exact (near spp=256): 5.12 s a frame.")
    assert "The model of quick alone is 12 % off, most of it bounces 2 to 4; quick comes down" in said


def test_advice_where_nothing_is_good_enough():
    made = result()
    made["points"] = [p for p in made["points"] if p["technique"] == "quick"]
    assert "Nothing measured here reaches 2 % error; quick comes closest with 12 %" in \
        summary.advice(made, "box")
    made["points"] = []
    assert summary.advice(made, "box") == "Nothing could be measured."


def test_a_reference_that_stopped_early_is_extrapolated_and_nothing_else_is():
    made = result()
    made["points"] = [p for p in made["points"] if p["settings"] in ({"spp": "1"}, {"n": "1"})]
    cells = {r["technique"]: r["cells"] for r in summary.equal_error(made, "box", "full", "beauty")}
    # 32 % in 20 ms: a sixteenth of it, at 2 %, takes 256 times as long.
    assert cells["exact"][1]["ms"] is None
    assert cells["exact"][1]["text"] == "≈ 5.12 s (not measured)"
    assert "≈" not in "".join(c["text"] for c in cells["quick"])
    made["points"] = made["points"][1:]
    assert "would take about 5.12 s" in summary.advice(made, "box")


def test_equal_error_says_floor_best_or_time():
    rows = {r["technique"]: r["cells"] for r in
            summary.equal_error(result(), "box", "full", "beauty")}
    assert [c["text"] for c in rows["quick"]][:4] == ["not reached (floor 12 %)"] * 4
    assert [round(c["ms"]) for c in rows["exact"]] == [20480, 5120, 819, 205, 51]
    model = {r["technique"]: r["cells"] for r in
             summary.equal_error(result(), "box", "model", "beauty")}
    assert [c["text"] for c in model["quick"]] == ["200 ms", "100 ms", "40 ms", "20 ms", "≤ 10 ms"]
    made = result()
    made["points"] = made["points"][:3]
    cells = summary.equal_error(made, "box", "model", "beauty")[0]["cells"]
    assert cells[0]["text"] == "not reached (best 5 %)"


def test_an_error_below_the_noise_is_shown_at_its_upper_end():
    assert summary.plotted({"value": 0.0, "high": 0.003}) == 0.003
    assert summary.plotted({"value": 0.02, "high": 0.03}) == 0.02
    assert summary.plotted({"value": 0.0, "high": 0.0}) == summary.EXACT
    assert summary.plotted({"value": None, "high": None}) is None


@pytest.mark.filterwarnings("error")
def test_no_error_at_all_is_reached_at_once_and_drawn_nowhere():
    made = result()
    for p in made["points"]:
        if p["technique"] == "quick" and p["state"] == "done":
            p["error"]["model"]["indirect"].update(value=0.0, low=0.0, high=0.0)
    cells = summary.equal_error(made, "box", "model", "indirect")[0]["cells"]
    assert [c["text"] for c in cells] == ["≤ 10 ms"] * 5
    made["points"] = [p for p in made["points"] if p["technique"] == "quick"]
    assert ("curve", "model", "indirect") not in figures.svgs(plots.load(), made, "box", "s")


def test_an_unknown_error_is_no_point_of_a_curve():
    made = result()
    for layers in made["points"][0]["error"].values():
        for error in layers.values():
            error.update(value=None, low=None, high=None)
    assert len(summary.curve(made, "box", "quick")) == 5
    assert summary.summarize(made) and not [w for w in summary.warnings(made) if "noise" in w]


def test_noise_above_a_tenth_of_the_error_is_said():
    made = result()
    assert not [line for line in summary.warnings(made) if "noise" in line]
    made["points"].append(point("exact", "spp=9", 10, 0.02, 0.02, noise=0.0021))
    lines = [line for line in summary.warnings(made) if "noise" in line]
    assert len(lines) == 2 and "exact spp=9" in lines[0]  # beauty against full and against model
    assert any("failed: n=0" in line for line in summary.warnings(made))


# --- figures of compare ---------------------------------------------------------------------

def test_headline_of_compare():
    figures_of = {"rel_rmse": {"value": 0.03, "low": 0.02, "high": 0.04},
                  "signed_error": {"value": -0.01}, "noise_floor": {"value": 0.001}}
    error = headline(figures_of)
    assert (error["value"], error["low"], error["high"]) == (0.03, 0.02, 0.04)
    assert (error["signed"], error["noise"]) == (-0.01, 0.001)


def test_seeds_are_joined_by_their_mean_square():
    each = [{"value": v, "low": v - 1, "high": v + 1, "signed": s, "noise": 0}
            for v, s in ((3, 1), (4, -2))]
    joined = over_seeds(each)
    assert joined["value"] == pytest.approx((12.5) ** 0.5)
    assert (joined["low"], joined["high"], joined["signed"]) == (2, 5, -0.5)
    assert over_seeds(each[:1]) is each[0]


# --- the ladder of models -------------------------------------------------------------------

def technique(**model):
    return Technique("some", "", Model(**model), {}, (), 0, 0, "", False, False)


def test_rungs_follow_from_the_model():
    one = technique(indirect_bounces=1, lights=frozenset(["punctual"]))
    names, settings = zip(*rungs.rungs_of(one))
    assert names[1:4] == ("bounces beyond 4", "bounces 2 to 4", "occlusion of indirect light")
    assert settings[0] == {} and settings[3] == {"bounces": "1", "indirect_visibility": "off"}
    assert settings[4]["lights"] == "punctual" and settings[-1] == {"model_of": "some"}
    none = technique(lights=frozenset(["punctual", "emissive", "environment"]))
    assert not any("indirect_visibility" in s for _, s in rungs.rungs_of(none))
    assert len(rungs.rungs_of(technique(indirect_bounces=rungs.UNLIMITED, indirect_visibility=True,
                                        lights=none.model.lights))) == 2


def planes(rng, mean, noise, shape=(24, 24)):
    made = {}
    for half in ("half_a", "half_b"):
        for channel in "RGB":
            made[f"{half}.{channel}"] = mean + noise * rng.standard_normal(shape)
    return made


def test_steps_lose_the_noise_of_references_and_their_gram_matrix_adds_up():
    rng = numpy.random.default_rng(3)
    across = numpy.linspace(-1, 1, 24)[None, :] * numpy.ones((24, 1))
    full, limit = 1 + 0 * across, 0.9 + 0.1 * across
    drawn = limit + 0.05 * across
    picture = {channel: drawn for channel in "RGB"}
    found = rungs.decomposition(["model", "settings"], [planes(rng, full, 0.1),
                                                       planes(rng, limit, 0.1)], picture, "beauty")
    model, settings = found["steps"]
    truth = float(numpy.sqrt(((limit - full) ** 2).mean()))
    assert model["rel_rmse"] == pytest.approx(truth, rel=0.05) == found["floor"]
    assert model["signed"] == pytest.approx(-0.1, abs=0.01)
    assert settings["rel_rmse"] == pytest.approx(0.05 * float(numpy.sqrt((across ** 2).mean())),
                                                 rel=0.1)
    whole = float(numpy.sqrt(((drawn - full) ** 2).mean()))
    assert found["total"] == pytest.approx(whole, rel=0.05)
    assert found["total"] ** 2 == pytest.approx(numpy.array(found["gram"]).sum())
    black = planes(rng, 0 * across, 0)
    assert rungs.decomposition(["a", "b"], [black, black], picture, "beauty") is None


# --- files ----------------------------------------------------------------------------------

def test_csv_has_a_row_for_each_reference_and_layer(tmp_path):
    kept = store.Store(tmp_path, {})
    kept.result.update(result())
    kept.save()
    with open(tmp_path / "bench.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == store.COLUMNS
    assert len(rows) == 12 * 4 + 1
    assert rows[0]["settings"] == "n=1" and float(rows[0]["frame_ms"]) == 10
    assert {(r["against"], r["layer"]) for r in rows[:4]} == \
        {(a, layer) for a in ("full", "model") for layer in ("beauty", "indirect")}
    assert rows[-1]["state"] == "failed" and rows[-1]["fault"] == "n=0: <too few>"


def test_json_has_no_number_that_json_does_not_know(tmp_path):
    kept = store.Store(tmp_path, {"title": float("nan")})
    kept.result["points"] = [{"key": "a", "state": "failed", "fault": "", "scene": "s",
                              "technique": "t", "settings": {}, "pictures": [], "x": [float("inf")]}]
    kept.save()
    read = json.loads((tmp_path / "bench.json").read_text())
    assert read["title"] is None and read["points"][0]["x"] == [None]


def test_only_finished_points_with_their_pictures_are_taken_over(tmp_path):
    kept = store.Store(tmp_path, {})
    kept.result.update(result())
    kept.result["points"][0]["pictures"] = ["gone.exr"]
    kept.save()
    again = store.Store(tmp_path, {})
    keys = [p["key"] for p in result()["points"]]
    taken = [key for key in keys if again.taken_over(key)]
    assert taken == keys[1:-1]
    (tmp_path / "pictures" / "gone.exr").touch()
    assert again.taken_over(keys[0])


# --- the page -------------------------------------------------------------------------------

class Checker(html.parser.HTMLParser):
    """Tags in balance, no script, nothing fetched."""

    def __init__(self):
        super().__init__()
        self.open, self.seen, self.ids = [], set(), []

    def handle_starttag(self, tag, attrs):
        self.handle_startendtag(tag, attrs)
        if tag not in EMPTY:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.seen.add(tag)
        for key, value in attrs:
            if key in ("src", "href", "xlink:href", "srcset", "data", "poster"):
                assert value.startswith(("#", "data:")), (tag, key, value)
            if key == "id":
                self.ids.append(value)
            assert not key.startswith("on"), (tag, key)

    def handle_endtag(self, tag):
        assert self.open and self.open.pop() == tag, (tag, self.getpos())


def made_page():
    made = result()
    pyplot = plots.load()
    picture = thumbs.jpeg_uri(numpy.ones((4, 4, 3)), (0.5, 1.0))
    sections = [scene_section(made, scene, figures.svgs(pyplot, made, scene["name"], "s0"),
                              [(picture, "reference", "full <reference>", "64 samples", "")])
                for scene in made["scenes"]]
    return page(made, sections)


def test_the_page_parses_and_fetches_nothing():
    text = made_page()
    checker = Checker()
    checker.feed(text)
    checker.close()
    assert checker.open == []
    assert {"svg", "table", "img", "details"} <= checker.seen and "script" not in checker.seen
    assert not re.search(r"@import|url\((?!#)", text)
    # Figures lie in one document: an id that two of them had would show one's clip in the other.
    assert len(checker.ids) == len(set(checker.ids))
    used = set(re.findall(r'(?:xlink:href="#|url\(#)([^")]+)', text))
    assert used <= set(checker.ids)
    assert "full &lt;reference&gt;" in text and "n=0: &lt;too few&gt;" in text


def test_small_errors_have_their_digits_on_the_axis():
    pyplot = plots.load()
    figure, axes = pyplot.subplots()
    axes.set_yscale("log")
    axes.set_ylim(1e-5, 1e-3)
    plots.logarithmic(axes.yaxis, (1, 5))
    plots.percents(axes.yaxis)
    said = re.findall(r">([\d.]+ %)<", plots.svg(pyplot, figure, "salt", "errors"))
    assert "0.005 %" in said and len(said) == len(set(said)) > 2


def test_the_overview_is_a_picture_of_every_scene(tmp_path):
    made = result()
    made["scenes"] += [{**made["scenes"][0], "name": name} for name in ("hall", "empty")]
    made["points"].append(point("quick", "n=1", 5, 0.3, 0.2, scene="hall"))
    plots.overview(plots.load(), made, tmp_path / "bench.svg")
    root = xml.etree.ElementTree.parse(tmp_path / "bench.svg").getroot()
    texts = {"".join(item.itertext()).strip() for item in root.iter()
             if item.tag.endswith("}text")}
    assert {"box", "hall", "quick", "exact", "spp=1024"} <= texts and "empty" not in texts
    made["points"] = []
    plots.overview(plots.load(), made, tmp_path / "nothing.svg")
    assert not (tmp_path / "nothing.svg").exists()


def test_pictures_end_at_white_and_show_what_is_no_number():
    row = numpy.array([[[0.0, 0, 0], [4, 4, 4], [9, 9, 9], [numpy.nan, 0, 0]]])
    shown = thumbs.displayed(row, (1.0, 4.0))[0]
    assert shown == pytest.approx(numpy.array([[0, 0, 0], [1, 1, 1], [1, 1, 1], [1, 0, 1]]))
    grey = numpy.full((8, 8, 3), 50.0)
    factor, white = thumbs.exposure_of(grey)
    assert (factor * 50, white) == pytest.approx((thumbs.KEY, 1))
    assert thumbs.exposure_of(numpy.zeros((2, 2, 3))) == (1, 1)


def test_percents_have_two_digits():
    shown = [summary.percent(e) for e in (1e-7, 0.00123, 0.0987, 0.123, 1.5)]
    assert shown == ["0 %", "0.12 %", "9.9 %", "12 %", "150 %"]
    assert summary.percent(-0.05, "+") == "-5 %" and summary.percent(0.2, "+") == "+20 %"


# --- the command line -----------------------------------------------------------------------

@pytest.mark.parametrize("words", [
    ["--size", "12"], ["--ladder", "rsm"], ["--ladder", "rsm:vpls"], ["--ladder", "rsm:=1"],
    ["--set", "brdf"], ["--runs", "0"], ["--reference-spp", "3"], ["--reference-error", "x"],
    ["/no/such.glb"], ["--reference-spp", "4", "--reference-error", "1"]])
def test_mistakes_are_refused(words, capsys):
    with pytest.raises(SystemExit) as fault:
        options.parse(words)
    assert fault.value.code == 2 and words[0].lstrip("-") in capsys.readouterr().err


def test_options_arrive():
    asked = options.parse(["--ladder", "rsm:vpls=4,16", "--set", "brdf=lambert", "--size", "8x9",
                           "--seed", "5", "--reference-error", "0.5"])
    assert asked.ladders == {"rsm": ({"vpls": "4"}, {"vpls": "16"})}
    assert asked.settings == {"brdf": "lambert"} and asked.size == (8, 9) and asked.seeds == [5]
    assert asked.scenes[0].name == "cornell.glb"
