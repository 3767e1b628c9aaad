// What the views take from a content: outlines of solids, handles, and whether to draw at all.
import assert from "node:assert/strict";
import { test } from "node:test";

import { IDENTITY, ofRpy, pose, rollPitchYaw, rotated } from "../src/kinematics/pose.ts";
import { eyeOf, Projection, type Orbit } from "../src/view/camera.ts";
import { isSame, isSameOverlay, linksInPlace } from "../src/view/changes.ts";
import { shaded } from "../src/view/colours.ts";
import { gizmoLines, grabbed } from "../src/view/flat_gizmo.ts";
import { pathDots } from "../src/view/path_dots.ts";
import { hull, isWithin, seenSolid, type Seen } from "../src/view/solids.ts";
import { EMPTY, type Content, type Gizmo } from "../src/view/view.ts";

const ORBIT: Orbit = { target: [0, 0, 0], azimuth: 0.4, elevation: 0.3, distance: 4 };
const BY = new Projection(ORBIT, 800, 600);
const MIDDLE = { x: 400, y: 300 };

function seen(form: string, size: number[], at = IDENTITY): Seen {
  const found = seenSolid({ form, size }, at, eyeOf(ORBIT), BY);
  assert.ok(found !== null);
  return found;
}

test("a hull has the outer points alone", () => {
  const corners = [{ x: 0, y: 0 }, { x: 2, y: 0 }, { x: 2, y: 2 }, { x: 0, y: 2 }];
  const found = hull([{ x: 1, y: 1 }, ...corners, { x: 1, y: 0 }]);
  assert.deepEqual(new Set(found.map(({ x, y }) => `${x} ${y}`)), new Set(["0 0", "2 0", "2 2", "0 2"]));
});

for (const [form, size] of Object.entries({
  box: [0.4, 0.4, 0.4], cylinder: [0.4, 0.4, 1], capsule: [0.4, 0.4, 1], sphere: [0.4, 0.4, 0.4],
  unknown: [0.4, 0.4, 0.4],
})) {
  test(`a ${form} is seen where it is, as large as it is`, () => {
    const { outline } = seen(form, size);
    assert.ok(isWithin(outline, MIDDLE));
    const wide = Math.max(...outline.map(({ x }) => x)) - Math.min(...outline.map(({ x }) => x));
    assert.ok(wide > 0.9 * BY.length(0.4, 4) && wide < 2 * BY.length(0.4, 4));
  });
}

test("of a box no more than three faces are seen, the upper one lightest", () => {
  const { faces } = seen("box", [1, 1, 1]);
  assert.equal(faces.length, 3);
  const lightest = faces.reduce((a, b) => (a.light > b.light ? a : b));
  const height = (face: typeof lightest): number => face.points.reduce((sum, { y }) => sum + y, 0);
  assert.ok(faces.every((face) => height(face) >= height(lightest)));
});

test("a cylinder seen from above shows its upper end", () => {
  const { faces, outline } = seen("cylinder", [0.4, 0.4, 1]);
  assert.equal(faces.length, 1);
  const top = Math.min(...outline.map(({ y }) => y));
  assert.ok(faces[0]!.points.some(({ y }) => Math.abs(y - top) < 1e-9));
});

test("nothing is seen of a solid behind the camera", () => {
  const at = { ...IDENTITY, position: eyeOf({ ...ORBIT, distance: 9 }) };
  assert.equal(seenSolid({ form: "box", size: [1, 1, 1] }, at, eyeOf(ORBIT), BY), null);
});

const HANDLE: Gizmo = { object: null, pose: IDENTITY, drags: "place", snap: 0 };

test("an arrow that is dragged moves along its axis by what the pointer went", () => {
  const [, , up] = gizmoLines(HANDLE, ORBIT, BY);
  const [from, tip] = up!.points;
  const grab = grabbed(HANDLE, ORBIT, BY, { x: (from!.x + tip!.x) / 2, y: (from!.y + tip!.y) / 2 + 1 });
  assert.equal(grab?.axis, 2);
  const [x, y, z] = grab!.at({ x: 400, y: 100 }).position;
  assert.deepEqual([x, y], [0, 0]);
  assert.ok(z > 0.5 && z < 2);
});

test("a dragged place goes by whole steps where it snaps", () => {
  const handle = { ...HANDLE, snap: 0.25 };
  const tip = gizmoLines(handle, ORBIT, BY)[2]!.points.at(-1)!;
  const { z } = { z: grabbed(handle, ORBIT, BY, tip)!.at({ x: tip.x, y: tip.y - 61 }).position[2] };
  assert.ok(z > 0 && Math.abs(z / 0.25 - Math.round(z / 0.25)) < 1e-9);
});

test("a ring that is dragged turns about its axis, the way that the pointer goes", () => {
  const handle: Gizmo = { ...HANDLE, drags: "turn" };
  const ring = gizmoLines(handle, ORBIT, BY)[2]!.points;
  const [from, to] = [ring[3]!, ring[7]!];
  const grab = grabbed(handle, ORBIT, BY, from);
  assert.equal(grab?.axis, 2);
  const { quaternion, position } = grab!.at(to);
  assert.deepEqual([...position], [0, 0, 0]);
  const [roll, pitch, yaw] = rollPitchYaw(quaternion);
  assert.ok(Math.abs(roll) < 1e-9 && Math.abs(pitch) < 1e-9);
  assert.ok(yaw > 0.2 && yaw < 1.6, String(yaw));
});

