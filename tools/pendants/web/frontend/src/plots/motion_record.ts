// The motion that the robot drove last, beside the plan that it followed; or this page's plan that waits.
//
// There is one record for the whole page, from its beginning: a motion can be looked at after it.
import { planModel } from "../planning/model.ts";
import { Activity } from "../protocol.ts";
import type { State } from "../protocol.ts";
import { onePerPage } from "../ui/app.ts";
import type { App } from "../ui/app.ts";
import { LinkLost, Refused } from "../wire/errors.ts";
import { DrivenMotion } from "./driven_motion.ts";
import { readPlan } from "./plan_samples.ts";
import type { PlannedMotion } from "./plan_samples.ts";
import type { Samples } from "./series.ts";

/** States a second with which a link begins [Hz]. */
export const USUAL_RATE = 30;

/** Return the record of this page, which begins with the first call. */
export const motionRecord = onePerPage((app) => new MotionRecord(app));

/** What the record has to show at a moment. */
export interface Look {
  /** The plan that waits, or the one that the last motion followed. */
  planned: PlannedMotion | null;
  /** What was driven last; nothing beside a plan that waits. */
  driven: Samples | null;
  isWaiting: boolean;
  /** Whether a motion or a jog was driven; else what is driven is how the robot stood. */
  isMotion: boolean;
  /** Whether the times of the motion are those of its plan. */
  isAtPace: boolean;
  /** Between two samples of what was driven [s]. */
  period: number;
}

export class MotionRecord {
  readonly #app: App;
  readonly #driven = new DrivenMotion(0);
  /** Number of this page's plan that the last motion followed; null where it followed none. */
  #followed: number | null = null;
  /** The samples of that plan, or of somebody else's. */
  #plan: PlannedMotion | null = null;
  #reading: AbortController | null = null;
  #rate = USUAL_RATE;
  /** States a second as the last motion began [Hz]. */
  #drivenRate = USUAL_RATE;

  constructor(app: App) {
    this.#app = app;
    let { hello } = app.cell.value;
    app.cell.watch((cell) => {
      // Without a link the last motion can still be looked at.
      if (cell.hello === hello || cell.hello === null) return;
      ({ hello } = cell);
      this.#beginLink();
    });
    // Not from the model of the cell, which tells the last of several that came together.
    app.session.watchStates((state) => this.#take(state));
    // The plan's samples may come after its motion began, and the page may plan anew soon after it.
    planModel(app).watch(() => this.#takeOwn());
  }

  /** Be told how many states a second this link is asked for [Hz]. */
  set rate(rate: number) {
    this.#rate = rate;
  }

  look(): Look {
    const { preview, motion } = planModel(this.#app).value;
    const isWaiting = preview.stage === "ready" && motion !== null;
    const isMotion = this.#driven.isKnown;
    const driven = isWaiting ? null : this.#driven.samples();
    return {
      planned: isWaiting ? motion : isMotion ? this.#plan : null,
      driven: driven !== null && driven.times.length > 1 ? driven : null,
      isWaiting,
      isMotion,
      isAtPace: this.#driven.isAtPace,
      period: 1 / (isMotion ? this.#drivenRate : this.#rate),
    };
  }

  /** Read the samples of the plan that is under way, where it is not this page's own. */
  async readOthers(): Promise<void> {
    const isAsked = this.#followed !== null || this.#reading !== null;
    if (!this.#driven.isUnderWay || !this.#driven.isKnown || isAsked) return;
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
    signal.throwIfAborted();
    if (running === undefined) return null;
    const motion = await readPlan((request) => session.call<"plans.samples">(request), running.plan, undefined, signal);
    signal.throwIfAborted();
    return motion;
  }

  /** Plans of another link have numbers of their own, and its first state tells of no beginning. */
  #beginLink(): void {
    this.#rate = USUAL_RATE;
    this.#forgetPlan();
    this.#driven.clear();
  }

  #take(state: State): void {
    const joints = this.#app.cell.value.hello?.dof ?? 0;
    if (joints === 0 || !this.#driven.take(state, joints, 1 / this.#rate)) return;
    // Whatever plan was shown, this motion need not be its own: a false comparison is worse than none.
    this.#forgetPlan();
    this.#drivenRate = this.#rate;
    const { preview } = planModel(this.#app).value;
    const isOwn = state.activity === Activity.MOVING && preview.stage === "running";
    this.#followed = isOwn ? (preview.plan?.plan ?? null) : null;
    this.#takeOwn();
  }

  #takeOwn(): void {
    const { motion } = planModel(this.#app).value;
    if (motion !== null && motion.plan === this.#followed) this.#plan = motion;
  }

  #forgetPlan(): void {
    this.#reading?.abort();
    this.#reading = null;
    this.#plan = null;
    this.#followed = null;
  }
}
