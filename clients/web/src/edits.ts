// Changes to a scene. A drag is a row of transient batches, one under way at a time and the latest
// wins, made durable at its end; anything else is durable at once.

import { type MessageInitShape } from "@bufbuild/protobuf";
import { type EditOpSchema } from "../gen/bounced_pb";
import { type Connection, Lost, Refusal } from "./connection";

export type Op = MessageInitShape<typeof EditOpSchema>;

// crypto.randomUUID is missing where the page came over plain HTTP from another machine.
function newId(): string {
  const bytes = crypto.getRandomValues(new Uint8Array(12));
  return "web-" + Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

export class Edits {
  private next: Op[] | null = null;
  private isUnderWay = false;
  private hasTransient = false;
  private wantsCommit = false;

  constructor(
    private readonly connection: Connection,
    private readonly scene: string,
    private readonly by: () => string,
    private readonly onFault: (message: string) => void,
  ) {}

  // The whole state of what is dragged, each time.
  drag(ops: Op[]): void {
    this.next = ops;
    void this.pump();
  }

  // The end of a drag.
  drop(): void {
    this.wantsCommit = true;
    void this.pump();
  }

  async apply(ops: Op[], message: string): Promise<void> {
    const value = { ...this.named(), ops, message };
    await this.ask("editReply", { case: "editBatch", value });
  }

  // One's own last; of `isOfAll` anybody's.
  undo(isOfAll = false): Promise<void> {
    return this.takeBack(false, isOfAll);
  }

  redo(isOfAll = false): Promise<void> {
    return this.takeBack(true, isOfAll);
  }

  private takeBack(redo: boolean, isOfAll: boolean): Promise<void> {
    const value = { ...this.named(), redo, scope: isOfAll ? "all" : "mine" };
    return this.ask("editReply", { case: "editUndo", value });
  }

  private named() {
    return { scene: this.scene, clientEditId: newId(), by: this.by() };
  }

  revert(revision: bigint): Promise<void> {
    const value = { ...this.named(), revision };
    return this.ask("editReply", { case: "editRevert", value });
  }

  private async ask(...[answer, body]: Parameters<Connection["request"]>): Promise<void> {
    try {
      await this.connection.request(answer, body);
    } catch (error) {
      this.report(error);
    }
  }

  private async pump(): Promise<void> {
    if (this.isUnderWay) return;
    this.isUnderWay = true;
    while (this.next || (this.wantsCommit && this.hasTransient)) await this.step();
    this.wantsCommit = false;
    this.isUnderWay = false;
  }

  private async step(): Promise<void> {
    if (!this.next) {
      this.hasTransient = this.wantsCommit = false;
      await this.ask("editReply", { case: "editCommit", value: this.named() });
      return;
    }
    const value = { scene: this.scene, by: this.by(), durability: "transient", ops: this.next };
    this.next = null;
    this.hasTransient = true;
    await this.ask("editReply", { case: "editBatch", value });
  }

  private report(error: unknown): void {
    if (error instanceof Lost) return;
    if (!(error instanceof Refusal)) throw error;
    this.onFault(error.field ? `${error.field}: ${error.message}` : error.message);
  }
}
