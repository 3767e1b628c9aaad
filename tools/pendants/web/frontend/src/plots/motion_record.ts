// The motion that the robot drove last and the plan that it followed, or the plan that waits.
//
// There is one record for the whole page, from its beginning: a motion can be looked at after it.
import { planModel } from "../planning/model.ts";
import { Activity } from "../protocol.ts";
import type { State } from "../protocol.ts";
import type { App } from "../ui/app.ts";
import { DrivenMotion } from "./driven_motion.ts";
import { readPlan } from "./plan_samples.ts";
import type { PlannedMotion } from "./plan_samples.ts";
import type { Samples } from "./series.ts";

/** States a second that a page is told by itself [Hz]. */
const USUAL_RATE = 30;

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
  /** States a second that were asked for [Hz]. */
  rate = USUAL_RATE;
  readonly #app: App;
  readonly #driven = new DrivenMotion(0);
  #planned: PlannedMotion | null = null;
  /** Whether that plan is what the last motion followed; else it waits, or is gone. */
  #isFollowed = false;
  #reading: AbortController | null = null;
  #greeted: number | null = null;
  #problem = "";

  constructor(app: App) {
    this.#app = app;
    // Not from the model of the cell, which tells the last of several that came together.
    app.session.watchStates((state) => this.#take(state));
  }

  get planned(): PlannedMotion | null {
    return this.#planned;
  }

  /** Why there is no plan, where it should have been read; else empty. */
  get problem(): string {
    return this.#problem;
  }

  /** What was driven: by the plan where there is one that was followed, nothing beside one that waits. */
  driven(): Samples | null {
    if (this.#planned !== null && !this.#isFollowed) return null;
    const samples = this.#driven.samples();
    return samples.times.length > 1 ? samples : null;
  }

  /** Take the newest plan that waits, if there is one, in place of what was driven. */
  async lookAtWaiting(): Promise<void> {
    await this.#learn("ready", false);
  }

  #take(state: State): void {
    const cell = this.#app.cell.value;
    const session = cell.hello?.session ?? null;
    if (session !== this.#greeted) {
      this.#greeted = session;
      this.#forget();
      this.#driven.clear();
    }
    const joints = cell.hello?.dof ?? 0;
    if (joints === 0 || !this.#driven.take(state, joints, 1 / this.rate)) return;
    // Whatever plan was shown, this motion need not be its own: a false comparison is worse than none.
    this.#forget();
    if (state.activity === Activity.MOVING) void this.#learn("running", true);
  }

  #forget(): void {
    this.#reading?.abort();
    this.#planned = null;
    this.#isFollowed = false;
    this.#problem = "";
  }

  async #learn(stage: "ready" | "running", isFollowed: boolean): Promise<void> {
    this.#reading?.abort();
    const { signal } = (this.#reading = new AbortController());
    try {
      const { session } = this.#app;
      const { plans } = await session.call<"plans.show">({ op: "plans.show" });
      const head = plans.findLast(({ state }) => state === stage);
      if (head === undefined || signal.aborted) return;
      const { motion } = planModel(this.#app).value;
      const read = motion?.plan === head.plan ? motion : await readPlan((request) => session.call<"plans.samples">(request), head.plan, undefined, signal);
      signal.throwIfAborted();
      this.#planned = read;
      this.#isFollowed = isFollowed;
      this.#problem = "";
      this.#app.choice.set({}); // has it drawn
    } catch (error) {
      // Another motion began meanwhile, or the plan is gone: what was driven is shown alone.
      if (!signal.aborted) this.#problem = error instanceof Error ? error.message : String(error);
    }
  }
}
