// What lies over the picture: a mark for each light, which chooses it and moves it across the view,
// and of the chosen node a box, three axes and a disc to move it by, and for lights that have a
// direction a handle to aim them by.

import { set, svg } from "./dom";
import { CLICK_PX, type Drag, type Handle, begin, moved, steppedByKey } from "./handle_drag";
import { type Orbit } from "./orbit";
import { type Size, depthOf, metresPerPixel, project } from "./project";
import { type Model, type Placed, aimOf, anchorOf, boxOf, lightNodes } from "./scene";
import { type Vec3, add, scale, transformPoint, translationOf } from "./vec";

export const AXES: Record<"x" | "y" | "z", Vec3> = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
const AXIS_PX = 64;
const AIM_PX = 96;
const LIGHTS_MOST = 100;
const HIT_PX = 22; // around what a finger is to hit
const KEY_QUIET_MS = 500;

export interface Scenery {
  readonly model: Model | null;
  readonly orbit: Orbit | null;
  readonly size: Size;
  readonly selected: number | null; // node
}

export interface Hooks {
  select(node: number | null): void;
  move(node: number, world: Vec3): void; // its own place, not its box's middle
  aim(node: number, world: Vec3): void;
  end(): void;
}

type Mark = SVGGElement;

// A light's mark that is held: a drag once the pointer has gone far enough.
interface Press {
  readonly node: number;
  readonly from: { x: number; y: number };
  drag: Drag | null;
}

export class Handles {
  private scenery: Scenery = { model: null, orbit: null, size: { width: 1, height: 1 }, selected: null };
  private readonly lights = svg("g", { class: "lights" });
  private readonly gizmo = svg("g", { class: "gizmo" });
  private readonly box = svg("path", { class: "box" });
  private readonly marks = new Map<number, Mark>();
  private readonly grips = new Map<Handle, SVGGElement>();
  private drag: Drag | null = null;
  private press: Press | null = null;
  private quiet = 0;

  constructor(
    private readonly root: SVGSVGElement,
    private readonly hooks: Hooks,
  ) {
    this.gizmo.append(this.box);
    for (const handle of ["x", "y", "z", "plane", "aim"] as const) this.addGrip(handle);
    root.append(this.gizmo, this.lights);
  }

  update(scenery: Scenery): void {
    this.scenery = scenery;
    const { width, height } = scenery.size;
    set(this.root, { viewBox: `0 0 ${width} ${height}` });
    this.placeLights();
    this.placeGizmo();
  }

  // --- lights ---

  private placeLights(): void {
    const { model, orbit, size, selected } = this.scenery;
    const nodes = model && orbit ? lightNodes(model).slice(0, LIGHTS_MOST) : [];
    const wanted = new Set(nodes.map((node) => node.id));
    for (const [id, mark] of this.marks) {
      if (wanted.has(id)) continue;
      mark.remove();
      this.marks.delete(id);
    }
    for (const node of nodes) {
      const mark = this.marks.get(node.id) ?? this.addMark(node);
      const at = project(orbit!, translationOf(node.worldFromNode), size);
      const isOff = !at || !isInside(at, size);
      set(mark, {
        transform: at ? `translate(${at.x.toFixed(1)} ${at.y.toFixed(1)})` : null,
        display: isOff ? "none" : null,
        "aria-pressed": String(node.id === selected),
      });
      mark.classList.toggle("is-hidden-node", !node.isShown);
    }
  }

  private addMark(node: Placed): Mark {
    const kind = this.scenery.model?.lights.get(node.light)?.state.kind ?? "point";
    const mark = svg("g", {
      class: `mark ${kind}`, tabindex: 0, role: "button",
      "aria-label": `Light ${node.name}, Enter chooses it, arrow keys move it`,
    });
    mark.append(svg("title", {}, `${node.name}: drag to move`), svg("circle", { r: HIT_PX, class: "hit" }),
      svg("circle", { r: 11, class: "back" }), glyph(kind));
    this.listenToMark(mark, node.id);
    this.lights.append(mark);
    this.marks.set(node.id, mark);
    return mark;
  }