test("a ring turns about the pose's own axis", () => {
  const tilted: Gizmo = { ...HANDLE, drags: "turn", pose: pose([0, 0, 0], ofRpy([0.5, 0.3, 0])) };
  const ring = gizmoLines(tilted, ORBIT, BY)[0]!.points;
  const turned = grabbed(tilted, ORBIT, BY, ring[2]!)?.at(ring[6]!);
  const [before, after] = [tilted.pose, turned!].map((each) => rotated(each.quaternion, [1, 0, 0]));
  before!.forEach((each, index) => assert.ok(Math.abs(each - after![index]!) < 1e-9));
});

test("a size that is pulled along the object's own axis grows there alone", () => {
  const sized: Gizmo = { ...HANDLE, object: "box", drags: "size", pose: pose([0, 0, 0], ofRpy([0, 0, 0.8])) };
  const [start, tip] = [0, -1].map((at) => gizmoLines(sized, ORBIT, BY)[1]!.points.at(at)!);
  const grab = grabbed(sized, ORBIT, BY, tip!)!;
  assert.equal(grab.axis, 1);
  const further = { x: 2 * tip!.x - start!.x, y: 2 * tip!.y - start!.y };
  const [x, y, z] = grab.scale(further);
  assert.deepEqual([x, z], [1, 1]);
  assert.ok(y > 1.7 && y < 2.3, String(y));
  assert.deepEqual(grab.at(further), sized.pose);
  assert.ok(grab.scale({ x: 10 * start!.x - 9 * tip!.x, y: 10 * start!.y - 9 * tip!.y }).every((each) => each > 0));
});

test("the handles of a size stand along the object's own axes", () => {
  const quarter: Gizmo = { ...HANDLE, drags: "size", pose: pose([0, 0, 0], ofRpy([0, 0, Math.PI / 2])) };
  const tips = [gizmoLines(quarter, ORBIT, BY)[0]!, gizmoLines(HANDLE, ORBIT, BY)[1]!].map(({ points }) => points.at(-1)!);
  assert.ok(Math.hypot(tips[0]!.x - tips[1]!.x, tips[0]!.y - tips[1]!.y) < 1e-6);
});

test("dots stand on a path at its ends and at equal times", () => {
  const path = Float32Array.from({ length: 3 * 121 }, (_, index) => Math.floor(index / 3));
  const dots = [...pathDots(path)].filter((_, index) => index % 3 === 0);
  assert.deepEqual(dots, Array.from({ length: 13 }, (_, index) => 10 * index));
  assert.equal(pathDots(new Float32Array(3)).length, 0);
});

test("no handle is taken from far away", () => {
  assert.equal(grabbed(HANDLE, ORBIT, BY, { x: 30, y: 30 }), null);
});

test("the same joint values in another list are nothing new", () => {
  const content: Content = { ...EMPTY, joints: [1, 2], ghost: { joints: [3], verdict: "good" } };
  assert.ok(isSame(content, { ...content, joints: [1, 2], ghost: { joints: [3], verdict: "good" } }));
});

for (const [what, change] of Object.entries({
  joints: { joints: [1, 2.001] }, "no joints": { joints: null }, age: { stale: true },
  "what moves": { driven: [0] }, ghost: { ghost: { joints: [1], verdict: "good" } },
  path: { path: new Float32Array(3) }, theme: { theme: "light" }, objects: { objects: [] },
  gizmo: { gizmo: HANDLE }, meshes: { meshes: [] },
} satisfies Record<string, Partial<Content>>)) {
  test(`another content is drawn: ${what}`, () => {
    const content: Content = { ...EMPTY, joints: [1, 2], objects: EMPTY.objects };
    assert.ok(!isSame(content, { ...content, ...change }));
  });
}

test("a ghost hides the links that did not move, turned ones are shown", () => {
  const moved = pose([0, 0, 0], ofRpy([0, 0, 0.01]));
  const still = linksInPlace(new Map([["foot", IDENTITY], ["arm", IDENTITY]]), new Map([["foot", IDENTITY], ["arm", moved]]));
  assert.deepEqual([...still], ["foot"]);
});

test("a colour that is none is grey, and no light leaves the range", () => {
  assert.equal(shaded("blue", 1), "rgb(144 152 160)");
  assert.equal(shaded("#ffffff", 2), "rgb(255 255 255)");
  assert.equal(shaded("#102030", 0.5, 0.25), "rgb(8 16 24 / 0.25)");
});

test("what a task adds to the picture is the same where each part of it is", () => {
  const pose = { position: [0, 0, 1], quaternion: [0, 0, 0, 1] } as const;
  const gizmo = { object: null, pose, drags: "place", snap: 0 } as const;
  const path = new Float32Array(3);
  const added = { gizmo, path, ghost: { joints: [1], verdict: "good" } } as const;
  assert.ok(isSameOverlay(added, { path, gizmo: { ...gizmo }, ghost: { ...added.ghost, joints: [1] } }));
  assert.ok(isSameOverlay({}, { gizmo: null }));
  const others = [{ path: new Float32Array(3) }, { gizmo: null }, { gizmo: { ...gizmo, snap: 1 } }, { frames: [] }];
  for (const change of others) assert.ok(!isSameOverlay(added, { ...added, ...change }));
  assert.ok(!isSameOverlay(added, {}));
});
