// How the picture is shown: layer, exposure, tone curve, detail.

import { el, field, options } from "./dom";
import { figure } from "./format";
import { type Settings } from "./settings";

export const LAYERS = [
  ["beauty", "Beauty"],
  ["direct", "Direct"],
  ["indirect", "Indirect"],
  ["emission", "Emission"],
  ["albedo", "Albedo"],
  ["normal", "Normal"],
  ["depth", "Depth"],
  ["error", "Error"],
] as const;

const STOPS_MOST = 16;

export class PicturePanel {
  private readonly layers = new Map<string, HTMLInputElement>();
  private readonly isAuto = el("input", { type: "checkbox" });
  private readonly stops = el("input", { type: "range", min: -STOPS_MOST, max: STOPS_MOST, step: 0.25 });
  private readonly stopsText = el("output", {});
  private readonly detail = el("select", {});
  private stopsUsed = 0;

  constructor(
    root: HTMLElement,
    layerRoot: HTMLElement,
    private readonly settings: Settings,
    private readonly onChange: () => void,
  ) {
    this.addLayers(layerRoot);
    const exposure = field("Exposure", this.stops, "Stops; at 0 a luminance of 1 cd/m² is white");
    exposure.append(this.stopsText);
    root.append(field("Automatic", this.isAuto, "Exposure from the picture's mean"), exposure,
      field("Tone curve", this.tone()), field("Detail", this.detail, "Share of the screen's pixels"),
      field("Smooth edges", this.smooth(), "Sub-frames that are averaged, at rest"),
      field("Coarse in motion", this.coarse(), "Smaller pictures while something moves, where a frame takes long"));
    this.isAuto.addEventListener("change", () => this.setExposure(this.isAuto.checked ? "auto" : String(this.stopsUsed)));
    this.stops.addEventListener("input", () => this.setExposure(this.stops.value));
    this.drawExposure();
  }

  // Half of a screen is what a software device can do; a person may know better.
  setDevice(isSoftware: boolean): void {
    this.settings.detail ||= isSoftware ? "0.5" : "1";
    options(this.detail, [["1", "Every pixel"], ["0.5", "Half"], ["0.25", "Quarter"], ["0.125", "Eighth"]]);
    this.detail.value = this.settings.detail;
    this.detail.onchange = () => {
      this.settings.detail = this.detail.value;
      this.onChange();
    };
  }

  // What the server chose, so that taking over from it does not jump.
  setStopsUsed(stops: number): void {
    this.stopsUsed = Math.round(stops * 4) / 4;
    if (this.settings.exposure === "auto") this.drawExposure();
  }

  private addLayers(root: HTMLElement): void {
    for (const [value, text] of LAYERS) {
      const input = el("input", { type: "radio", name: "layer", value });
      input.checked = this.settings.layer === value;
      input.addEventListener("change", () => {
        this.settings.layer = value;
        input.parentElement!.scrollIntoView({ block: "nearest", inline: "center" });
        this.onChange();
      });
      root.append(el("label", {}, input, el("span", {}, text)));
      this.layers.set(value, input);
    }
    if (!this.layers.has(this.settings.layer)) this.layers.get("beauty")!.click();
  }

  private tone(): HTMLElement {
    const select = el("select", {});
    options(select, [["neutral", "Neutral"], ["agx", "AgX"], ["linear", "Linear"]]);
    select.value = this.settings.tonemap;
    select.addEventListener("change", () => {
      this.settings.tonemap = select.value;
      this.onChange();
    });
    return select;
  }

  private smooth(): HTMLElement {
    const select = el("select", {});
    options(select, [["1", "Off"], ["4", "4 samples"], ["16", "16 samples"]]);
    select.value = this.settings.aa;
    select.addEventListener("change", () => {
      this.settings.aa = select.value;
      this.onChange();
    });
    return select;
  }

  private coarse(): HTMLElement {
    const input = el("input", { type: "checkbox" });
    input.checked = this.settings.coarseInMotion;
    input.addEventListener("change", () => {
      this.settings.coarseInMotion = input.checked;
      this.onChange();
    });
    return input;
  }

  private setExposure(value: string): void {
    this.settings.exposure = value;
    this.drawExposure();
    this.onChange();
  }

  private drawExposure(): void {
    const isAuto = this.settings.exposure === "auto";
    const stops = isAuto ? this.stopsUsed : Number(this.settings.exposure);
    this.isAuto.checked = isAuto;
    this.stops.value = String(stops);
    this.stopsText.textContent = `${stops > 0 ? "+" : ""}${figure(stops)}`;
  }
}
