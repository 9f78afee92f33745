// Technique and parameters, from what the server says there is: ranges, choices, defaults.

import { isFieldSet } from "@bufbuild/protobuf";
import { type Parameter, ParameterSchema, type Technique } from "../gen/bounced_pb";
import { button, el, field, options, set } from "./dom";
import { type Settings } from "./settings";
import { type Range, STEPS, fromStep, hasSlider, toStep } from "./slider";

type Values = Record<string, string>;

// "vpls=64 finest=4" to its values.
export function valuesOf(setting: string): Values {
  const pairs = setting.split(" ").filter(Boolean).map((pair) => pair.split("=") as [string, string]);
  return Object.fromEntries(pairs);
}

// Which step of the ladder these values are; -1: none of them.
export function rungOf(ladder: readonly string[], standard: Values, changed: Values): number {
  return ladder.findIndex((setting) => {
    const wanted = { ...standard, ...valuesOf(setting) };
    return Object.entries(wanted).every(([key, value]) => same(changed[key] ?? standard[key], value));
  });
}

const same = (a: string | undefined, b: string | undefined): boolean =>
  a === b || (a !== undefined && b !== undefined && Number(a) === Number(b));

// What a request that names none gets: the server's own choice, in front of what it would mostly be.
const AUTO = "auto";

export function withAuto<T extends { name: string; isDefault?: boolean; summary?: string }>(techniques: readonly T[]): T[] {
  const usual = techniques.find((one) => one.isDefault);
  const summary = usual && `${usual.name}, with less of it while something moves`;
  return usual ? [{ ...usual, name: AUTO, summary }, ...techniques] : [...techniques];
}

// Of a server that does not say so the one that it would be.
export function defaultOf(techniques: readonly { name: string }[]): string {
  const found = [AUTO, "multires_gather"].map((name) => techniques.find((one) => one.name === name));
  return found.find((one) => one !== undefined)?.name ?? techniques[0]?.name ?? "";
}

const words = (key: string): string => key.replaceAll("_", " ").replace("vpl", "VPL").replace("rsm", "RSM");

export class TechniquePanel {
  private readonly select = el("select", {});
  private readonly summary = el("p", { class: "note" });
  private readonly quality = el("input", { type: "range", min: 0, step: 1 });
  private readonly qualityText = el("output", {});
  private readonly list = el("div", { class: "fields" });
  private readonly reset = button("Reset", () => this.change({}), { class: "quiet" });
  private techniques: Technique[] = [];

  constructor(
    root: HTMLElement,
    private readonly settings: Settings,
    private readonly onChange: () => void,
  ) {
    this.select.addEventListener("change", () => {
      settings.technique = this.select.value;
      this.draw();
      onChange();
    });
    this.quality.addEventListener("input", () => {
      const setting = this.technique?.ladder[Number(this.quality.value)];
      if (setting !== undefined) this.change(valuesOf(setting));
    });
    const quality = field("Quality", this.quality, "Cheapest to best, as the technique itself sets its parameters");
    quality.append(this.qualityText);
    const more = el("details", { class: "sub" },
      el("summary", {}, "Parameters"), this.list, this.reset);
    root.append(field("Technique", this.select), this.summary, quality, more);
  }

  setTechniques(all: Technique[]): void {
    const techniques = withAuto(all);
    this.techniques = techniques;
    const usual = techniques.filter((one) => !one.forComparison && !one.isReference);
    const group = (label: string, some: Technique[]) =>
      el("optgroup", { label }, ...some.map((one) => el("option", { value: one.name }, one.name)));
    this.select.replaceChildren(
      group("Rendered", usual),
      group("For comparison", techniques.filter((one) => one.forComparison)),
      group("Traced", techniques.filter((one) => one.isReference)),
    );
    if (!techniques.some((one) => one.name === this.settings.technique))
      this.settings.technique = defaultOf(techniques);
    this.select.value = this.settings.technique;
    this.draw();
  }

  private get technique(): Technique | undefined {
    return this.techniques.find((one) => one.name === this.settings.technique);
  }

  private get values(): Values {
    return this.settings.parameters[this.settings.technique] ?? {};
  }

  private change(values: Values): void {
    this.settings.parameters[this.settings.technique] = values;
    this.draw();
    this.onChange();
  }

  private setOne(parameter: Parameter, value: string): void {
    const values = { ...this.values, [parameter.key]: value };
    if (same(value, parameter.standard)) delete values[parameter.key];
    this.settings.parameters[this.settings.technique] = values;
    this.drawQuality();
    this.onChange();
  }

  private drawQuality(): void {
    const technique = this.technique;
    const ladder = technique?.ladder ?? [];
    const standard = Object.fromEntries((technique?.parameters ?? []).map((one) => [one.key, one.standard]));
    const rung = rungOf(ladder, standard, this.values);
    set(this.quality, { max: Math.max(0, ladder.length - 1), disabled: ladder.length < 2 });
    if (rung >= 0) this.quality.value = String(rung);
    this.qualityText.textContent = rung >= 0 ? `${rung + 1} of ${ladder.length}` : "own";
    this.reset.disabled = Object.keys(this.values).length === 0;
  }

  private draw(): void {
    const technique = this.technique;
    this.summary.textContent = technique?.summary ?? "";
    // The control that is under the person's finger stays the same element.
    this.list.replaceChildren(...(technique?.parameters ?? []).map((one) => this.control(one)));
    this.drawQuality();
  }

  private control(parameter: Parameter): HTMLElement {
    const value = this.values[parameter.key] ?? parameter.standard;
    const title = `${parameter.key}, ${parameter.standard} unless set`;
    if (parameter.choices.length > 0) return field(words(parameter.key), this.choice(parameter, value), title);
    const range: Range = {
      minimum: isFieldSet(parameter, ParameterSchema.field.minimum) ? parameter.minimum : -Infinity,
      maximum: isFieldSet(parameter, ParameterSchema.field.maximum) ? parameter.maximum : Infinity,
      isWhole: parameter.whole,
    };
    if (range.isWhole && range.minimum === 0 && range.maximum === 1)
      return field(words(parameter.key), this.toggle(parameter, value), title);
    return this.number(parameter, range, value, title);
  }

  private choice(parameter: Parameter, value: string): HTMLElement {
    const select = el("select", {});
    const names = new Set([...parameter.choices, parameter.standard]);
    options(select, [...names].map((name) => [name, name] as const));
    select.value = value;
    select.addEventListener("change", () => this.setOne(parameter, select.value));
    return select;
  }

  private toggle(parameter: Parameter, value: string): HTMLElement {
    const input = el("input", { type: "checkbox" });
    input.checked = value === "1";
    input.addEventListener("change", () => this.setOne(parameter, input.checked ? "1" : "0"));
    return input;
  }

  private number(parameter: Parameter, range: Range, value: string, title: string): HTMLElement {
    const text = el("input", { type: "text", inputmode: "decimal", value, class: "number", spellcheck: "false" });
    const row = field(words(parameter.key), text, title);
    const slider = hasSlider(range)
      ? el("input", { type: "range", min: 0, max: STEPS, tabindex: -1, "aria-hidden": "true" })
      : null;
    if (slider) {
      slider.value = String(toStep(range, Number(value)));
      slider.addEventListener("input", () => {
        text.value = String(fromStep(range, Number(slider.value)));
        this.setOne(parameter, text.value);
      });
      text.before(slider);
    }
    text.addEventListener("change", () => {
      if (text.value.trim() === "") text.value = parameter.standard;
      if (slider) slider.value = String(toStep(range, Number(text.value)));
      this.setOne(parameter, text.value.trim());
    });
    return row;
  }
}
