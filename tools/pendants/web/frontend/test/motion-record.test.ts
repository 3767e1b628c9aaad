// What was driven beside the plan that it followed, and never beside another one.
import assert from "node:assert/strict";
import { test } from "node:test";
import { NO_CELL } from "../src/pendant/cell.ts";
import type { Cell } from "../src/pendant/cell.ts";
import { Observable } from "../src/pendant/observable.ts";
import { planModel } from "../src/planning/model.ts";
import { NO_PREVIEW } from "../src/planning/preview.ts";
import type { Stage } from "../src/planning/preview.ts";
import { motionRecord } from "../src/plots/motion_record.ts";
import type { MotionRecord } from "../src/plots/motion_record.ts";
import { plannedSamples } from "../src/plots/series.ts";
import type { HelloReply, PlansMakeReply, State } from "../src/protocol.ts";
import type { App } from "../src/ui/app.ts";

const [IDLE, MOVING, JOGGING] = [0, 2, 4];
const HELLO = { session: 7, dof: 1 } as HelloReply;
const COLUMNS = ["t", "q0", "v0", "a0"];
const ROWS = [[0, 0, 0, 0], [0.01, 0, 0, 0]];

interface Rig {
  record: MotionRecord;
  cell: Observable<Cell>;
  asked: string[];
  /** Have this page's own plan be in a stage. */
  own(stage: Stage, plan?: number): void;
  /** Have states come with these activities. */
  states(...activities: number[]): void;
}

/** A record of a cell in which somebody else's plan runs, or none. */
function rig(others: number | null = null): Rig {
  let told: (state: State) => void = () => undefined;
  let sequence = 0;
  const asked: string[] = [];
  const cell = new Observable<Cell>({ ...NO_CELL, stage: "up", hello: HELLO });
  const session = {
    listen: () => undefined,
    watchStates: (listener: typeof told) => (told = listener),
    call: ({ op }: { op: string }) => {
      asked.push(op);
      const plans = others === null ? [] : [{ plan: others, state: "running" }];
      return Promise.resolve(op === "plans.show" ? { plans } : { columns: COLUMNS, rows: ROWS, more: false });
    },
  };
  const app = { cell, session, choice: new Observable({}), now: () => 0 } as unknown as App;
  const record = motionRecord(app);
  return {
    record,
    cell,
    asked,
    own: (stage, plan = 5) =>
      planModel(app).set({
        preview: { ...NO_PREVIEW, stage, plan: { plan } as PlansMakeReply },
        motion: { plan, samples: plannedSamples(COLUMNS, ROWS), path: new Float32Array() },
      }),
    states(...activities) {
      for (const activity of activities) {
        sequence += 1;
        told({ sequence, activity, override: 1, time_s: 100, time_ns: sequence * 1e7, age: 0, valid_fields: 6, positions: [0], velocities: [0] } as unknown as State);
      }
    },
  };
}

const settled = (): Promise<void> => new Promise((done) => setTimeout(done, 5));

test("a motion is shown beside this page's plan that it follows, also once that is over", () => {
  const { record, own, states } = rig();
  states(IDLE);
  own("running");
  states(MOVING, MOVING);
  own("done");
  states(IDLE);
  assert.equal(record.look().planned?.plan, 5);
  assert.equal(record.look().driven?.times.length, 4);
});

test("a motion without a plan of its own is not compared with the plan before it", () => {
  const { record, own, states } = rig();
  states(IDLE);
  own("running");
  states(MOVING);
  own("done");
  states(IDLE, MOVING, MOVING);
  assert.equal(record.look().planned, null);
  assert.notEqual(record.look().driven, null);
});

test("a plan that waits is shown alone, and what was driven again once it waits no more", () => {
  const { record, own, states } = rig();
  states(IDLE, JOGGING, IDLE);
  own("ready");
  assert.equal(record.look().planned?.plan, 5);
  assert.equal(record.look().driven, null);
  own("stale");
  assert.equal(record.look().planned, null);
  assert.notEqual(record.look().driven, null);
});

test("somebody else's plan is read only where it is asked for, and once", async () => {
  const { record, asked, states } = rig(9);
  states(IDLE, MOVING);
  assert.deepEqual(asked, []);
  await Promise.all([record.readOthers(), record.readOthers()]);
  await record.readOthers();
  assert.deepEqual(asked, ["plans.show", "plans.samples"]);
  assert.equal(record.look().planned?.plan, 9);
});

test("where no plan runs, that is asked once for each motion", async () => {
  const { record, asked, states } = rig();
  states(IDLE, MOVING);
  await record.readOthers();
  await record.readOthers();
  assert.deepEqual(asked, ["plans.show"]);
  states(IDLE, MOVING);
  await record.readOthers();
  assert.equal(asked.length, 2);
});

test("another link of the same number begins with nothing, whatever is under way", async () => {
  const { record, cell, own, states } = rig();
  states(IDLE);
  own("running");
  states(MOVING, MOVING);
  record.rate = 100;
  assert.equal(record.look().planned?.plan, 5);
  cell.set({ hello: null });
  await settled();
  assert.equal(record.look().planned?.plan, 5, "without a link it can be looked at");
  cell.set({ hello: { ...HELLO } });
  await settled();
  assert.equal(record.look().planned, null);
  assert.equal(record.look().driven, null);
  assert.equal(record.look().period, 1 / 30);
});

test("a motion whose beginning nobody saw is compared with nothing", async () => {
  const { record, asked, states } = rig(9);
  states(MOVING, MOVING, MOVING);
  await record.readOthers();
  assert.deepEqual(asked, []);
  assert.equal(record.look().planned, null);
  assert.equal(record.look().isMotion, false);
});

test("a plan is kept beside its motion when the page plans another one, and its samples may come late", async () => {
  const { record, own, states } = rig();
  states(IDLE);
  own("running");
  states(MOVING, MOVING);
  await settled();
  own("stale", 6);
  await settled();
  assert.equal(record.look().planned?.plan, 5);
});

test("what was driven long ago and is kept no more is compared with nothing", () => {
  const { record, own, states } = rig();
  states(IDLE);
  own("running");
  states(MOVING);
  own("done");
  states(...new Array<number>(37_000).fill(IDLE));
  assert.equal(record.look().isMotion, false);
  assert.equal(record.look().planned, null);
});
