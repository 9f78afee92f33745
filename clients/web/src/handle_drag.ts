// Where a handle's node goes as the pointer moves. Pure: a drag is fixed at its beginning, and each
// point gives a place in the world, so that nothing adds up over a long drag.

import { type Orbit, rightOf, upOf } from "./orbit";
import { type Point, type Size, depthOf, metresPerPixel, nearestOnAxis, rayAt, unproject } from "./project";
import { type Placed, aimOf } from "./scene";
import { type Vec3, add, scale, sub, translationOf } from "./vec";

export type Handle = "x" | "y" | "z" | "plane" | "aim";

// A press that moves less is a click.
export const CLICK_PX = 4;

export interface Hold {
  readonly handle: Handle;
  readonly node: Placed;
  readonly orbit: Orbit;
  readonly size: Size;
  readonly anchor: Vec3; // where the handles meet
  readonly aimPx: number; // length of the aim's arrow
}

export interface Drag extends Hold {
  readonly held: Vec3; // the point in the world that was taken hold of
}

const AXES: Record<string, Vec3> = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
const KEY_PX = 6;

function aimTip(hold: Hold): Vec3 {
  const pixel = metresPerPixel(hold.orbit, depthOf(hold.orbit, hold.anchor), hold.size);
  return add(hold.anchor, scale(aimOf(hold.node), hold.aimPx * pixel));
}

// The point under the pointer on what this handle moves along.
function pointAt(hold: Hold, point: Point): Vec3 | null {
  const axis = AXES[hold.handle];
  if (axis) {
    const metres = nearestOnAxis(rayAt(hold.orbit, point, hold.size), hold.anchor, axis);
    return metres === null ? null : add(hold.anchor, scale(axis, metres));
  }
  const through = hold.handle === "aim" ? aimTip(hold) : hold.anchor;
  return unproject(hold.orbit, point, depthOf(hold.orbit, through), hold.size);
}

// `point` null: by keys, from where the handle is.
export function begin(hold: Hold, point: Point | null): Drag {
  const start = hold.handle === "aim" ? aimTip(hold) : hold.anchor;
  return { ...hold, held: (point && pointAt(hold, point)) ?? start };
}

function after(drag: Drag, step: Vec3): Vec3 {
  const from = drag.handle === "aim" ? aimTip(drag) : translationOf(drag.node.worldFromNode);
  return add(from, step);
}

// Of a move the node's new place, of an aim the point to aim at; null where the pointer says
// nothing, as along an axis that is seen from its end.
export function moved(drag: Drag, point: Point): Vec3 | null {
  const now = pointAt(drag, point);
  return now ? after(drag, sub(now, drag.held)) : null;
}

export function steppedByKey(drag: Drag, key: string, isShifted: boolean): Vec3 | null {
  const steps: Record<string, [number, number]> = {
    ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1],
  };
  const step = steps[key];
  if (!step) return null;
  const pixel = metresPerPixel(drag.orbit, depthOf(drag.orbit, drag.anchor), drag.size);
  const size = KEY_PX * pixel * (isShifted ? 8 : 1);
  const axis = AXES[drag.handle];
  if (axis) return after(drag, scale(axis, (step[0] + step[1]) * size));
  const across = add(scale(rightOf(drag.orbit), step[0]), scale(upOf(drag.orbit), step[1]));
  return after(drag, scale(across, size));
}
