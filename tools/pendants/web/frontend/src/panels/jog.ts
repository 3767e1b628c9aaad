// Jog: rows with a button on either side, speed, steps, targets, home, undo, enabling.
import { aimOf, isAtEnd, jointRows, NEAR, fraction, toolRows, userFrames } from "../pendant/axes.ts";
import type { Row } from "../pendant/axes.ts";
import { isInControl } from "../pendant/cell.ts";
import type { Cell } from "../pendant/cell.ts";
import { isManual } from "../pendant/checklist.ts";
import type { JogKey } from "../pendant/hold.ts";
import { EnablingPosition, JogSpace, OperatingMode } from "../protocol.ts";
import { pageState } from "../pendant/states.ts";
import { fixed } from "../texts/texts.ts";
import type { App, AxesFrame, TaskPart } from "../ui/app.ts";
import { choose, h, mark, off, say, sayOrHide, show } from "../ui/elements.ts";
import { holdButton } from "../ui/hold-button.ts";
import { icon } from "../ui/icons.ts";
import { enablingPad } from "./enabling-pad.ts";
import { targetBox } from "./target.ts";
import type { Part } from "../ui/app.ts";

const FRAMES: AxesFrame[] = ["joint", "base", "tool", "user"];
const STEPS = [0, 10, 1, 0.1];
const SLOTS = 10;

export function jogTask(app: App): TaskPart {
  const { texts } = app;
  const tabs = FRAMES.map((each) =>
    h(
      "button",
      { type: "button", onclick: () => chooseAxes(app, each) },
      { joint: texts.joint, base: texts.base, tool: texts.tool, user: texts.user }[each],
    ),
  );
  const user = h("select", { "aria-label": texts.userFrame, class: "user-frame" });
  user.addEventListener("change", () => {
    app.choice.set({ userFrame: user.value });
    chooseAxes(app, "user");
  });
  const remark = h("p", { class: "remark" });
  const list = h("div", { class: "rows", role: "application", "aria-label": texts.jogPanel });
  const speed = speedRow(app);
  const steps = stepRow(app);
  const pad = enablingPad(app);
  const homes = homeButtons(app);
  const element = h(
    "section",
    { class: "jog", "aria-label": texts.jog },
    h("div", { class: "tabs", role: "group", "aria-label": texts.frameOfAxes }, ...tabs),
    user,
    remark,
    list,
    speed.element,
    steps.element,
    pad.element,
    homes.element,
  );
  let rows: JogRow[] = [];
  let shape = "";
  return {
    element,
    update(cell) {
      const { axes } = app.choice.value;
      const told = axes === "joint" ? jointRows(cell) : toolRows(cell);
      const wanted = `${axes} ${told.map((each) => each.name).join()}`;
      if (wanted !== shape) {
        shape = wanted;
        rows = told.map((each, index) => new JogRow(app, each, index));
        list.replaceChildren(...rows.map((each) => each.element));
      }
      app.holding.setAim(aimOf(axes, app.choice.value.userFrame, cell.hello?.dof ?? told.length));
      tabs.forEach((each, index) => choose(each, FRAMES[index] === axes));
      const why = whyNoJog(app, cell);
      rows.forEach((each, index) => {
        const row = told[index];
        if (row !== undefined) each.update(cell, row, why);
      });
      fillFrames(user, cell, app, axes === "user");
      sayOrHide(remark, remarkOf(app, cell, axes));
      for (const each of [speed, steps, pad, homes]) each.update(cell);
    },
  };
}

/** Choose the frame of the axes; what is held ends. */
export function chooseAxes(app: App, axes: AxesFrame): void {
  app.holding.letGo();
  app.choice.set({ axes });
}

function fillFrames(select: HTMLSelectElement, cell: Cell, app: App, isShown: boolean): void {
  const frames = userFrames(cell);
  const wanted = frames.join("\n");
  if (select.dataset["frames"] !== wanted) {
    select.dataset["frames"] = wanted;
    select.replaceChildren(...frames.map((each) => h("option", { value: each }, each)));
    if (!frames.includes(app.choice.value.userFrame)) {
      app.choice.set({ userFrame: frames[0] ?? "" });
    }
  }
  select.value = app.choice.value.userFrame;
  show(select, isShown && frames.length > 0);
}

function remarkOf(app: App, cell: Cell, axes: AxesFrame): string {
  const { texts } = app;
  if (cell.controller?.jog === "none") return texts.noJogAtAll;
  if (cell.controller?.jog === "increments") return texts.incrementsOnly;
  if (axes === "user" && userFrames(cell).length === 0) return texts.noUserFrame;
  return "";
}

