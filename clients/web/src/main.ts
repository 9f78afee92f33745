// The page: puts the modules together. Each knows one topic; what depends on several is here.

import { type Report, type SceneEvent, type Technique } from "../gen/bounced_pb";
import { astray } from "./astray";
import { busy } from "./busy";
import { listen } from "./camera_input";
import { Connection, Lost } from "./connection";
import { byId, options } from "./dom";
import { Edits, type Op } from "./edits";
import { type FrameInit, frameRequest, motionMs, motionScale, pictureSize } from "./frame_request";
import { Handles } from "./handles";
import { listenForFiles } from "./drop";
import { type Orbit, diagonalOf, eyeOf, frame, isWithin, lookOf, nearestOf, ofCamera } from "./orbit";
import { CostPanel } from "./panel_cost";
import { ErrorMap } from "./error_map";
import { ErrorPanel } from "./panel_error";
import { exportScene } from "./export";
import { HistoryPanel } from "./panel_history";
import { type LightInit, ObjectsPanel } from "./panel_objects";
import { PicturePanel } from "./panel_picture";
import { Progress } from "./panel_progress";
import { TechniquePanel } from "./panel_technique";
import { Measure, type Subject } from "./measure";
import { pick } from "./pick";
import { Picture } from "./picture";
import { empty, grown } from "./plot";
import { type Point, type Size } from "./project";
import { type Local, type Model, type Placed, aimedAt, firstOrbit, movedTo, withLocal } from "./scene";
import { Scenes } from "./scenes";
import { isUnauthorized, tokenOfFragment, trade, withoutToken } from "./session";
import { loadSettings, saveSettings } from "./settings";
import { Status } from "./status";
import { tell, toast } from "./toast";
import { type Upload, addScene } from "./upload";
import { type Vec3 } from "./vec";
import { type Shown, View } from "./view";
import { Who, lineOf } from "./who";

// After the last movement the picture is asked for at its full size.
const REST_MS = 250;
const RESIZE_MS = 120;

class Page {
  private readonly settings = loadSettings();
  private readonly stage = byId("stage");
  private readonly connection: Connection;
  private readonly view: View;
  private readonly handles: Handles;
  private readonly status: Status;
  private readonly progress = new Progress();
  private readonly who = Who.ofBrowser();
  private readonly lost = byId("astray");
  private readonly technique: TechniquePanel;
  private readonly pictureOptions: PicturePanel;
  private readonly cost = new CostPanel(byId("cost"));
  private readonly error: ErrorPanel;
  private readonly measure: Measure;
  private readonly errorMap: ErrorMap;
  private readonly objects: ObjectsPanel;
  private readonly scenes: Scenes;
  private readonly cameras = byId<HTMLSelectElement>("cameras");

  private model: Model | null = null;
  private edits: Edits | null = null;
  private orbit: Orbit | null = null;
  private camera: string | null = null; // of the scene, while the view is just it
  private shownOrbit: Orbit | null = null;
  private selected: number | null = null;
  private request: FrameInit | null = null;
  private requestKey = "";
  private size: Size = { width: 1, height: 1 };
  private isMoving = false;
  private isDragging = false;
  private isExporting = false;
  private fullFrameMs = 0;
  private changedMs = 0; // performance.now() of the last change of the view
  private series = empty;
  private rest = 0;
  private readonly poses = new Map<string, Orbit>(); // of scenes that were looked at

  constructor() {
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    this.connection = new Connection(`${scheme}//${location.host}/v1/socket`, isUnauthorized);
    this.status = new Status(() => this.connection.tryNow());
    const picture = new Picture(byId<HTMLCanvasElement>("picture"));
    this.view = new View(this.connection, picture, (shown) => this.onShown(shown), toast);
    const changed = () => this.onSettings();
    this.technique = new TechniquePanel(byId("technique"), this.settings, changed);
    this.pictureOptions = new PicturePanel(byId("look"), byId("layers"), this.settings, changed);
    this.error = new ErrorPanel(byId("error"), this.settings, changed);
    this.measure = new Measure(this.connection, (subject, report) => this.onMeasured(subject, report), toast);
    this.errorMap = new ErrorMap(this.connection, toast);
    const log = new HistoryPanel(byId("history"), this.who, () => void this.edits?.undo(true),
      (revision) => void this.edits?.revert(revision));
    this.scenes = new Scenes(this.connection, log, {
      techniques: (techniques) => this.setTechniques(techniques),
      opened: (id) => this.opened(id),
      closed: () => this.closed(),
      objects: (model) => this.setModel(model),
      changed: () => this.changed(),
      done: (event) => this.tellOf(event),
      isHeld: () => this.isDragging,
      fault,
    });
    const hooks = {
      select: (node: number | null) => this.select(node),
      move: (node: number, world: Vec3) => this.place(node, (model, placed) => movedTo(model, placed, world)),
      aim: (node: number, world: Vec3) => this.place(node, (model, placed) => aimedAt(model, placed, world)),
      end: () => this.endDrag(),
    };
    this.handles = new Handles(document.querySelector<SVGSVGElement>("#overlay")!, hooks);
    this.objects = new ObjectsPanel(byId("objects"), {
      ...hooks,
      light: (light, change, isFinal) => this.changeLight(light, change, isFinal),
      show: (node, isShown) =>
        void this.edits?.apply([{ op: { case: "setNode", value: { node, shown: isShown } } }], isShown ? "shown" : "hidden"),
    });
  }

