import assert from "node:assert/strict";
import { createHash } from "node:crypto";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { ReportSchema } from "../gen/bounced_pb";
import { WAIT_FIRST_MS, WAIT_MOST_MS, waitBeforeTry } from "../src/backoff";
import { afterKey } from "../src/camera_input";
import { fileNameOf } from "../src/export";
import { frameRequest, motionMs, motionScale, pictureSize } from "../src/frame_request";
import { jsonOfGlb, mainOf, match, resolve, urisOf } from "../src/gltf_files";
import { barsOf } from "../src/panel_cost";
import { wordsOf } from "../src/panel_progress";
import { hexOf, linearOf, placeTyped } from "../src/panel_objects";
import { defaultOf, rungOf, valuesOf, withAuto } from "../src/panel_technique";
import { ERROR_MOST, colourOf, readHalf, relativeError } from "../src/difference";
import { empty, evenAxis, grown, logAxis } from "../src/plot";
import { tokenOfFragment, withoutToken } from "../src/session";
import { readSettings, standard } from "../src/settings";
import { sha256 } from "../src/sha256";
import { STEPS, fromStep, hasSlider, toStep } from "../src/slider";
import { listOf, named } from "../src/upload";
import { Who, lineOf, nameOf, plainName } from "../src/who";
import { decode, encode } from "../src/wire";

test("waits double from the first to the most, and are spread", () => {
  assert.equal(waitBeforeTry(1, 0.5), WAIT_FIRST_MS);
  assert.equal(waitBeforeTry(3, 0.5), 4 * WAIT_FIRST_MS);
  assert.equal(waitBeforeTry(60, 0.5), WAIT_MOST_MS);
  assert.ok(waitBeforeTry(60, 0.999) < 1.26 * WAIT_MOST_MS && waitBeforeTry(1, 0) >= 0.75 * WAIT_FIRST_MS);
});

test("SHA-256 of every length around a block", () => {
  for (const size of [0, 1, 3, 55, 56, 63, 64, 65, 119, 120, 1000, 65537]) {
    const bytes = Uint8Array.from({ length: size }, (_, i) => (i * 131 + size) & 255);
    const expected = createHash("sha256").update(bytes).digest("hex");
    assert.equal(Buffer.from(sha256(bytes)).toString("hex"), expected, `${size}`);
  }
});

test("a message is its header's length, header, payload", () => {
  const bytes = encode(7n, { case: "viewCredit", value: { view: 3, count: 2 } });
  const { envelope, payload } = decode(new Uint8Array([...bytes, 9, 8]).buffer);
  assert.equal(envelope.requestId, 7n);
  assert.equal(envelope.body.case === "viewCredit" && envelope.body.value.count, 2);
  assert.deepEqual([...payload], [9, 8]);
  assert.throws(() => decode(new Uint8Array([200, 0, 0, 0, 1]).buffer));
  assert.throws(() => decode(new Uint8Array([1, 0]).buffer));
});

test("a token leaves the fragment, the rest stays", () => {
  assert.equal(tokenOfFragment("#scene=a&token=0123456789abcdef"), "0123456789abcdef");
  assert.equal(withoutToken("#scene=a&token=0123456789abcdef"), "#scene=a");
  assert.equal(withoutToken("#token=x"), "");
  assert.equal(tokenOfFragment("#scene=a"), null);
});

test("files of a glTF: each uri once, data: not, escapes followed, never out", () => {
  const text = JSON.stringify({
    buffers: [{ uri: "a%20b.bin" }, { uri: "data:application/octet-stream;base64,AA==" }, {}],
    images: [{ uri: "tex/c.png" }, { uri: "a%20b.bin" }, { bufferView: 0 }],
  });
  assert.deepEqual(urisOf(text), ["a%20b.bin", "tex/c.png"]);
  assert.equal(resolve("x/y/s.gltf", "../a%20b.bin"), "x/a b.bin");
  for (const uri of ["../../../b", "/etc/passwd", "http://h/x", "%2e%2e/%2e%2e/%2e%2e/b", "\\b"])
    assert.equal(resolve("x/y/s.gltf", uri), null, uri);
});

test("files picked one by one are found by name, if only one has it", () => {
  const main = { path: "s.gltf" };
  const flat = [main, { path: "c.png" }, { path: "other.png" }];
  assert.equal(match(main, "tex/c.png", flat), flat[1]);
  assert.equal(match(main, "tex/d.png", flat), null);
  const deep = [{ path: "m/s.gltf" }, { path: "m/tex/c.png" }, { path: "n/c.png" }];
  assert.equal(match(deep[0]!, "tex/c.png", deep), deep[1]);
  assert.equal(match(deep[0]!, "c.png", deep), null);
  assert.equal(mainOf([{ path: "a/b/x.glb" }, { path: "y.gltf" }, { path: "z.png" }])!.path, "y.gltf");
  assert.equal(mainOf([{ path: "z.png" }]), null);
});

