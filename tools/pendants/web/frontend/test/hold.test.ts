import assert from "node:assert/strict";
import { test } from "node:test";
import { Holds } from "../src/pendant/hold.ts";
import type { Order } from "../src/pendant/hold.ts";

const JOINTS = { space: "joints", frame: "", count: 6 } as const;
const BASE = { axis: 0, direction: 1 } as const;
const ELBOW = { axis: 2, direction: -1 } as const;

function holds(): Holds {
  const made = new Holds();
  made.setAim(JOINTS);
  return made;
}

function kinds(orders: Order[]): string[] {
  return orders.map((each) => `${each.order} ${each.press}`);
}

test("a key that goes down starts a press with its direction and speed", () => {
  const [start] = holds().down("k", BASE, 0.25, 0);
  assert.deepEqual(start, {
    order: "start",
    press: 1,
    aim: JOINTS,
    values: [0.25, 0, 0, 0, 0, 0],
  });
});

test("a key that repeats starts nothing", () => {
  const held = holds();
  held.down("k", BASE, 1, 0);
  assert.deepEqual(held.down("k", BASE, 1, 30), []);
});

test("a press is beaten with rising numbers", () => {
  const held = holds();
  held.down("k", BASE, 1, 0);
  assert.deepEqual(held.tick(50), [{ order: "beat", press: 1, beat: 1 }]);
  assert.deepEqual(held.tick(100), [{ order: "beat", press: 1, beat: 2 }]);
});

test("letting go releases the press and ends its beats", () => {
  const held = holds();
  held.down("k", BASE, 1, 0);
  assert.deepEqual(kinds(held.up("k", 1, 40)), ["release 1"]);
  assert.deepEqual(held.tick(50), []);
});

test("a second key joins the first in one new press", () => {
  const held = holds();
  held.down("a", BASE, 0.5, 0);
  const [start] = held.down("b", ELBOW, 0.5, 10);
  assert.equal(start?.order, "start");
  assert.deepEqual(start?.order === "start" && start.values, [0.5, 0, -0.5, 0, 0, 0]);
});

test("of two keys the one that is still held goes on when the other is let go", () => {
  const held = holds();
  held.down("a", BASE, 0.5, 0);
  held.down("b", ELBOW, 0.5, 10);
  const [start] = held.up("a", 0.5, 20);
  assert.deepEqual(start?.order === "start" && start.values, [0, 0, -0.5, 0, 0, 0]);
});

test("an earlier press is beaten until its successor is accepted", () => {
  const held = holds();
  held.down("a", BASE, 1, 0);
  held.down("b", ELBOW, 1, 10);
  assert.deepEqual(kinds(held.tick(50)), ["beat 1", "beat 2"]);
  held.accepted(2);
  assert.deepEqual(kinds(held.tick(100)), ["beat 2"]);
});

test("a refused press lets go of everything", () => {
  const held = holds();
  held.down("a", BASE, 1, 0);
  held.down("b", ELBOW, 1, 10);
  assert.deepEqual(kinds(held.refused(2)), ["release 1"]);
  assert.deepEqual(held.tick(50), []);
});

test("a key whose press was refused moves nothing until it is pressed anew", () => {
  const held = holds();
  held.down("k", BASE, 1, 0);
  held.refused(1);
  assert.deepEqual(held.down("k", BASE, 1, 20), []);
  held.up("k", 1, 30);
  assert.deepEqual(kinds(held.down("k", BASE, 1, 40)), ["start 2"]);
});

test("two keys of one axis against each other stand, and neither goes on by itself", () => {
  const held = holds();
  held.down("a", BASE, 1, 0);
  assert.deepEqual(kinds(held.down("b", { axis: 0, direction: -1 }, 1, 10)), ["release 1"]);
  assert.deepEqual(held.up("b", 1, 20), []);
  assert.deepEqual(held.tick(50), []);
});