  // A click chooses the light, a drag moves it, chosen or not.
  private listenToMark(mark: Mark, node: number): void {
    mark.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      event.stopPropagation();
      this.press = { node, from: this.pointOf(event), drag: null };
      mark.setPointerCapture(event.pointerId);
    });
    mark.addEventListener("pointermove", (event) => this.pullMark(mark, event));
    for (const name of ["pointerup", "pointercancel"] as const)
      mark.addEventListener(name, (event) => this.releaseMark(mark, event));
    mark.addEventListener("keydown", (event) => this.onMarkKey(node, event));
  }

  private pullMark(mark: Mark, event: PointerEvent): void {
    const { press } = this;
    if (!press) return;
    event.stopPropagation();
    const to = this.pointOf(event);
    if (!press.drag && Math.hypot(to.x - press.from.x, to.y - press.from.y) <= CLICK_PX) return;
    if (!press.drag) {
      this.hooks.select(press.node);
      press.drag = this.beginAt("plane", press.from);
      mark.classList.add("is-held");
    }
    if (press.drag) this.apply(press.drag, moved(press.drag, to));
  }

  private releaseMark(mark: Mark, event: PointerEvent): void {
    const { press } = this;
    this.press = null;
    mark.classList.remove("is-held");
    if (!press) return;
    if (press.drag) this.hooks.end();
    else if (event.type === "pointerup") this.hooks.select(press.node);
  }

  private onMarkKey(node: number, event: KeyboardEvent): void {
    if (event.key === "Enter" || event.key === " ") {
      event.preventDefault();
      event.stopPropagation();
      this.hooks.select(node);
    } else if (event.key.startsWith("Arrow")) {
      this.hooks.select(node);
      this.onKey("plane", event);
    }
  }

  // --- the chosen node ---

  private get chosen(): Placed | null {
    const { model, selected } = this.scenery;
    return selected === null ? null : (model?.nodes.get(selected) ?? null);
  }

  private placeGizmo(): void {
    const { model, orbit, size } = this.scenery;
    const node = this.chosen;
    const anchor = node && model ? anchorOf(model, node) : null;
    const at = anchor && orbit ? project(orbit, anchor, size) : null;
    set(this.gizmo, { display: at ? null : "none" });
    if (!at || !anchor || !node || !model || !orbit) return;
    const pixel = metresPerPixel(orbit, depthOf(orbit, anchor), size);
    for (const axis of ["x", "y", "z"] as const)
      this.placeArrow(axis, anchor, add(anchor, scale(AXES[axis], AXIS_PX * pixel)));
    const plane = this.grips.get("plane")!;
    set(plane, { transform: `translate(${at.x.toFixed(1)} ${at.y.toFixed(1)})` });
    const kind = model.lights.get(node.light)?.state.kind;
    const hasAim = kind === "spot" || kind === "directional";
    set(this.grips.get("aim")!, { display: hasAim ? null : "none" });
    if (hasAim) this.placeArrow("aim", anchor, add(anchor, scale(aimOf(node), AIM_PX * pixel)));
    set(this.box, { d: this.boxPath(model, node) });
  }

  private placeArrow(handle: Handle, from: Vec3, to: Vec3): void {
    const { orbit, size } = this.scenery;
    const [a, b] = [project(orbit!, from, size), project(orbit!, to, size)];
    const grip = this.grips.get(handle)!;
    if (!a || !b) {
      set(grip, { display: "none" });
      return;
    }
    const place = { x1: a.x.toFixed(1), y1: a.y.toFixed(1), x2: b.x.toFixed(1), y2: b.y.toFixed(1) };
    for (const line of grip.querySelectorAll("line")) set(line, place);
    for (const circle of grip.querySelectorAll("circle")) set(circle, { cx: place.x2, cy: place.y2 });
    set(grip.querySelector("text")!, { x: place.x2, y: place.y2 });
    set(grip, { display: null });
  }

  private boxPath(model: Model, node: Placed): string {
    const box = boxOf(model, node);
    if (!box) return "";
    const { min, max } = box.bounds;
    const corner = (i: number): Vec3 => [
      i & 1 ? max[0] : min[0], i & 2 ? max[1] : min[1], i & 4 ? max[2] : min[2],
    ];
    const { orbit, size } = this.scenery;
    const at = [0, 1, 2, 3, 4, 5, 6, 7].map((i) =>
      project(orbit!, transformPoint(box.worldFromBox, corner(i)), size));
    const edges = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((i) =>
      [1, 2, 4].filter((bit) => !(i & bit)).map((bit) => [at[i], at[i | bit]]));
    return edges
      .map(([a, b]) => (a && b ? `M${a.x.toFixed(1)} ${a.y.toFixed(1)}L${b.x.toFixed(1)} ${b.y.toFixed(1)}` : ""))
      .join("");
  }

  // --- dragging ---

  private addGrip(handle: Handle): void {
    const label = handle === "aim" ? "Aim" : handle === "plane" ? "Move across the view" : `Move along ${handle}`;
    const grip = svg("g", { class: `grip ${handle}`, tabindex: 0, role: "button", "aria-label": `${label}, arrow keys` });
    grip.append(svg("title", {}, label));
    if (handle === "plane") grip.append(svg("circle", { r: HIT_PX, class: "hit" }), svg("circle", { r: 9, class: "tip" }));
    else grip.append(svg("line", { class: "wide" }), svg("circle", { r: HIT_PX, class: "hit" }),
      svg("line", { class: "shaft" }), svg("circle", { r: 7, class: "tip" }),
      svg("text", { class: "letter", "aria-hidden": "true" }, handle === "aim" ? "" : handle));
    grip.addEventListener("pointerdown", (event) => this.take(handle, grip, event));
    grip.addEventListener("pointermove", (event) => this.pull(event));
    for (const name of ["pointerup", "pointercancel"] as const)
      grip.addEventListener(name, () => this.release());
    grip.addEventListener("keydown", (event) => this.onKey(handle, event));
    this.gizmo.append(grip);
    this.grips.set(handle, grip);
  }

  private pointOf(event: PointerEvent): { x: number; y: number } {
    const box = this.root.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }

  private beginAt(handle: Handle, point: { x: number; y: number } | null): Drag | null {
    const { model, orbit, size } = this.scenery;
    const node = this.chosen;
    if (!model || !orbit || !node) return null;
    return begin({ handle, node, orbit, size, anchor: anchorOf(model, node), aimPx: AIM_PX }, point);
  }

  private take(handle: Handle, grip: SVGGElement, event: PointerEvent): void {
    if (event.button !== 0) return;
    event.stopPropagation();
    this.drag = this.beginAt(handle, this.pointOf(event));
    grip.setPointerCapture(event.pointerId);
    grip.classList.add("is-held");
  }

  private pull(event: PointerEvent): void {
    if (!this.drag) return;
    event.stopPropagation();
    this.apply(this.drag, moved(this.drag, this.pointOf(event)));
  }

  private apply(drag: Drag, world: Vec3 | null): void {
    if (!world) return;
    if (drag.handle === "aim") this.hooks.aim(drag.node.id, world);
    else this.hooks.move(drag.node.id, world);
  }

  private release(): void {
    for (const grip of this.grips.values()) grip.classList.remove("is-held");
    if (!this.drag) return;
    this.drag = null;
    this.hooks.end();
  }

  private onKey(handle: Handle, event: KeyboardEvent): void {
    const drag = this.beginAt(handle, null);
    const world = drag && steppedByKey(drag, event.key, event.shiftKey);
    if (!drag || !world) return;
    event.preventDefault();
    event.stopPropagation();
    this.apply(drag, world);
    clearTimeout(this.quiet);
    this.quiet = window.setTimeout(() => this.hooks.end(), KEY_QUIET_MS);
  }
}

const isInside = (at: { x: number; y: number }, size: Size): boolean =>
  at.x > -12 && at.y > -12 && at.x < size.width + 12 && at.y < size.height + 12;

// A bulb, a sun, a lamp's cone: told apart by shape, not by colour.
function glyph(kind: string): SVGPathElement {
  const rays = [0, 45, 90, 135, 180, 225, 270, 315]
    .map((degrees) => (degrees * Math.PI) / 180)
    .map((a) => `M${(5 * Math.cos(a)).toFixed(1)} ${(5 * Math.sin(a)).toFixed(1)}L${(8 * Math.cos(a)).toFixed(1)} ${(8 * Math.sin(a)).toFixed(1)}`);
  const disc = "M3 0A3 3 0 1 1 -3 0A3 3 0 1 1 3 0Z";
  const shapes: Record<string, string> = {
    directional: disc + rays.join(""),
    spot: "M-3 -6H3L6 5H-6Z",
    point: "M5 0A5 5 0 1 1 -5 0A5 5 0 1 1 5 0Z",
  };
  return svg("path", { d: shapes[kind] ?? shapes["point"]!, class: "glyph" });
}