/** Return why no jog may begin; empty where one may. */
function whyNoJog(app: App, cell: Cell): string {
  const { texts } = app;
  const state = pageState(cell);
  const isOn = isInControl(cell) && isManual(cell) && (state === "control" || state === "fault");
  const isEnabled = cell.state?.enabling === EnablingPosition.HELD || app.holding.enabling.isOn;
  if (!isOn || !isEnabled || cell.controller?.jog === "none") return texts.noJog;
  if (app.choice.value.axes === "user" && app.choice.value.userFrame === "") {
    return texts.noUserFrame;
  }
  return "";
}

/** Return a value as it stands on the screen, and its unit. */
export function shown(value: number, isAngle: boolean, areRadians: boolean): [string, string] {
  if (!isAngle) return [fixed(value * 1000, 1), " mm"];
  return areRadians ? [fixed(value, 4), " rad"] : [fixed((value * 180) / Math.PI, 2), "°"];
}

class JogRow {
  readonly element: HTMLElement;
  #app: App;
  #name: string;
  #index: number;
  #minus: HTMLButtonElement;
  #plus: HTMLButtonElement;
  #value = h("span", { class: "value" });
  #speed = h("span", { class: "actual" });
  #bar: HTMLElement;
  #mark = h("span", { class: "mark" });
  #target: Part;

