// What the robot drove of late, as STATE told it, and when its last motion began.
import { Activity, StateField, type State } from "../protocol.ts";
import { delayed, DrivenSeries, indexAt, type Samples } from "./series.ts";

/** What is seen before a motion began, and behind where none did [s]. */
const BEFORE = 0.2;
const LAST = 10;

type Told = Pick<
  State,
  "sequence" | "time_s" | "time_ns" | "activity" | "valid_fields" | "positions" | "velocities"
>;

export class DrivenMotion {
  #series: DrivenSeries;
  #joints: number;
  #sequence = -1;
  #wasMoving = false;
  #start: number | null = null;

  constructor(joints: number) {
    this.#joints = joints;
    this.#series = new DrivenSeries(joints);
  }

  /** Take a state; true where a planned motion began with it. */
  take(state: Told, joints: number, period: number): boolean {
    if (joints !== this.#joints) {
      this.#joints = joints;
      this.#series = new DrivenSeries(joints);
    }
    const needed = StateField.POSITION | StateField.VELOCITY;
    if (state.sequence === this.#sequence || (state.valid_fields & needed) !== needed) return false;
    this.#sequence = state.sequence;
    const time = state.time_s + state.time_ns * 1e-9;
    this.#series.add(state.sequence, time, period, state.positions, state.velocities);
    const isMoving = state.activity === Activity.MOVING;
    const began = isMoving && !this.#wasMoving;
    // A motion goes on after a pause; whatever else comes between ends it.
    this.#wasMoving = isMoving || (this.#wasMoving && isPause(state.activity));
    if (began) this.#start = time;
    return began;
  }

  /** Return the last motion with its beginning at 0; the last seconds where there was none. */
  samples(): Samples {
    const all = this.#series.samples();
    const last = all.times.at(-1) ?? 0;
    const isGone = this.#start === null || this.#start < (all.times[0] ?? 0);
    const start = isGone ? last - LAST : (this.#start ?? 0);
    return delayed(cut(all, isGone ? start : start - BEFORE), -start);
  }

  clear(): void {
    this.#series.clear();
    this.#start = null;
    this.#wasMoving = false;
  }
}

function isPause(activity: number): boolean {
  return activity === Activity.PAUSED || activity === Activity.PAUSING;
}

/** Return the samples from a time on. */
function cut(samples: Samples, from: number): Samples {
  const first = Math.max(0, indexAt(samples.times, from));
  const rest = (columns: readonly Float32Array[]): Float32Array[] =>
    columns.map((column) => column.subarray(first));
  return {
    times: samples.times.subarray(first),
    positions: rest(samples.positions),
    velocities: rest(samples.velocities),
    accelerations: rest(samples.accelerations),
    gaps: samples.gaps.filter(([, to]) => to > (samples.times[first] ?? 0)),
  };
}
