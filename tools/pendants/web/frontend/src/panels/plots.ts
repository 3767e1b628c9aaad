// Plots: planned and driven motion against the limits in the place of the picture, and beside them the numbers.
import "../plots.css";
import type { Cell } from "../pendant/cell.ts";
import { csvTable } from "../plots/csv.ts";
import {
  controllerDelay,
  largestDifference,
  worstShares,
  type PlotJoint,
} from "../plots/findings.ts";
import { motionRecord, USUAL_RATE } from "../plots/motion_record.ts";
import type { Look, MotionRecord } from "../plots/motion_record.ts";
import { planModel } from "../planning/model.ts";
import { jointColour, Plots, valuesAt } from "../plots/plots.ts";
import { copied, QUANTITIES, type Quantity, type Samples } from "../plots/series.ts";
import type { PlotTexts } from "../texts/plots.ts";
import type { App, TaskPart } from "../ui/app.ts";
import { attribute, choose, download, h, mark, say, show } from "../ui/elements.ts";

/** States a second while the plots are seen [Hz]. */
const RATE_SHOWN = 100;
/** Between two pictures of what is being driven [ms]. */
const EVERY = 100;
/** A share of a limit that is near it. */
const NEAR = 0.9;
const PER: Readonly<Record<Quantity, string>> = {
  positions: "",
  velocities: "/s",
  accelerations: "/s²",
};

export function plotsTask(app: App): TaskPart {
  return new PlotsTask(app);
}

class PlotsTask implements TaskPart {
  readonly element: HTMLElement;
  readonly stage: HTMLElement;
  readonly #app: App;
  readonly #words: PlotTexts;
  readonly #record: MotionRecord;
  readonly #plots: Plots;
  readonly #one: HTMLButtonElement;
  readonly #all: HTMLButtonElement;
  readonly #pause: HTMLButtonElement;
  readonly #about = h("span", { class: "plan-name" });
  readonly #title = h("h2", {});
  readonly #heads = QUANTITIES.map(() => h("th", { scope: "col" }));
  readonly #body = h("tbody", {});
  readonly #shares = h("div", { class: "shares" });
  readonly #against = h("dl", {});
  readonly #notCompared = h("p", { class: "muted" });
  readonly #how = h("p", { class: "remark" });
  #joints: PlotJoint[] = [];
  #told: Cell["snapshot"] = null;
  #greeted: Cell["hello"] = null;
  /** What is drawn: what the record has, or had when the picture was held. */
  #seen: Look;
  #chosen: number | null = 0;
  #cursor: number | null = null;
  #isShown = false;
  #isHeld = false;
  #dueAt = 0;