  constructor(app: App, row: Row, index: number) {
    this.#app = app;
    this.#name = row.name;
    this.#index = index;
    this.#minus = this.#button(-1);
    this.#plus = this.#button(1);
    this.#bar = h("span", { class: "bar" }, this.#mark);
    show(this.#bar, row.limits !== null);
    this.#target = targetBox(app, row.name, index, row.isAngle);
    const middle = h(
      "div",
      { class: "middle" },
      h("span", { class: "name" }, row.name),
      this.#target.element,
      this.#bar,
      this.#speed,
    );
    (this.#target.element.querySelector("button") ?? middle).append(this.#value);
    this.element = h("div", { class: "row" }, this.#minus, middle, this.#plus);
  }

  update(cell: Cell, row: Row, why: string): void {
    const { settings, texts } = this.#app;
    const { areRadians } = settings.value;
    const [text, unit] =
      row.value === null ? ["–", ""] : shown(row.value, row.isAngle, areRadians);
    say(this.#value, text + unit);
    const moves = Math.abs(row.speed ?? 0) > 1e-3;
    const [rate, per] = shown(row.speed ?? 0, row.isAngle, areRadians);
    say(this.#speed, moves ? `${(row.speed ?? 0) > 0 ? "+" : ""}${rate}${per}/s` : "");
    const at = fraction(row);
    if (at !== null) this.#mark.style.left = `${(100 * at).toFixed(2)}%`;
    mark(this.element, "near", at !== null && (at < NEAR || at > 1 - NEAR));
    for (const [button, direction] of [
      [this.#minus, -1],
      [this.#plus, 1],
    ] as const) {
      const limit = row.limits?.[direction > 0 ? 1 : 0] ?? 0;
      const end = shown(limit, row.isAngle, areRadians).join("");
      const isEnd = row.limits !== null && isAtEnd(row, direction);
      off(button, why !== "" ? why : isEnd ? texts.limitReached(end) : "");
      mark(button, "held", this.#isHeld(direction));
    }
    this.#target.update(cell);
  }

  #isHeld(direction: 1 | -1): boolean {
    return this.#app.holding.held.some(
      (each) => each.axis === this.#index && each.direction === direction,
    );
  }

  #button(direction: 1 | -1): HTMLButtonElement {
    const app = this.#app;
    const key: JogKey = { axis: this.#index, direction };
    const label = direction > 0 ? app.texts.jogPlus(this.#name) : app.texts.jogMinus(this.#name);
    return holdButton(
      "jog-key",
      label,
      {
        down: (source) => pressKey(app, source, key),
        up: (source) => app.holding.release(source),
        explain: () => app.choice.set({ note: { text: app.texts.holdHow, kind: "remark" } }),
      },
      icon(direction > 0 ? "plus" : "minus"),
    );
  }
}

/** A jog key went down, on the screen or on the keyboard: it holds, or it steps. */
export function pressKey(app: App, source: string, key: JogKey): void {
  if (!mayJog(app)) return;
  const { step } = app.choice.value;
  if (isStepping(app)) takeStep(app, key, step > 0 ? step : 1);
  else app.holding.press(source, key);
}

function isStepping(app: App): boolean {
  return app.choice.value.step > 0 || app.cell.value.controller?.jog === "increments";
}

/** Whether a jog may begin; where not, it is said. */
function mayJog(app: App): boolean {
  const cell = app.cell.value;
  if (isInControl(cell) && pageState(cell) === "running") {
    app.choice.set({ note: { text: app.texts.movesStill, kind: "remark" } });
    return false;
  }
  if (whyNoJog(app, cell) === "") return true;
  app.session.refreshWhy();
  app.choice.set({ isChecklistOpen: true });
  return false;
}

/** Sticks ask for a motion, which they hold: they make no steps. */
export function steer(app: App, values: readonly number[]): void {
  if (mayJog(app) && !isStepping(app)) app.holding.steer(values);
}

function takeStep(app: App, { axis, direction }: JogKey, step: number): void {
  const { aim } = app.holding;
  const rows = aim.space === "joints" ? jointRows(app.cell.value) : toolRows(app.cell.value);
  const row = rows[axis];
  if (row === undefined) return;
  if (app.holding.isMoving) {
    app.choice.set({ note: { text: app.texts.movesStill, kind: "remark" } });
    return;
  }
  const size = row.isAngle ? (step * Math.PI) / 180 : step / 1000;
  const values = new Array<number>(SLOTS).fill(0);
  values[axis] = direction * size;
  app.attempt(async () => {
    const { ended } = await app.session.move({
      type: "jog_step",
      speed: app.holding.speed,
      space: aim.space === "joints" ? JogSpace.JOINTS : JogSpace.TOOL,
      frame: aim.frame,
      value_count: aim.count,
      values,
    });
    await ended;
  });
}

function speedRow(app: App): Part {
  const { texts } = app;
  const slider = h("input", {
    type: "range",
    min: 1,
    max: 100,
    value: Math.round(app.holding.speed * 100),
    "aria-label": texts.jogSpeed,
  });
  const told = h("output", { class: "number" });
  slider.addEventListener("input", () => {
    app.holding.speed = Number(slider.value) / 100;
    say(told, `${slider.value} %`);
  });
  return {
    element: h("label", { class: "speed" }, h("span", {}, texts.jogSpeed), slider, told),
    update() {
      say(told, `${slider.value} %`);
      slider.style.setProperty("--filled", `${slider.value}%`);
    },
  };
}

function stepRow(app: App): Part {
  const { texts } = app;
  const buttons = STEPS.map((each) =>
    h(
      "button",
      {
        type: "button",
        title: each === 0 ? null : texts.stepUnits,
        onclick: () => {
          app.holding.letGo();
          app.choice.set({ step: each });
        },
      },
      each === 0 ? texts.holdToMove : texts.step(String(each)),
    ),
  );
  return {
    element: h("div", { class: "tabs steps", role: "group", "aria-label": texts.stepUnits }, ...buttons),
    update(cell) {
      const mustStep = cell.controller?.jog === "increments";
      const { step } = app.choice.value;
      buttons.forEach((each, index) => {
        const isHold = STEPS[index] === 0;
        off(each, isHold && mustStep ? texts.incrementsOnly : "");
        choose(each, mustStep && step === 0 ? STEPS[index] === 1 : STEPS[index] === step);
      });
    },
  };
}

function homeButtons(app: App): Part {
  const { texts } = app;
  const motion = (text: string, draft: () => Parameters<typeof app.holding.holdMotion>[1]) =>
    holdButton(
      "motion",
      null,
      {
        down: (source) => app.holding.holdMotion(source, draft()),
        up: (source) => app.holding.release(source),
        explain: () => app.choice.set({ note: { text: texts.holdHow, kind: "remark" } }),
      },
      text,
    );
  const to = (target: string) => () => ({ type: "home", speed: app.holding.speed, target }) as const;
  const home = motion(texts.holdHome, to("home"));
  const zero = motion(texts.holdZero, to("zero"));
  const undo = motion(texts.undoJog, () => ({ type: "jog_undo", speed: app.holding.speed }) as const);
  return {
    element: h("div", { class: "homes" }, home, h("div", { class: "pair" }, zero, undo)),
    update(cell) {
      const why = whyNoMotion(app, cell);
      for (const each of [home, zero, undo]) off(each, why);
    },
  };
}

/** Return why no motion may begin; empty where one may. */
export function whyNoMotion(app: App, cell: Cell): string {
  const state = pageState(cell);
  const isAutomatic = cell.state?.operating_mode === OperatingMode.AUTOMATIC;
  const isEnabled = isAutomatic || app.holding.enabling.isOn;
  const isOn = isInControl(cell) && isEnabled && (state === "control" || state === "running");
  return isOn ? "" : app.texts.noJog;
}
