// The tour's panel: what it needs, what it does now, what it did; ended by one press at any moment.
import "./tour.css";
import { isInControl, isReal } from "../pendant/cell.ts";
import type { Cell } from "../pendant/cell.ts";
import { isManual } from "../pendant/checklist.ts";
import { enablingPad } from "../panels/enabling-pad.ts";
import { whyNoMotion } from "../panels/jog.ts";
import { MotionControlAction, StateField } from "../protocol.ts";
import { Twice } from "../planning/twice.ts";
import type { TourTexts } from "../texts/tour.ts";
import { fixed, refusalSentence } from "../texts/texts.ts";
import type { App, Part, TaskPart } from "../ui/app.ts";
import { attribute, h, isOff, mark, off, say, show } from "../ui/elements.ts";
import { icon } from "../ui/icons.ts";
import { LinkLost, Refused } from "../wire/errors.ts";
import type { Refusal } from "../wire/errors.ts";
import { Ended, Tour } from "./tour.ts";
import type { TouringPendant } from "./tour.ts";

export function tourTask(app: App): TaskPart {
  return new TourTask(app);
}

class TourTask implements TaskPart {
  readonly element: HTMLElement;
  readonly #app: App;
  readonly #words: TourTexts;
  readonly #needs = h("p", { class: "needs" });
  readonly #told = h("p", { class: "told", role: "status" });
  readonly #steps = h("ol", { class: "tour-steps", "aria-live": "polite" });
  readonly #pad: Part;
  readonly #begin: HTMLButtonElement;
  readonly #end: HTMLButtonElement;
  readonly #twice: Twice;
  #tour: Tour | null = null;
  #isOver = true;
  #isShown = false;

  constructor(app: App) {
    this.#app = app;
    const words = (this.#words = app.texts.tourWords);
    this.#twice = new Twice();
    this.#pad = enablingPad(app);
    this.#begin = h("button", { type: "button", class: "begin", onclick: () => this.#press() }, words.begin);
    this.#end = h("button", { type: "button", class: "end", onclick: () => this.#stop() }, words.end);
    const leave = h("button", { type: "button", onclick: () => app.choice.set({ task: "jog" }) }, words.leave);
    this.element = h(
      "section",
      { class: "tour", "aria-label": words.title },
      h("header", {}, h("h2", {}, words.title), leave),
      h("p", { class: "muted" }, words.what),
      this.#steps,
      this.#told,
      h("div", { class: "foot" }, this.#needs, this.#pad.element, h("div", { class: "acts" }, this.#end, this.#begin)),
    );
    // Nobody sees what a page in the background does.
    document.addEventListener("visibilitychange", () => document.hidden && this.#stop());
    // In another language the page is built anew, without this list.
    const { language } = app.settings.value;
    app.settings.watch((settings) => settings.language !== language && this.#stop());
  }

  shown(isShown: boolean): void {
    this.#isShown = isShown;
    this.#app.overlay(null);
    if (isShown) this.#app.choice.set({ isChecklistOpen: false, isMenuOpen: false });
    else this.#stop();
  }

  update(cell: Cell): void {
    if (!this.#isShown) return;
    this.#pad.update(cell);
    show(this.#pad.element, isManual(cell) && isInControl(cell));
    const why = whyNoMotion(this.#app, cell);
    off(this.#begin, this.#isOver ? why : this.#words.now);
    off(this.#end, this.#isOver ? this.#words.ended : "");
    show(this.#end, !this.#isOver);
    show(this.#begin, this.#isOver);
    mark(this.#begin, "orange", this.#isOver && isInControl(cell) && why === "");
    const asks = this.#twice.asks(this.#app.now());
    say(this.#begin, asks ? this.#words.sure : this.#tour === null ? this.#words.begin : this.#words.again);
    say(this.#needs, this.#needed(cell, why));
  }

  #needed(cell: Cell, why: string): string {
    const words = this.#words;
    if (!isInControl(cell)) return words.needsControl;
    if (isManual(cell)) return words.needsEnabling;
    return why === "" ? words.freely : words.needsPeace;
  }

  #press(): void {
    const { session, choice, cell } = this.#app;
    if (isOff(this.#begin)) {
      session.refreshWhy();
      if (this.#isOver) choice.set({ isChecklistOpen: true });
    } else if (this.#twice.press(isReal(cell.value), this.#app.now())) void this.#run();
  }

  #stop(): void {
    if (!this.#isOver) this.#tour?.end();
  }

  async #run(): Promise<void> {
    const joints = this.#app.cell.value.snapshot?.joints ?? [];
    const tour = new Tour(this.#pendant(), joints, () => this.#tell(tour));
    this.#tour = tour;
    this.#isOver = false;
    this.#tell(tour);
    say(this.#told, "");
    let told = "";
    try {
      await tour.run();
      told = this.#words.done(tour.steps.length);
    } catch (error) {
      told = this.#reason(error);
    }
    this.#isOver = true;
    say(this.#told, told);
    this.#tell(tour);
    this.#app.choice.set({});
  }

  /** Why it ended before its end. */
  #reason(error: unknown): string {
    const refusal: Refusal | null = error instanceof Refused || error instanceof Ended ? error.refusal : null;
    if (refusal !== null) return this.#words.endedBy(refusalSentence(refusal, this.#app.settings.value.language, this.#app.jointNames()));
    if (error instanceof Ended) return this.#words.ended;
    if (error instanceof LinkLost) return this.#words.endedBy(this.#app.texts.linkNone);
    throw error;
  }

  #pendant(): TouringPendant {
    const { session, cell } = this.#app;
    const state = () => {
      const now = cell.value.state;
      const needed = StateField.POSITION | StateField.TOOL;
      if (now === null || (now.valid_fields & needed) !== needed) throw new LinkLost();
      return now;
    };
    return {
      joints: () => state().positions.slice(0, cell.value.hello?.dof ?? 0),
      tool: () => ({ position: state().tool_position, orientation: state().tool_orientation }),
      move: (draft) => session.move(draft),
      endMotion: () => {
        const action = MotionControlAction.PROGRAM_STOP;
        // Refused nothing is under way.
        session.askNow({ type: "motion_control", action }).catch(() => undefined);
      },
    };
  }

  #tell(tour: Tour): void {
    const words = this.#words;
    const names = this.#names();
    const named = (name: string): string => names.get(name) ?? name;
    const { language } = this.#app.settings.value;
    const done = tour.steps.map(({ kind, name, count, took }) => {
      const time = took === null ? (this.#isOver ? "" : words.now) : words.took(fixed(took, 1));
      const sign = took !== null ? "check" : this.#isOver ? "cross" : "play";
      const row = h("li", { class: sign }, icon(sign), h("span", {}, words.steps[kind](named(name), count)), h("span", { class: "time" }, language === "de" ? time.replace(".", ",") : time));
      attribute(row, "aria-current", took === null && !this.#isOver ? "step" : null);
      return row;
    });
    const left = tour.leftOut.map(({ kind, name }) => h("li", { class: "left-out" }, icon("warning"), h("span", {}, words.leftOut[kind](named(name)))));
    this.#steps.replaceChildren(...done, ...left);
    this.#steps.lastElementChild?.scrollIntoView({ block: "nearest" });
  }

  #names(): Map<string, string> {
    return new Map((this.#app.cell.value.snapshot?.joints ?? []).map((each) => [each.name, each.display_name ?? each.name]));
  }
}
