import assert from "node:assert/strict";
import { test } from "node:test";
import { Enabling } from "../src/pendant/enabling.ts";

function emulated(): Enabling {
  const made = new Enabling();
  made.mayBeKept = true;
  return made;
}

test("held it is said at once and every 50 ms", () => {
  const device = new Enabling();
  assert.deepEqual(device.down("v", 0), [1]);
  assert.deepEqual(device.tick(50), [1]);
  assert.deepEqual(device.tick(100), [1]);
});

test("it is said with each beat, also with one that comes soon after a late one", () => {
  const device = new Enabling();
  device.down("v", 0);
  assert.deepEqual(device.tick(80), [1]);
  assert.deepEqual(device.tick(100), [1]);
});

test("let go it is said once", () => {
  const device = new Enabling();
  device.down("v", 0);
  assert.deepEqual(device.up("v", 900, false), [0]);
  assert.deepEqual(device.tick(950), []);
});

test("with two hands on it, one may leave", () => {
  const device = new Enabling();
  device.down("v", 0);
  device.down("pad", 10);
  assert.deepEqual(device.up("v", 900, false), []);
  assert.equal(device.state, "held");
});

test("a tap on the pad keeps it where the controller is emulated", () => {
  const device = emulated();
  device.down("pad", 0);
  device.up("pad", 200, true);
  assert.equal(device.state, "kept");
});

test("a tap on the pad keeps nothing where the controller is not known to be emulated", () => {
  const device = new Enabling();
  device.down("pad", 0);
  assert.deepEqual(device.up("pad", 200, true), [0]);
  assert.deepEqual(device.keep(300), []);
  assert.equal(device.state, "released");
});

test("a longer hold of the pad is no tap", () => {
  const device = emulated();
  device.down("pad", 0);
  assert.deepEqual(device.up("pad", 400, true), [0]);
});

function keptUntil(device: Enabling, from: number, to: number): number {
  for (let now = from; now <= to; now += 50) if (device.tick(now).includes(0)) return now;
  return Infinity;
}

test("kept it ends 30 s after the last key or touch, and says why", () => {
  const device = emulated();
  device.keep(0);
  assert.equal(keptUntil(device, 50, 40_000), 30_000);
  assert.equal(device.endedBy, "unanswered");
});

test("every key or touch renews it", () => {
  const device = emulated();
  device.keep(0);
  assert.equal(keptUntil(device, 50, 20_000), Infinity);
  device.touched(20_000);
  assert.equal(keptUntil(device, 20_050, 60_000), 50_000);
});

test("it asks 5 s before the end", () => {
  const device = emulated();
  device.keep(0);
  assert.equal(device.asks(24_999), false);
  assert.equal(device.asks(25_000), true);
});

test("V on a kept device renews it and does not toggle it off", () => {
  const device = emulated();
  device.keep(0);
  assert.deepEqual(device.down("v", 10_000), []);
  assert.deepEqual(device.up("v", 10_100, false), []);
  assert.equal(device.state, "kept");
  assert.equal(device.left(10_100), 29_900);
});

test("after a silence that the server took for letting go it has to be taken anew", () => {
  const device = new Enabling();
  device.down("v", 0);
  device.tick(50);
  assert.deepEqual(device.tick(300), [0]);
  assert.equal(device.endedBy, "silent");
  assert.deepEqual(device.down("v", 310), []);
  device.up("v", 320, false);
  assert.deepEqual(device.down("v", 330), [1]);
});

test("pressed through it is a panic until it is let go", () => {
  const device = emulated();
  device.keep(0);
  assert.deepEqual(device.pressThrough("pad", 10), [2]);
  assert.equal(device.isOn, false);
  assert.deepEqual(device.up("pad", 100, true), [0]);
});

test("a sign in front of a press is one, too", () => {
  const device = new Enabling();
  device.down("v", 0);
  assert.deepEqual(device.ahead(200), [1]);
  assert.deepEqual(device.tick(300), [1]);
});