  async start(): Promise<void> {
    this.listen();
    const token = tokenOfFragment(location.hash);
    if (token !== null) await this.login(token);
    this.connection.onState((state) => {
      this.status.setState(state);
      document.body.dataset["connection"] = state.kind;
      if (state.kind !== "open") this.stage.dataset["current"] = "false";
      if (state.kind === "open") this.pictureOptions.setDevice(state.device?.software ?? true);
      if (state.kind === "unauthorized") byId<HTMLDialogElement>("login").showModal();
    });
    this.connection.connect();
  }

  // --- who we are ---

  private async login(token: string): Promise<boolean> {
    // Gone from the address before anything else can read it, or it is bookmarked.
    history.replaceState(null, "", location.pathname + withoutToken(location.hash));
    const isTaken = await trade(token).catch(() => false);
    if (!isTaken) toast("The token was not accepted.");
    return isTaken;
  }

  private async onLogin(event: Event): Promise<void> {
    event.preventDefault();
    const input = byId<HTMLInputElement>("token");
    if (!(await this.login(input.value.trim()))) return;
    input.value = "";
    byId<HTMLDialogElement>("login").close();
    this.connection.connect();
  }

  // --- what is open ---

  private setTechniques(techniques: Technique[]): void {
    this.technique.setTechniques(techniques);
    this.sync();
  }

  private opened(id: string): void {
    if (this.model && this.orbit) this.poses.set(this.model.id, this.orbit);
    this.edits = new Edits(this.connection, id, () => this.who.by, toast);
    this.selected = null;
    this.orbit = null;
    this.sync();
  }

  private closed(): void {
    this.model = this.edits = this.orbit = this.shownOrbit = this.selected = null;
    this.view.none();
    this.status.setShown(null);
    this.progress.show(null);
    this.redraw();
  }

  private setModel(model: Model): void {
    this.model = model;
    if (this.selected !== null && !model.nodes.has(this.selected)) this.selected = null;
    const entries = model.cameras.map((camera) => [camera.index, camera.name] as const);
    options(this.cameras, [["", "Free"], ...entries]);
    if (!this.orbit) {
      const held = this.poses.get(model.id);
      this.orbit = held ?? firstOrbit(model, this.size.width / this.size.height);
      this.setCamera(held ? null : (model.cameras[0]?.index ?? null));
      this.changed();
    }
    this.sync();
    this.redraw();
  }

  // --- the view ---

  private onSettings(): void {
    saveSettings(this.settings);
    this.changed();
    this.sync();
  }

  // Something that the picture shows is another now.
  private changed(): void {
    this.changedMs = performance.now();
    this.series = empty;
    this.measure.drop();
    this.errorMap.drop();
  }

  private moving(): void {
    this.isMoving = true;
    this.stage.dataset["moving"] = "true";
    this.changed();
    clearTimeout(this.rest);
    this.rest = window.setTimeout(() => {
      this.isMoving = false;
      this.stage.dataset["moving"] = "false";
      this.sync();
    }, REST_MS);
  }

  private moveCamera(orbit: Orbit): void {
    this.orbit = orbit;
    this.setCamera(null);
    this.moving();
    this.sync();
  }