test("the JSON in a .glb", () => {
  const head = Buffer.from([2, 0, 0, 0, 28, 0, 0, 0, 8, 0, 0, 0]);
  const glb = Buffer.concat([Buffer.from("glTF"), head, Buffer.from('JSON{"a":1} ')]);
  assert.equal(jsonOfGlb(glb), '{"a":1} ');
  assert.equal(jsonOfGlb(glb.subarray(0, 19)), null);
  assert.equal(jsonOfGlb(Buffer.from("nothing of the kind, but long")), null);
});

test("the ladder's rung is known again, by numbers", () => {
  const ladder = ["vpls=16 t=1", "vpls=256 t=0.10", "vpls=1024 t=inf"];
  const own = { vpls: "1024", t: "0.1", brdf: "full" };
  assert.deepEqual(valuesOf(ladder[1]!), { vpls: "256", t: "0.10" });
  assert.equal(rungOf(ladder, own, { vpls: "256" }), 1);
  assert.equal(rungOf(ladder, own, { t: "inf" }), 2);
  assert.equal(rungOf(ladder, own, { vpls: "256", brdf: "lambert" }), -1);
  assert.equal(rungOf(ladder, own, {}), -1);
});

test("sliders: ends are ends, steps come back, whole stays whole", () => {
  for (const range of [
    { minimum: 1, maximum: 16777216, isWhole: true },
    { minimum: 0, maximum: 1e6, isWhole: false },
    { minimum: 0, maximum: 2, isWhole: false },
    { minimum: 16, maximum: 8192, isWhole: true },
  ]) {
    assert.deepEqual([fromStep(range, 0), fromStep(range, STEPS)], [range.minimum, range.maximum]);
    for (let step = 0; step <= STEPS; step += 50) {
      const value = fromStep(range, step);
      assert.ok(value >= range.minimum && value <= range.maximum);
      if (range.isWhole) assert.equal(value, Math.round(value));
      const again = fromStep(range, toStep(range, value));
      assert.ok(Math.abs(again - value) <= 0.06 * Math.max(value, 0.02), `${value} ${again}`);
    }
  }
  assert.equal(hasSlider({ minimum: 0, maximum: Infinity, isWhole: false }), false);
});

test("settings that were stored by hand are taken as far as they fit", () => {
  const one = readSettings('{"layer":"direct","measure":"yes","parameters":null,"more":1}');
  assert.deepEqual(one, { ...standard, layer: "direct" });
  assert.deepEqual(readSettings("{"), standard);
  assert.deepEqual(readSettings("null"), standard);
  assert.equal(standard.against, "full"); // what a technique leaves out is seen
});

test("a request names the technique's own parameters alone, and is cheap in motion", () => {
  const parameters = { isr: { vpls: "64" }, rsm: { vpls: "9" } };
  const settings = { ...structuredClone(standard), technique: "isr", aa: "4", parameters };
  const still = frameRequest(settings, { size: [8, 8], isMoving: false });
  assert.deepEqual(still.parameters, [{ key: "vpls", value: "64" }]);
  const moving = frameRequest(settings, { size: [8, 8], isMoving: true });
  assert.deepEqual([still.aa, moving.aa], [4, 1]);
  assert.ok(moving.jpegQuality < still.jpegQuality);
});

test("pictures have the stage's shape, within the limits", () => {
  assert.deepEqual(pictureSize({ width: 960, height: 730 }, 1, 0.5), [480, 365]);
  assert.deepEqual(pictureSize({ width: 960, height: 730 }, 2, 1), [1920, 1460]);
  for (const side of pictureSize({ width: 9000, height: 30 }, 2, 1)) assert.ok(side >= 64 && side <= 4096);
  assert.deepEqual([0, 100, 200, 900, 1e5].map(motionScale), [1, 1, 0.5, 0.5, 0.5]);
});

test("what a frame says of those in motion: its own time, less what is done once, a sub-frame", () => {
  const size = [320, 200];
  const report = (more: object) =>
    create(ReportSchema, { size, aa: 1, timeMs: { total: 90, load: 20, compile: 10 }, ...more });
  assert.equal(motionMs(report({}), 0, size), 60);
  assert.equal(motionMs(report({ aa: 4 }), 0, size), 15);
  assert.equal(motionMs(report({}), 1, size), null);
  assert.equal(motionMs(report({ size: [160, 100] }), 0, size), null);
  assert.equal(motionMs(create(ReportSchema, { size }), 0, size), null);
});

