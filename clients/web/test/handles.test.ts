import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { SceneSchema } from "../gen/bounced_pb";
import { type Handle, begin, moved, steppedByKey } from "../src/handle_drag";
import { type Orbit, ofCamera } from "../src/orbit";
import { pick } from "../src/pick";
import { depthOf, hitBox, nearestOnAxis, project, rayAt } from "../src/project";
import { type Local, aimOf, aimedAt, anchorOf, firstOrbit, modelOf, movedTo, withLocal } from "../src/scene";
import { type Mat4, type Vec3, add, identity, invertAffine, multiply, normalize, scale, sub, transformPoint, translationOf } from "../src/vec";
import { near } from "./near";

const size = { width: 640, height: 480 };
const orbit: Orbit = { target: [0, 1, 0], yaw: 0.5, pitch: 0.4, distance: 6, yfov: 0.9 };

// A group that is turned, scaled and mirrored, below it a box and a spot; beside it a room.
const group: Mat4 = [0, 0, -2, 0, 0, 2, 0, 0, -2, 0, 0, 0, 3, 1, 0, 1];
const at = (t: Vec3): Mat4 => [...identity.slice(0, 12), ...t, 1];
const none = { parent: -1, mesh: -1, light: -1, camera: -1 };
const objects = [
  { kind: "node", id: 0, node: { ...none, transform: { matrix: [...group] } }, worldFromNode: [...group] },
  { kind: "node", id: 1, node: { ...none, parent: 0, mesh: 0, transform: { translation: [0.5, 0, 0], scale: [1, 1, 1] } },
    worldFromNode: [...multiply(group, at([0.5, 0, 0]))] },
  { kind: "node", id: 2, node: { ...none, parent: 0, light: 0, transform: { translation: [0, 1, 0] } },
    worldFromNode: [...multiply(group, at([0, 1, 0]))] },
  { kind: "node", id: 3, node: { ...none, mesh: 1 }, worldFromNode: [...identity] },
  { kind: "mesh", id: 0, boundsMin: [-0.25, -0.25, -0.25], boundsMax: [0.25, 0.25, 0.25] },
  { kind: "mesh", id: 1, boundsMin: [-9, 0, -9], boundsMax: [9, 9, 9] },
  { kind: "light", id: 0, light: { kind: "spot", intensity: 5 } },
];
const sceneOf = (more: object[]) =>
  modelOf(create(SceneSchema, { id: "s", cameras: ["Eye"], boundsMin: [-5, 0, -5], boundsMax: [5, 5, 5], objects: [...objects, ...more] }));
const model = sceneOf([]);
const node = (id: number) => model.nodes.get(id)!;
const placeOf = (id: number) => translationOf(node(id).worldFromNode);
const anchor = anchorOf(model, node(1));
const hold = (handle: Handle) => ({ handle, node: node(1), orbit, size, anchor, aimPx: 90 });
const after = (id: number, local: Local | null) => withLocal(model, node(id), local!).nodes;

test("an inverse undoes its matrix; a flat one has none", () => {
  near(multiply(group, invertAffine(group)!), identity);
  assert.equal(invertAffine([1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]), null);
});

test("a ray passes an axis nearest where it should", () => {
  const ray = { origin: [0, 0, 5] as Vec3, direction: normalize([1, 0, -5]) };
  assert.ok(Math.abs(nearestOnAxis(ray, [0, 0, 0], [1, 0, 0])! - 1) < 1e-9);
  assert.equal(nearestOnAxis({ ...ray, direction: [0, 0, -1] }, [0, 0, 0], [0, 0, 1]), null);
});

test("dragging an axis moves along it alone, as far as the pointer", () => {
  for (const [handle, axis] of [["x", [1, 0, 0]], ["y", [0, 1, 0]], ["z", [0, 0, 1]]] as [Handle, Vec3][]) {
    const to = add(anchor, scale(axis, 0.7));
    const drag = begin(hold(handle), project(orbit, anchor, size)!);
    const world = moved(drag, project(orbit, to, size)!)!;
    near(sub(world, placeOf(1)), sub(to, anchor), 1e-6);
  }
});

