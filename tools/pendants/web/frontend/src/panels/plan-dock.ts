// The preview's slider with its marks, its pace, and what is planned of each joint.
import type { PlanModel } from "../planning/model.ts";
import { moments } from "../planning/preview.ts";
import { Plots } from "../plots/plots.ts";
import type { PlotJoint } from "../plots/findings.ts";
import type { PlannedMotion } from "../plots/plan_samples.ts";
import type { PlansMakeReply } from "../protocol.ts";
import type { PlanTexts } from "../texts/plan.ts";
import { fixed } from "../texts/texts.ts";
import type { App, Part } from "../ui/app.ts";
import { attribute, h, mark, say, show } from "../ui/elements.ts";
import { icon } from "../ui/icons.ts";

const RATES = [0.5, 1, 2];
/** Moments that are nearer than this part of the duration have their words on either side. */
const TIGHT = 0.15;

export function planDock(app: App, words: PlanTexts, model: PlanModel): Part {
  const play = h("button", { type: "button", "aria-label": words.play, onclick: () => model.play() }, icon("play"));
  const time = h("output", { class: "time" });
  const end = h("span", { class: "muted time" });
  const slider = h("input", { type: "range", min: 0, step: 0.01, value: 0, "aria-label": words.slider });
  slider.addEventListener("input", () => model.seek(Number(slider.value)));
  const marks = h("div", { class: "marks" });
  const rates = RATES.map((rate) =>
    h("button", { type: "button", onclick: () => model.set({ rate }) }, rate === 0.5 ? "½×" : `${rate}×`),
  );
  const bar = h(
    "div",
    { class: "preview-bar" },
    play,
    time,
    h("div", { class: "slider" }, marks, slider),
    end,
    h("div", { class: "tabs", role: "group", "aria-label": words.rate }, ...rates),
  );
  const legend = h("p", { class: "muted legend-of-preview" });
  const host = h("div", { class: "plots" });
  const element = h("section", { class: "plan-dock", "aria-label": words.slider }, bar, legend, host);
  const plots = new PlannedPlots(app, model, host);
  let marked: PlansMakeReply | null = null;
  return {
    element,
    update() {
      const { preview, motion, time: at, isPlaying, rate } = model.value;
      const { plan } = preview;
      const isSeen = plan !== null && ["ready", "running", "done"].includes(preview.stage);
      show(element, isSeen);
      if (!isSeen) return;
      attribute(slider, "max", plan.duration);
      if (Number(slider.value) !== at) slider.value = String(at);
      slider.style.setProperty("--filled", `${(100 * at) / Math.max(plan.duration, 0.01)}%`);
      attribute(slider, "aria-valuetext", words.seconds(fixed(at, 2)));
      attribute(slider, "data-joints", model.joints()?.map((each) => each.toFixed(5)).join(" ") ?? null);
      say(time, words.seconds(fixed(at, 2)));
      say(end, words.seconds(fixed(plan.duration, 2)));
      attribute(play, "aria-label", isPlaying ? words.hold : words.play);
      mark(play, "chosen", isPlaying);
      say(legend, `○ ${words.robotNow}  ·  ● ${words.previewAt(fixed(at, 2))}  ·  ─ ${words.pathOfTool}`);
      rates.forEach((each, index) => {
        mark(each, "chosen", RATES[index] === rate);
        attribute(each, "aria-pressed", String(RATES[index] === rate));
      });
      if (plan !== marked) {
        marked = plan;
        marks.replaceChildren(...markButtons(words, model, plan));
      }
      plots.update(motion, at);
    },
  };
}

function markButtons(words: PlanTexts, model: PlanModel, plan: PlansMakeReply): HTMLElement[] {
  const told = moments(plan).sort((one, other) => one.at - other.at);
  const isTight = told.length > 1 && (told.at(-1)?.at ?? 0) - (told[0]?.at ?? 0) < TIGHT * plan.duration;
  return told.map(({ kind, at }, index) => {
    const button = h(
      "button",
      { type: "button", class: `moment ${kind}`, "aria-label": words.goTo(words[kind], fixed(at, 2)), onclick: () => model.seek(at) },
      words[kind],
    );
    if (isTight) button.classList.add(index === 0 ? "before" : "after");
    button.style.left = `${(100 * at) / Math.max(plan.duration, 0.01)}%`;
    return button;
  });
}

/** Planned positions, velocities and accelerations of all joints over the preview's time. */
class PlannedPlots {
  readonly #app: App;
  readonly #host: HTMLElement;
  readonly #model: PlanModel;
  #plots: Plots | null = null;
  #shown: PlannedMotion | null = null;
  #at = -1;

  constructor(app: App, model: PlanModel, host: HTMLElement) {
    this.#app = app;
    this.#model = model;
    this.#host = host;
    new ResizeObserver(() => this.#plots?.resize()).observe(host);
  }

  update(motion: PlannedMotion | null, at: number): void {
    show(this.#host, motion !== null);
    // A plot that is made before its place is laid out has no size.
    if (motion === null || this.#host.clientWidth === 0) return;
    if (motion !== this.#shown) this.#show(motion);
    if (at === this.#at) return;
    this.#at = at;
    this.#plots?.setCursor(at);
  }

  #show(motion: PlannedMotion): void {
    this.#shown = motion;
    this.#at = -1;
    const { language, theme, areRadians } = this.#app.settings.value;
    const number = (value: number, digits: number): string =>
      value.toLocaleString(language, { maximumFractionDigits: digits, useGrouping: false });
    this.#plots ??= new Plots(this.#host, {
      words: { quantities: this.#app.texts.plotWords, number },
      theme,
      layout: "row",
      onCursor: (time) => {
        if (time !== null) this.#model.seek(time);
      },
    });
    const joints: PlotJoint[] = (this.#app.cell.value.snapshot?.joints ?? []).map((each) => ({
      ...each,
      name: each.display_name ?? each.name,
    }));
    this.#plots.show({ joints, planned: motion.samples, driven: null, chosen: null, unit: areRadians ? "rad" : "deg" });
  }
}
