// SHA-256 of bytes, as the 64 digits that name a blob.
//
// The browser's own where there is one. It is missing where the page came over plain HTTP from
// another machine, so that the same function is here once more.

export async function sha256Hex(bytes: Uint8Array<ArrayBuffer>): Promise<string> {
  const subtle = globalThis.crypto?.subtle;
  const digest = subtle ? new Uint8Array(await subtle.digest("SHA-256", bytes)) : sha256(bytes);
  return Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

// Fractional parts of the square roots (h) and cube roots (k) of the first primes.
function constants(): { h: Uint32Array; k: Uint32Array } {
  const h = new Uint32Array(8);
  const k = new Uint32Array(64);
  for (let found = 0, n = 2; found < 64; n++) {
    let isPrime = true;
    for (let d = 2; d * d <= n; d++) isPrime &&= n % d !== 0;
    if (!isPrime) continue;
    if (found < 8) h[found] = Math.floor((Math.sqrt(n) % 1) * 2 ** 32);
    k[found++] = Math.floor((Math.cbrt(n) % 1) * 2 ** 32);
  }
  return { h, k };
}

const table = constants();
const turnRight = (x: number, n: number) => (x >>> n) | (x << (32 - n));

function schedule(view: DataView, at: number, w: Int32Array): void {
  for (let i = 0; i < 16; i++) w[i] = view.getInt32(at + 4 * i);
  for (let i = 16; i < 64; i++) {
    const [a, b] = [w[i - 15]!, w[i - 2]!];
    const s0 = turnRight(a, 7) ^ turnRight(a, 18) ^ (a >>> 3);
    const s1 = turnRight(b, 17) ^ turnRight(b, 19) ^ (b >>> 10);
    w[i] = w[i - 16]! + s0 + w[i - 7]! + s1;
  }
}

function compress(state: Int32Array, w: Int32Array): void {
  let [a, b, c, d, e, f, g, h] = state as unknown as number[] as [
    number, number, number, number, number, number, number, number,
  ];
  for (let i = 0; i < 64; i++) {
    const s1 = turnRight(e, 6) ^ turnRight(e, 11) ^ turnRight(e, 25);
    const t1 = (h + s1 + ((e & f) ^ (~e & g)) + table.k[i]! + w[i]!) | 0;
    const s0 = turnRight(a, 2) ^ turnRight(a, 13) ^ turnRight(a, 22);
    const t2 = (s0 + ((a & b) ^ (a & c) ^ (b & c))) | 0;
    [h, g, f, e, d, c, b, a] = [g, f, e, (d + t1) | 0, c, b, a, (t1 + t2) | 0];
  }
  [a, b, c, d, e, f, g, h].forEach((value, i) => (state[i] = state[i]! + value));
}

export function sha256(bytes: Uint8Array): Uint8Array {
  const state = new Int32Array(table.h);
  const w = new Int32Array(64);
  const whole = bytes.length & ~63;
  const body = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
  for (let at = 0; at < whole; at += 64) {
    schedule(body, at, w);
    compress(state, w);
  }
  const rest = bytes.length - whole;
  const tail = new Uint8Array(rest < 56 ? 64 : 128);
  tail.set(bytes.subarray(whole));
  tail[rest] = 0x80;
  const end = new DataView(tail.buffer);
  end.setBigUint64(tail.length - 8, BigInt(bytes.length) * 8n);
  for (let at = 0; at < tail.length; at += 64) {
    schedule(end, at, w);
    compress(state, w);
  }
  const out = new DataView(new ArrayBuffer(32));
  state.forEach((value, i) => out.setInt32(4 * i, value));
  return new Uint8Array(out.buffer);
}
