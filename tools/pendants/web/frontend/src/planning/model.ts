// The plan of this page: asks for it, keeps its samples, plays them, executes it.
//
// There is one for the whole page, so that a plan outlives a change of panel, theme or language.
import { jointsAt, readPlan } from "../plots/plan_samples.ts";
import type { PlannedMotion } from "../plots/plan_samples.ts";
import { measuredJoints } from "../pendant/cell.ts";
import { Observable } from "../pendant/observable.ts";
import type { Message, PlanChanged, PlansMakeRequest } from "../protocol.ts";
import { refusalSentence } from "../texts/texts.ts";
import { onePerPage } from "../ui/app.ts";
import type { App } from "../ui/app.ts";
import { LinkLost, Refused } from "../wire/errors.ts";
import type { Refusal } from "../wire/errors.ts";
import { begun, changed, explained, linkLost, made, NO_PREVIEW, refused } from "./preview.ts";
import type { Preview } from "./preview.ts";

export interface Shown {
  preview: Preview;
  /** Its samples, once they are here. */
  motion: PlannedMotion | null;
  /** Of the slider [s]. */
  time: number;
  isPlaying: boolean;
  /** Of the preview's time to the clock's. */
  rate: number;
  /** Whether somebody else looks on at this cell. */
  isWatched: boolean;
}

/** Return the plan of this page. */
export const planModel = onePerPage((app) => new PlanModel(app));

export class PlanModel extends Observable<Shown> {
  readonly #app: App;
  #asked: PlansMakeRequest | null = null;
  #reading: AbortController | null = null;
  #changesBefore: Readonly<Record<number, number>> = {};
  #tickedAt = 0;

  constructor(app: App) {
    super({ preview: NO_PREVIEW, motion: null, time: 0, isPlaying: false, rate: 1, isWatched: false });
    this.#app = app;
    this.watch(() => app.choice.set({})); // has it drawn, also what is played from one picture to the next
    app.session.listen((message) => this.#told(message));
    app.cell.watch((cell) => {
      const { preview } = this.value;
      const after =
        cell.stage === "up" ? explained(preview, this.#around(), app.now()) : linkLost(preview);
      if (after !== preview) this.set({ preview: after });
    });
  }

  /** Whether there is something to plan again. */
  get hasAsked(): boolean {
    return this.#asked !== null;
  }

  /** Have a plan made; nothing moves. */
  async make(goal: PlansMakeRequest["goal"], speed: number): Promise<void> {
    this.#asked = { op: "plans.make", goal, speed };
    await this.again();
  }

  /** Have a plan made by the settings of the last one. */
  async again(): Promise<void> {
    const asked = this.#asked;
    if (asked === null || this.value.preview.stage === "planning") return;
    this.#reading?.abort();
    this.#drop();
    this.set({ preview: begun(), motion: null, time: 0, isPlaying: false });
    this.#changesBefore = this.#app.cell.value.changes;
    try {
      const plan = await this.#app.session.call<"plans.make">(asked);
      this.set({ preview: made(plan, this.#app.now()) });
      await Promise.all([this.#read(plan.plan), this.#lookRound()]);
    } catch (error) {
      if (error instanceof Refused) this.#refused(error.refusal);
      else if (!(error instanceof LinkLost)) throw error;
    }
  }

  #refused(refusal: Refusal): void {
    const { log, settings } = this.#app;
    log.add("refusal", refusalSentence(refusal, settings.value.language, this.#app.jointNames()));
    this.set({ preview: refused(refusal) });
  }

  /** Execute the samples that were shown. */
  async execute(): Promise<void> {
    const { preview } = this.value;
    if (preview.stage !== "ready" || preview.plan === null) return;
    const { ended } = await this.#app.session.move({
      type: "execute", plan: preview.plan.plan, override_is_one: 0,
    });
    await ended;
  }

  seek(time: number): void {
    const end = this.value.preview.plan?.duration ?? 0;
    this.set({ time: Math.min(end, Math.max(0, time)), isPlaying: false });
  }

  play(): void {
    const end = this.value.preview.plan?.duration ?? 0;
    const { isPlaying, time } = this.value;
    this.set({ isPlaying: !isPlaying, ...(time >= end ? { time: 0 } : {}) });
    this.#tickedAt = this.#app.now();
  }

  /** Move on with the clock what is played, or executed. */
  tick(): void {
    const { preview, isPlaying, time, rate } = this.value;
    const now = this.#app.now();
    const passed = (now - this.#tickedAt) / 1000;
    this.#tickedAt = now;
    const end = preview.plan?.duration ?? 0;
    if (preview.stage === "running") {
      const override = this.#app.cell.value.state?.override ?? 1;
      this.set({ time: Math.min(end, time + passed * override), isPlaying: false });
    } else if (isPlaying) {
      const next = time + passed * rate;
      this.set({ time: Math.min(end, next), isPlaying: next < end });
    }
  }

  /** Joints at the slider's time; null where no samples are here. */
  joints(): number[] | null {
    const { motion, time } = this.value;
    return motion === null ? null : jointsAt(motion.samples, time);
  }

  #told(message: Message): void {
    if (message.type !== "plan_changed") return;
    const { preview } = this.value;
    const after = changed(preview, message, this.#around(), this.#app.now());
    if (after === preview) return;
    this.#tickedAt = this.#app.now();
    this.set({ preview: after, ...this.#timeOf(after, message) });
  }

  #timeOf({ stage, plan }: Preview, { code }: PlanChanged): Partial<Shown> {
    if (stage === "running") return { time: 0, isPlaying: false };
    return stage === "done" && code === 0 ? { time: plan?.duration ?? 0 } : {};
  }

  #around() {
    const cell = this.#app.cell.value;
    const { changes } = cell;
    const kinds = Object.keys(changes).map(Number);
    return {
      joints: measuredJoints(cell),
      changed: kinds.filter((each) => changes[each] !== this.#changesBefore[each]),
    };
  }

  async #read(plan: number): Promise<void> {
    const reading = new AbortController();
    this.#reading = reading;
    try {
      const ask = this.#app.session.call.bind(this.#app.session);
      const motion = await readPlan((request) => ask<"plans.samples">(request), plan, undefined, reading.signal);
      this.set({ motion });
    } catch (error) {
      // A plan that ended meanwhile says so itself.
      if (!reading.signal.aborted && !(error instanceof Refused || error instanceof LinkLost)) throw error;
    }
  }

  /** Somebody else who looks on makes Execute ask twice. */
  async #lookRound(): Promise<void> {
    const { cells } = await this.#app.session.call<"cells">({ op: "cells" });
    const here = this.#app.session.place?.cell ?? "";
    const cell = cells.find((each) => each.cell === here);
    this.set({ isWatched: (cell?.connections ?? 1) > 1 });
  }

  /** The server keeps four plans of a page; the one that is planned anew is wanted no more. */
  #drop(): void {
    const { preview } = this.value;
    if (preview.stage !== "ready" || preview.plan === null) return;
    this.#app.session.call<"plans.drop">({ op: "plans.drop", plan: preview.plan.plan }).catch((error: unknown) => {
      if (!(error instanceof Refused || error instanceof LinkLost)) throw error;
    });
  }
}
