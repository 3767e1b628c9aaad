// A plan on the page: its life, its goals, a button that asks twice, questions that follow a hand.
import assert from "node:assert/strict";
import { test } from "node:test";
import { firstGoal, goalOf, readSeed } from "../src/planning/goals.ts";
import type { Wish } from "../src/planning/goals.ts";
import { Newest } from "../src/planning/newest.ts";
import { begun, changed, clock, explained, left, linkLost, made, moments, rowsOf } from "../src/planning/preview.ts";
import { stopsOf } from "../src/planning/stops.ts";
import { Twice } from "../src/planning/twice.ts";
import { NoticeKind, PlanState } from "../src/protocol.ts";
import type { NamedPosition, PlanChanged, PlansMakeReply } from "../src/protocol.ts";

const plan = (change: Partial<PlansMakeReply> = {}): PlansMakeReply => ({
  plan: 7,
  state: "ready",
  expires_in: 60,
  duration: 2,
  samples: 201,
  plan_time: 0.1,
  planner: "RRTConnect",
  seed: 0,
  start: [0, 1],
  end: [1, 1],
  end_pose: { position: [0, 0, 0], orientation: [0, 0, 0, 1] },
  based_on: { scene: 1, tools: 0, frames: 0, tool: null, attached: [] },
  certificate: {
    valid: true,
    margin: 0.3,
    worst: [
      { joint: "a", quantity: "velocity", ratio: 0.2, at: 0.5 },
      { joint: "b", quantity: "velocity", ratio: 0.4, at: 0.7 },
      { joint: "b", quantity: "acceleration", ratio: 0.9, at: 0.1 },
    ],
  },
  clearance: { distance: 0.0055, first: "pillar", second: "link_4", at: 1.34 },
  executable: true,
  why: null,
  ...change,
});

const told = (state: number, number = 7): PlanChanged => ({
  type: "plan_changed", plan: number, state, code: 0, stage: 0, fraction: 0, text: "words",
});
const quiet = { joints: [0, 1], changed: [] };

test("a plan is kept for as long as the server says", () => {
  const preview = made(plan(), 1000);
  assert.equal(left(preview, 14_000), 47);
  assert.equal(clock(left(preview, 14_000)), "0:47");
  assert.equal(left(preview, 70_000), 0);
});

test("what makes a plan stale is named: a change of somebody, a robot that moved, time", () => {
  const preview = made(plan(), 0);
  const cause = (state: number, around: { joints: number[]; changed: number[] }) =>
    changed(preview, told(state), around, 0).cause;
  assert.equal(cause(PlanState.STALE, { joints: [0, 1], changed: [NoticeKind.SCENE] }), "scene");
  assert.equal(cause(PlanState.STALE, { joints: [0, 1.01], changed: [] }), "moved");
  assert.equal(cause(PlanState.STALE, quiet), "other");
  assert.equal(cause(PlanState.EXPIRED, quiet), "expired");
});

test("a change that is told just behind the plan that it ended is named, a later one is not", () => {
  const stale = changed(made(plan(), 0), told(PlanState.STALE), quiet, 5000);
  const around = { joints: [0, 1], changed: [NoticeKind.TOOLS] };
  assert.equal(explained(stale, around, 5200).cause, "tools");
  assert.equal(explained(stale, around, 7000).cause, "other");
  assert.equal(explained(stale, quiet, 5200), stale);
});

test("what is told of another plan changes nothing", () => {
  const preview = made(plan(), 0);
  assert.equal(changed(preview, told(PlanState.STALE, 8), quiet, 0), preview);
});

test("a plan that lost its connection is stale, one that ended before is not", () => {
  assert.deepEqual([linkLost(made(plan(), 0)).stage, linkLost(begun()).stage], ["stale", "none"]);
  const done = changed(made(plan(), 0), told(PlanState.DONE), quiet, 0);
  assert.equal(linkLost(done).stage, "done");
});

test("the slider marks the nearest and the fastest moment", () => {
  assert.deepEqual(moments(plan()), [{ kind: "nearest", at: 1.34 }, { kind: "fastest", at: 0.7 }]);
  assert.deepEqual(moments(plan({ clearance: null })).map(({ kind }) => kind), ["fastest"]);
});

test("a way that passes nearer than 20 mm is a remark", () => {
  const tone = (distance: number) =>
    rowsOf(plan({ clearance: { distance, first: "a", second: "b", at: 0 } }))[0]?.tone;
  assert.deepEqual([tone(0.0199), tone(0.0201)], ["remark", "good"]);
});

const home: NamedPosition = {
  name: "home", kind: "robot", joints: [0, 1], legal: true, why: "", condition: 1,
  pose: { position: [1, 2, 3], orientation: [0, 0, 0, 1] },
};
const wish = (change: Partial<Wish>): Wish => ({
  way: "ptp", position: null, pose: null, branch: null, joints: null, stops: [], planner: "PRM", seed: 4, ...change,
});

