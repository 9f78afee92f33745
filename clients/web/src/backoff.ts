// How long to wait before the next try to connect.

export const WAIT_FIRST_MS = 250;
export const WAIT_MOST_MS = 10_000;

// `failures` tries have failed since the last success, 1 or more. Doubles up to a limit; `random`
// in [0, 1) spreads clients that lost the same daemon.
export function waitBeforeTry(failures: number, random: number): number {
  const whole = Math.min(WAIT_MOST_MS, WAIT_FIRST_MS * 2 ** Math.min(failures - 1, 16));
  return whole * (0.75 + 0.5 * random);
}
