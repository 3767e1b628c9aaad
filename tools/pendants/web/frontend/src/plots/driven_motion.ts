// What the robot drove of late, as STATE told it, and when its last motion began.
import { Activity, StateField, type State } from "../protocol.ts";
import { delayed, DrivenSeries, indexAt, type Samples } from "./series.ts";

/** What is seen before a motion began, and behind where none did [s]. */
const BEFORE = 0.2;
/** What is seen after it ended: the controller comes to rest behind its plan [s]. */
const AFTER = 0.5;
const LAST = 10;
/** Samples that are kept: six minutes of 100 states a second. */
const MOST = 36_000;
/** States whose reports are nearer than this share of a period tell of the same one. */
const SAME = 0.25;

type Told = Pick<
  State,
  "sequence" | "time_s" | "time_ns" | "age" | "activity" | "override" | "valid_fields" | "positions" | "velocities"
>;

export class DrivenMotion {
  #series: DrivenSeries;
  #joints: number;
  #sequence = -1;
  #time = Number.NEGATIVE_INFINITY;
  /** Null before the first state: a motion that is under way by then began at a time that nobody saw. */
  #wasMoving: boolean | null = null;
  /** Whether nothing made the last motion slower than it was planned. */
  #isAtPace = true;
  #start: number | null = null;
  #end = Number.POSITIVE_INFINITY;

  constructor(joints: number) {
    this.#joints = joints;
    this.#series = new DrivenSeries(joints, MOST);
  }

  /** Take a state; true where a motion or a jog began with it. */
  take(state: Told, joints: number, period: number): boolean {
    if (joints !== this.#joints) {
      this.#joints = joints;
      this.#series = new DrivenSeries(joints, MOST);
    }
    const needed = StateField.POSITION | StateField.VELOCITY;
    if (state.sequence === this.#sequence || (state.valid_fields & needed) !== needed) return false;
    this.#sequence = state.sequence;
    // What it tells was measured when the controller reported, not when the state was sent.
    const time = state.time_s + state.time_ns * 1e-9 - Math.max(0, state.age);
    const isSameReport = Math.abs(time - this.#time) < SAME * period;
    if (!isSameReport) {
      this.#time = time;
      this.#series.add(state.sequence, time, period, state.positions, state.velocities);
    }
    const isMoving = state.activity === Activity.MOVING || state.activity === Activity.JOGGING;
    const began = isMoving && this.#wasMoving === false;
    // A motion goes on through a pause and to its end in a ramp.
    const isUnderWay = isMoving || (this.#wasMoving === true && isUndecided(state.activity));
    if (began) [this.#start, this.#end, this.#isAtPace] = [time, Number.POSITIVE_INFINITY, true];
    else if (this.#wasMoving === true && !isUnderWay) this.#end = time;
    if (isUnderWay && (state.override !== 1 || !isMoving)) this.#isAtPace = false;
    this.#wasMoving = isUnderWay;
    return began;
  }

  get isUnderWay(): boolean {
    return this.#wasMoving === true;
  }

  /** Whether the beginning of the last motion was seen, and is kept still. */
  get isKnown(): boolean {
    return this.#start !== null && this.#start >= (this.#series.samples().times[0] ?? Infinity);
  }

  /** Whether the last motion ran without a pause, a stop and a speed below that of its plan. */
  get isAtPace(): boolean {
    return this.#isAtPace;
  }

  /** Return the last motion with its beginning at 0; the last seconds where there was none. */
  samples(): Samples {
    const all = this.#series.samples();
    const last = all.times.at(-1) ?? 0;
    const { isKnown } = this;
    const start = isKnown ? (this.#start ?? 0) : last - LAST;
    const part = isKnown ? cut(all, start - BEFORE, this.#end + AFTER) : cut(all, start, last);
    return delayed(part, -start);
  }

  clear(): void {
    this.#series.clear();
    this.#time = Number.NEGATIVE_INFINITY;
    this.#start = null;
    this.#wasMoving = null;
  }
}

function isUndecided(activity: number): boolean {
  return activity === Activity.PAUSED || activity === Activity.PAUSING || activity === Activity.STOPPING;
}

/** Return the samples from a time to another. */
function cut(samples: Samples, from: number, to: number): Samples {
  const first = Math.max(0, indexAt(samples.times, from));
  const end = indexAt(samples.times, to) + 1;
  const rest = (columns: readonly Float32Array[]): Float32Array[] =>
    columns.map((column) => column.subarray(first, end));
  return {
    times: samples.times.subarray(first, end),
    positions: rest(samples.positions),
    velocities: rest(samples.velocities),
    accelerations: rest(samples.accelerations),
    gaps: samples.gaps.filter((gap) => gap[1] > (samples.times[first] ?? 0) && gap[0] < to),
  };
}
