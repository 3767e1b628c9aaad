// The tour: its moves with a robot that refuses some, and its end at any moment.
import assert from "node:assert/strict";
import { test } from "node:test";
import { OutcomeKind, VerdictCode } from "../src/protocol.ts";
import type { Message } from "../src/protocol.ts";
import { circle, Ended, Tour } from "../src/tour/tour.ts";
import type { TourJoint, TouringPendant } from "../src/tour/tour.ts";
import { Refused } from "../src/wire/errors.ts";
import type { RequestDraft } from "../src/wire/link.ts";

const refusal = (code: number) => ({ code, joint: -1, value: 0, limit: 0, text: "" });

const arrived = { type: "outcome", request_id: 1, outcome: OutcomeKind.COMPLETED, motion_time: 2, ...refusal(0) } as Message;

/** A robot that does what it is not told to refuse, and stands where it was sent. */
class Robot implements TouringPendant {
  moves: RequestDraft[] = [];
  ends = 0;
  /** What ends each motion on its way; 0 for nothing. */
  aborts = 0;
  onMove: () => void = () => undefined;
  #refuses: (draft: RequestDraft) => number;
  #joints: number[];

  constructor(refuses: (draft: RequestDraft) => number = () => 0, joints = [0, 0]) {
    this.#refuses = refuses;
    this.#joints = joints;
  }

  joints(): number[] {
    return this.#joints;
  }

  tool(): { position: number[]; orientation: number[] } {
    return { position: [1, 0, 1], orientation: [0, 0, 0, 1] };
  }

  async move(draft: RequestDraft): Promise<{ ended: Promise<Message> }> {
    const code = this.#refuses(draft);
    if (code !== 0) throw new Refused(refusal(code));
    this.moves.push(draft);
    this.onMove();
    return { ended: this.aborts === 0 ? Promise.resolve(arrived) : Promise.reject(new Refused(refusal(this.aborts))) };
  }

  endMotion(): void {
    this.ends += 1;
    this.aborts = VerdictCode.STOPPED;
  }
}

const JOINTS: TourJoint[] = ["a", "b"].map((name) => ({ name, lower: -2, upper: 2, unit: "rad" }));

const tourOf = (robot: Robot, joints = JOINTS): Tour => new Tour(robot, joints, () => undefined);

const kinds = (tour: Tour): string[] => tour.steps.map(({ kind }) => kind);

const cannot = (type: string) => (draft: RequestDraft) => (draft.type === type ? VerdictCode.UNREACHABLE : 0);

test("each joint moves alone, then all back, then the tool along a line and a circle", async () => {
  const robot = new Robot();
  const tour = tourOf(robot);
  await tour.run();
  assert.deepEqual(kinds(tour), ["joint", "joint", "back", "line", "lineBack", "poses"]);
  const first = robot.moves[0] as { joints: number[] };
  assert.deepEqual(first.joints, [(12 * Math.PI) / 180, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
  assert.deepEqual(tour.leftOut, []);
});

test("a joint without room above goes down, and one without any is left out", async () => {
  const robot = new Robot((draft) => (draft.type === "joint_move" && draft.joints[1] !== 0 ? VerdictCode.OUT_OF_RANGE : 0), [1.95, 0]);
  const tour = tourOf(robot);
  await tour.run();
  assert.ok((robot.moves[0] as { joints: number[] }).joints[0]! < 1.95);
  assert.deepEqual(tour.leftOut, [{ kind: "joint", name: "b" }]);
});

test("a robot that can do no line tries with its arm bent, goes back, and runs through positions", async () => {
  const tour = tourOf(new Robot(cannot("pose_move")));
  await tour.run();
  assert.deepEqual(kinds(tour), ["joint", "joint", "back", "bend", "bend", "back", "positions"]);
  assert.deepEqual(tour.leftOut, [{ kind: "line", name: "" }]);
});

test("where no circle can be done the tool runs along its line and back", async () => {
  const tour = tourOf(new Robot((draft) => (draft.type === "pose_path" && draft.waypoints.length > 2 ? VerdictCode.UNREACHABLE : 0)));
  await tour.run();
  assert.equal(tour.steps.at(-1)?.count, 2);
  assert.deepEqual(tour.leftOut, [{ kind: "circle", name: "" }]);
});

test("a refusal that is not of the robot's geometry ends the tour", async () => {
  const robot = new Robot(() => VerdictCode.NOT_ENABLED);
  await assert.rejects(tourOf(robot).run(), (error) => error instanceof Refused && error.refusal.code === VerdictCode.NOT_ENABLED);
  assert.equal(robot.moves.length, 0);
});

test("a motion that does not come to its end is the last one, and tells why", async () => {
  const robot = new Robot();
  robot.aborts = VerdictCode.PATH_IN_COLLISION;
  await assert.rejects(tourOf(robot).run(), (error) => error instanceof Ended && error.refusal !== null);
  assert.equal(robot.moves.length, 1);
});

test("ended while a motion is asked for, it ends that motion as it begins, and sends no other", async () => {
  const robot = new Robot();
  const tour = tourOf(robot);
  robot.onMove = () => {
    if (robot.moves.length === 2) tour.end();
  };
  await assert.rejects(tour.run(), (error) => error instanceof Ended && error.refusal === null);
  assert.equal(robot.moves.length, 2);
  assert.equal(robot.ends, 2);
});

test("ended between two motions, it sends no other", async () => {
  const robot = new Robot();
  const tour: Tour = new Tour(robot, JOINTS, () => {
    if (tour.steps[0]?.took === 2) tour.end();
  });
  await assert.rejects(tour.run(), Ended);
  assert.equal(robot.moves.length, 1);
});

test("a circle passes its start and comes back to it", () => {
  const start = { position: [1, 0, 1], orientation: [0, 0, 0, 1] };
  const places = circle(start, [0, 0, 1], [0, 1, 0], 0.05);
  const distances = places.map(({ position }) => Math.hypot(position[0]! - 1, position[1]!, position[2]! - 0.95));
  for (const each of distances) assert.ok(Math.abs(each - 0.05) < 1e-9);
  assert.ok(Math.hypot(...places.at(-1)!.position.map((each, index) => each - start.position[index]!)) < 1e-9);
});
