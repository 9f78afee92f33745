// The scenes that the server has and the one that is open: their list, what the watch tells of them,
// the objects and the log of the open one.

import { type Scene, type SceneEvent, type Technique } from "../gen/bounced_pb";
import { type Connection, type Event, Refusal } from "./connection";
import { byId, options } from "./dom";
import { type HistoryPanel } from "./panel_history";
import { type Model, modelOf } from "./scene";

const REFRESH_MS = 150;

export interface Hooks {
  techniques(techniques: Technique[]): void;
  opened(id: string): void; // another than before; its objects follow
  closed(): void; // there is none
  objects(model: Model): void;
  changed(): void; // what the open one shows is another now
  done(event: SceneEvent): void; // a revision of the open one, and whose it is
  isHeld(): boolean; // by a drag, whose objects are newer than what the server tells
  fault(error: unknown): void;
}

export class Scenes {
  private readonly select = byId<HTMLSelectElement>("scenes");
  private isSetUp = false; // this session has its watch: a break before its answer ends the set-up
  private added: string | null = null; // by this page, and not yet in a list
  private refresh = 0;
  id: string | null = null; // of the open one

  constructor(
    private readonly connection: Connection,
    private readonly history: HistoryPanel,
    private readonly hooks: Hooks,
  ) {
    this.select.addEventListener("change", () => void this.open(this.select.value));
    connection.onOpen((isSame) => void this.onOpen(isSame));
  }

  // Opened as soon as a list has it.
  add(id: string): void {
    this.added = id;
    void this.list();
  }

  async remove(): Promise<void> {
    if (this.id === null) return;
    try {
      await this.connection.request("done", { case: "sceneRemove", value: { id: this.id } });
      this.id = null;
      await this.list();
    } catch (error) {
      this.hooks.fault(error);
    }
  }

  refreshSoon(): void {
    clearTimeout(this.refresh);
    this.refresh = window.setTimeout(() => void this.readObjects(), REFRESH_MS);
  }

  private async onOpen(isSame: boolean): Promise<void> {
    if (isSame && this.isSetUp) {
      // The watch goes on; what it missed meanwhile it says.
      await this.list();
      return;
    }
    this.isSetUp = false;
    const onEvent = ({ body }: Event) => {
      if (body.case === "sceneEvent") this.onEvent(body.value);
    };
    const once = { isBound: true };
    const ask = this.connection;
    try {
      const techniques = await ask.request("techniquesReply", { case: "techniques", value: {} }, once);
      this.hooks.techniques(techniques.techniques);
      const list = await ask.request("sceneListReply", { case: "sceneList", value: {} }, once);
      this.setList(list.scenes);
      await ask.request("done", { case: "sceneWatch", value: {} }, { isBound: true, onEvent });
      this.isSetUp = true;
    } catch (error) {
      this.hooks.fault(error);
    }
  }

  private setList(scenes: Scene[]): void {
    options(this.select, scenes.map((scene) => [scene.id, scene.name || scene.id] as const));
    document.body.classList.toggle("has-scenes", scenes.length > 0);
    // A list from before it was added: another follows.
    if (this.added !== null && !scenes.some((scene) => scene.id === this.added)) return;
    const wanted = this.added ?? this.id ?? new URLSearchParams(location.hash.slice(1)).get("scene");
    const found = scenes.find((scene) => scene.id === wanted) ?? scenes.at(-1);
    this.added = null;
    if (found) void this.open(found.id);
    else this.close();
  }

  private onEvent(event: SceneEvent): void {
    if (event.kind === "added" || event.kind === "removed" || event.kind === "missed") void this.list();
    if (event.scene !== this.id && event.kind !== "missed") return;
    this.hooks.changed();
    if (event.kind === "edited") this.hooks.done(event);
    if (event.kind !== "transient") void this.readLog();
    if (!this.hooks.isHeld()) this.refreshSoon();
  }

  private async list(): Promise<void> {
    try {
      this.setList((await this.connection.request("sceneListReply", { case: "sceneList", value: {} })).scenes);
    } catch (error) {
      this.hooks.fault(error);
    }
  }

  private close(): void {
    this.id = null;
    this.hooks.closed();
  }

  private async open(id: string): Promise<void> {
    const isOther = this.id !== id;
    this.id = id;
    this.select.value = id;
    history.replaceState(null, "", `#scene=${encodeURIComponent(id)}`);
    if (isOther) this.hooks.opened(id);
    await this.readObjects();
    void this.readLog();
  }

  private async readObjects(): Promise<void> {
    const id = this.id;
    if (id === null) return;
    try {
      const scene = await this.connection.request("scene", { case: "sceneGet", value: { id, objects: true } });
      if (this.id === id && !this.hooks.isHeld()) this.hooks.objects(modelOf(scene));
    } catch (error) {
      this.hooks.fault(error);
    }
  }

  private async readLog(): Promise<void> {
    const scene = this.id;
    if (scene === null) return;
    try {
      const reply = await this.connection.request("sceneLogReply", { case: "sceneLog", value: { scene, limit: 40 } });
      if (this.id === scene) this.history.show(reply.entries);
    } catch (error) {
      // A server without a journal has no history: nothing to be told of.
      if (!(error instanceof Refusal && error.code === "unsupported")) this.hooks.fault(error);
    }
  }
}
