// The chosen object: which it is, where it is, and of a light how it shines.

import { isFieldSet } from "@bufbuild/protobuf";
import { LightEditSchema, type LightEdit } from "../gen/bounced_pb";
import { el, field } from "./dom";
import { figure } from "./format";
import { type Model, type Placed, lightNodes, meshNodes } from "./scene";
import { type Vec3, translationOf } from "./vec";

export interface Hooks {
  select(node: number | null): void;
  move(node: number, world: Vec3): void;
  end(): void;
  light(light: number, change: Partial<LightInit>, isFinal: boolean): void;
  show(node: number, isShown: boolean): void;
}

export interface LightInit {
  intensity: number;
  color: number[];
  range: number;
  coneInner: number;
  coneOuter: number;
}

const DEGREE = Math.PI / 180;
const LISTED_MOST = 500;

// sRGB digits of an <input type=color> and linear light, each way. Light beyond 1 is shown as the
// colour it has at 1.
export function linearOf(hex: string): number[] {
  return [1, 3, 5].map((at) => {
    const s = parseInt(hex.slice(at, at + 2), 16) / 255;
    return s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4;
  });
}

export function hexOf(linear: readonly number[]): string {
  const most = Math.max(1, ...linear);
  return "#" + linear.slice(0, 3).map((value) => {
    const l = Math.max(0, value / most);
    const s = l <= 0.0031308 ? 12.92 * l : 1.055 * l ** (1 / 2.4) - 0.055;
    return Math.round(255 * s).toString(16).padStart(2, "0");
  }).join("");
}

// The place after one of its coordinates was typed: the others keep all of their digits, of which the
// boxes show three. null: what was typed is no number.
export function placeTyped(place: Vec3, axis: number, text: string): Vec3 | null {
  const typed = Number(text);
  if (text.trim() === "" || !Number.isFinite(typed)) return null;
  return place.map((value, i) => (i === axis ? typed : value)) as unknown as Vec3;
}

export class ObjectsPanel {
  private readonly select = el("select", {});
  private readonly fields = el("div", { class: "fields" });
  private readonly place: HTMLInputElement[] = [];
  private node: Placed | null = null;
  private drawn = "";
  private listed: string | null = null;

  constructor(
    root: HTMLElement,
    private readonly hooks: Hooks,
  ) {
    this.select.addEventListener("change", () =>
      hooks.select(this.select.value === "" ? null : Number(this.select.value)));
    root.append(field("Object", this.select), this.fields);
  }

  update(model: Model | null, selected: number | null): void {
    this.list(model);
    this.select.value = selected === null ? "" : String(selected);
    this.node = (selected === null ? null : model?.nodes.get(selected)) ?? null;
    const light = this.node && model ? model.lights.get(this.node.light)?.state : undefined;
    // What is being typed into is not taken away: only another object, or another light, is drawn anew.
    const drawn = `${this.node?.id} ${this.node?.isShown} ${light ? lightWords(light) : ""}`;
    const isTyping = this.fields.contains(document.activeElement) && this.drawn.split(" ")[0] === String(this.node?.id);
    if (drawn !== this.drawn && !isTyping) this.draw(light);
    if (!isTyping) this.drawn = drawn;
    this.showPlace();
  }

  private list(model: Model | null): void {
    const lights = model ? lightNodes(model).slice(0, LISTED_MOST) : [];
    const meshes = model ? meshNodes(model).slice(0, LISTED_MOST) : [];
    const listed = [...lights, ...meshes].map((node) => `${node.id} ${node.name}`).join("\n");
    if (listed === this.listed) return;
    this.listed = listed;
    const group = (label: string, nodes: Placed[]) => nodes.length === 0 ? null
      : el("optgroup", { label }, ...nodes.map((node) => el("option", { value: node.id }, node.name)));
    const parts = [group("Lights", lights), group("Objects", meshes)].filter((part) => part !== null);
    this.select.replaceChildren(el("option", { value: "" }, "none"), ...parts);
  }