  private sync(): void {
    this.stage.dataset["current"] = "false";
    const scene = this.scenes.id;
    if (scene === null || !this.orbit || !this.settings.technique) return;
    const isCoarse = this.isMoving && this.settings.coarseInMotion;
    const size = this.sizeAt(isCoarse ? motionScale(this.fullFrameMs) : 1);
    const moment = { size, isMoving: this.isMoving };
    const request = frameRequest(this.settings, moment);
    const key = JSON.stringify(request);
    if (key !== this.requestKey) this.request = request;
    this.requestKey = key;
    this.progress.ask();
    this.view.want({ scene, frame: this.request!, orbit: this.orbit, camera: this.camera });
    this.errorMap.setLegend(this.settings.layer === "error");
  }

  private sizeAt(scale: number): number[] {
    const detail = Number(this.settings.detail) || 1;
    return pictureSize(this.size, Math.min(devicePixelRatio, 2), detail * scale);
  }

  private onShown(shown: Shown): void {
    const { report } = shown;
    this.shownOrbit = shown.orbit;
    this.status.setShown(shown);
    this.progress.show(shown);
    this.redraw();
    this.stage.dataset["frames"] = String(shown.frame.number);
    // Without an orbit, a scene is opened that the view does not show yet.
    if (shown.isCurrent && this.orbit) this.stage.dataset["current"] = "true";
    this.stage.dataset["final"] = String(shown.frame.final);
    if (!report) return;
    this.stage.dataset["technique"] = report.technique;
    this.stage.dataset["revision"] = String(report.revision);
    this.fullFrameMs = motionMs(report, shown.frame.step, this.sizeAt(1)) ?? this.fullFrameMs;
    this.cost.show(report);
    this.pictureOptions.setStopsUsed(report.exposureStops);
    const seconds = (shown.atMs - this.changedMs) / 1000;
    this.series = grown(this.series, report, seconds);
    this.error.show(this.series, undefined);
    this.compare(shown.orbit, report, seconds);
  }

  // With the reference.
  private compare(orbit: Orbit, report: Report, seconds: number): void {
    if (this.isMoving || report.technique === "reference") return;
    const { settings } = this;
    const look = lookOf(orbit, this.camera);
    const subject = { scene: this.scenes.id!, look, against: settings.against, report, seconds };
    if (settings.measure) this.measure.want(subject);
    if (settings.layer === "error") this.errorMap.want(subject);
  }

  private onMeasured({ seconds }: Subject, report: Report): void {
    this.series = grown(this.series, report, seconds);
    this.error.show(this.series, report.error[0]);
  }

  private redraw(): void {
    const orbit = this.shownOrbit ?? this.orbit;
    this.handles.update({ model: this.model, orbit, size: this.size, selected: this.selected });
    this.objects.update(this.model, this.selected);
    document.body.classList.toggle("has-scene", this.scenes.id !== null);
    this.sayWhere();
  }

  // By what is asked for, so that the word comes before a picture of nothing does.
  private sayWhere(): void {
    const words = this.model && this.orbit ? astray(this.orbit, this.model.bounds, this.size, this.isRoom(this.model)) : "";
    this.lost.hidden = words === "";
    if (words) byId("astray-text").textContent = words;
  }

  private isRoom(model: Model): boolean {
    return isWithin(eyeOf(firstOrbit(model, this.size.width / this.size.height)), model.bounds);
  }

  // --- edits ---

  // What others did is told, and what was taken back, whoever did.
  private tellOf(event: SceneEvent): void {
    const isMine = event.author !== "" && event.author === this.authorOfMine;
    const words = lineOf(event, isMine);
    if (words) tell(words);
  }

  private get authorOfMine(): string {
    return `${this.connection.author} ${this.who.by}`;
  }

  private select(node: number | null): void {
    this.selected = node;
    if (node !== null) byId<HTMLDetailsElement>("objects-section").open = true;
    this.redraw();
  }

  private place(id: number, localOf: (model: Model, node: Placed) => Local | null): void {
    const node = this.model?.nodes.get(id);
    const local = node && localOf(this.model!, node);
    if (!node || !local) return;
    this.isDragging = true;
    const op: Op = { op: { case: "setTransform", value: { node: id, ...local } } };
    this.model = withLocal(this.model!, node, local);
    this.moving();
    this.edits?.drag([op]);
    this.sync();
    this.redraw();
  }

  private changeLight(light: number, change: Partial<LightInit>, isFinal: boolean): void {
    const op: Op = { op: { case: "setLight", value: { light, ...change } } };
    this.isDragging = true;
    this.moving();
    this.edits?.drag([op]);
    if (isFinal) this.endDrag();
    this.sync();
  }

  private endDrag(): void {
    this.isDragging = false;
    this.edits?.drop();
    this.scenes.refreshSoon();
  }

