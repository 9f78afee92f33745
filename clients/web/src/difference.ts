// Pictures of floats, and how far one is from another. Pure.

export interface Floats {
  readonly width: number;
  readonly height: number;
  readonly rgba: Float32Array; // rows from the top, scene-linear
}

function floatOfHalf(bits: number): number {
  const sign = bits & 0x8000 ? -1 : 1;
  const exponent = (bits >> 10) & 31;
  const fraction = bits & 1023;
  if (exponent === 0) return sign * fraction * 2 ** -24;
  if (exponent === 31) return fraction ? NaN : sign * Infinity;
  return sign * (1024 + fraction) * 2 ** (exponent - 25);
}

// The encoding `half`; null where the bytes are not as many as the size says.
export function readHalf(payload: Uint8Array, width: number, height: number): Floats | null {
  const count = 4 * width * height;
  if (payload.length !== 2 * count) return null;
  const view = new DataView(payload.buffer, payload.byteOffset, payload.length);
  const rgba = Float32Array.from({ length: count }, (_, i) => floatOfHalf(view.getUint16(2 * i, true)));
  return { width, height, rgba };
}

const luminance = (rgba: Float32Array, i: number): number =>
  0.2126 * rgba[i]! + 0.7152 * rgba[i + 1]! + 0.0722 * rgba[i + 2]!;

// Shares of the mean over both that black is taken for: what is nearly black has no error of a
// thousand per cent.
const FLOOR_SHARE = 0.02;

// Of each pixel, the difference of luminance as a share of the reference's.
export function relativeError(picture: Floats, reference: Floats): Float32Array {
  const count = picture.width * picture.height;
  let sum = 0;
  for (let i = 0; i < count; i++) sum += luminance(reference.rgba, 4 * i);
  const floor = Math.max(1e-12, (FLOOR_SHARE * sum) / count);
  return Float32Array.from({ length: count }, (_, i) => {
    const truth = luminance(reference.rgba, 4 * i);
    return Math.abs(luminance(picture.rgba, 4 * i) - truth) / Math.max(truth, floor);
  });
}

export const ERROR_MOST = 0.5; // what the last colour stands for

// From dark over purple and orange to light, evenly brighter, so that it can be read without
// colour too.
const RAMP = [
  [12, 12, 24], [60, 20, 90], [130, 35, 110], [200, 65, 80], [240, 130, 50], [252, 200, 90], [255, 250, 220],
] as const;

export function colourOf(error: number): [number, number, number] {
  const share = Math.min(1, Math.max(0, error / ERROR_MOST)) || 0;
  const at = share * (RAMP.length - 1);
  const low = Math.min(RAMP.length - 2, Math.floor(at));
  const [a, b] = [RAMP[low]!, RAMP[low + 1]!];
  const mix = (i: 0 | 1 | 2) => Math.round(a[i] + (b[i] - a[i]) * (at - low));
  return [mix(0), mix(1), mix(2)];
}