  constructor(app: App) {
    this.#app = app;
    this.#record = motionRecord(app);
    this.#seen = this.#record.look();
    this.#words = app.texts.plotWords;
    const words = this.#words;
    const button = (word: string, act: () => void): HTMLButtonElement =>
      h("button", { type: "button", onclick: act }, word);
    this.#one = button(words.oneJoint, () => this.#choose(this.#chosen ?? 0));
    this.#all = button(words.allJoints, () => this.#choose(null));
    this.#pause = button(words.hold, () => this.#hold(!this.#isHeld));
    const host = h("div", { class: "plots" });
    this.stage = h(
      "section",
      { class: "plots-dock", "aria-label": app.texts.plots },
      h(
        "header",
        {},
        this.#about,
        this.#legend(),
        h("div", { class: "tabs", role: "group", "aria-label": words.joint }, this.#one, this.#all),
        this.#pause,
        button(words.fit, () => this.#plots.setRange(null)),
      ),
      host,
    );
    this.element = this.#panel(button(words.saveCsv, () => this.#save()), button(words.savePicture, () => this.#savePicture()));
    this.#plots = new Plots(host, {
      words: { quantities: words, number: (value, digits) => this.#number(value, digits) },
      theme: app.settings.value.theme,
      layout: "stack",
      onCursor: (time) => this.#pointed(time),
    });
    new ResizeObserver(() => this.#plots.resize()).observe(host);
    app.cell.watch((cell) => this.#learn(cell));
    app.settings.watch(({ theme }) => {
      this.#plots.setTheme(theme);
      this.#draw();
    });
  }

  update(): void {
    const now = this.#app.now();
    if (!this.#isShown || this.#isHeld || now < this.#dueAt) return;
    this.#dueAt = now + EVERY;
    void this.#record.readOthers();
    this.#draw();
  }

  shown(isShown: boolean): void {
    if (isShown === this.#isShown) return;
    this.#isShown = isShown;
    this.#subscribe();
    if (!isShown) return;
    this.#learn(this.#app.cell.value);
    this.#draw();
  }

  get #rate(): number {
    const most = this.#app.cell.value.hello?.max_state_rate ?? USUAL_RATE;
    return Math.min(most, this.#isShown ? RATE_SHOWN : USUAL_RATE);
  }

  #subscribe(): void {
    const { hello } = this.#app.cell.value;
    this.#greeted = hello;
    this.#record.rate = this.#rate;
    if (hello === null) return;
    this.#app.attempt(() => this.#app.session.ask({ type: "subscribe", state_rate: this.#rate }));
  }

  #panel(...acts: HTMLElement[]): HTMLElement {
    const words = this.#words;
    const row = h("tr", {}, h("th", { scope: "col" }, words.joint), ...this.#heads);
    const table = h("table", { class: "values" }, h("thead", {}, row), this.#body);
    const close = h("section", {}, h("h3", {}, words.howClose), this.#shares);
    const against = h("section", {}, h("h3", {}, words.against), this.#notCompared, this.#against);
    const parts = [this.#title, table, close, against, this.#how, h("div", { class: "acts" }, ...acts)];
    return h("section", { class: "plots-panel", "aria-label": this.#app.texts.plots }, ...parts);
  }

  #legend(): HTMLElement {
    const { planned, driven, limit } = this.#words;
    const entry = (word: string, line: string): HTMLElement =>
      h("span", { class: `sample ${line}` }, h("i", { "aria-hidden": "true" }), word);
    return h(
      "div",
      { class: "samples" },
      entry(planned, "solid"),
      entry(driven, "dotted"),
      entry(limit, "dashed"),
    );
  }

  #learn(cell: Cell): void {
    // A new conversation has the rate that it began with.
    if (this.#isShown && cell.hello !== this.#greeted) this.#subscribe();
    if (cell.snapshot === null || cell.snapshot === this.#told) return;
    this.#told = cell.snapshot;
    const joints = cell.snapshot.joints.map((joint) => ({
      ...joint,
      name: joint.display_name ?? joint.name,
    }));
    // A snapshot comes with each change of the scene: the same joints need no new plots.
    if (JSON.stringify(joints) !== JSON.stringify(this.#joints)) this.#joints = joints;
  }

  #choose(joint: number | null): void {
    this.#chosen = joint;
    this.#draw();
  }

  #hold(isHeld: boolean): void {
    this.#isHeld = isHeld;
    const { driven } = this.#seen;
    if (isHeld && driven !== null) this.#seen = { ...this.#seen, driven: copied(driven) };
    say(this.#pause, isHeld ? this.#words.goOn : this.#words.hold);
    attribute(this.#pause, "aria-pressed", String(isHeld));
  }

  #pointed(time: number | null): void {
    this.#cursor = time ?? this.#cursor;
    // Where the pointer left it, it can still be read.
    if (time === null) this.#plots.setCursor(this.#readAt);
    this.#tellValues();
  }

  /** The time that is read: what was pointed at, else where the preview's slider stands. */
  get #readAt(): number | null {
    if (this.#cursor !== null) return this.#cursor;
    const { motion, time } = planModel(this.#app).value;
    return motion !== null && motion === this.#seen.planned ? time : null;
  }

  #draw(): void {
    if (!this.#isShown || this.#joints.length === 0) return;
    if (!this.#isHeld) this.#see();
    const { planned, driven } = this.#seen;
    this.#plots.show({
      joints: this.#joints,
      planned: planned?.samples ?? null,
      driven,
      chosen: this.#chosen,
      unit: this.#app.settings.value.areRadians ? "rad" : "deg",
    });
    choose(this.#one, this.#chosen !== null);
    choose(this.#all, this.#chosen === null);
    this.#tellPlan();
    this.#tellValues();
    this.#tellShares();
    this.#tellAgainst();
  }

  #see(): void {
    const seen = this.#record.look();
    if (seen.planned !== this.#seen.planned) this.#cursor = null;
    this.#seen = seen;
    this.#plots.setCursor(this.#readAt);
  }

  #tellPlan(): void {
    const { planned, isMotion, period } = this.#seen;
    const words = this.#words;
    const seconds = this.#number(planned?.samples.times.at(-1) ?? 0, 2);
    const none = isMotion ? words.noPlan : words.noMotion;
    say(this.#about, planned === null ? none : words.planOf(planned.plan, seconds));
    say(this.#how, words.howMade(this.#number(1000 * period, 0)));
  }

  /** What the table and the bars are about: the plan, else what was driven. */
  get #read(): Samples | null {
    return this.#seen.planned?.samples ?? this.#seen.driven;
  }

  #tellValues(): void {
    const words = this.#words;
    const at = this.#readAt;
    say(this.#title, at === null ? words.pointAtPlots : words.atTime(this.#number(at, 2)));
    const unit = this.#unit(this.#joints[this.#chosen ?? 0]);
    this.#heads.forEach((head, index) =>
      say(head, `${"qva"[index] ?? ""} ${unit}${PER[QUANTITIES[index]!]}`),
    );
    const [planned, driven] = [this.#seen.planned?.samples ?? null, this.#seen.driven].map((samples) =>
      samples === null || at === null ? null : valuesAt(samples, at),
    );
    this.#fitRows();
    this.#joints.forEach((joint, index) => {
      const row = this.#body.rows[index];
      if (row === undefined) return;
      mark(row, "chosen", index === this.#chosen);
      const button = row.cells[0]?.querySelector("button") ?? null;
      if (button !== null) attribute(button, "aria-pressed", String(index === this.#chosen));
      QUANTITIES.forEach((quantity, column) => {
        const value = planned?.[quantity][index] ?? driven?.[quantity][index] ?? null;
        const cell = row.cells[column + 1];
        if (cell !== undefined) say(cell, value === null ? "–" : this.#shownValue(value, joint, 2));
      });
    });
  }

  #fitRows(): void {
    const names = this.#joints.map(({ name }) => name).join("\n");
    if (this.#body.dataset["names"] === names) return;
    this.#body.dataset["names"] = names;
    const { theme } = this.#app.settings.value;
    this.#body.replaceChildren(
      ...this.#joints.map(({ name }, index) => {
        const dash = h("i", { class: "dash", "aria-hidden": "true" });
        dash.style.background = jointColour(index, theme);
        const button = h("button", { type: "button", onclick: () => this.#choose(index) }, dash, name);
        const cells = QUANTITIES.map(() => h("td", {}));
        return h("tr", {}, h("th", { scope: "row" }, button), ...cells);
      }),
    );
  }

  #tellShares(): void {
    const samples = this.#read;
    const worst = samples === null ? [] : worstShares(samples, this.#joints);
    this.#shares.replaceChildren(
      ...worst.map(({ quantity, joint, time, share }) => {
        const percent = `${this.#number(100 * share, 1)} %`;
        const name = this.#joints[joint]?.name ?? "";
        const bar = h("i", { class: share >= NEAR ? "bar amber" : "bar green" });
        bar.style.width = `${Math.min(100, 100 * share)}%`;
        const where = this.#words.worstAt(name, this.#number(time, 2));
        return h(
          "div",
          { class: "share" },
          h("span", {}, this.#words[quantity]),
          h("span", { class: "muted" }, where),
          h("strong", {}, percent),
          h("div", { class: "track", "aria-hidden": "true" }, bar),
        );
      }),
    );
  }

  #tellAgainst(): void {
    const { driven, isAtPace, isWaiting } = this.#seen;
    const planned = this.#seen.planned?.samples ?? null;
    const both = planned !== null && driven !== null;
    const largest = both && isAtPace ? largestDifference(planned, driven) : null;
    say(this.#notCompared, isWaiting ? this.#words.notDriven : both && !isAtPace ? this.#words.notAtPace : "");
    show(this.#against, largest !== null);
    if (!both || largest === null) return;
    const joint = this.#joints[largest.joint];
    const delay = controllerDelay(planned, driven);
    const entry = (word: string, value: string): HTMLElement[] => [h("dt", {}, word), h("dd", {}, value)];
    const value = joint === undefined ? "" : `${this.#shownValue(Math.abs(largest.value), joint, 2)} ${this.#unit(joint)}`;
    this.#against.replaceChildren(
      ...entry(this.#words.largestDifference, value),
      ...entry(this.#words.where, this.#words.worstAt(joint?.name ?? "", this.#number(largest.time, 2))),
      ...(delay === null ? [] : entry(this.#words.controllerDelay, `${this.#number(1000 * delay, 0)} ms`)),
    );
  }

  #unit(joint: PlotJoint | undefined): string {
    if (joint?.unit === "m") return "mm";
    return this.#app.settings.value.areRadians ? "rad" : "°";
  }

  #shownValue(value: number, joint: PlotJoint, digits: number): string {
    const unit = this.#unit(joint);
    const factor = unit === "mm" ? 1000 : unit === "rad" ? 1 : 180 / Math.PI;
    return this.#number(value * factor, unit === "rad" ? digits + 2 : digits);
  }

  #number(value: number, digits: number): string {
    const { language } = this.#app.settings.value;
    // No minus in front of a zero.
    const rounded = Number(value.toFixed(digits)) + 0;
    return rounded.toLocaleString(language, { maximumFractionDigits: digits, useGrouping: false });
  }

  #save(): void {
    const table = csvTable(this.#joints, this.#seen.planned?.samples ?? null, this.#seen.driven);
    download(`${this.#fileName}.csv`, new Blob([table], { type: "text/csv" }));
  }

  #savePicture(): void {
    const ground = getComputedStyle(this.stage).backgroundColor;
    const { planned, driven, limit } = this.#words;
    const joint = this.#chosen === null ? this.#words.allJoints : (this.#joints[this.#chosen]?.name ?? "");
    const lines = `${planned} ——  ${driven} ···  ${limit} – –`;
    const caption = [this.#fileName, joint, this.#about.textContent, lines].join("  ·  ");
    this.#plots.picture(ground, caption).toBlob((png) => png !== null && download(`${this.#fileName}.png`, png));
  }

  get #fileName(): string {
    return this.#app.cell.value.robot?.robot ?? "motion";
  }
}