  // --- files ---

  private async open(files: readonly Upload[]): Promise<void> {
    if (files.length === 0) return;
    const isHeld = (blob: string) => this.isHeld(blob);
    try {
      await busy(async (on) => this.scenes.add(await addScene(files, isHeld, on)));
    } catch (error) {
      fault(error);
    }
  }

  private async exportScene(): Promise<void> {
    const model = this.model;
    if (!model || this.isExporting) return;
    this.isExporting = true;
    try {
      await busy(async (on) => {
        on(`Exporting ${model.name}`, null);
        const differs = await exportScene(model.id, model.name);
        if (differs) toast(`The file differs from the scene: ${differs}`);
      });
    } catch (error) {
      fault(error);
    }
    this.isExporting = false;
  }

  // Not by HEAD: of a missing blob that is a red line in every console.
  private async isHeld(blob: string): Promise<boolean> {
    const reply = await this.connection.request("blobReply", { case: "blobHave", value: { blobs: [blob] } });
    return reply.have.includes(blob);
  }

  // --- input ---

  private listen(): void {
    listen(this.stage, {
      orbit: () => this.orbit,
      move: (orbit) => this.moveCamera(orbit),
      pick: (at) => this.pickAt(at),
      showAll: () => this.showAll(),
      stepM: () => (this.model ? diagonalOf(this.model.bounds) / 80 : 0.1),
      nearestM: () => (this.model ? nearestOf(this.model.bounds) : 1e-4),
    });
    this.cameras.addEventListener("change", () => this.useCamera());
    byId("astray-home").addEventListener("click", () => this.showAll());
    byId("undo").addEventListener("click", () => void this.edits?.undo());
    byId("redo").addEventListener("click", () => void this.edits?.redo());
    byId("login-form").addEventListener("submit", (event) => void this.onLogin(event));
    byId("export").addEventListener("click", () => void this.exportScene());
    byId("remove").addEventListener("click", () => void this.removeScene());
    byId("help-open").addEventListener("click", () => byId<HTMLDialogElement>("help").showModal());
    addEventListener("keydown", (event) => this.onKey(event));
    listenForFiles((files) => void this.open(files), fault);
    this.listenForSize();
  }

  private onKey(event: KeyboardEvent): void {
    const isText = event.target instanceof HTMLInputElement && event.target.type === "text";
    if (isText || !(event.ctrlKey || event.metaKey) || event.altKey) return;
    const key = event.key.toLowerCase();
    if (key !== "z" && key !== "y") return;
    event.preventDefault();
    void (key === "y" || event.shiftKey ? this.edits?.redo() : this.edits?.undo());
  }

  private listenForSize(): void {
    let soon = 0;
    new ResizeObserver(() => {
      this.size = { width: this.stage.clientWidth || 1, height: this.stage.clientHeight || 1 };
      this.redraw();
      clearTimeout(soon);
      soon = window.setTimeout(() => this.sync(), RESIZE_MS);
    }).observe(this.stage);
    this.size = { width: this.stage.clientWidth || 1, height: this.stage.clientHeight || 1 };
  }

  private pickAt(at: Point): void {
    if (this.model && this.orbit) this.select(pick(this.model, this.shownOrbit ?? this.orbit, at, this.size));
  }

  // Everything; from outside of a room back to where it is looked at from.
  private showAll(): void {
    const { model, orbit } = this;
    if (!model || !orbit) return;
    const aspect = this.size.width / this.size.height;
    const isOut = this.isRoom(model) && !isWithin(eyeOf(orbit), model.bounds);
    this.moveCamera(isOut ? firstOrbit(model, aspect) : frame(orbit, model.bounds, aspect));
  }

  private useCamera(): void {
    const camera = this.model?.cameras.find((one) => one.index === this.cameras.value);
    if (camera && this.model) this.orbit = ofCamera(camera.worldFromNode, camera.yfov, this.model.bounds);
    this.setCamera(camera?.index ?? null);
    this.changed();
    this.sync();
  }

  private setCamera(index: string | null): void {
    this.camera = index;
    this.cameras.value = index ?? "";
  }

  private async removeScene(): Promise<void> {
    const { id } = this.scenes;
    if (id !== null && confirm(`Remove “${this.model?.name ?? id}” from the server?`)) await this.scenes.remove();
  }
}

function fault(error: unknown): void {
  if (!(error instanceof Lost)) toast(error instanceof Error ? error.message : String(error));
}

void new Page().start();
