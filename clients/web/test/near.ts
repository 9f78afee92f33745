import assert from "node:assert/strict";

export function near(a: readonly number[], b: readonly number[], e = 1e-9): void {
  assert.ok(a.length === b.length && a.every((x, i) => Math.abs(x - b[i]!) <= e), `${a} is not ${b}`);
}
