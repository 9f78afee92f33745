import assert from "node:assert/strict";
import { test } from "node:test";
import { astray } from "../src/astray";
import { type Orbit, PITCH_MAX, eyeOf, forwardOf, frame, ofCamera, pan, rightOf, startOf, turn, upOf, walk, zoom } from "../src/orbit";
import { type Size, depthOf, project, unproject } from "../src/project";
import { type Mat4, type Vec3, dot, length, matrixOfQuat, multiply, sub } from "../src/vec";
import { near } from "./near";

const orbit: Orbit = { target: [1, 2, 3], yaw: 0.7, pitch: 0.3, distance: 5, yfov: 0.8 };
const level: Orbit = { ...orbit, yaw: 0, pitch: 0 };
const size: Size = { width: 800, height: 500 };
const room = { min: [-2, 0, -1], max: [2, 3, 1] } as const;
const at = (t: Vec3): Mat4 => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, ...t, 1];

test("axes are of length 1, across each other, the right way up", () => {
  for (const pitch of [-PITCH_MAX, 0, 1]) {
    const one = { ...orbit, pitch };
    const [f, r, u] = [forwardOf(one), rightOf(one), upOf(one)];
    near([length(f), length(r), length(u), dot(f, r), dot(r, u), dot(u, f)], [1, 1, 1, 0, 0, 0]);
    assert.ok(u[1] > 0);
  }
});

test("no turn at all looks along -z, with +x to the right", () => {
  near(forwardOf(level), [0, 0, -1]);
  near(rightOf(level), [1, 0, 0]);
  near(eyeOf(level), [1, 2, 8]);
});

test("turning keeps target and distance, and stops before the poles", () => {
  const one = turn(orbit, 2, 9);
  assert.equal(one.pitch, PITCH_MAX);
  assert.equal(one.target, orbit.target);
  assert.ok(Math.abs(length(sub(eyeOf(one), one.target)) - 5) < 1e-9);
  assert.ok(Math.abs(turn(orbit, 100, 0).yaw) <= Math.PI);
});

test("dragging to the right shows more of the left, down more of the top", () => {
  assert.ok(eyeOf(turn(level, 0.1, 0))[0] < eyeOf(level)[0]);
  assert.ok(eyeOf(turn(level, 0, 0.1))[1] > eyeOf(level)[1]);
});

test("panning: what is at the target follows the pointer", () => {
  const place = project(pan(orbit, 0.1, 0.2), orbit.target, size)!;
  near([place.x, place.y], [400 + 0.1 * 500, 250 + 0.2 * 500], 1e-6);
});

test("zoom keeps the direction and never reaches the target", () => {
  const one = zoom(orbit, 0.5);
  near(forwardOf(one), forwardOf(orbit));
  assert.equal(one.distance, 2.5);
  let close: Orbit = orbit;
  for (let i = 0; i < 2000; i++) close = zoom(close, 0.5);
  assert.ok(close.distance > 0);
});

test("coming nearer has no end: the pivot stays before the eye, and the eye goes on", () => {
  let close: Orbit = orbit;
  for (let i = 0; i < 200; i++) close = zoom(close, 0.8, 0.1);
  assert.equal(close.distance, 0.1);
  near(forwardOf(close), forwardOf(orbit));
  near([depthOf(close, close.target)], [0.1], 1e-9);
  const on = zoom(close, 0.8, 0.1);
  const step = sub(eyeOf(on), eyeOf(close));
  assert.ok(dot(step, forwardOf(on)) > 0.01 && length(step) < 0.1, `${step}`);
  // And back from there, as ever; nor does a pivot that is nearer jump away.
  assert.ok(zoom(on, 2, 0.1).distance > 0.1);
  assert.equal(zoom({ ...orbit, distance: 0.01 }, 0.5, 0.1).distance, 0.01);
});

test("walking moves the eye as it says", () => {
  near(sub(eyeOf(walk(level, 1, 2, 3)), eyeOf(level)), [2, 3, -1]);
});

test("framing: every corner is in the picture, wide or narrow", () => {
  for (const [width, height] of [[800, 500], [300, 900]] as const) {
    const one = frame(orbit, room, width / height);
    for (const x of [-2, 2]) for (const y of [0, 3]) for (const z of [-1, 1]) {
      const p = project(one, [x, y, z], { width, height })!;
      assert.ok(p && p.x >= 0 && p.x <= width && p.y >= 0 && p.y <= height, `${x} ${y} ${z}`);
    }
  }
  // A point is a scene too.
  assert.ok(frame(orbit, { min: [1, 1, 1], max: [1, 1, 1] }, 1).distance > 0);
});

test("a scene's camera is taken over: eye, direction, angle", () => {
  const turned = multiply(at([0, 1, 4]), matrixOfQuat([0, Math.sin(0.3), 0, Math.cos(0.3)]));
  const one = ofCamera(turned, 0.66, room);
  near(eyeOf(one), [0, 1, 4]);
  near(forwardOf(one), [-Math.sin(0.6), 0, -Math.cos(0.6)]);
  assert.equal(one.yfov, 0.66);
});

test("a camera in a room turns about what is before it in the room", () => {
  for (const yaw of [0, 1, 2, 3, 4, 5, 6]) {
    const turned = multiply(at([1.5, 1, 0.5]), matrixOfQuat([0, Math.sin(yaw / 2), 0, Math.cos(yaw / 2)]));
    const one = ofCamera(turned, 1, room);
    assert.ok(depthOf(one, one.target) > 0);
    assert.ok(one.target.every((x, i) => x >= room.min[i]! - 0.3 && x <= room.max[i]! + 0.3), `${yaw}: ${one.target}`);
  }
});

test("a scene that is out of sight, or left, is said to be", () => {
  const front = startOf(room, 1.6);
  assert.equal(astray(front, room, size, false), "");
  assert.equal(astray(front, room, size, true), "Outside the scene");
  const inside = ofCamera(at([0, 1, 0.9]), 1, room);
  assert.equal(astray(inside, room, size, true), "");
  for (const lost of [pan(front, 9, 0), zoom(front, 1000), walk(front, 100, 0, 0)])
    for (const isRoom of [true, false])
      assert.equal(astray(lost, room, size, isRoom), "Nothing of the scene is in sight");
  // Near enough that corners are behind the eye: that something is seen cannot be ruled out.
  assert.equal(astray({ ...front, target: [0, 1, 1.2], distance: 0.01, yaw: 0, pitch: 0 }, room, size, false), "");
});

test("a camera that looks straight down keeps what is to its right", () => {
  const down = matrixOfQuat([-Math.SQRT1_2, 0, 0, Math.SQRT1_2]);
  const one = ofCamera(multiply(at([0, 5, 0]), down), 1, room);
  near(rightOf(one), [1, 0, 0]);
  assert.ok(forwardOf(one)[1] < -0.999);
});

test("without a camera the view begins in front of all of it", () => {
  const one = startOf(room, 1);
  assert.ok(depthOf(one, [0, 1.5, 0]) > 0 && eyeOf(one)[2] > 1);
});

test("projection and its inverse agree; what is behind has no place", () => {
  for (const point of [{ x: 10, y: 20 }, { x: 790, y: 333 }]) {
    const back = project(orbit, unproject(orbit, point, 3.5, size), size)!;
    near([back.x, back.y], [point.x, point.y], 1e-6);
  }
  assert.equal(project(orbit, eyeOf(orbit), size), null);
  assert.equal(project(level, [1, 2, 9], size), null);
});