test("a typed coordinate changes itself alone, and has to be a number", () => {
  const place = [1.23456789, -2, 3] as const;
  assert.deepEqual(placeTyped(place, 1, " 0.5 "), [1.23456789, 0.5, 3]);
  for (const text of ["", " ", "x", "1e999", "1,5"]) assert.equal(placeTyped(place, 0, text), null, text);
});

test("an export is named after its scene", () => {
  assert.deepEqual(["box.glb", "a.b.GLTF", "box", " ", ".glb"].map(fileNameOf),
    ["box.glb", "a.b.glb", "box.glb", "scene.glb", "scene.glb"]);
});

test("a pass's bar says what it is; what a pass names already is not said twice", () => {
  const report = create(ReportSchema, {
    timeMs: { total: 9, encode: 2, readback: 3, load: 0 },
    passes: [
      { name: "gather", ms: 4, state: "ran" },
      { name: "rsm", ms: 7, state: "reused" },
      { name: "readback", ms: 3, state: "ran" },
    ],
  });
  const said = barsOf(report).map((bar) => `${bar.name} ${bar.state}`);
  assert.deepEqual(said, ["gather ran", "rsm reused", "readback ran", "encode rest"]);
});

test("the plot grows, and begins anew when the error is measured", () => {
  const timed = create(ReportSchema, { timeMs: { total: 9 } });
  const checked = create(ReportSchema, { timeMs: { total: 9 }, error: [{ value: 0.1, low: 0.08, high: NaN }] });
  const one = grown(grown(empty, timed, 1), timed, 2);
  assert.deepEqual([one.unit, one.samples.length], ["ms", 2]);
  const two = grown(one, checked, 3);
  assert.deepEqual([two.unit, two.samples.length, two.samples[0]!.high], ["error", 1, null]);
  assert.equal(grown(two, timed, 4), two);
});

test("axes hold their values and have few round ticks", () => {
  for (const values of [[3, 4], [0.001, 5], [7e-5, 3e3], [2]]) {
    const axis = logAxis(values);
    assert.ok(axis.least < Math.min(...values) && axis.most > Math.max(...values));
    assert.ok(axis.ticks.length >= 1 && axis.ticks.length <= 6, `${values}: ${axis.ticks}`);
  }
  for (const most of [0, 0.4, 1, 7, 95]) {
    const { ticks } = evenAxis(most);
    assert.ok(ticks.length >= 2 && ticks.length <= 5, `${most}: ${ticks}`);
  }
});

test("keys: arrows turn, Shift pans, letters walk, others are left alone", () => {
  const orbit = { target: [0, 0, 0], yaw: 0, pitch: 0, distance: 2, yfov: 1 } as const;
  assert.ok(afterKey(orbit, "ArrowRight", false, 1, 0.1)!.yaw > 0);
  assert.ok(afterKey(orbit, "ArrowRight", true, 1, 0.1)!.target[0] > 0);
  assert.equal(afterKey(orbit, "w", false, 1, 0.1)!.target[2], -1);
  assert.ok(afterKey(orbit, "+", false, 1, 0.1)!.distance < 2);
  assert.equal(afterKey(orbit, "Tab", false, 1, 0.1), null);
});

test("colours: digits to linear light and back", () => {
  for (const hex of ["#000000", "#ffffff", "#8040c1"]) assert.equal(hexOf(linearOf(hex)), hex);
  assert.equal(hexOf([4, 2, 0]), hexOf([1, 0.5, 0]));
});

test("half floats: one, the smallest, the largest, minus two, what is no number", () => {
  const bits = [0x3c00, 0x0001, 0x7bff, 0xc000, 0x7c00, 0x7e00, 0x0000, 0x3555];
  const floats = readHalf(new Uint8Array(Uint16Array.from(bits).buffer), 2, 1)!;
  const [one, least, most, two, infinite, none, zero, third] = floats.rgba;
  assert.deepEqual([one, least, most, two, infinite, zero], [1, 2 ** -24, 65504, -2, Infinity, 0]);
  assert.ok(Number.isNaN(none) && Math.abs(third! - 1 / 3) < 1e-3);
  assert.equal(readHalf(new Uint8Array(15), 2, 1), null);
});

test("an error is a share of the reference, of black a share of what is usual", () => {
  const grey = (...values: number[]) =>
    ({ width: values.length, height: 1, rgba: Float32Array.from(values.flatMap((v) => [v, v, v, 1])) });
  const error = relativeError(grey(1.1, 2, 0.02), grey(1, 2, 0));
  assert.ok(Math.abs(error[0]! - 0.1) < 1e-6 && error[1] === 0);
  assert.ok(Math.abs(error[2]! - 1) < 1e-6);
  assert.deepEqual([...relativeError(grey(0), grey(0))], [0]);
});

