// DH frames and user frames in base.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { Chain, describedRobot } from "../src/kinematics/chain.ts";
import { dhFrames, dhTable } from "../src/kinematics/dh.ts";
import { aboutAxis, composed, distance, pose } from "../src/kinematics/pose.ts";
import type { Pose } from "../src/kinematics/pose.ts";
import { NO_CELL } from "../src/pendant/cell.ts";
import type { Cell } from "../src/pendant/cell.ts";
import { NoticeKind, StateField } from "../src/protocol.ts";
import type { HelloReply, ShapesShowReply, State } from "../src/protocol.ts";
import { cellFrames, frameMarks } from "../src/scene/frames.ts";
import type { App } from "../src/ui/app.ts";

interface Case {
  name: string;
  shapes: ShapesShowReply;
  facts: Record<string, unknown>;
  joints: number[];
}

const path = process.env["DH_CASES"];
const cases = path === undefined ? [] : (JSON.parse(readFileSync(path, "utf8")) as Case[]);

test("the last DH frame and the table's tool are where the chain has its tool link", { skip: cases.length === 0 }, () => {
  for (const { name, shapes, facts, joints } of cases) {
    const chain = new Chain(describedRobot(shapes, facts));
    const table = dhTable(facts);
    assert.ok(table !== null, name);
    const frames = dhFrames(table, chain, joints);
    assert.equal(frames.length, table.rows.length + 1);
    const end = composed(frames.at(-1) as Pose, table.tool);
    assert.ok(distance(end.position, chain.flange(joints).position) < 1e-6, `${name}: ${end.position} ${chain.flange(joints).position}`);
  }
});

test("a robot without a table has no DH frames", () => {
  assert.equal(dhTable({ dh: null }), null);
});

test("a user frame stands in its parent, and one of an unknown parent is left out", () => {
  const quat = [...aboutAxis([0, 0, 1], Math.PI / 2)];
  const frames = [
    { name: "table", parent: "base", xyz: [1, 0, 0], quat },
    { name: "corner", parent: "table", xyz: [0.5, 0, 0], quat: [0, 0, 0, 1] },
    { name: "lost", parent: "nowhere", xyz: [0, 0, 0], quat: [0, 0, 0, 1] },
    { name: "tip", parent: "tool", xyz: [0, 0, 0.1], quat: [0, 0, 0, 1] },
  ];
  const marks = frameMarks({ frames }, { tool: pose([0, 0, 1], [0, 0, 0, 1]) });
  assert.deepEqual(marks.map(({ name }) => name), ["table", "corner", "tip"]);
  assert.ok(distance(marks[1]?.position ?? [0, 0, 0], [1, 0.5, 0]) < 1e-12);
  assert.ok(distance(marks[2]?.position ?? [0, 0, 0], [0, 0, 1.1]) < 1e-12);
});

const HELLO = { session: 7 } as HelloReply;

/** A cell whose tool stands in a place along x [m]. */
function toolAt(x: number, changes: Record<number, number> = {}): Cell {
  const state = { valid_fields: StateField.TOOL, tool_position: [x, 0, 1], tool_orientation: [0, 0, 0, 1] } as unknown as State;
  return { ...NO_CELL, stage: "up", hello: HELLO, state, changes };
}

const settled = (): Promise<void> => new Promise((done) => setTimeout(done, 5));

test("many frames come in parts", async () => {
  const named = (name: string) => ({ name, parent: "base", xyz: [0, 0, 0], quat: [0, 0, 0, 1] });
  const session = {
    call: ({ first }: { first: number }) =>
      Promise.resolve(first === 0 ? { content: { frames: [named("a")] }, next: 50 } : { content: { tools: [{ name: "gripper" }], frames: [named("b")] }, next: null }),
  };
  const frames = cellFrames({ session, choice: { set: () => undefined } } as unknown as App);
  frames.content(toolAt(0));
  await settled();
  assert.deepEqual(frames.content(toolAt(0)), { tools: [{ name: "gripper" }], frames: [named("a"), named("b")] });
});

test("frames are asked for once, and again when they change; the list is another one only where they moved", async () => {
  const asked: string[] = [];
  const session = {
    call: ({ op }: { op: string }) => {
      asked.push(op);
      return Promise.resolve({ content: { frames: [{ name: "table", parent: "base", xyz: [1, 0, 0], quat: [0, 0, 0, 1] }] } });
    },
  };
  const frames = cellFrames({ session, choice: { set: () => undefined } } as unknown as App);
  const chain = { root: pose([0, 0, 0], [0, 0, 0, 1]), flange: () => pose([0, 0, 0], [0, 0, 0, 1]) } as unknown as Chain;
  assert.deepEqual(frames.all(toolAt(0.5), chain).map(({ name }) => name), ["base", "tool"]);
  await settled();
  const marks = frames.all(toolAt(0.5), chain);
  assert.deepEqual(marks.map(({ name }) => name), ["base", "tool", "table"]);
  assert.equal(frames.all(toolAt(0.50001), chain), marks);
  assert.notEqual(frames.all(toolAt(0.6), chain), marks);
  assert.equal(asked.length, 1);
  frames.all(toolAt(0.6, { [NoticeKind.FRAMES]: 1 }), chain);
  assert.equal(asked.length, 2);
  await settled();
  const other = { ...toolAt(0.6), hello: { ...HELLO } };
  assert.deepEqual(frames.all(other, chain).map(({ name }) => name), ["base", "tool"], "another cell has its own");
  assert.equal(asked.length, 3);
});
