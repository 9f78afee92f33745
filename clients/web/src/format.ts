// Numbers for people: three significant digits, no trailing zeros, no exponent where it can do
// without.

export function figure(value: number): string {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e6)) return value.toExponential(1).replace("e+", "e");
  return String(Number(value.toPrecision(3)));
}

export function milliseconds(ms: number): string {
  if (!Number.isFinite(ms)) return "–";
  if (ms < 0.01) return "0 ms";
  return ms < 9_999 ? `${figure(ms)} ms` : `${figure(ms / 1000)} s`;
}

export const percent = (share: number): string => `${figure(share * 100)} %`;

export const plural = (count: number, one: string, many = `${one}s`): string =>
  `${count.toLocaleString("en")} ${count === 1 ? one : many}`;
