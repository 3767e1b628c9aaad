// Poses of links against those of Python, which come in the file that KINEMATICS_CASES names.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { Chain, describedRobot } from "../src/kinematics/chain.ts";
import {
  composed,
  homogeneous,
  inverse,
  ofRpy,
  pose,
  rollPitchYaw,
  transformed,
  zTowards,
  type Pose,
} from "../src/kinematics/pose.ts";
import type { ShapesShowReply } from "../src/operations.ts";

interface Case {
  shapes: ShapesShowReply;
  facts: Record<string, unknown>;
  questions: { joints: number[]; places: Record<string, { position: number[]; quaternion: number[] }> }[];
}

const file = process.env["KINEMATICS_CASES"];
const cases: Case[] = file === undefined ? [] : (JSON.parse(readFileSync(file, "utf8")) as Case[]);

/** The two quaternions of one rotation count as one. */
function assertSame(found: Pose, told: { position: number[]; quaternion: number[] }, what: string): void {
  const wanted = pose(told.position, told.quaternion);
  const off = Math.hypot(...found.position.map((each, i) => each - (wanted.position[i] ?? 0)));
  assert.ok(off < 1e-9, `${what}: ${off} m off`);
  const cosine = found.quaternion.reduce((sum, each, i) => sum + each * (wanted.quaternion[i] ?? 0), 0);
  assert.ok(Math.abs(cosine) > 1 - 1e-12, `${what}: turned`);
}

for (const { shapes, facts, questions } of cases) {
  test(`links of ${shapes.robot} are where Python has them`, () => {
    const chain = new Chain(describedRobot(shapes, facts));
    for (const { joints, places } of questions) {
      const found = chain.linkPoses(joints);
      assert.deepEqual([...found.keys()].sort(), Object.keys(places).sort());
      for (const [link, told] of Object.entries(places)) {
        assertSame(found.get(link)!, told, `${link} at ${joints.join(" ")}`);
      }
    }
  });
}

const ARM: ShapesShowReply = {
  robot: "arm",
  shapes: [],
  struts: [],
  links: [
    { link: "foot", joint: null, mesh: null },
    { link: "upper", joint: "first", mesh: null },
    { link: "lower", joint: "second", mesh: null },
  ],
  joints: [
    {
      name: "first", display_name: "First", type: "revolute", parent: "foot", child: "upper",
      xyz: [0, 0, 1], quat: [0, 0, 0, 1], axis: [0, 0, 1], lower: -3, upper: 3, driven: true,
      coupled_to: [], offset: 0,
    },
    {
      name: "second", display_name: "Second", type: "revolute", parent: "upper", child: "lower",
      xyz: [1, 0, 0], quat: [0, 0, 0, 1], axis: [0, 0, 1], lower: -3, upper: 3, driven: true,
      coupled_to: [{ joint: "first", gain: -1 }], offset: 0,
    },
  ],
  home: [0, 0],
  hash: "",
};

test("a coupled joint follows the one that it is coupled to", () => {
  const place = new Chain(ARM).flange([Math.PI / 2, 0]);
  assertSame(place, { position: [0, 1, 1], quaternion: [0, 0, 0, 1] }, "lower");
});

for (const [what, joints] of Object.entries({
  "unknown": null, "too few": [1], "not finite": [1, Number.NaN],
})) {
  test(`joint values that are ${what} show the robot at home`, () => {
    assertSame(new Chain(ARM).flange(joints), { position: [1, 0, 1], quaternion: [0, 0, 0, 1] }, "lower");
  });
}

test("facts without a base frame leave the root where base is", () => {
  for (const facts of [{}, { base_frame: null }, { base_frame: { parent: "foot", xyz: ["1"], rpy: 0 } }]) {
    const { position } = new Chain(describedRobot(ARM, facts)).flange([0, 0]);
    assert.deepEqual([...position], [1, 0, 1]);
  }
});

test("a pose and its inverse make no motion", () => {
  const place = pose([1, -2, 3], ofRpy([0.3, -0.7, 2]));
  assertSame(composed(place, inverse(place)), { position: [0, 0, 0], quaternion: [0, 0, 0, 1] }, "both");
});

test("roll, pitch and yaw come back, and at the pole the roll is 0", () => {
  for (const rpy of [[0.3, -0.7, 2], [-3, 1.5, -3], [0, 0, 0]]) {
    rollPitchYaw(ofRpy(rpy)).forEach((each, i) => assert.ok(Math.abs(each - rpy[i]!) < 1e-12));
  }
  const [roll, pitch] = rollPitchYaw(ofRpy([0.5, Math.PI / 2, 0.2]));
  assert.ok(roll === 0 && Math.abs(pitch - Math.PI / 2) < 1e-6);
});

test("the homogeneous matrix moves a point as the pose does", () => {
  const place = pose([1, -2, 3], ofRpy([0.3, -0.7, 2]));
  const point = [0.4, 0.5, -0.6, 1];
  const moved = homogeneous(place).map((row) => row.reduce((sum, each, i) => sum + each * point[i]!, 0));
  const wanted = [...transformed(place, [0.4, 0.5, -0.6]), 1];
  moved.forEach((each, i) => assert.ok(Math.abs(each - wanted[i]!) < 1e-12));
});

test("z is led to any direction, straight down too", () => {
  for (const direction of [[0, 0, 1], [0, 0, -1], [0.6, 0, 0.8], [-0.6, 0.8, 0]] as const) {
    const led = transformed(pose([0, 0, 0], zTowards(direction)), [0, 0, 1]);
    led.forEach((each, i) => assert.ok(Math.abs(each - direction[i]!) < 1e-12));
  }
});
