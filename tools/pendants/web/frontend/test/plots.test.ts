import assert from "node:assert/strict";
import { test } from "node:test";

import { csvTable } from "../src/plots/csv.ts";
import {
  controllerDelay,
  largestDifference,
  worstShares,
  type PlotJoint,
} from "../src/plots/findings.ts";
import { DrivenMotion } from "../src/plots/driven_motion.ts";
import { jointsAt, readPlan, type AskSamples } from "../src/plots/plan_samples.ts";
import {
  DrivenSeries,
  indexAt,
  joinedTimes,
  plannedSamples,
  valueAt,
  type Samples,
} from "../src/plots/series.ts";
import { evenSteps } from "../src/plots/steps.ts";

const PERIOD = 0.01;
const close = (found: number | null | undefined, wanted: number, off = 1e-5): void =>
  assert.ok(Math.abs((found ?? Number.NaN) - wanted) <= off, `${found} is not ${wanted}`);

/** A series of `count` samples whose position is the number of the sample. */
function counted(count: number, most: number): DrivenSeries {
  const series = new DrivenSeries(1, most);
  for (let i = 0; i < count; i++) series.add(i + 1, i * PERIOD, PERIOD, [i], [0]);
  return series;
}

for (const count of [1, 2048, 2049, 4999, 5000, 5001, 12_345]) {
  test(`the newest of ${count} samples are kept, oldest first`, () => {
    const { times, positions } = counted(count, 5000).samples();
    const kept = Math.min(count, 5000);
    assert.deepEqual([times.length, positions[0]!.length], [kept, kept]);
    const wanted = Float32Array.from({ length: kept }, (_, i) => count - kept + i);
    assert.deepEqual(positions[0], wanted);
  });
}

test("acceleration is the difference of two velocities, and the first has that of the next", () => {
  const series = new DrivenSeries(1);
  [0, 0.1, 0.3].forEach((velocity, i) => series.add(i + 1, i * 0.1, 0.1, [0], [velocity]));
  [1, 1, 2].forEach((wanted, i) => close(series.samples().accelerations[0]![i], wanted));
});

test("a gap in the sequence that took time is a gap in the line, and has no acceleration", () => {
  const series = new DrivenSeries(1);
  for (const [sequence, time, velocity] of [[1, 0, 0], [2, 0.01, 0], [9, 0.08, 5], [10, 0.09, 5]] as const) {
    series.add(sequence, time, PERIOD, [0], [velocity]);
  }
  const { gaps, accelerations } = series.samples();
  assert.deepEqual(gaps, [[0.01, 0.08]]);
  assert.deepEqual([...accelerations[0]!], [0, 0, 0, 0]);
});

test("what others were told between is no gap", () => {
  const series = new DrivenSeries(1);
  for (let i = 0; i < 5; i++) series.add(1 + 4 * i, i * PERIOD, PERIOD, [0], [0]);
  assert.deepEqual(series.samples().gaps, []);
});

test("a state that came twice or late is left out, and a server begun anew begins anew", () => {
  const series = counted(500, 5000);
  series.add(500, 4.99, PERIOD, [77], [0]);
  series.add(499, 4.98, PERIOD, [77], [0]);
  assert.equal(series.length, 500);
  series.add(1, 6, PERIOD, [3], [0]);
  assert.deepEqual([...series.samples().positions[0]!], [3]);
  series.add(2, 60, PERIOD, [4], [0]);
  series.add(1, 0.5, PERIOD, [5], [0]);
  assert.deepEqual([...series.samples().positions[0]!], [5]);
});

test("gaps are forgotten with the samples around them", () => {
  const series = new DrivenSeries(1, 10);
  series.add(1, 0, PERIOD, [0], [0]);
  series.add(9, 1, PERIOD, [0], [0]);
  for (let i = 0; i < 20; i++) series.add(10 + i, 1.01 + i * PERIOD, PERIOD, [0], [0]);
  assert.deepEqual(series.samples().gaps, []);
});