test("a page that was frozen beats no press that has ended at the server", () => {
  const held = holds();
  held.down("k", BASE, 1, 0);
  held.tick(50);
  assert.deepEqual(kinds(held.tick(300)), ["release 1"]);
  assert.deepEqual(held.tick(350), []);
});

test("a beat that is only late goes on", () => {
  const held = holds();
  held.down("k", BASE, 1, 0);
  held.tick(50);
  assert.deepEqual(kinds(held.tick(299)), ["beat 1"]);
});

test("a press that the server ended kills its key", () => {
  const held = holds();
  held.down("k", BASE, 1, 0);
  assert.deepEqual(held.ended(1), []);
  assert.deepEqual(held.tick(50), []);
  assert.deepEqual(held.down("k", BASE, 1, 60), []);
});

test("the end of a press that another took over from kills nothing", () => {
  const held = holds();
  held.down("a", BASE, 1, 0);
  held.down("b", ELBOW, 1, 10);
  held.accepted(2);
  held.ended(1);
  assert.deepEqual(kinds(held.tick(50)), ["beat 2"]);
});

test("another frame ends what is held", () => {
  const held = holds();
  held.down("k", BASE, 1, 0);
  assert.deepEqual(kinds(held.setAim({ space: "tool", frame: "base", count: 6 })), ["release 1"]);
});

test("the same frame again ends nothing", () => {
  const held = holds();
  held.down("k", BASE, 1, 0);
  assert.deepEqual(held.setAim({ ...JOINTS }), []);
});

test("numbers of presses rise and begin anew on a new link", () => {
  const held = holds();
  held.down("k", BASE, 1, 0);
  held.up("k", 1, 10);
  assert.deepEqual(kinds(held.down("k", BASE, 1, 20)), ["start 2"]);
  held.lost();
  held.up("k", 1, 30);
  assert.deepEqual(kinds(held.down("k", BASE, 1, 40)), ["start 1"]);
});

test("a key that is down while the link is lost holds nothing on the next one", () => {
  const held = holds();
  held.down("k", BASE, 1, 0);
  held.lost();
  assert.deepEqual(held.tick(50), []);
  assert.deepEqual(held.down("k", BASE, 1, 60), []);
});

test("sticks ask for parts of the speed, beside keys", () => {
  const held = holds();
  const [start] = held.steer([1, 0, -0.5, 0, 0, 0], 0.5, 0);
  assert.deepEqual(start?.order === "start" && start.values, [0.5, 0, -0.25, 0, 0, 0]);
  const [both] = held.down("k", { axis: 1, direction: 1 }, 0.5, 10);
  assert.deepEqual(both?.order === "start" && both.values, [0.5, 0.5, -0.25, 0, 0, 0]);
});

test("sticks that ask for more axes than there are move those", () => {
  const held = new Holds();
  held.setAim({ space: "joints", frame: "", count: 4 });
  const [start] = held.steer([1, 0, 0, 0, 1, 1], 1, 0);
  assert.deepEqual(start?.order === "start" && start.values, [1, 0, 0, 0]);
});

test("centred sticks release, and ask for nothing twice", () => {
  const held = holds();
  held.steer([1, 0, 0, 0, 0, 0], 1, 0);
  assert.deepEqual(kinds(held.steer(null, 1, 40)), ["release 1"]);
  assert.deepEqual(held.steer(null, 1, 60), []);
  assert.equal(held.isSteered, false);
});

test("sticks whose press was ended are dead until they were centred", () => {
  const held = holds();
  held.steer([1, 0, 0, 0, 0, 0], 1, 0);
  held.ended(1);
  assert.equal(held.isSteered, false);
  assert.deepEqual(held.steer([0.5, 0, 0, 0, 0, 0], 1, 40), []);
  held.steer(null, 1, 60);
  assert.deepEqual(kinds(held.steer([1, 0, 0, 0, 0, 0], 1, 80)), ["start 2"]);
});