  private draw(light: LightEdit | undefined): void {
    this.place.length = 0;
    const node = this.node;
    if (!node) {
      this.fields.replaceChildren(el("p", { class: "note" }, "Click an object or a light in the picture to move it."));
      return;
    }
    const rows = [this.placeRow(), this.shownRow(node)];
    if (light) rows.push(...this.lightRows(node.light, light));
    this.fields.replaceChildren(...rows);
  }

  private placeRow(): HTMLElement {
    for (const [i, axis] of ["x", "y", "z"].entries()) {
      const input = el("input", { type: "text", inputmode: "decimal", class: `number axis-${axis}`, "aria-label": `${axis}, metres` });
      input.addEventListener("change", () => this.setPlace(i, input));
      this.place.push(input);
    }
    return el("div", { class: "field", role: "group", "aria-label": "Position in metres" },
      el("span", { class: "label" }, "Position"), el("span", { class: "triple" }, ...this.place));
  }

  private setPlace(axis: number, input: HTMLInputElement): void {
    if (!this.node) return;
    const held = translationOf(this.node.worldFromNode);
    const world = placeTyped(held, axis, input.value);
    if (!world) {
      input.value = figure(held[axis]!);
      return;
    }
    this.hooks.move(this.node.id, world);
    this.hooks.end();
  }

  private showPlace(): void {
    if (!this.node) return;
    const world = translationOf(this.node.worldFromNode);
    this.place.forEach((input, axis) => {
      if (input !== document.activeElement) input.value = figure(world[axis]!);
    });
  }

  private shownRow(node: Placed): HTMLElement {
    const input = el("input", { type: "checkbox" });
    input.checked = node.isShown;
    input.addEventListener("change", () => this.hooks.show(node.id, input.checked));
    return field("Shown", input);
  }

  private lightRows(id: number, light: LightEdit): HTMLElement[] {
    const unit = light.kind === "directional" ? "lx" : "cd";
    const rows = [this.colourRow(id, light), this.intensityRow(id, light, unit)];
    if (light.kind !== "spot") return rows;
    const cone = (label: string, key: "coneInner" | "coneOuter") =>
      this.numberRow(label, light[key] / DEGREE, (degrees) =>
        this.hooks.light(id, { [key]: degrees * DEGREE }, true));
    return [...rows, cone("Cone, inner °", "coneInner"), cone("Cone, outer °", "coneOuter")];
  }

  private colourRow(id: number, light: LightEdit): HTMLElement {
    const held = isFieldSet(light, LightEditSchema.field.color) ? light.color : [];
    const input = el("input", { type: "color", value: hexOf(held.length >= 3 ? held : [1, 1, 1]) });
    input.addEventListener("input", () => this.hooks.light(id, { color: linearOf(input.value) }, false));
    input.addEventListener("change", () => this.hooks.light(id, { color: linearOf(input.value) }, true));
    return field("Colour", input);
  }

  // The slider goes from 1/64 of what the light was to 64 times that.
  private intensityRow(id: number, light: LightEdit, unit: string): HTMLElement {
    const row = this.numberRow(`Intensity, ${unit}`, light.intensity, (intensity) =>
      this.hooks.light(id, { intensity }, true));
    const text = row.querySelector("input")!;
    const middle = light.intensity > 0 ? light.intensity : 1;
    const slider = el("input", { type: "range", min: -6, max: 6, step: 0.05, value: 0, "aria-label": "Intensity" });
    const now = () => Number((middle * 2 ** Number(slider.value)).toPrecision(3));
    slider.addEventListener("input", () => {
      text.value = figure(now());
      this.hooks.light(id, { intensity: now() }, false);
    });
    slider.addEventListener("change", () => this.hooks.light(id, { intensity: now() }, true));
    text.before(slider);
    return row;
  }

  private numberRow(label: string, value: number, onSet: (value: number) => void): HTMLElement {
    const input = el("input", { type: "text", inputmode: "decimal", class: "number", value: figure(value) });
    input.addEventListener("change", () => {
      const typed = Number(input.value);
      if (input.value.trim() !== "" && Number.isFinite(typed)) onSet(typed);
      else input.value = figure(value);
    });
    return field(label, input);
  }
}

function lightWords(light: LightEdit): string {
  return [light.kind, light.intensity, light.color, light.coneInner, light.coneOuter].join(" ");
}
