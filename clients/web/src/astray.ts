// Whether the eye has lost the scene, and what is said of it. Pure.

import { type Bounds, type Orbit, eyeOf, isWithin } from "./orbit";
import { type Size, project } from "./project";
import { type Vec3 } from "./vec";

const LEAST_PX = 24; // a scene that is smaller is a speck

const cornersOf = ({ min, max }: Bounds): Vec3[] =>
  [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [i & 1 ? max[0] : min[0], i & 2 ? max[1] : min[1], i & 4 ? max[2] : min[2]]);

// Nothing of the bounds is in the picture, or hardly a speck.
function isOutOfSight(orbit: Orbit, bounds: Bounds, size: Size): boolean {
  if (isWithin(eyeOf(orbit), bounds)) return false;
  const seen = cornersOf(bounds).map((corner) => project(orbit, corner, size));
  const before = seen.filter((point) => point !== null);
  if (before.length === 0) return true;
  if (before.length < seen.length) return false; // it reaches past the eye: what of it is seen, nobody knows here
  const [xs, ys] = [before.map((p) => p.x), before.map((p) => p.y)];
  const isBeside = Math.max(...xs) < 0 || Math.min(...xs) > size.width || Math.max(...ys) < 0 || Math.min(...ys) > size.height;
  const span = Math.max(Math.max(...xs) - Math.min(...xs), Math.max(...ys) - Math.min(...ys));
  return isBeside || span < LEAST_PX;
}

// `isRoom`: the scene is looked at from within, by its own camera.
export function astray(orbit: Orbit, bounds: Bounds, size: Size, isRoom: boolean): string {
  if (isOutOfSight(orbit, bounds, size)) return "Nothing of the scene is in sight";
  return isRoom && !isWithin(eyeOf(orbit), bounds) ? "Outside the scene" : "";
}