const PLAN = plannedSamples(
  ["t", "q0", "q1", "v0", "v1", "a0", "a1"],
  [[0, 0, 1, 0, 0, 2, 0], [0.5, 1, 1, 2, 0, 0, 0], [1, 2, 1, 0, 0, -2, 0]],
);

test("the columns of a plan are found by their names", () => {
  assert.deepEqual(PLAN.positions.map((each) => [...each]), [[0, 1, 2], [1, 1, 1]]);
  assert.deepEqual([...PLAN.velocities[0]!], [0, 2, 0]);
  assert.deepEqual([...PLAN.accelerations[0]!], [2, 0, -2]);
});

test("a value between two samples lies on the line, and none beside them", () => {
  close(valueAt(PLAN, PLAN.positions[0]!, 0.25), 0.5);
  close(valueAt(PLAN, PLAN.positions[0]!, 1), 2);
  assert.equal(valueAt(PLAN, PLAN.positions[0]!, -0.1), null);
  assert.equal(valueAt(PLAN, PLAN.positions[0]!, 1.1), null);
  assert.equal(valueAt({ ...PLAN, gaps: [[0, 0.5]] }, PLAN.positions[0]!, 0.25), null);
});

test("a time is found among many", () => {
  const times = Float64Array.from([0, 1, 2, 3]);
  assert.deepEqual([-1, 0, 1.5, 9].map((time) => indexAt(times, time)), [-1, 0, 1, 3]);
});

test("two motions have all their times once", () => {
  const [one, other] = [Float64Array.from([0, 1, 2]), Float64Array.from([0.5, 1, 3])];
  assert.deepEqual([...joinedTimes(one, other)], [0, 0.5, 1, 2, 3]);
});

const JOINTS: PlotJoint[] = [
  { name: "Base", unit: "rad", lower: -4, upper: 2, velocity: 4, acceleration: 2 },
  { name: "Arm, upper", unit: "rad", lower: -2, upper: 2, velocity: 1, acceleration: 1 },
];

test("the worst share of each limit is told with joint and time", () => {
  const worst = worstShares(PLAN, JOINTS);
  assert.deepEqual(
    worst.map(({ quantity, joint, time, share }) => [quantity, joint, time, share]),
    [["positions", 0, 1, 1], ["velocities", 0, 0.5, 0.5], ["accelerations", 0, 0, 1]],
  );
});

test("a joint without a limit has no share of it", () => {
  const free = JOINTS.map((joint) => ({ ...joint, acceleration: Number.POSITIVE_INFINITY }));
  assert.deepEqual(worstShares(PLAN, free).map((each) => each.quantity), ["positions", "velocities"]);
});

/** The motion of a robot that follows a plan so late. */
function late(planned: Samples, by: number): Samples {
  const times = Float64Array.from({ length: 101 }, (_, i) => i / 100);
  const positions = planned.positions.map((column) =>
    Float32Array.from(times, (time) => valueAt(planned, column, Math.max(0, time - by)) ?? 0),
  );
  return { ...planned, times, positions, velocities: positions, accelerations: positions };
}

test("what was driven late is found to be so late, and how far off", () => {
  const driven = late(PLAN, 0.04);
  close(controllerDelay(PLAN, driven), 0.04, 0.003);
  const { joint, value } = largestDifference(PLAN, driven) ?? { joint: -1, value: 0 };
  assert.equal(joint, 0);
  close(value, -0.08, 1e-3);
});

test("motions that never meet have no difference and no delay", () => {
  const far = { ...PLAN, times: PLAN.times.map((time) => time + 100) };
  assert.equal(largestDifference(PLAN, far), null);
  assert.equal(controllerDelay(PLAN, far), null);
});

