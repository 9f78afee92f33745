// Mouse, touch and keys on the picture, to a camera that moves.
//
//   drag, one finger           turn            arrows
//   right, middle or Shift     pan             Shift + arrows
//   wheel, pinch               zoom            + and -
//   two fingers                pan and zoom    W A S D Q E walk, Home shows all of it
//   click, tap                 picks what is there

import { type Orbit, pan, turn, walk, zoom } from "./orbit";
import { type Point } from "./project";

const CLICK_PX = 4;
const TURN_PER_HEIGHT = Math.PI; // radians for a drag over the whole height
const KEY_TURN = Math.PI / 36;
const KEY_PAN = 0.05;
const KEY_ZOOM = 0.9;
const WHEEL_LINE_PX = 30;

export interface Camera {
  orbit(): Orbit | null;
  move(orbit: Orbit): void;
  pick(at: Point): void;
  showAll(): void;
  stepM(): number; // of one key of walking, metres
  nearestM(): number; // to what is turned about
}

// What a key does; null if it is none of the camera's.
export function afterKey(
  orbit: Orbit, key: string, isShifted: boolean, stepM: number, nearestM: number,
): Orbit | null {
  const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[key];
  if (arrow) {
    const [x, y] = arrow as [number, number];
    // The arrow names where the eye goes, so that the picture goes the other way.
    if (isShifted) return pan(orbit, -x * KEY_PAN, -y * KEY_PAN);
    return turn(orbit, -x * KEY_TURN, -y * KEY_TURN);
  }
  if (key === "+" || key === "=") return zoom(orbit, KEY_ZOOM, nearestM);
  if (key === "-" || key === "_") return zoom(orbit, 1 / KEY_ZOOM);
  const steps: Record<string, [number, number, number]> = {
    w: [1, 0, 0], s: [-1, 0, 0], a: [0, -1, 0], d: [0, 1, 0], q: [0, 0, -1], e: [0, 0, 1],
  };
  const step = steps[key.toLowerCase()];
  if (!step) return null;
  const size = stepM * (isShifted ? 5 : 1);
  return walk(orbit, step[0] * size, step[1] * size, step[2] * size);
}

interface Gesture {
  readonly pointers: Map<number, Point>;
  travelPx: number;
  isPan: boolean;
}

const spread = ([a, b]: Point[]): number => (a && b ? Math.hypot(a.x - b.x, a.y - b.y) : 0);

function middleOf(points: Point[]): Point {
  const sum = points.reduce((s, p) => ({ x: s.x + p.x, y: s.y + p.y }), { x: 0, y: 0 });
  return { x: sum.x / points.length, y: sum.y / points.length };
}

function pointOf(event: MouseEvent, stage: Element): Point {
  const box = stage.getBoundingClientRect();
  return { x: event.clientX - box.left, y: event.clientY - box.top };
}

export function listen(stage: HTMLElement, camera: Camera): void {
  const gesture: Gesture = { pointers: new Map(), travelPx: 0, isPan: false };
  stage.addEventListener("pointerdown", (event) => press(stage, gesture, event));
  stage.addEventListener("pointermove", (event) => drag(stage, gesture, camera, event));
  for (const name of ["pointerup", "pointercancel"] as const)
    stage.addEventListener(name, (event) => release(stage, gesture, camera, event));
  stage.addEventListener("wheel", (event) => onWheel(camera, event), { passive: false });
  stage.addEventListener("contextmenu", (event) => event.preventDefault());
  stage.addEventListener("keydown", (event) => onKey(camera, event, stage));
}

function press(stage: HTMLElement, gesture: Gesture, event: PointerEvent): void {
  if (gesture.pointers.size === 0) gesture.travelPx = 0;
  gesture.isPan = event.button !== 0 || event.shiftKey;
  gesture.pointers.set(event.pointerId, pointOf(event, stage));
  // The capture swallows the click on whatever lies inside of the stage: buttons and layers are its siblings.
  stage.setPointerCapture(event.pointerId);
  stage.focus({ preventScroll: true });
}

function drag(stage: HTMLElement, gesture: Gesture, camera: Camera, event: PointerEvent): void {
  const orbit = camera.orbit();
  if (!orbit || !gesture.pointers.has(event.pointerId)) return;
  const before = [...gesture.pointers.values()];
  gesture.pointers.set(event.pointerId, pointOf(event, stage));
  const after = [...gesture.pointers.values()];
  const [from, to] = [middleOf(before), middleOf(after)];
  const height = stage.clientHeight || 1;
  const [x, y] = [(to.x - from.x) / height, (to.y - from.y) / height];
  gesture.travelPx += Math.hypot(to.x - from.x, to.y - from.y);
  if (gesture.travelPx <= CLICK_PX && after.length === 1) return;
  if (after.length === 1 && !gesture.isPan) {
    camera.move(turn(orbit, x * TURN_PER_HEIGHT, y * TURN_PER_HEIGHT));
    return;
  }
  const factor = after.length > 1 ? spread(before) / Math.max(1, spread(after)) : 1;
  gesture.travelPx += after.length > 1 ? CLICK_PX : 0;
  camera.move(zoom(pan(orbit, x, y), factor, camera.nearestM()));
}

function release(stage: HTMLElement, gesture: Gesture, camera: Camera, event: PointerEvent): void {
  if (!gesture.pointers.delete(event.pointerId)) return;
  const isClick = gesture.travelPx <= CLICK_PX && gesture.pointers.size === 0;
  if (isClick && event.type === "pointerup" && event.button === 0) camera.pick(pointOf(event, stage));
}

function onWheel(camera: Camera, event: WheelEvent): void {
  const orbit = camera.orbit();
  if (!orbit) return;
  event.preventDefault();
  const pixels = event.deltaY * (event.deltaMode === WheelEvent.DOM_DELTA_LINE ? WHEEL_LINE_PX : 1);
  camera.move(zoom(orbit, Math.exp(Math.max(-300, Math.min(300, pixels)) * 0.0015), camera.nearestM()));
}

function onKey(camera: Camera, event: KeyboardEvent, stage: HTMLElement): void {
  const orbit = camera.orbit();
  if (!orbit || event.target !== stage || event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === "Home") {
    event.preventDefault();
    camera.showAll();
    return;
  }
  const moved = afterKey(orbit, event.key, event.shiftKey, camera.stepM(), camera.nearestM());
  if (!moved) return;
  event.preventDefault();
  camera.move(moved);
}
