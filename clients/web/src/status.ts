// The line below the picture: connection, frame, its age, credits, device.

import { type State } from "./connection";
import { byId } from "./dom";
import { milliseconds } from "./format";
import { CREDITS, type Shown } from "./view";

export class Status {
  private readonly connection = byId("connection");
  private readonly retry = byId<HTMLButtonElement>("retry");
  private readonly frame = byId("frame");
  private readonly device = byId("device");
  private state: State = { kind: "connecting" };
  private shown: Shown | null = null;

  constructor(onRetry: () => void) {
    this.retry.addEventListener("click", onRetry);
    setInterval(() => this.tick(), 500);
  }

  setState(state: State): void {
    this.state = state;
    if (state.kind === "open") this.setDevice(state.device?.name ?? "", state.device?.class ?? "");
    this.tick();
  }

  setShown(shown: Shown | null): void {
    this.shown = shown;
    this.drawFrame();
  }

  private setDevice(name: string, kind: string): void {
    this.device.textContent = kind || name;
    this.device.title = name;
  }

  private tick(): void {
    const text = this.connectionText();
    this.connection.dataset["state"] = this.state.kind;
    // Only said again when it changed: it is read out.
    if (this.connection.textContent !== text) this.connection.textContent = text;
    this.retry.hidden = this.state.kind !== "waiting";
    this.drawFrame();
  }

  private connectionText(): string {
    switch (this.state.kind) {
      case "open":
        return "Connected";
      case "connecting":
        return "Connecting";
      case "unauthorized":
        return "A token is needed";
      case "waiting":
        return "Disconnected, trying again";
    }
  }

  private drawFrame(): void {
    const shown = this.shown;
    if (!shown) {
      this.frame.textContent = "";
      return;
    }
    const { frame, report } = shown;
    // How old the picture on the screen is: a final one does not age, nothing newer is known.
    const since = frame.final ? 0 : performance.now() - shown.atMs;
    const size = report?.size.length === 2 ? `${report.size[0]} × ${report.size[1]}` : "";
    const revision = report ? `revision ${report.revision}${frame.transient ? ` + ${frame.transient}` : ""}` : "";
    const step = frame.final ? `final, step ${frame.step}` : `step ${frame.step}`;
    const latency = shown.latencyMs === null ? "" : ` (${milliseconds(shown.latencyMs)} from input)`;
    const age = `age ${milliseconds(frame.ageMs + since)}${latency}`;
    const credits = `credits ${frame.credits} of ${CREDITS}`;
    this.frame.textContent = [size, revision, step, age, credits].filter(Boolean).join("  ·  ");
  }
}
