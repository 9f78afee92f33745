// Between the world and the picture's pixels, for handles that lie over it.

import { type Orbit, eyeOf, forwardOf, rightOf, upOf } from "./orbit";
import { type Mat4, type Vec3, add, dot, invertAffine, normalize, scale, sub } from "./vec";
import { transformDirection, transformPoint } from "./vec";

export interface Size {
  readonly width: number; // CSS pixels
  readonly height: number;
}

export interface Point {
  readonly x: number; // CSS pixels from the left
  readonly y: number; // from the top
}

export interface Ray {
  readonly origin: Vec3;
  readonly direction: Vec3; // length 1
}

// Metres that a CSS pixel covers at `depth` metres along the view's axis.
export const metresPerPixel = (orbit: Orbit, depth: number, size: Size): number =>
  (2 * depth * Math.tan(orbit.yfov / 2)) / size.height;

export const depthOf = (orbit: Orbit, world: Vec3): number =>
  dot(sub(world, eyeOf(orbit)), forwardOf(orbit));

// null for what is behind the eye.
export function project(orbit: Orbit, world: Vec3, size: Size): Point | null {
  const depth = depthOf(orbit, world);
  if (!(depth > orbit.distance * 1e-4)) return null;
  const from = sub(world, eyeOf(orbit));
  const pixel = metresPerPixel(orbit, depth, size);
  return {
    x: size.width / 2 + dot(from, rightOf(orbit)) / pixel,
    y: size.height / 2 - dot(from, upOf(orbit)) / pixel,
  };
}

// The point `depth` metres along the view's axis that is seen at `point`.
export function unproject(orbit: Orbit, point: Point, depth: number, size: Size): Vec3 {
  const pixel = metresPerPixel(orbit, depth, size);
  const across = add(
    scale(rightOf(orbit), (point.x - size.width / 2) * pixel),
    scale(upOf(orbit), (size.height / 2 - point.y) * pixel),
  );
  return add(add(eyeOf(orbit), scale(forwardOf(orbit), depth)), across);
}

export function rayAt(orbit: Orbit, point: Point, size: Size): Ray {
  const origin = eyeOf(orbit);
  return { origin, direction: normalize(sub(unproject(orbit, point, 1, size), origin)) };
}

// Where on the line through `start` along `axis` (length 1) the ray passes nearest: metres from
// `start`. null where the two are too nearly parallel to tell.
export function nearestOnAxis(ray: Ray, start: Vec3, axis: Vec3): number | null {
  const along = dot(ray.direction, axis);
  const sine2 = 1 - along * along;
  if (sine2 < 1e-3) return null;
  const between = sub(start, ray.origin);
  return (dot(between, ray.direction) * along - dot(between, axis)) / sine2;
}

// Where the ray enters a box that lies turned in the world: metres from its origin, 0 from inside.
export function hitBox(ray: Ray, worldFromBox: Mat4, min: Vec3, max: Vec3): number | null {
  const inverse = invertAffine(worldFromBox);
  if (!inverse) return null;
  const origin = transformPoint(inverse, ray.origin);
  const direction = transformDirection(inverse, ray.direction);
  let [near, far] = [0, Infinity];
  for (let i = 0; i < 3; i++) {
    const [o, d] = [origin[i]!, direction[i]!];
    if (d === 0) {
      if (o < min[i]! || o > max[i]!) return null;
      continue;
    }
    const [a, b] = [(min[i]! - o) / d, (max[i]! - o) / d];
    near = Math.max(near, Math.min(a, b));
    far = Math.min(far, Math.max(a, b));
  }
  return near <= far ? near : null;
}
