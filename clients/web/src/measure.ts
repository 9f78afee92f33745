// How wrong the picture on the screen is: the server renders it once more, and traces some of its
// pixels. One request at a time; what changes meanwhile is measured after it, the latest only.

import { type Report } from "../gen/bounced_pb";
import { type Connection, Lost, Refusal } from "./connection";
import { type Look } from "./orbit";

export const CHECK_PIXELS = 256;

export interface Subject {
  readonly scene: string;
  readonly look: Look;
  readonly against: string;
  readonly report: Report; // of the frame on the screen: technique, parameters, size
  readonly seconds: number; // since the last change, when it was shown
}

export class Measure {
  private next: Subject | null = null;
  private current: bigint | null = null; // id of the request under way

  constructor(
    private readonly connection: Connection,
    private readonly onMeasured: (subject: Subject, report: Report) => void,
    private readonly onFault: (message: string) => void,
  ) {}

  // Of a picture at rest. Replaces what was to be measured next.
  want(subject: Subject): void {
    this.next = subject;
    if (this.current === null) void this.run();
  }

  // The picture has changed: what is under way says nothing about it any more.
  drop(): void {
    this.next = null;
    if (this.current === null) return;
    const value = { requestId: this.current };
    this.current = null;
    this.connection.request("done", { case: "cancel", value }, { isBound: true }).catch(() => {});
  }

  private async run(): Promise<void> {
    const subject = this.next;
    if (!subject) return;
    this.next = null;
    const { id, answer } = this.connection.requestWithId("renderReply", requestOf(subject), { isBound: true });
    this.current = id;
    try {
      const { report } = await answer;
      if (this.current !== id) return;
      if (report) this.onMeasured(subject, report);
    } catch (error) {
      if (this.current !== id) return;
      if (error instanceof Refusal) this.onFault(error.message);
      else if (!(error instanceof Lost)) throw error;
    }
    this.current = null;
    void this.run();
  }
}

function requestOf({ scene, look, against, report }: Subject) {
  const { technique, parameters, size, aa } = report;
  const frame = { technique, parameters, size, aa, ...look, against, check: CHECK_PIXELS, encoding: "none" };
  return { case: "render" as const, value: { scene, frame } };
}
