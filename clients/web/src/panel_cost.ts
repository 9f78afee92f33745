// What the last frame cost: a bar for each pass, what was reused, what was left out and why.

import { type Report } from "../gen/bounced_pb";
import { el } from "./dom";
import { figure, milliseconds, plural } from "./format";

export interface Bar {
  readonly name: string;
  readonly ms: number;
  readonly state: string; // ran | reused | planned, or "rest" for what is no pass
}

// Passes as they ran, then what a frame costs beside them.
export function barsOf(report: Report): Bar[] {
  const passes = report.passes.map(({ name, ms, state }) => ({ name, ms, state }));
  const named = new Set(passes.map((pass) => pass.name));
  const rest = (["load", "compile", "check", "readback", "encode"] as const)
    .filter((name) => !named.has(name))
    .map((name) => ({ name, ms: report.timeMs?.[name] ?? 0, state: "rest" }))
    .filter((bar) => bar.ms >= 0.05);
  return [...passes, ...rest];
}

interface Row {
  readonly element: HTMLElement;
  readonly fill: HTMLElement;
  readonly text: HTMLElement;
}

export class CostPanel {
  private readonly total = el("p", { class: "headline" });
  private readonly bars = el("ul", { class: "bars", "aria-label": "Time of each pass" });
  private readonly omitted = el("ul", { class: "omitted" });
  private readonly flags = el("ul", { class: "flags" });
  private readonly counts = el("p", { class: "note" });
  private readonly rows = new Map<string, Row>();
  private order = "";

  constructor(root: HTMLElement) {
    const left = el("div", { class: "left-out" }, el("h3", {}, "Left out"), this.omitted);
    left.hidden = true;
    root.append(this.total, this.bars, left, this.flags, this.counts);
  }

  show(report: Report): void {
    const bars = barsOf(report);
    const reused = bars.filter((bar) => bar.state === "reused").length;
    const { total = 0 } = report.timeMs ?? {};
    this.total.replaceChildren(
      el("strong", {}, milliseconds(total)),
      reused > 0 ? ` · ${plural(reused, "pass", "passes")} reused` : "",
    );
    this.draw(bars);
    this.lists(report);
    const { vpls = 0n, triangles = 0n, fragments = 0n } = report.counts ?? {};
    const parts = [plural(Number(triangles), "triangle")];
    if (vpls) parts.push(plural(Number(vpls), "virtual light"));
    if (fragments) parts.push(plural(Number(fragments), "block"));
    if (report.memoryMib) parts.push(`${figure(report.memoryMib.gpu)} MiB`);
    this.counts.textContent = parts.join(" · ");
  }

  private draw(bars: Bar[]): void {
    const most = Math.max(1e-3, ...bars.filter((bar) => bar.state !== "reused").map((bar) => bar.ms));
    const order = bars.map((bar) => bar.name).join(" ");
    if (order !== this.order) this.bars.replaceChildren(...bars.map((bar) => this.row(bar.name).element));
    this.order = order;
    for (const bar of bars) {
      const row = this.row(bar.name);
      const isReused = bar.state === "reused";
      row.element.dataset["state"] = bar.state;
      row.fill.style.width = `${isReused ? 0 : Math.min(100, (100 * bar.ms) / most)}%`;
      row.text.textContent = isReused ? "reused" : milliseconds(bar.ms);
    }
  }

  private row(name: string): Row {
    const held = this.rows.get(name);
    if (held) return held;
    const fill = el("span", { class: "fill" });
    const text = el("span", { class: "ms" });
    const element = el("li", {}, el("span", { class: "name" }, name), el("span", { class: "track" }, fill), text);
    const row = { element, fill, text };
    this.rows.set(name, row);
    return row;
  }

  private lists(report: Report): void {
    this.omitted.replaceChildren(...report.omitted.map(({ pass, reason }) =>
      el("li", {}, el("b", {}, pass), ` ${reason}`)));
    this.omitted.parentElement!.hidden = report.omitted.length === 0;
    this.flags.replaceChildren(...report.flags.map((flag) => el("li", {}, flag)));
    this.flags.hidden = report.flags.length === 0;
  }
}
