// The viewer's camera: a point that it looks at, a direction and a distance. Pure: input goes in,
// a new camera comes out.

import { type Mat4, type Vec3 } from "./vec";
import { add, axisOf, cross, dot, length, normalize, scale, sub, translationOf } from "./vec";

export interface Orbit {
  readonly target: Vec3; // metres, world
  readonly yaw: number; // radians about +y; 0 looks along -z
  readonly pitch: number; // radians; above 0 looks down
  readonly distance: number; // metres from the target
  readonly yfov: number; // radians, vertical
}

export interface Bounds {
  readonly min: Vec3;
  readonly max: Vec3;
}

export const PITCH_MAX = (89.5 * Math.PI) / 180;
const YFOV_STANDARD = (45 * Math.PI) / 180;

const clamp = (x: number, least: number, most: number) => Math.min(most, Math.max(least, x));

// From the eye to the target, length 1.
export function forwardOf(orbit: Orbit): Vec3 {
  const flat = Math.cos(orbit.pitch);
  return [
    -Math.sin(orbit.yaw) * flat,
    -Math.sin(orbit.pitch),
    -Math.cos(orbit.yaw) * flat,
  ];
}

export const eyeOf = (orbit: Orbit): Vec3 =>
  sub(orbit.target, scale(forwardOf(orbit), orbit.distance));

export interface Pose {
  readonly eye: number[];
  readonly target: number[];
  readonly yfov: number;
}

// What a frame is asked for with. A camera of the scene is named, not described: it may be tilted,
// or without perspective.
export type Look = { readonly camera: string } | { readonly pose: Pose };

export const poseOf = (orbit: Orbit): Pose =>
  ({ eye: [...eyeOf(orbit)], target: [...orbit.target], yfov: orbit.yfov });

export const lookOf = (orbit: Orbit, camera: string | null): Look =>
  camera === null ? { pose: poseOf(orbit) } : { camera };

export const rightOf = (orbit: Orbit): Vec3 => [Math.cos(orbit.yaw), 0, -Math.sin(orbit.yaw)];

export const upOf = (orbit: Orbit): Vec3 => cross(rightOf(orbit), forwardOf(orbit));

// Radians to the right and down that the picture is dragged by.
export function turn(orbit: Orbit, right: number, down: number): Orbit {
  const yaw = orbit.yaw - right;
  return {
    ...orbit,
    yaw: yaw - 2 * Math.PI * Math.round(yaw / (2 * Math.PI)),
    pitch: clamp(orbit.pitch + down, -PITCH_MAX, PITCH_MAX),
  };
}

// Shares of the picture's height to the right and down that the picture is dragged by: what lies
// at the target's depth follows the pointer.
export function pan(orbit: Orbit, right: number, down: number): Orbit {
  const height = 2 * orbit.distance * Math.tan(orbit.yfov / 2);
  const step = add(scale(rightOf(orbit), -right * height), scale(upOf(orbit), down * height));
  return { ...orbit, target: add(orbit.target, step) };
}

// `factor` below 1 comes nearer. Nearer to the target than `least` metres the eye goes on, and the
// target before it: there is no end to coming nearer, and what is turned about stays in front of
// the eye, at a distance that a turn can be seen by. Never out of numbers.
export function zoom(orbit: Orbit, factor: number, least = 1e-4): Orbit {
  const wanted = orbit.distance * factor;
  const distance = clamp(wanted, Math.min(least, orbit.distance), 1e7);
  if (!(factor < 1) || distance === wanted) return { ...orbit, distance };
  // As far as a step at that distance is, whatever is left of the way to it.
  const ahead = least * (1 - Math.max(factor, 0.1));
  return { ...orbit, distance, target: add(orbit.target, scale(forwardOf(orbit), ahead)) };
}

// How near the target may come in a scene.
export const nearestOf = (bounds: Bounds): number => Math.max(diagonalOf(bounds) * 0.02, 1e-4);

// Metres ahead, to the right and up (world): the eye moves, the view's direction stays.
export function walk(orbit: Orbit, ahead: number, right: number, up: number): Orbit {
  const step = add(
    add(scale(forwardOf(orbit), ahead), scale(rightOf(orbit), right)),
    [0, up, 0],
  );
  return { ...orbit, target: add(orbit.target, step) };
}

export const diagonalOf = (bounds: Bounds): number => length(sub(bounds.max, bounds.min));

// All of `bounds` in the picture, whatever its shape; the direction stays.
export function frame(orbit: Orbit, bounds: Bounds, aspect: number): Orbit {
  const radius = Math.max(diagonalOf(bounds) / 2, 1e-4);
  const half = orbit.yfov / 2;
  const narrow = Math.min(half, Math.atan(Math.tan(half) * aspect));
  return {
    ...orbit,
    target: scale(add(bounds.min, bounds.max), 0.5),
    distance: radius / Math.sin(narrow),
  };
}

// Looks at the scene from the front, a little from above.
export function startOf(bounds: Bounds, aspect: number): Orbit {
  const front = { target: [0, 0, 0], yaw: 0.4, pitch: 0.25, distance: 1, yfov: YFOV_STANDARD };
  return frame(front as unknown as Orbit, bounds, aspect);
}

export const isWithin = (point: Vec3, { min, max }: Bounds): boolean =>
  point.every((x, i) => x >= min[i]! && x <= max[i]!);

// Metres from a point in the bounds along a direction to where it leaves them.
function wayOut(from: Vec3, direction: Vec3, { min, max }: Bounds): number {
  const ways = direction.map((d, i) => (d === 0 ? Infinity : ((d > 0 ? max[i]! : min[i]!) - from[i]!) / d));
  return Math.min(...ways);
}

// What a camera of the scene sees. It looks along -z of its node. The target is put as deep as the
// scene's middle, so that the scene turns about what is in it; of a camera that stands inside, not
// beyond what it looks at, and no deeper than there is room behind it to turn.
export function ofCamera(worldFromNode: Mat4, yfov: number | undefined, bounds: Bounds): Orbit {
  const eye = translationOf(worldFromNode);
  const forward = normalize(scale(axisOf(worldFromNode, 2), -1));
  const centre = scale(add(bounds.min, bounds.max), 0.5);
  const depth = dot(sub(centre, eye), forward);
  const deepest = isWithin(eye, bounds) ? wayOut(eye, forward, bounds) / 2 : 1e7;
  const least = diagonalOf(bounds) * 0.05 + 1e-4;
  const distance = clamp(depth, least, Math.max(least, deepest));
  // Straight up or down the direction has no yaw: the camera's own right has one.
  const right = axisOf(worldFromNode, 0);
  const flat = Math.hypot(forward[0], forward[2]);
  const yaw = flat > 1e-4 ? Math.atan2(-forward[0], -forward[2]) : Math.atan2(-right[2], right[0]);
  const pitch = clamp(Math.asin(clamp(-forward[1], -1, 1)), -PITCH_MAX, PITCH_MAX);
  const orbit = { target: eye, yaw, pitch, distance, yfov: yfov ?? YFOV_STANDARD };
  return { ...orbit, target: add(eye, scale(forwardOf(orbit), distance)) };
}
