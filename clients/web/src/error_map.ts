// The layer `error`: where the picture differs from the reference, as colours over it.
//
// The server has no such layer: both pictures are asked for small and in floats, and compared here.
// The reference is asked for once for each view, with few samples first and with more after.

import { type Connection, Lost, Refusal } from "./connection";
import { type Floats, colourOf, readHalf, relativeError } from "./difference";
import { byId } from "./dom";
import { type Subject } from "./measure";

const SIDE_MOST_PX = 192;
// An even number, of two halves. Two are soon there, and show where the picture is far off.
const SAMPLES = [2, 4, 16, 64];

export class ErrorMap {
  private readonly canvas = byId<HTMLCanvasElement>("error-map");
  private readonly legend = byId("error-legend");
  private readonly text = byId("error-legend-text");
  private next: Subject | null = null;
  private isBusy = false;
  private epoch = 0; // grows with each change of the view
  private reference: { samples: number; floats: Floats } | null = null;

  constructor(
    private readonly connection: Connection,
    private readonly onFault: (message: string) => void,
  ) {}

  // The map that is shown is of another view now.
  drop(): void {
    this.epoch++;
    this.next = null;
    this.reference = null;
    this.canvas.hidden = true;
  }

  setLegend(isShown: boolean): void {
    this.legend.hidden = !isShown;
    if (this.canvas.hidden && !this.isBusy) this.text.textContent = "Tracing";
  }

  want(subject: Subject): void {
    this.next = subject;
    if (!this.isBusy) void this.run();
  }

  private async run(): Promise<void> {
    this.isBusy = true;
    while (this.next) {
      const subject = this.next;
      this.next = null;
      try {
        await this.show(subject);
      } catch (error) {
        if (error instanceof Refusal) this.onFault(error.message);
        else if (!(error instanceof Lost)) throw error;
      }
    }
    this.isBusy = false;
  }

  private async show(subject: Subject): Promise<void> {
    const epoch = this.epoch;
    const { technique, parameters } = subject.report;
    const picture = await this.floats(subject, technique, parameters);
    if (this.reference && epoch === this.epoch) this.draw(picture);
    for (const samples of SAMPLES) {
      if (epoch !== this.epoch || this.next) return;
      if (this.reference && this.reference.samples >= samples) continue;
      this.say(samples);
      const floats = await this.floats(subject, "reference", [{ key: "spp", value: String(samples) }]);
      if (epoch !== this.epoch) return;
      this.reference = { samples, floats };
      this.draw(picture);
      this.say(null);
    }
  }

  private async floats(
    { scene, look, report }: Subject,
    technique: string,
    parameters: { key: string; value: string }[],
  ): Promise<Floats> {
    const [width = 1, height = 1] = report.size;
    const shrink = Math.min(1, SIDE_MOST_PX / Math.max(width, height));
    const size = [width, height].map((side) => Math.max(1, Math.round(side * shrink)));
    const frame = { technique, parameters, size, ...look, encoding: "half" };
    const event = await this.connection.requestWhole("renderReply", { case: "render", value: { scene, frame } });
    const floats = readHalf(event.payload, size[0]!, size[1]!);
    if (!floats) throw new Refusal("bad_input", "the picture has another size than was asked for", "");
    return floats;
  }

  // What is seen, and what is on its way (samples, null: nothing).
  private say(next: number | null): void {
    const held = this.reference;
    const seen = held ? `of the reference with ${count(held.samples)} a pixel, its noise included` : "";
    const coming = next === null ? "" : `tracing ${count(next)}…`;
    this.text.textContent = [seen, coming].filter(Boolean).join("; ");
  }

  private draw(picture: Floats): void {
    const { floats } = this.reference!;
    const error = relativeError(picture, floats);
    const { width, height } = picture;
    const image = new ImageData(width, height);
    error.forEach((value, i) => image.data.set([...colourOf(value), 255], 4 * i));
    this.canvas.width = width;
    this.canvas.height = height;
    this.canvas.getContext("2d")!.putImageData(image, 0, 0);
    this.canvas.hidden = false;
  }
}

const count = (samples: number): string => (samples === 1 ? "1 sample" : `${samples} samples`);

