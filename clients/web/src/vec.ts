// Vectors, quaternions (x y z w) and affine 4x4 matrices (column-major), as far as the page needs
// them. Nothing here changes its arguments.

export type Vec3 = readonly [number, number, number];
export type Quat = readonly [number, number, number, number];
export type Mat4 = readonly number[]; // 16

export const identity: Mat4 = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

export const add = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a: Vec3, s: number): Vec3 => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const length = (a: Vec3): number => Math.hypot(a[0], a[1], a[2]);
export const middle = (a: Vec3, b: Vec3): Vec3 => scale(add(a, b), 0.5);

export function cross(a: Vec3, b: Vec3): Vec3 {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

// Of a vector without a length: `otherwise`.
export function normalize(a: Vec3, otherwise: Vec3 = [0, 0, -1]): Vec3 {
  const size = length(a);
  return size > 1e-30 && Number.isFinite(size) ? scale(a, 1 / size) : otherwise;
}

export function vec3(values: readonly number[] | undefined, otherwise: Vec3 = [0, 0, 0]): Vec3 {
  return values && values.length >= 3 ? [values[0]!, values[1]!, values[2]!] : otherwise;
}

// --- matrices ---

const at = (m: Mat4, i: number): number => m[i] ?? 0;

export const translationOf = (m: Mat4): Vec3 => [at(m, 12), at(m, 13), at(m, 14)];

export function axisOf(m: Mat4, axis: 0 | 1 | 2): Vec3 {
  return [at(m, axis * 4), at(m, axis * 4 + 1), at(m, axis * 4 + 2)];
}

export function transformDirection(m: Mat4, d: Vec3): Vec3 {
  return add(
    add(scale(axisOf(m, 0), d[0]), scale(axisOf(m, 1), d[1])),
    scale(axisOf(m, 2), d[2]),
  );
}

export const transformPoint = (m: Mat4, p: Vec3): Vec3 =>
  add(transformDirection(m, p), translationOf(m));

function fromAxes(x: Vec3, y: Vec3, z: Vec3, t: Vec3): Mat4 {
  return [...x, 0, ...y, 0, ...z, 0, ...t, 1];
}

export function multiply(a: Mat4, b: Mat4): Mat4 {
  const axis = (i: 0 | 1 | 2) => transformDirection(a, axisOf(b, i));
  return fromAxes(axis(0), axis(1), axis(2), transformPoint(a, translationOf(b)));
}

// null of a matrix that flattens space.
export function invertAffine(m: Mat4): Mat4 | null {
  const [x, y, z] = [axisOf(m, 0), axisOf(m, 1), axisOf(m, 2)];
  const det = dot(x, cross(y, z));
  const size = length(x) * length(y) * length(z);
  if (!Number.isFinite(det) || Math.abs(det) <= 1e-12 * size || size === 0) return null;
  const rows = [cross(y, z), cross(z, x), cross(x, y)].map((row) => scale(row, 1 / det));
  const [r0, r1, r2] = rows as [Vec3, Vec3, Vec3];
  const inverse = fromAxes(
    [r0[0], r1[0], r2[0]],
    [r0[1], r1[1], r2[1]],
    [r0[2], r1[2], r2[2]],
    [0, 0, 0],
  );
  const t = transformDirection(inverse, translationOf(m));
  return fromAxes(axisOf(inverse, 0), axisOf(inverse, 1), axisOf(inverse, 2), scale(t, -1));
}

// --- quaternions ---

// The shortest turn that takes direction `from` to direction `to`.
export function turnBetween(from: Vec3, to: Vec3): Quat {
  const a = normalize(from);
  const b = normalize(to);
  const w = 1 + dot(a, b);
  if (w > 1e-6) return unit([...cross(a, b), w]);
  // Opposite: half a turn about anything across.
  const across = Math.abs(a[0]) < 0.9 ? cross(a, [1, 0, 0]) : cross(a, [0, 1, 0]);
  return [...normalize(across), 0];
}

function unit(q: Quat): Quat {
  const size = Math.hypot(...q) || 1;
  return [q[0] / size, q[1] / size, q[2] / size, q[3] / size];
}

export function multiplyQuat(a: Quat, b: Quat): Quat {
  const [av, bv]: [Vec3, Vec3] = [
    [a[0], a[1], a[2]],
    [b[0], b[1], b[2]],
  ];
  const v = add(add(scale(bv, a[3]), scale(av, b[3])), cross(av, bv));
  return unit([...v, a[3] * b[3] - dot(av, bv)]);
}

export function rotate(q: Quat, v: Vec3): Vec3 {
  const axis: Vec3 = [q[0], q[1], q[2]];
  const t = scale(cross(axis, v), 2);
  return add(add(v, scale(t, q[3])), cross(axis, t));
}

export function matrixOfQuat(q: Quat): Mat4 {
  return fromAxes(rotate(q, [1, 0, 0]), rotate(q, [0, 1, 0]), rotate(q, [0, 0, 1]), [0, 0, 0]);
}
