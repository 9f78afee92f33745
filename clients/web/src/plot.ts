// Error, or time, of the picture on the screen against the seconds since it last changed.

import { type Report } from "../gen/bounced_pb";

export interface Sample {
  readonly seconds: number; // since the change
  readonly value: number; // share, or milliseconds
  readonly low: number | null; // of the 95 % interval
  readonly high: number | null;
}

export interface Series {
  readonly unit: "error" | "ms";
  readonly samples: readonly Sample[];
}

export const empty: Series = { unit: "ms", samples: [] };

const SAMPLES_MOST = 400;

// The series with one more frame in it. A figure of another kind begins a new one: once the error
// is measured, times say nothing beside it.
export function grown(series: Series, report: Report, seconds: number): Series {
  const error = report.error[0];
  const finite = (x: number) => (Number.isFinite(x) && x > 0 ? x : null);
  const sample: Sample = error
    ? { seconds, value: error.value, low: finite(error.low), high: finite(error.high) }
    : { seconds, value: report.timeMs?.total ?? 0, low: null, high: null };
  if (!(sample.value > 0)) return series;
  const unit = error ? "error" : "ms";
  if (series.unit === "error" && unit === "ms") return series;
  const held = series.unit === unit ? series.samples : [];
  return { unit, samples: [...held, sample].slice(-SAMPLES_MOST) };
}

export interface Axis {
  readonly least: number;
  readonly most: number;
  readonly ticks: readonly number[];
}

// Of a logarithmic axis that holds all of `values`: whole decades and their 2 and 5, few enough.
export function logAxis(values: readonly number[]): Axis {
  const least = Math.min(...values) / 1.25;
  const most = Math.max(...values) * 1.25;
  const all: number[] = [];
  for (let e = Math.floor(Math.log10(least)); e <= Math.ceil(Math.log10(most)); e++)
    for (const m of [1, 2, 5]) all.push(Number(`${m}e${e}`));
  const inside = all.filter((tick) => tick >= least && tick <= most);
  const decades = inside.filter((tick) => String(tick.toExponential())[0] === "1");
  const ticks = inside.length > 4 && decades.length >= 2 ? decades : inside;
  return { least, most, ticks: ticks.length > 5 ? ticks.filter((_, i) => i % 2 === 0) : ticks };
}

// Of an even axis from 0: three or four round steps.
export function evenAxis(most: number): Axis {
  const top = Math.max(most, 0.1);
  const rough = top / 3;
  const size = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((m) => m * size).find((s) => s >= rough) ?? rough;
  const ticks: number[] = [];
  for (let t = 0; t <= top * 1.0001; t += step) ticks.push(Number(t.toPrecision(6)));
  return { least: 0, most: top, ticks };
}
