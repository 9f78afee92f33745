// What lies under a point of the picture, by the boxes of the scene's objects.

import { type Orbit } from "./orbit";
import { type Point, type Size, hitBox, rayAt } from "./project";
import { type Box, type Model, boxOf, meshNodes } from "./scene";
import { axisOf, length } from "./vec";

// The sum of its sides, not their product: a floor has no volume, and is large all the same.
function sizeOf({ worldFromBox, bounds }: Box): number {
  const side = (axis: 0 | 1 | 2) =>
    (bounds.max[axis] - bounds.min[axis]) * length(axisOf(worldFromBox, axis));
  return side(0) + side(1) + side(2);
}

// The smallest of the boxes that are hit: a room's box holds everything in it, and the eye. null
// beside all of them.
export function pick(model: Model, orbit: Orbit, at: Point, picture: Size): number | null {
  const ray = rayAt(orbit, at, picture);
  let [best, least] = [null as number | null, Infinity];
  for (const node of meshNodes(model)) {
    const box = boxOf(model, node);
    if (!box || !node.isShown) continue;
    const size = sizeOf(box);
    if (size >= least) continue;
    if (hitBox(ray, box.worldFromBox, box.bounds.min, box.bounds.max) === null) continue;
    [best, least] = [node.id, size];
  }
  return best;
}