test("more error is brighter, and there is a last colour", () => {
  const light = (e: number) => colourOf(e).reduce((a, b, i) => a + b * [0.2126, 0.7152, 0.0722][i]!, 0);
  for (let e = 0; e < ERROR_MOST; e += 0.02) assert.ok(light(e + 0.02) > light(e), `${e}`);
  assert.deepEqual([colourOf(9), colourOf(NaN)], [colourOf(ERROR_MOST), colourOf(0)]);
});

test("faults begin with the file that they are about", () => {
  assert.equal(named("a.glb", new Error("no glTF")).message, "a.glb: no glTF");
  assert.equal(named("a.glb", new Error("a.glb: no glTF")).message, "a.glb: no glTF");
  const files = ["a.txt", "b/c.txt", "d", "e"].map((path) => ({ path }));
  assert.equal(listOf(files.slice(0, 1)), "a.txt");
  assert.equal(listOf(files), "a.txt, b/c.txt, d and 1 more");
});

function store(): Storage & { held: Map<string, string> } {
  const held = new Map<string, string>();
  return {
    held,
    getItem: (key: string) => held.get(key) ?? null,
    setItem: (key: string, value: string) => void held.set(key, value),
    removeItem: (key: string) => void held.delete(key),
  } as Storage & { held: Map<string, string> };
}

test("each tab is somebody, and a person who typed a name the same one everywhere", () => {
  const browser = store();
  const tabs = [store(), store()];
  const [one, two] = tabs.map((tab) => new Who(browser, tab)) as [Who, Who];
  assert.match(one.by, /^viewer [0-9a-f]{4}$/);
  assert.equal(new Who(browser, tabs[0]!).by, one.by); // after a reload
  one.by = "  Zoë\u202e\n ";
  assert.equal(one.by, "Zoë");
  assert.equal(new Who(browser, store()).by, "Zoë");
  assert.notEqual(two.by, "Zoë"); // until it is loaded again
  one.by = "";
  assert.match(one.by, /^viewer /);
  assert.equal(new TextEncoder().encode(plainName("🦊".repeat(40))).length, 64);
  const broken = { getItem() { throw new Error("no"); }, setItem() { throw new Error("no"); }, removeItem() {} };
  assert.match(new Who(broken as unknown as Storage, broken as unknown as Storage).by, /^viewer /);
});

test("who did what, in a line", () => {
  assert.deepEqual(["local Anna B", "local", "alice", "alice pad", ""].map(nameOf), ["Anna B", "", "alice", "alice (pad)", ""]);
  const deed = { batch: "edit", author: "local Anna", of: 0n, changes: ["light 0", "node 1", "node 2"] };
  assert.equal(lineOf(deed, false), "Anna changed light 0 and 2 more");
  assert.equal(lineOf(deed, true), ""); // one knows what one does
  const undo = { ...deed, batch: "undo", of: 7n, changes: ["light 0"] };
  assert.equal(lineOf(undo, true), "You took back the change of revision 7: light 0");
  assert.equal(lineOf({ ...undo, batch: "redo", author: "" }, false), "Somebody did again the change of revision 7: light 0");
  assert.equal(lineOf({ ...undo, batch: "revert" }, false), "Anna went back to revision 7: light 0");
  assert.equal(lineOf({ ...undo, batch: "import" }, false), "");
});

test("how far a picture is", () => {
  const stand = { step: 1, samples: 1, isFinal: false, sinceMs: 300 };
  assert.equal(wordsOf(stand), "Refining: step 2");
  assert.equal(wordsOf({ ...stand, samples: 4, sinceMs: 5900 }), "Refining: step 2, 4 samples a pixel, 5 s on the next");
  assert.equal(wordsOf({ ...stand, isFinal: true }), "Finished after 2 steps");
});

test("the technique at first is the server's choice", () => {
  const some = [{ name: "direct" }, { name: "multires_gather" }, { name: "hisr" }];
  assert.equal(defaultOf(some), "multires_gather");
  assert.deepEqual(withAuto(some), some);
  const told = withAuto([...some, { name: "isr", isDefault: true, summary: "blocks" }]);
  assert.equal(defaultOf(told), "auto");
  assert.equal(told.length, 5);
  assert.equal(told[0]?.summary, "isr, with less of it while something moves");
  assert.equal(defaultOf([{ name: "direct" }]), "direct");
  assert.equal(defaultOf([]), "");
});
