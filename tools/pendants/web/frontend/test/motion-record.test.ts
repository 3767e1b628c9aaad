// What was driven beside the plan that it followed, and never beside another one.
import assert from "node:assert/strict";
import { test } from "node:test";
import { NO_CELL } from "../src/pendant/cell.ts";
import { Observable } from "../src/pendant/observable.ts";
import { motionRecord } from "../src/plots/motion_record.ts";
import type { MotionRecord } from "../src/plots/motion_record.ts";
import type { HelloReply, State } from "../src/protocol.ts";
import type { App } from "../src/ui/app.ts";

const [IDLE, MOVING, JOGGING] = [0, 2, 4];

interface Rig {
  record: MotionRecord;
  /** Have a state come with this activity, and let what it asks be answered. */
  state(activity: number, session?: number): Promise<void>;
}

/** A record of a cell that has these plans. */
function rig(plans: { plan: number; state: string }[]): Rig {
  let told: (state: State) => void = () => undefined;
  let sequence = 0;
  const cell = new Observable({ ...NO_CELL, hello: { session: 7, dof: 1 } as HelloReply });
  const session = {
    listen: () => undefined,
    watchStates: (listener: typeof told) => (told = listener),
    call: ({ op, plan }: { op: string; plan: number }) =>
      Promise.resolve(
        op === "plans.show"
          ? { plans }
          : { columns: ["t", "q0", "v0", "a0"], rows: [[0, plan, 0, 0], [0.01, plan, 0, 0]], more: false },
      ),
  };
  const record = motionRecord({ cell, session, choice: new Observable({}), now: () => 0 } as unknown as App);
  return {
    record,
    async state(activity, number = 7) {
      cell.set({ hello: { session: number, dof: 1 } as HelloReply });
      sequence += 1;
      told({ sequence, activity, time_s: 100, time_ns: sequence * 1e7, age: 0, valid_fields: 6, positions: [0], velocities: [0] } as unknown as State);
      await new Promise((done) => setTimeout(done, 5));
    },
  };
}

test("a motion is shown beside the plan that it follows", async () => {
  const { record, state } = rig([{ plan: 4, state: "ready" }, { plan: 5, state: "running" }]);
  await state(IDLE);
  await state(MOVING);
  await state(MOVING);
  assert.equal(record.planned?.plan, 5);
  assert.equal(record.driven()?.times.length, 3);
});

test("a motion without a plan of its own is not compared with the plan before it", async () => {
  const plans = [{ plan: 5, state: "running" }];
  const { record, state } = rig(plans);
  await state(MOVING);
  await state(IDLE);
  plans[0]!.state = "done";
  await state(MOVING);
  await state(MOVING);
  assert.equal(record.planned, null);
  assert.notEqual(record.driven(), null);
});

test("a plan that waits is shown alone, until the robot moves without it", async () => {
  const { record, state } = rig([{ plan: 5, state: "ready" }]);
  await state(IDLE);
  await state(IDLE);
  await record.lookAtWaiting();
  assert.equal(record.planned?.plan, 5);
  assert.equal(record.driven(), null);
  await state(JOGGING);
  await state(JOGGING);
  assert.equal(record.planned, null);
  assert.notEqual(record.driven(), null);
});

test("another link begins with nothing: its plans have numbers of their own", async () => {
  const { record, state } = rig([{ plan: 5, state: "running" }]);
  await state(MOVING);
  assert.equal(record.planned?.plan, 5);
  await state(IDLE, 8);
  assert.equal(record.planned, null);
  assert.equal(record.driven(), null);
});
