// The objects of a scene: read, written, placed, measured.
import assert from "node:assert/strict";
import { test } from "node:test";
import { IDENTITY, aboutAxis, pose } from "../src/kinematics/pose.ts";
import { contentOf, distanceTo, drawn, freeName, graspOf, isSame, isWall, newEntry, readScene, resized, shapeOf, snapped } from "../src/scene/objects.ts";

const content = {
  schema: "openpendant-scene/1",
  revision: 3,
  objects: [
    { name: "table", shape: { type: "box", size: [1.2, 0.8, 0.05] }, position: [0, 0.6, -0.03], quaternion: [0, 0, 0, 1], frame: "base" },
    { name: "pin", shape: { type: "capsule", radius: 0.02, length: 0.1 }, position: [0, 0, 0.1], quaternion: [0, 0, 0, 1], frame: "base", link: "flange" },
    { name: "jig", shape: { type: "mesh", file: "jig.stl", scale: [1, 1, 1] }, position: [0, 0, 0], quaternion: [0, 0, 0, 1], frame: "root" },
  ],
  allowed: [["pin", "flange"]],
};

test("a scene that is read is written as it came", () => {
  const { schema, objects, allowed } = content;
  assert.deepEqual(contentOf(readScene(content, 3)), { schema, objects, allowed });
});

test("what is no object is left out", () => {
  assert.deepEqual(readScene({ objects: [null, 7, { name: "x", shape: { type: "cone" } }] }, 1).entries, []);
});

test("a capsule is drawn with its caps, which its file leaves out", () => {
  const [, pin] = readScene(content, 3).entries;
  assert.ok(pin !== undefined);
  assert.deepEqual(shapeOf(pin).size, [0.04, 0.04, 0.1 + 0.04]);
  assert.equal(drawn(pin, IDENTITY).held, true);
});

const at = pose([0, 0, 1], aboutAxis([0, 0, 1], Math.PI / 2));
const distance = (kind: "box" | "cylinder" | "sphere" | "capsule", sizes: number[], point: [number, number, number]) =>
  distanceTo({ ...newEntry(kind, [0, 0, 0], []), sizes }, at, point) ?? NaN;
const near = (found: number, wanted: number) => assert.ok(Math.abs(found - wanted) < 1e-12, `${found} for ${wanted}`);

test("the distance from a body is that to its nearest point, and 0 inside", () => {
  // A quarter turn: the box is 0.2 along y, 0.4 along x.
  near(distance("box", [0.2, 0.4, 0.6], [0.5, 0, 1]), 0.3);
  near(distance("box", [0.2, 0.4, 0.6], [0.23, 0.14, 1]), 0.05);
  near(distance("box", [0.2, 0.4, 0.6], [0.1, 0.05, 1.2]), 0);
  near(distance("cylinder", [0.1, 0.4], [0.13, 0, 1.24]), 0.05);
  near(distance("sphere", [0.1], [0, 0, 1.25]), 0.15);
  near(distance("capsule", [0.1, 0.4], [0, 0.03, 1.24]), 0);
  near(distance("capsule", [0.1, 0.4], [0, 0, 1.35]), 0.05);
});

test("a thin and large box is a wall, a table top is none", () => {
  const box = (sizes: number[]) => isWall({ ...newEntry("box", [0, 0, 0], []), sizes });
  assert.deepEqual([[0.02, 3, 2], [3, 0.02, 2], [1.2, 0.8, 0.02], [0.02, 0.1, 2], [0.02, 3, 0.1]].map(box), [true, true, false, false, false]);
});

test("a new object has a name of its own", () => {
  const first = newEntry("box", [0, 0, 0], []);
  assert.deepEqual([first.name, freeName("box", [first])], ["box", "box 2"]);
});

test("two entries are the same that would be written so", () => {
  const [table] = readScene(content, 3).entries;
  assert.ok(table !== undefined);
  assert.ok(isSame(table, { ...table }));
  assert.ok(!isSame(table, { ...table, pose: { ...table.pose, position: [0, 0, 0] } }));
});

test("a tool grasps at its own point, the bare flange at its centre with 10 mm", () => {
  const tools = { tools: [{ name: "gripper", grasp: { point: [0, 0, 0.05], reach: 0.02 } }] };
  assert.deepEqual(graspOf(tools, "gripper", pose([1, 0, 0], [0, 0, 0, 1])), { point: [1, 0, 0.05], reach: 0.02 });
  assert.deepEqual(graspOf(tools, null, pose([1, 0, 0], [0, 0, 0, 1])), { point: [1, 0, 0], reach: 0.01 });
});

test("an object has another colour than the seven before it, and keeps it as others are added", () => {
  const named = (...names: string[]) =>
    readScene({ objects: names.map((name) => ({ name, shape: { type: "sphere", radius: 0.1 } })) }, 1).entries.map(({ colour }) => colour);
  const names = ["bin", "table", "pillar", "part", "fence", "camera", "lamp", "door", "shelf"];
  const colours = named(...names);
  assert.equal(new Set(colours.slice(0, 8)).size, 8);
  assert.ok(!colours.slice(1, 8).includes(colours[8] ?? ""));
  assert.deepEqual(named(...names.slice(0, 5)), colours.slice(0, 5));
});

test("a place snaps to the raster", () => {
  assert.deepEqual(snapped(pose([0.0149, -0.0151, 0.2], [0, 0, 0, 1]), 0.01).position, [0.01, -0.02, 0.2]);
});

test("an object that is pulled grows along the axes that it has sizes for", () => {
  const pulled = (kind: "box" | "cylinder" | "sphere", sizes: number[], by: [number, number, number], snap = 0) =>
    resized({ ...newEntry(kind, [0, 0, 0], []), sizes }, by, snap).sizes.map((each) => Math.round(each * 1e6) / 1e6);
  assert.deepEqual(pulled("box", [0.1, 0.2, 0.3], [1, 2, 1]), [0.1, 0.4, 0.3]);
  assert.deepEqual(pulled("cylinder", [0.1, 0.2], [1.5, 1, 1]), [0.15, 0.2]);
  assert.deepEqual(pulled("sphere", [0.1], [1, 1, 3]), [0.3]);
  assert.deepEqual(pulled("box", [0.1, 0.2, 0.3], [1, 1, 1.11], 0.01), [0.1, 0.2, 0.33]);
});

test("what is pulled to nothing stays a body, and what is not pulled keeps its size beside a raster", () => {
  const box = { ...newEntry("box", [0, 0, 0], []), sizes: [0.1, 0.123, 0.3] };
  assert.deepEqual(resized(box, [0.0001, 1, 1], 0).sizes, [0.001, 0.123, 0.3]);
  assert.deepEqual(resized(box, [0.0001, 1, 1], 0.01).sizes, [0.01, 0.123, 0.3]);
});
