// The motion that the robot drove last, beside the plan that it followed; or this page's plan that waits.
//
// There is one record for the whole page, from its beginning: a motion can be looked at after it.
import { planModel } from "../planning/model.ts";
import { Activity } from "../protocol.ts";
import type { State } from "../protocol.ts";
import type { App } from "../ui/app.ts";
import { LinkLost, Refused } from "../wire/errors.ts";
import { DrivenMotion } from "./driven_motion.ts";
import { readPlan } from "./plan_samples.ts";
import type { PlannedMotion } from "./plan_samples.ts";
import type { Samples } from "./series.ts";

/** States a second with which a link begins [Hz]. */
export const USUAL_RATE = 30;

const records = new WeakMap<App, MotionRecord>();

/** Return the record of this page, which begins with the first call. */
export function motionRecord(app: App): MotionRecord {
  let record = records.get(app);
  if (record === undefined) {
    record = new MotionRecord(app);
    records.set(app, record);
  }
  return record;
}

export class MotionRecord {
  /** States a second that this link was asked for [Hz]. */
  rate = USUAL_RATE;
  readonly #app: App;
  readonly #driven = new DrivenMotion(0);
  /** Number of the plan that the last motion followed; null where it is not known. */
  #followed: number | null = null;
  /** Its samples: somebody else's, or this page's own, which plans another one meanwhile. */
  #plan: PlannedMotion | null = null;
  /** States a second while the last motion began [Hz]. */
  #drivenRate = USUAL_RATE;
  #reading: AbortController | null = null;

  constructor(app: App) {
    this.#app = app;
    let { hello } = app.cell.value;
    app.cell.watch((cell) => {
      if (cell.hello === hello) return;
      ({ hello } = cell);
      this.#beginLink();
    });
    // Not from the model of the cell, which tells the last of several that came together.
    app.session.watchStates((state) => this.#take(state));
  }

  /** The plan of this page that waits, else the one that the last motion followed. */
  get planned(): PlannedMotion | null {
    const { motion } = planModel(this.#app).value;
    if (this.isWaiting) return motion;
    if (motion !== null && motion.plan === this.#followed) this.#plan = motion;
    return this.#plan;
  }

  /** Whether that plan is still to be executed. */
  get isWaiting(): boolean {
    const { preview, motion } = planModel(this.#app).value;
    return preview.stage === "ready" && motion !== null;
  }

  /** Whether times of the last motion are those of its plan. */
  get isAtPace(): boolean {
    return this.#driven.isAtPace;
  }

  /** Between two samples of what was driven [s]. */
  get period(): number {
    return 1 / this.#drivenRate;
  }

  /** Return what was driven last; nothing beside a plan that waits. */
  driven(): Samples | null {
    if (this.isWaiting) return null;
    const samples = this.#driven.samples();
    return samples.times.length > 1 ? samples : null;
  }

  /** Read the samples of the plan that is under way, where it is not this page's own. */
  async readOthers(): Promise<void> {
    const isKnown = this.#followed !== null || this.#plan !== null || this.#reading !== null;
    if (!this.#driven.isUnderWay || isKnown) return;
    const reading = (this.#reading = new AbortController());
    try {
      this.#plan = await this.#runningPlan(reading.signal);
      this.#app.choice.set({}); // has it drawn
    } catch (error) {
      // Another motion began meanwhile, or the plan is over: what was driven is shown alone.
      if (!reading.signal.aborted && !(error instanceof Refused || error instanceof LinkLost)) throw error;
    }
  }

  async #runningPlan(signal: AbortSignal): Promise<PlannedMotion | null> {
    const { session } = this.#app;
    const { plans } = await session.call<"plans.show">({ op: "plans.show" });
    const running = plans.find(({ state }) => state === "running");
    if (running === undefined) return null;
    const motion = await readPlan((request) => session.call<"plans.samples">(request), running.plan, undefined, signal);
    signal.throwIfAborted();
    return motion;
  }

  /** Plans of another link have numbers of their own, and its first state tells of no beginning. */
  #beginLink(): void {
    this.rate = USUAL_RATE;
    this.#forgetPlan();
    this.#driven.clear();
  }

  #take(state: State): void {
    const joints = this.#app.cell.value.hello?.dof ?? 0;
    if (joints === 0 || !this.#driven.take(state, joints, 1 / this.rate)) return;
    // Whatever plan was shown, this motion need not be its own: a false comparison is worse than none.
    this.#forgetPlan();
    this.#drivenRate = this.rate;
    const { preview } = planModel(this.#app).value;
    const isOwn = state.activity === Activity.MOVING && preview.stage === "running";
    this.#followed = isOwn ? (preview.plan?.plan ?? null) : null;
  }

  #forgetPlan(): void {
    this.#reading?.abort();
    this.#reading = null;
    this.#plan = null;
    this.#followed = null;
  }
}
