// How far the picture is refined: over the picture, and read out at its end. How many steps there
// will be, the server itself does not know: it stops where a step would take too long.

import { byId, set } from "./dom";
import { plural } from "./format";
import { type Shown } from "./view";

const TICK_MS = 500;

export interface Stand {
  readonly step: number;
  readonly samples: number; // a pixel
  readonly isFinal: boolean;
  readonly sinceMs: number; // since that step was shown
}

export function wordsOf({ step, samples, isFinal, sinceMs }: Stand): string {
  const edges = samples > 1 ? `, ${samples} samples a pixel` : "";
  if (isFinal) return `Finished after ${plural(step + 1, "step")}${edges}`;
  // What comes soon is not waited for by anybody.
  const since = sinceMs >= 2000 ? `, ${Math.floor(sinceMs / 1000)} s on the next` : "";
  return `Refining: step ${step + 1}${edges}${since}`;
}

export class Progress {
  private readonly root = byId("refining");
  private readonly bar = byId<HTMLProgressElement>("refining-bar");
  private readonly text = byId("refining-text");
  private shown: Shown | null = null;
  private askedMs: number | null = null; // when something was asked for that is not shown yet

  constructor() {
    setInterval(() => this.draw(), TICK_MS);
  }

  // Another picture is asked for.
  ask(): void {
    this.askedMs ??= performance.now();
    this.draw();
  }

  show(shown: Shown | null): void {
    this.shown = shown;
    if (!shown || shown.isCurrent) this.askedMs = null;
    this.draw();
  }

  private get words(): string {
    const { shown, askedMs } = this;
    if (askedMs !== null) {
      const waitedMs = performance.now() - askedMs;
      return waitedMs >= 2000 ? `Rendering, ${Math.floor(waitedMs / 1000)} s` : "Rendering";
    }
    if (!shown) return "";
    const { step, final } = shown.frame;
    return wordsOf({ step, samples: shown.report?.aa ?? 1, isFinal: final, sinceMs: performance.now() - shown.atMs });
  }

  private draw(): void {
    const isDone = this.askedMs === null && (this.shown?.frame.final ?? true);
    const { words } = this;
    this.root.hidden = words === "";
    this.root.title = isDone ? (this.shown?.frame.whyFinal ?? "") : "";
    this.root.dataset["state"] = isDone ? "done" : "busy";
    if (this.text.textContent !== words) this.text.textContent = words;
    set(this.bar, { value: isDone ? 1 : null });
  }
}
