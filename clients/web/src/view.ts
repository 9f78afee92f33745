// One view of one scene, kept open: what is asked of it, its frames, their credits.
//
// Latest wins on both sides: what changes while two updates are under way is sent as one when the
// first of them is answered, and a frame is credited when it was shown, so that a slow page gets
// fewer of them and never old ones. While the page is hidden nothing is credited.

import { type Report, type ViewFrame } from "../gen/bounced_pb";
import { type Connection, type Event, Lost, Refusal } from "./connection";
import { type FrameInit } from "./frame_request";
import { type Orbit, lookOf, poseOf } from "./orbit";
import { type Picture } from "./picture";

export const CREDITS = 2;
const UPDATES_MOST = 2;
const SENT_KEPT = 64;

export interface Wanted {
  readonly scene: string;
  readonly frame: FrameInit; // compared by identity: a new object is a new request
  readonly orbit: Orbit;
  readonly camera: string | null; // the scene's that the orbit is, if it is one
}

export interface Shown {
  readonly frame: ViewFrame;
  readonly report: Report | undefined;
  readonly orbit: Orbit; // that it was asked for with
  readonly atMs: number; // performance.now()
  readonly latencyMs: number | null; // from the update that it shows to the screen
  readonly isCurrent: boolean; // it shows the last update
  readonly bytes: number;
}

interface Sent {
  readonly orbit: Orbit;
  readonly atMs: number;
}

export class View {
  private wanted: Wanted | null = null;
  private sent: Wanted | null = null;
  private readonly bySequence = new Map<bigint, Sent>();
  private sequence = 0n; // of the next update
  private latest = -1n; // sequence that a frame has shown
  private request = 0n; // id of the ViewOpen
  private id: number | null = null; // of the view; null until it is open
  private isOpening = false;
  private underWay = 0;
  private owed = 0; // credits held back while the page is hidden
  private drawing: Promise<void> = Promise.resolve();
  private orbit: Orbit | null = null;

  constructor(
    private readonly connection: Connection,
    private readonly picture: Picture,
    private readonly onShown: (shown: Shown) => void,
    private readonly onFault: (message: string) => void,
  ) {
    connection.onOpen((isSame) => this.onOpen(isSame));
    document.addEventListener("visibilitychange", () => this.payOwed());
  }

  want(wanted: Wanted): void {
    const isOther = this.wanted?.scene !== wanted.scene;
    this.wanted = wanted;
    if (isOther && this.id !== null) this.close();
    this.sync();
  }

  none(): void {
    this.wanted = null;
    if (this.id !== null) this.close();
    this.picture.clear();
  }

  // A session that goes on has the view still, with all of its credits: it is told everything anew.
  private onOpen(isSame: boolean): void {
    if (isSame && this.isOpening) this.cancelOpening();
    if (!isSame) this.forget();
    this.underWay = 0;
    this.owed = 0;
    this.sent = null;
    this.sync();
  }

  // It may have been opened, and the answer lost.
  private cancelOpening(): void {
    const value = { requestId: this.request };
    this.connection.request("done", { case: "cancel", value }, { isBound: true }).catch(() => {});
    this.forget();
  }

  private forget(): void {
    this.connection.forget(this.request);
    this.id = null;
    this.isOpening = false;
    this.underWay = 0;
    this.owed = 0;
    this.sent = null;
  }

  private close(): void {
    const value = { view: this.id! };
    this.connection.request("done", { case: "viewClose", value }, { isBound: true }).catch(() => {});
    this.forget();
  }

  private sync(): void {
    const wanted = this.wanted;
    if (!wanted || this.connection.state.kind !== "open" || this.isOpening) return;
    if (this.id === null) void this.open(wanted);
    else if (this.underWay < UPDATES_MOST && wanted !== this.sent) void this.update(wanted);
  }

