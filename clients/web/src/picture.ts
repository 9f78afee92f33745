// The canvas that frames are shown on.

const TYPES: Record<string, string> = { jpeg: "image/jpeg", png: "image/png" };

export class Picture {
  private readonly context: CanvasRenderingContext2D;

  constructor(readonly canvas: HTMLCanvasElement) {
    const context = canvas.getContext("2d", { alpha: false });
    if (!context) throw new Error("this browser has no canvas");
    this.context = context;
  }

  async show(payload: Uint8Array<ArrayBuffer>, encoding: string): Promise<void> {
    const bitmap = await createImageBitmap(new Blob([payload], { type: TYPES[encoding] ?? "" }));
    if (this.canvas.width !== bitmap.width || this.canvas.height !== bitmap.height) {
      this.canvas.width = bitmap.width;
      this.canvas.height = bitmap.height;
    }
    this.context.drawImage(bitmap, 0, 0);
    bitmap.close();
    this.canvas.classList.add("has-picture");
  }

  clear(): void {
    this.canvas.classList.remove("has-picture");
    this.context.clearRect(0, 0, this.canvas.width, this.canvas.height);
  }
}