test("a named position is gone to as each way can", () => {
  const kinds = (["ptp", "lin", "free"] as const).map((way) => goalOf(wish({ way, position: home })));
  assert.deepEqual(kinds, [
    { kind: "position", name: "home" },
    { kind: "lin", pose: { position: [1, 2, 3], orientation: [0, 0, 0, 1] }, frame: "base" },
    { kind: "free", joints: [0, 1], planner: "PRM", seed: 4 },
  ]);
});

test("the handles' place is gone to by the posture that was chosen", () => {
  const pose = { position: [1, 2, 3], quaternion: [0, 0, 0, 1] } as const;
  const goal = goalOf(wish({ pose, branch: 2 }));
  assert.ok(goal?.kind === "ptp" && goal.branch === 2);
  const round = goalOf(wish({ way: "free", pose, joints: [0.5, 0.5] }));
  assert.ok(round?.kind === "free" && round.joints?.[0] === 0.5 && round.pose === undefined);
  assert.equal(goalOf(wish({})), null);
});

test("a path goes through its stops in their order, and without a stop is no goal", () => {
  const goal = goalOf(wish({ way: "path", position: home, stops: [[1, 1], [0, 1]] }));
  assert.deepEqual(goal, { kind: "path", waypoints: [[1, 1], [0, 1]] });
  assert.equal(goalOf(wish({ way: "path", position: home })), null);
});

test("the stops of a program are its points as its moves reach them", () => {
  const points = ["a", "b", "c"].map((name, index) => ({ name, joints: [index] }));
  const move = (point: string, via: string[] = []) => ({ statement: "move" as const, way: "PTP" as const, point, via });
  const statements = [move("c"), { statement: "comment" as const, text: "a" }, move("a", ["b"]), move("c")];
  assert.deepEqual(stopsOf({ points, statements } as never).map(({ name }) => name), ["c", "b", "a", "c"]);
  assert.deepEqual(stopsOf({ points, statements: [] }).map(({ joints }) => joints), [[0], [1], [2]]);
});

test("the first goal is legal, and not where the robot stands", () => {
  const bad = { ...home, name: "bad", joints: [2, 2], legal: false };
  const away = { ...home, name: "away", joints: [1, 1] };
  assert.equal(firstGoal([home, bad, away], [0, 1])?.name, "away");
});

test("a seed is a whole number of 31 bits", () => {
  assert.deepEqual(["0", " 12 ", "-1", "1.5", "2147483648", ""].map(readSeed), [0, 12, null, null, null, null]);
});

test("what is dear wants two presses, not one that bounces", () => {
  const twice = new Twice();
  assert.equal(twice.press(true, 0), false);
  assert.equal(twice.press(true, 100), false);
  assert.equal(twice.press(true, 600), true);
  assert.equal(twice.press(true, 700), false);
  assert.equal(twice.press(true, 9000), false);
  assert.equal(twice.press(false, 9100), true);
});

class Rig {
  now = 0;
  asked: [number, number][] = [];
  answers: number[] = [];
  #finish: (() => void)[] = [];
  #timers: { at: number; then: () => void }[] = [];
  readonly newest = new Newest<number, number>(
    (question) => {
      this.asked.push([question, this.now]);
      return new Promise((done) => this.#finish.push(() => done(question)));
    },
    (_, answer) => this.answers.push(answer),
    () => undefined,
    100,
    {
      now: () => this.now,
      after: (wait, then) => this.#timers.push({ at: this.now + wait, then }),
    },
  );

  async finish(): Promise<void> {
    this.#finish.shift()?.();
    await new Promise((done) => setImmediate(done));
  }

  pass(to: number): void {
    this.now = to;
    for (const each of this.#timers.splice(0)) {
      if (each.at <= to) each.then();
      else this.#timers.push(each);
    }
  }
}

test("of questions that wait only the newest is asked, once the one before was answered", async () => {
  const rig = new Rig();
  for (const each of [1, 2, 3]) rig.newest.ask(each);
  assert.deepEqual(rig.asked, [[1, 0]]);
  rig.pass(150);
  assert.deepEqual(rig.asked, [[1, 0]]);
  await rig.finish();
  assert.deepEqual(rig.asked, [[1, 0], [3, 150]]);
});

test("questions come no faster than their time apart", async () => {
  const rig = new Rig();
  rig.newest.ask(1);
  await rig.finish();
  rig.newest.ask(2);
  rig.pass(60);
  rig.newest.ask(3);
  assert.equal(rig.asked.length, 1);
  rig.pass(100);
  assert.deepEqual(rig.asked, [[1, 0], [3, 100]]);
});
