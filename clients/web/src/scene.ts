// A scene as the page needs it: what can be moved, where it is, and what cameras there are.

import { create, isFieldSet } from "@bufbuild/protobuf";
import { type LightEdit, type NodeEdit, NodeEditSchema, type Scene, type SceneObject } from "../gen/bounced_pb";
import { CameraEditSchema, TransformEditSchema, type TransformEdit } from "../gen/bounced_pb";
import { type Bounds, type Orbit, ofCamera, startOf } from "./orbit";
import { type Mat4, type Quat, type Vec3, add, axisOf, identity, invertAffine } from "./vec";
import { matrixOfQuat, multiply, multiplyQuat, normalize, scale, sub, transformDirection } from "./vec";
import { transformPoint, translationOf, turnBetween, vec3 } from "./vec";

export interface Placed {
  readonly id: number; // of the node
  readonly name: string;
  readonly parent: number; // -1: a root
  readonly light: number; // -1: none
  readonly mesh: number;
  readonly camera: number;
  readonly isShown: boolean;
  readonly worldFromNode: Mat4;
  readonly transform: TransformEdit | undefined;
}

export interface Light {
  readonly id: number;
  readonly state: LightEdit;
}

export interface SceneCamera {
  readonly name: string;
  readonly index: string; // as frames name it
  readonly worldFromNode: Mat4;
  readonly yfov: number | undefined; // not set: of an orthographic one
}

export interface Model {
  readonly id: string;
  readonly name: string;
  readonly revision: bigint;
  readonly bounds: Bounds;
  readonly flags: readonly string[];
  readonly triangles: bigint;
  readonly nodes: ReadonlyMap<number, Placed>;
  readonly lights: ReadonlyMap<number, Light>;
  readonly meshes: ReadonlyMap<number, Bounds>; // in their own space
  readonly cameras: readonly SceneCamera[];
}

function idIn(node: NodeEdit, field: "parent" | "light" | "mesh" | "camera"): number {
  return isFieldSet(node, NodeEditSchema.field[field]) ? node[field] : -1;
}

function placedOf(object: SceneObject): Placed {
  const node = object.node!;
  const isHidden = isFieldSet(node, NodeEditSchema.field.shown) && !node.shown;
  return {
    id: object.id,
    name: object.name || node.name || `node ${object.id}`,
    parent: idIn(node, "parent"),
    light: idIn(node, "light"),
    mesh: idIn(node, "mesh"),
    camera: idIn(node, "camera"),
    isShown: !isHidden,
    worldFromNode: object.worldFromNode.length === 16 ? object.worldFromNode : identity,
    transform: node.transform,
  };
}

function byKind(scene: Scene, kind: string): SceneObject[] {
  return scene.objects.filter((object) => object.kind === kind);
}

function camerasOf(scene: Scene, nodes: Iterable<Placed>): SceneCamera[] {
  const lenses = new Map(byKind(scene, "camera").map((object) => [object.id, object]));
  const cameras: SceneCamera[] = [];
  const free = scene.cameras.map((name) => ({ name, isTaken: false }));
  for (const node of nodes) {
    const lens = lenses.get(node.camera)?.camera;
    if (!lens) continue;
    const hasAngle = !lens.orthographic && isFieldSet(lens, CameraEditSchema.field.yfov);
    const { name, worldFromNode } = node;
    const at = free.findIndex((one) => one.name === name && !one.isTaken);
    if (at < 0) continue;
    free[at]!.isTaken = true;
    cameras.push({ name, index: String(at), worldFromNode, yfov: hasAngle ? lens.yfov : undefined });
  }
  return cameras;
}

export function modelOf(scene: Scene): Model {
  const nodes = byKind(scene, "node").filter((object) => object.node).map(placedOf);
  const lights = byKind(scene, "light").filter((object) => object.light);
  const boundsOf = (object: SceneObject) => [
    object.id,
    { min: vec3(object.boundsMin), max: vec3(object.boundsMax) },
  ] as const;
  return {
    id: scene.id,
    name: scene.name,
    revision: scene.revision,
    bounds: { min: vec3(scene.boundsMin), max: vec3(scene.boundsMax, [1, 1, 1]) },
    flags: scene.flags,
    triangles: scene.counts?.triangles ?? 0n,
    nodes: new Map(nodes.map((node) => [node.id, node])),
    lights: new Map(lights.map((object) => [object.id, { id: object.id, state: object.light! }])),
    meshes: new Map(byKind(scene, "mesh").map(boundsOf)),
    cameras: camerasOf(scene, nodes),
  };
}

// Where the view begins: at the scene's first camera, or in front of all of it.
export function firstOrbit(model: Model, aspect: number): Orbit {
  const camera = model.cameras[0];
  if (!camera) return startOf(model.bounds, aspect);
  return ofCamera(camera.worldFromNode, camera.yfov, model.bounds);
}