test("a table has a row for each time and says its units", () => {
  const driven = { ...PLAN, times: Float64Array.from([0.25, 0.5, 2]) };
  const lines = csvTable(JOINTS, PLAN, driven).trimEnd().split("\r\n");
  assert.equal(lines.length, 1 + 5);
  assert.ok(lines[0]!.startsWith('t [s],Base q planned [rad],"Arm, upper q planned [rad]",Base v planned [rad/s]'));
  assert.ok(lines[1]!.startsWith("0,0,1,"));
  assert.ok(lines[1]!.endsWith(",,,,,"), "nothing was driven yet");
});

test("a name that a spreadsheet would run is only a name", () => {
  const [head] = csvTable([{ ...JOINTS[0]!, name: "=1+1" }], PLAN, null).split("\r\n");
  assert.ok(head!.includes(",'=1+1 q planned"));
});

test("an axis has round values as they are written, not as they are kept", () => {
  const degrees = 180 / Math.PI;
  const written = evenSteps(-2, 1, degrees).map((each) => Math.round(each * degrees * 1e6) / 1e6);
  assert.deepEqual(written, [-100, -50, 0, 50]);
});

test("an axis without a span has no values", () => {
  for (const [least, most] of [[1, 1], [2, 1], [0, Number.POSITIVE_INFINITY]] as const) {
    assert.deepEqual(evenSteps(least, most, 1), []);
  }
});

/** A server that has a plan of so many samples and gives so many rows at most. */
function planner(count: number, most: number): { ask: AskSamples; seen: number[] } {
  const seen: number[] = [];
  const ask: AskSamples = async ({ plan, first = 0, count: wanted = 100 }) => {
    seen.push(first);
    await Promise.resolve();
    const last = Math.min(count, first + Math.min(wanted, most));
    const numbers = Array.from({ length: last - first }, (_, i) => first + i);
    return {
      plan, first, every: 1, total: count, columns: ["t", "q0", "v0", "a0"], more: last < count,
      rows: numbers.map((each) => [each * PERIOD, each, 1, 0]),
      tool: numbers.map((each) => [each, 0, 1, 0, 0, 0, 1]),
    };
  };
  return { ask, seen };
}

const atOnce = (): Promise<void> => Promise.resolve();

test("a plan is fetched to its end, whatever a frame holds", async () => {
  const { ask, seen } = planner(144, 60);
  const { samples, path } = await readPlan(ask, 7, atOnce);
  assert.deepEqual(seen, [0, 60, 120]);
  assert.deepEqual([...samples.positions[0]!], Array.from({ length: 144 }, (_, i) => i));
  assert.deepEqual([path.length, path[3 * 143]], [3 * 144, 143]);
});

test("a server that gives no rows but says that more follow is asked once", async () => {
  const { ask, seen } = planner(10, 0);
  await readPlan(ask, 7, atOnce);
  assert.equal(seen.length, 1);
});

test("a plan that is no longer wanted is asked for no more", async () => {
  const { ask, seen } = planner(1000, 100);
  const stop = new AbortController();
  const read = readPlan(ask, 7, () => Promise.resolve(stop.abort()), stop.signal);
  await assert.rejects(read);
  assert.equal(seen.length, 1);
});

test("the slider's joints are the samples, and between two on the line", () => {
  assert.deepEqual(jointsAt(PLAN, 0.5), [1, 1]);
  assert.deepEqual(jointsAt(PLAN, 0.75), [1.5, 1]);
  assert.deepEqual([jointsAt(PLAN, -1), jointsAt(PLAN, 9)], [[0, 1], [2, 1]]);
});

const told = (sequence: number, activity: number): Parameters<DrivenMotion["take"]>[0] => ({
  sequence, activity: activity as 0, override: 1, time_s: 100, time_ns: sequence * 1e7, age: 0, valid_fields: 6,
  positions: [sequence, 0], velocities: [0, 0],
});

