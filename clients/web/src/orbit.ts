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

// `factor` below 1 comes nearer. Never through the target, never out of numbers.
export function zoom(orbit: Orbit, factor: number): Orbit {
  return { ...orbit, distance: clamp(orbit.distance * factor, 1e-4, 1e7) };
}

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

// What a camera of the scene sees. It looks along -z of its node. The target is put as deep as the
// scene's middle, so that the scene turns about what is in it.
export function ofCamera(worldFromNode: Mat4, yfov: number | undefined, bounds: Bounds): Orbit {
  const eye = translationOf(worldFromNode);
  const forward = normalize(scale(axisOf(worldFromNode, 2), -1));
  const centre = scale(add(bounds.min, bounds.max), 0.5);
  const depth = dot(sub(centre, eye), forward);
  const distance = clamp(depth, diagonalOf(bounds) * 0.05 + 1e-4, 1e7);
  // Straight up or down the direction has no yaw: the camera's own right has one.
  const right = axisOf(worldFromNode, 0);
  const flat = Math.hypot(forward[0], forward[2]);
  const yaw = flat > 1e-4 ? Math.atan2(-forward[0], -forward[2]) : Math.atan2(-right[2], right[0]);
  const pitch = clamp(Math.asin(clamp(-forward[1], -1, 1)), -PITCH_MAX, PITCH_MAX);
  const orbit = { target: eye, yaw, pitch, distance, yfov: yfov ?? YFOV_STANDARD };
  return { ...orbit, target: add(eye, scale(forwardOf(orbit), distance)) };
}