// --- moving what is placed: new local transforms for new places in the world ---

function parentOf(model: Model, node: Placed): Mat4 {
  return model.nodes.get(node.parent)?.worldFromNode ?? identity;
}

export interface Local {
  readonly matrix?: number[];
  readonly translation?: number[];
  readonly rotation?: number[];
  readonly scale?: number[];
}

function matrixIn(transform: TransformEdit | undefined): number[] | null {
  return transform?.matrix.length === 16 ? transform.matrix : null;
}

// null where the parent flattens space: nothing that is done below it has a place in the world.
export function movedTo(model: Model, node: Placed, world: Vec3): Local | null {
  const inverse = invertAffine(parentOf(model, node));
  if (!inverse) return null;
  const place = transformPoint(inverse, world);
  const matrix = matrixIn(node.transform);
  if (matrix) return { matrix: [...matrix.slice(0, 12), ...place, 1] };
  return { ...partsOf(node.transform), translation: [...place] };
}

function partsOf(transform: TransformEdit | undefined): Local {
  if (!transform) return {};
  const fields = TransformEditSchema.field;
  const given = (field: "translation" | "rotation" | "scale") =>
    isFieldSet(transform, fields[field]) ? { [field]: transform[field] } : {};
  return { ...given("translation"), ...given("rotation"), ...given("scale") };
}

// Lights shine along -z of their node.
export const aimOf = (node: Placed): Vec3 => normalize(scale(axisOf(node.worldFromNode, 2), -1));

// Turned on the shortest way, so that -z points at `world`.
export function aimedAt(model: Model, node: Placed, world: Vec3): Local | null {
  const inverse = invertAffine(parentOf(model, node));
  if (!inverse) return null;
  const to = sub(world, translationOf(node.worldFromNode));
  const turn = turnBetween(
    transformDirection(inverse, aimOf(node)),
    transformDirection(inverse, to),
  );
  const matrix = matrixIn(node.transform);
  if (matrix) {
    const linear: Mat4 = [...matrix.slice(0, 12), 0, 0, 0, 1];
    return { matrix: [...multiply(matrixOfQuat(turn), linear).slice(0, 12), ...matrix.slice(12)] };
  }
  const held = (node.transform?.rotation.length === 4 ? node.transform.rotation : [0, 0, 0, 1]) as unknown as Quat;
  return { ...partsOf(node.transform), rotation: [...multiplyQuat(turn, held)] };
}

function matrixOfLocal(local: Local): Mat4 {
  if (local.matrix) return local.matrix;
  const q = (local.rotation ?? [0, 0, 0, 1]) as unknown as Quat;
  const s = vec3(local.scale, [1, 1, 1]);
  const t = vec3(local.translation);
  const r = matrixOfQuat(q);
  const axis = (i: 0 | 1 | 2) => scale(axisOf(r, i), s[i]);
  return [...axis(0), 0, ...axis(1), 0, ...axis(2), 0, ...t, 1];
}

// The model after a move that the server has yet to tell of: the node's and all below it.
export function withLocal(model: Model, node: Placed, local: Local): Model {
  const transform = create(TransformEditSchema, local);
  const worldFromNode = multiply(parentOf(model, node), matrixOfLocal(local));
  const nodes = new Map(model.nodes);
  nodes.set(node.id, { ...node, transform, worldFromNode });
  const inverse = invertAffine(node.worldFromNode);
  const step = inverse ? multiply(worldFromNode, inverse) : identity;
  for (const child of model.nodes.values())
    if (isBelow(model, child, node.id))
      nodes.set(child.id, { ...child, worldFromNode: multiply(step, child.worldFromNode) });
  return { ...model, nodes };
}

function isBelow(model: Model, node: Placed, ancestor: number): boolean {
  for (let at: Placed | undefined = node; at && at.parent >= 0; at = model.nodes.get(at.parent))
    if (at.parent === ancestor) return true;
  return false;
}

// --- what a person can take hold of ---

export interface Box {
  readonly worldFromBox: Mat4;
  readonly bounds: Bounds;
}

export function boxOf(model: Model, node: Placed): Box | null {
  const bounds = model.meshes.get(node.mesh);
  return bounds ? { worldFromBox: node.worldFromNode, bounds } : null;
}

// The middle of its box, or the node's own place.
export function anchorOf(model: Model, node: Placed): Vec3 {
  const box = boxOf(model, node);
  if (!box) return translationOf(node.worldFromNode);
  return transformPoint(box.worldFromBox, scale(add(box.bounds.min, box.bounds.max), 0.5));
}

export const lightNodes = (model: Model): Placed[] =>
  [...model.nodes.values()].filter((node) => node.light >= 0);

export const meshNodes = (model: Model): Placed[] =>
  [...model.nodes.values()].filter((node) => node.mesh >= 0);