test("a motion begins at 0, where it first moved", () => {
  const motion = new DrivenMotion(1);
  const began = [0, 0, 2, 2, 5, 2, 0, 0].map((each, i) => motion.take(told(i + 1, each), 1, PERIOD));
  assert.deepEqual(began.map(Number), [0, 0, 1, 0, 0, 0, 0, 0], "a pause begins no other");
  const { times, positions } = motion.samples();
  close(valueAt(motion.samples(), positions[0]!, 0), 3);
  close(times[0], -0.02);
});

test("a motion that was under way before the first state began at a time that nobody saw", () => {
  const motion = new DrivenMotion(1);
  assert.deepEqual([2, 2, 0, 2].map((each, i) => motion.take(told(i + 1, each), 1, PERIOD)), [false, false, false, true]);
});

const PACES: [string, boolean, { activity: number; override?: number }[]][] = [
  ["as planned", true, [{ activity: 2 }, { activity: 2 }]],
  ["slower", false, [{ activity: 2 }, { activity: 2, override: 0.5 }]],
  ["with a pause", false, [{ activity: 2 }, { activity: 5 }, { activity: 2 }]],
  ["to a stop", false, [{ activity: 2 }, { activity: 3 }]],
];
for (const [name, isAtPace, states] of PACES) {
  test(`a motion ${name} ${isAtPace ? "has" : "has not"} the times of its plan, and the next one may have them`, () => {
    const motion = new DrivenMotion(1);
    const all = [{ activity: 0 }, ...states, { activity: 0 }];
    all.forEach((each, i) => motion.take({ ...told(i + 1, each.activity), ...each } as ReturnType<typeof told>, 1, PERIOD));
    assert.equal(motion.isAtPace, isAtPace);
    motion.take(told(all.length + 1, 2), 1, PERIOD);
    assert.equal(motion.isAtPace, true);
  });
}

test("a jog is a motion, and its ramp is the end of it", () => {
  const motion = new DrivenMotion(1);
  const began = [0, 4, 4, 3, 4, 0, 4].map((each, i) => motion.take(told(i + 1, each), 1, PERIOD));
  assert.deepEqual(began.map(Number), [0, 1, 0, 0, 0, 0, 1]);
});

test("a value is put where it was reported, and one report is one value", () => {
  const motion = new DrivenMotion(1);
  motion.take(told(0, 0), 1, PERIOD);
  for (const [sequence, age] of [[1, 0], [2, 0.004], [3, 0.014], [4, 0]] as const) {
    motion.take({ ...told(sequence, 2), age }, 1, PERIOD);
  }
  const { times } = motion.samples();
  [-0.01, 0, 0.006, 0.03].forEach((wanted, i) => close(times[i], wanted));
  assert.equal(times.length, 4);
});

test("a motion that ended is shown a little beyond, and standing no longer", () => {
  const motion = new DrivenMotion(1);
  for (let i = 1; i <= 500; i++) motion.take(told(i, i > 1 && i < 102 ? 2 : 0), 1, PERIOD);
  close(motion.samples().times.at(-1), 1.5, 0.011);
});

test("where nothing moved, the last seconds are shown", () => {
  const motion = new DrivenMotion(1);
  for (let i = 1; i < 2000; i++) motion.take(told(i, 0), 1, PERIOD);
  const { times } = motion.samples();
  close(times[0], 0, 0.011);
  close(times.at(-1), 10, 1e-6);
});

test("a robot of other joints begins anew, and a state without positions is left out", () => {
  const motion = new DrivenMotion(1);
  motion.take(told(1, 2), 1, PERIOD);
  motion.take({ ...told(2, 2), valid_fields: 2 }, 1, PERIOD);
  assert.equal(motion.samples().times.length, 1);
  motion.take(told(3, 2), 2, PERIOD);
  assert.equal(motion.samples().positions.length, 2);
  assert.equal(motion.samples().times.length, 1);
});