test("a drag begins without a jump wherever the handle is taken", () => {
  const from = { x: 200, y: 333 };
  for (const handle of ["x", "plane"] as const)
    near(moved(begin(hold(handle), from), from)!, placeOf(1));
});

test("dragging the disc stays at its depth, under the pointer", () => {
  const from = project(orbit, anchor, size)!;
  const world = moved(begin(hold("plane"), from), { x: from.x + 40, y: from.y - 25 })!;
  const place = project(orbit, add(anchor, sub(world, placeOf(1))), size)!;
  near([place.x, place.y], [from.x + 40, from.y - 25], 1e-6);
  near([depthOf(orbit, world)], [depthOf(orbit, placeOf(1))]);
});

test("keys step an axis there and back", () => {
  const there = steppedByKey(begin(hold("x"), null), "ArrowRight", false)!;
  const back = steppedByKey(begin(hold("x"), null), "ArrowLeft", false)!;
  assert.ok(there[0] > placeOf(1)[0] && back[0] < placeOf(1)[0]);
  near(add(there, back), scale(placeOf(1), 2));
  assert.equal(steppedByKey(begin(hold("x"), null), "Tab", false), null);
});

test("a place in the world becomes one below a turned, mirrored parent", () => {
  near(translationOf(after(1, movedTo(model, node(1), [1, 2, 3])).get(1)!.worldFromNode), [1, 2, 3]);
  const local = movedTo(model, node(1), [1, 2, 3])!;
  assert.deepEqual([local.scale, local.rotation, local.matrix], [[1, 1, 1], undefined, undefined]);
});

test("what lies below a node that moves goes with it, and nothing else", () => {
  const nodes = after(0, movedTo(model, node(0), [0, 0, 0]));
  near(sub(translationOf(nodes.get(2)!.worldFromNode), placeOf(2)), [-3, -1, 0]);
  near(nodes.get(3)!.worldFromNode, identity);
});

test("aiming points -z at the place, below a mirrored parent too, also straight back", () => {
  const back = sub(placeOf(2), aimOf(node(2)));
  for (const to of [[9, -3, 2], back] as Vec3[]) {
    const turned = after(2, aimedAt(model, node(2), to)).get(2)!;
    near(aimOf(turned), normalize(sub(to, placeOf(2))), 1e-6);
    near(translationOf(turned.worldFromNode), placeOf(2));
  }
  near(aimOf(after(0, aimedAt(model, node(0), [3, 9, 0])).get(0)!), [0, 1, 0], 1e-6);
});

test("picking: the small thing before the room that holds it, nothing beside", () => {
  assert.equal(pick(model, orbit, project(orbit, anchor, size)!, size), 1);
  assert.equal(pick(model, orbit, { x: 10, y: 400 }, size), 3);
  const out = { ...orbit, target: [0, 100, 0] as Vec3, pitch: -1 };
  assert.equal(pick(model, out, { x: 320, y: 240 }, size), null);
});

test("a turned box is hit where it is", () => {
  const corner = transformPoint(node(1).worldFromNode, [0.2, 0.2, 0.2]);
  const hit = (x: number, y: number) =>
    hitBox(rayAt(orbit, { x, y }, size), node(1).worldFromNode, [-0.25, -0.25, -0.25], [0.25, 0.25, 0.25]);
  const place = project(orbit, corner, size)!;
  assert.ok(hit(place.x, place.y)! > 0);
  assert.equal(hit(1, 1), null);
});

test("a scene's first camera is where the view begins", () => {
  const one = sceneOf([
    { kind: "node", id: 4, name: "Eye", node: { ...none, camera: 0 }, worldFromNode: [...at([0, 1, 8])] },
    { kind: "camera", id: 0, camera: { yfov: 0.5 } },
  ]);
  assert.deepEqual(firstOrbit(one, 1), ofCamera(at([0, 1, 8]), 0.5, one.bounds));
});
