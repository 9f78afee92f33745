// The plot of plot.ts, drawn, and the switch that has the error measured.

import { type ReportError } from "../gen/bounced_pb";
import { el, field, options, set, svg } from "./dom";
import { figure, milliseconds, percent } from "./format";
import { type Axis, type Sample, type Series, evenAxis, logAxis } from "./plot";
import { type Settings } from "./settings";

// Right of the curves is room for half of the last label.
const [WIDTH, HEIGHT, LEFT, BOTTOM, TOP, RIGHT] = [300, 132, 40, 18, 8, 18];

export class ErrorPanel {
  private readonly headline = el("p", { class: "headline" });
  private readonly figure = svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, class: "plot", role: "img" });

  constructor(root: HTMLElement, settings: Settings, onChange: () => void) {
    const measure = el("input", { type: "checkbox" });
    measure.checked = settings.measure;
    const against = el("select", {});
    options(against, [["full", "all of the light"], ["model", "its own model"]]);
    against.value = settings.against;
    const change = () => {
      settings.measure = measure.checked;
      settings.against = against.value;
      onChange();
    };
    measure.addEventListener("change", change);
    against.addEventListener("change", change);
    root.append(this.headline, this.figure,
      field("Measure error", measure, "Traces some pixels of each better picture: it costs time"),
      field("Against", against, "What the technique's model leaves out counts only against all of the light"));
    this.show({ unit: "ms", samples: [] }, undefined);
  }

  show(series: Series, error: ReportError | undefined): void {
    this.headline.replaceChildren(...this.words(series, error));
    const name = series.unit === "error" ? "Error" : "Time of the frame";
    set(this.figure, { "aria-label": `${name} against seconds since the last change` });
    if (series.samples.length === 0) {
      this.figure.replaceChildren();
      return;
    }
    const values = series.samples.flatMap(({ value, low, high }) => [value, low ?? value, high ?? value]);
    const x = evenAxis(Math.max(...series.samples.map((sample) => sample.seconds)));
    const y = logAxis(values);
    this.figure.replaceChildren(...axes(x, y, series.unit), ...curve(series.samples, x, y));
  }

  private words(series: Series, error: ReportError | undefined): (Node | string)[] {
    const last = series.samples.at(-1);
    if (!last) return [el("span", { class: "note" }, "No frame yet")];
    if (series.unit === "ms") return [el("strong", {}, milliseconds(last.value)), " for this step"];
    const interval = last.low !== null && last.high !== null ? ` (${percent(last.low)} – ${percent(last.high)})` : "";
    const from = error ? `, ${error.samples} pixels traced` : "";
    return [el("strong", {}, percent(last.value)), `${interval}${from}`];
  }
}

const placeX = (x: Axis, seconds: number) => LEFT + ((WIDTH - LEFT - RIGHT) * (seconds - x.least)) / (x.most - x.least);

function placeY(y: Axis, value: number): number {
  const share = Math.log(value / y.least) / Math.log(y.most / y.least);
  return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * share;
}

function axes(x: Axis, y: Axis, unit: Series["unit"]): SVGElement[] {
  const label = (value: number) => (unit === "error" ? percent(value) : milliseconds(value));
  const rows = y.ticks.flatMap((tick) => {
    const at = placeY(y, tick).toFixed(1);
    return [
      svg("line", { x1: LEFT, x2: WIDTH - RIGHT, y1: at, y2: at, class: "grid" }),
      svg("text", { x: LEFT - 5, y: at, class: "tick y" }, label(tick)),
    ];
  });
  const columns = x.ticks.map((tick) =>
    svg("text", { x: placeX(x, tick).toFixed(1), y: HEIGHT - 5, class: "tick x" }, `${figure(tick)} s`));
  return [...rows, ...columns];
}

function curve(samples: readonly Sample[], x: Axis, y: Axis): SVGElement[] {
  const point = (seconds: number, value: number) => `${placeX(x, seconds).toFixed(1)} ${placeY(y, value).toFixed(1)}`;
  const banded = samples.filter((sample) => sample.low !== null && sample.high !== null);
  const upper = banded.map((sample) => point(sample.seconds, sample.high!));
  const lower = banded.map((sample) => point(sample.seconds, sample.low!)).reverse();
  const band = svg("path", { d: banded.length > 1 ? `M${[...upper, ...lower].join("L")}Z` : "", class: "band" });
  const bars = banded.length > 1 ? [] : banded.map((sample) =>
    svg("path", { d: `M${point(sample.seconds, sample.low!)}L${point(sample.seconds, sample.high!)}`, class: "bar" }));
  const line = svg("path", { d: `M${samples.map((s) => point(s.seconds, s.value)).join("L")}`, class: "line" });
  const dots = samples.slice(-60).map((s) =>
    svg("circle", { cx: placeX(x, s.seconds).toFixed(1), cy: placeY(y, s.value).toFixed(1), r: 2, class: "dot" }));
  return [band, ...bars, line, ...dots];
}