  private note(wanted: Wanted): bigint {
    this.sent = wanted;
    const sequence = this.sequence++;
    this.bySequence.set(sequence, { orbit: wanted.orbit, atMs: performance.now() });
    for (const old of this.bySequence.keys()) {
      if (this.bySequence.size <= SENT_KEPT) break;
      this.bySequence.delete(old);
    }
    return sequence;
  }

  private async open(wanted: Wanted): Promise<void> {
    this.isOpening = true;
    // Frames of the view as it was opened say 0.
    this.bySequence.clear();
    this.sequence = 0n;
    this.latest = -1n;
    this.note(wanted);
    this.orbit = wanted.orbit;
    const frame = frameOf(wanted);
    const value = { scene: wanted.scene, frame, credits: CREDITS };
    const onEvent = (event: Event) => this.onEvent(event);
    const { id, answer } = this.connection.requestWithId(
      "viewReply", { case: "viewOpen", value }, { isBound: true, onEvent });
    this.request = id;
    try {
      const reply = await answer;
      if (this.request !== id) return;
      this.id = reply.view;
      this.isOpening = false;
      if (this.wanted?.scene !== wanted.scene) this.close();
      this.sync();
    } catch (error) {
      // Of a connection that broke, onOpen decides.
      if (this.request === id && !(error instanceof Lost)) this.refused(wanted);
      this.report(error);
    }
  }

  // What was wanted meanwhile may be what corrects it.
  private refused(wanted: Wanted): void {
    this.isOpening = false;
    if (this.wanted !== wanted) this.sync();
  }

  private async update(wanted: Wanted): Promise<void> {
    const before = this.sent;
    const isMoveOnly = before?.frame === wanted.frame && before.camera === null && wanted.camera === null;
    const sequence = this.note(wanted);
    const what = isMoveOnly ? { pose: poseOf(wanted.orbit) } : { frame: frameOf(wanted) };
    const value = { view: this.id!, sequence, ...what };
    const request = this.request;
    this.underWay++;
    try {
      await this.connection.request("done", { case: "viewUpdate", value }, { isBound: true });
    } catch (error) {
      this.report(error);
    }
    if (this.request !== request) return;
    this.underWay = Math.max(0, this.underWay - 1);
    this.sync();
  }

  private report(error: unknown): void {
    if (error instanceof Lost) return;
    if (error instanceof Refusal) this.onFault(error.field ? `${error.field}: ${error.message}` : error.message);
    else throw error;
  }

  private onEvent({ body, payload }: Event): void {
    if (body.case === "viewEnd") {
      this.onFault(body.value.error?.message ?? "the view ended");
      this.forget(); // the next that is wanted opens another
      return;
    }
    if (body.case !== "viewFrame") return;
    const frame = body.value;
    const request = this.request;
    this.drawing = this.drawing.then(() => this.show(frame, payload, request)).catch(() => {});
  }

  private async show(frame: ViewFrame, payload: Uint8Array<ArrayBuffer>, request: bigint): Promise<void> {
    try {
      if (request === this.request) await this.picture.show(payload, frame.encoding);
    } finally {
      if (request === this.request) this.pay(1);
    }
    if (request !== this.request) return;
    const sent = this.bySequence.get(frame.sequence);
    if (sent) this.orbit = sent.orbit;
    const isFirst = frame.sequence > this.latest;
    this.latest = frame.sequence;
    const atMs = performance.now();
    this.onShown({
      frame,
      report: frame.report,
      orbit: this.orbit!,
      atMs,
      isCurrent: frame.sequence === this.sequence - 1n && this.sent === this.wanted,
      latencyMs: sent && isFirst ? atMs - sent.atMs : null,
      bytes: payload.length,
    });
  }

  private pay(count: number): void {
    this.owed += count;
    this.payOwed();
  }

  private payOwed(): void {
    if (document.hidden || this.owed === 0 || this.id === null) return;
    this.connection.say({ case: "viewCredit", value: { view: this.id, count: this.owed } });
    this.owed = 0;
  }
}

function frameOf({ frame, orbit, camera }: Wanted) {
  return { ...frame, ...lookOf(orbit, camera) };
}
