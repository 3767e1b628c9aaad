// The checklist: what is missing until the robot moves, each line with its button and its key.
import { aimOf, jointRows } from "../pendant/axes.ts";
import { isInControl, isReal } from "../pendant/cell.ts";
import type { Cell } from "../pendant/cell.ts";
import { checklist, isManual, nextLine, waysOut } from "../pendant/checklist.ts";
import type { Line, LineName } from "../pendant/checklist.ts";
import { outside, pageState } from "../pendant/states.ts";
import { JogSpace, LinkState, OperatingMode, PrepareAction, TriState, VerdictCode } from "../protocol.ts";
import { causeAndRemedy, modeWord } from "../texts/texts.ts";
import type { App, AxesFrame, Part } from "../ui/app.ts";
import { Refused } from "../wire/errors.ts";
import { attribute, h, keyCap, mark, off, say, show } from "../ui/elements.ts";
import { bindHold } from "../ui/hold-button.ts";
import { icon } from "../ui/icons.ts";
import { pressKey } from "./jog.ts";
import { resetStop, setMode, takeControl } from "./top-row.ts";

const MOST_AXES = 10;

interface Words {
  title: string;
  done: string;
  how: string;
  button: string;
  key: string;
}

export function checklistCard(app: App): Part {
  const { texts } = app;
  const title = h("h2", {});
  const list = h("ol", {});
  const element = h(
    "section",
    { class: "checklist", "aria-label": texts.eachStep },
    h(
      "header",
      {},
      h("div", {}, title, h("p", {}, texts.eachStep)),
      h("button", { type: "button", class: "quiet", onclick: () => app.choice.set({ isChecklistOpen: false }) }, texts.hide, keyCap("Esc")),
    ),
    list,
    h("footer", {}, h("span", {}, texts.comesBack, keyCap("?")),
      h("button", { type: "button", class: "quiet take-tour", onclick: () => app.choice.set({ task: "tour" }) }, texts.tour)),
  );
  const rows = new Map<LineName, LineRow>();
  return {
    element,
    update(cell) {
      // Whoever holds control of a stopped robot has the two steps in the dock.
      const isAskedBelow = pageState(cell) === "stopped" && isInControl(cell);
      const isOpen = app.choice.value.isChecklistOpen && cell.hello !== null && !isAskedBelow;
      show(element, isOpen);
      if (!isOpen) return;
      const lines = checklist(cell);
      const left = lines.filter((each) => each.done !== true).length;
      say(title, left <= 1 ? texts.allDone : texts.stepsUntil(left));
      const next = nextLine(lines);
      let number = 0;
      lines.forEach((line) => {
        const row = rows.get(line.name) ?? new LineRow(app, line.name);
        rows.set(line.name, row);
        if (line.done !== true) number += 1;
        row.update(cell, line, number, line === next);
      });
      for (const [name, row] of rows) {
        if (lines.some((each) => each.name === name)) continue;
        row.element.remove();
        rows.delete(name);
      }
      lines.forEach((line, index) => {
        const row = rows.get(line.name)?.element;
        if (row !== undefined && list.children[index] !== row) {
          list.insertBefore(row, list.children[index] ?? null);
        }
      });
    },
  };
}

class LineRow {
  readonly element: HTMLElement;
  #app: App;
  #name: LineName;
  #number = h("span", { class: "number" });
  #tick = icon("check");
  #title = h("strong", {});
  #how = h("span", { class: "how" });
  #key = keyCap("");
  #button: HTMLButtonElement;
  #lamps: HTMLElement[] = [];

  constructor(app: App, name: LineName) {
    this.#app = app;
    this.#name = name;
    this.#button = h("button", { type: "button" });
    if (name === "enabling") {
      bindHold(this.#button, {
        down: (source) => app.holding.enable(`list ${source}`),
        up: (source) => app.holding.disable(`list ${source}`, source !== "Enter"),
        explain: () => app.choice.set({ note: { text: app.texts.holdHow, kind: "remark" } }),
      });
    } else if (name === "key") {
      bindHold(this.#button, {
        down: (source) => pressKey(app, `list ${source}`, { axis: 0, direction: 1 }),
        up: (source) => app.holding.release(`list ${source}`),
        explain: () => app.choice.set({ note: { text: app.texts.holdHow, kind: "remark" } }),
      });
    } else if (name === "limits") {
      bindHold(this.#button, {
        down: (source) => !needsRecovery(app.cell.value) && leadOut(app, `list ${source}`),
        up: (source) => letWayGo(app, `list ${source}`),
        explain: () => !needsRecovery(app.cell.value) && app.choice.set({ note: { text: app.texts.holdHow, kind: "remark" } }),
      });
      this.#button.addEventListener("click", () => {
        if (needsRecovery(app.cell.value)) setMode(app, OperatingMode.RECOVERY);
      });
    } else this.#button.addEventListener("click", () => mend(app, name, this.#button));
    const lamps = name === "connected" ? this.#threeLamps() : null;
    this.element = h(
      "li",
      { "data-line": name },
      h("span", { class: "sign" }, this.#number, this.#tick),
      h("span", { class: "words" }, this.#title, this.#how, lamps),
      this.#key,
      this.#button,
    );
  }

  update(cell: Cell, line: Line, number: number, isNext: boolean): void {
    const words = wordsOf(this.#app, cell, line);
    const isDone = line.done === true;
    say(this.#number, isDone ? "" : String(number));
    this.#tick.style.display = isDone ? "" : "none";
    say(this.#title, isDone ? words.done : words.title);
    say(this.#how, words.how);
    say(this.#key, words.key);
    show(this.#key, words.key !== "" && !isDone);
    say(this.#button, words.button);
    // A hand that holds this button keeps it until it lets go.
    const isHeld = this.#name === "enabling" && this.#app.holding.enabling.isOn;
    show(this.#button, words.button !== "" && (!isDone || isHeld));
    mark(this.element, "done", isDone);
    mark(this.element, "next", isNext);
    mark(this.#button, "orange", isNext);
    if (this.#name === "key") off(this.#button, isNext ? "" : this.#app.texts.noJog);
    if (this.#name === "limits") {
      const mayJog = isInControl(cell) && isManual(cell) && this.#app.holding.enabling.isOn;
      off(this.#button, mayJog || needsRecovery(cell) ? "" : this.#app.texts.noJog);
    }
    if (this.#name === "enabling") off(this.#button, isInControl(cell) ? "" : this.#app.texts.noJog);
    attribute(this.element, "aria-current", isNext ? "step" : null);
    this.#updateLamps(cell);
  }

  #threeLamps(): HTMLElement {
    const { texts } = this.#app;
    this.#lamps = [texts.lampServer, texts.lampController, texts.lampDrives].map((each) =>
      h("span", { class: "lamp" }, h("i", {}), h("span", {}, each), h("b", {})),
    );
    return h("span", { class: "lamps", role: "group", "aria-label": texts.lamps }, ...this.#lamps);
  }

  #updateLamps(cell: Cell): void {
    const { texts } = this.#app;
    const values = [
      cell.stage === "up",
      cell.state?.link === LinkState.UP,
      cell.state?.drives_powered === TriState.UNKNOWN
        ? null
        : cell.state?.drives_powered === TriState.TRUE,
    ];
    this.#lamps.forEach((lamp, index) => {
      const value = values[index];
      attribute(lamp, "data-on", value === null || value === undefined ? "unknown" : String(value));
      const word = lamp.querySelector("b");
      if (word !== null) say(word, value === null ? texts.unknown : value === true ? texts.on : texts.offWord);
    });
  }
}

function mend(app: App, name: LineName, button: HTMLButtonElement): void {
  switch (name) {
    case "connected":
      return app.choice.set({ isConnectOpen: true });
    case "control":
      return takeControl(app);
    case "mode":
      return setMode(app, OperatingMode.MANUAL_REDUCED);
    case "prepare":
      return prepare(app, button);
    case "stop":
      if (!app.choice.value.isStopReleased) app.choice.set({ isStopReleased: true });
      else resetStop(app);
      return;
    default:
      return app.session.refreshWhy();
  }
}

function wordsOf(app: App, cell: Cell, line: Line): Words {
  const { texts } = app;
  const { language } = app.settings.value;
  const { code = 0, name = "", text = "" } = line.report ?? {};
  const said = line.report === null ? "" : `${name}: ${code === 0 ? text : causeAndRemedy(code, text, language).join(" ")}`;
  const isDone = line.done === true;
  switch (line.name) {
    case "connected":
      return {
        title: texts.lineConnected,
        done: texts.lineConnected,
        how: isDone || cell.stage !== "up" ? texts.lineConnectedTo(cell.server, cell.hello?.cell ?? "") : texts.lineNotConnected,
        button: texts.connect,
        key: "",
      };
    case "control": {
      const holder = cell.state?.holder === 0 ? "" : cell.holderName || texts.notKnown;
      return {
        title: texts.lineControl,
        done: texts.lineControlDone,
        how: isDone ? "" : holder === "" ? texts.lineControlFree : texts.lineControlHeld(holder),
        button: holder === "" ? texts.takeControl : texts.askForControl,
        key: "C",
      };
    }
    case "mode":
      return {
        title: texts.lineMode,
        done: `${texts.lineModeDone}: ${modeWord(texts, cell.state?.operating_mode)}`,
        how: isDone ? "" : isReal(cell) && said.startsWith("MODE_NOT_OURS") ? texts.lineModeReal : texts.lineModeIs(modeWord(texts, cell.state?.operating_mode)),
        button: texts.setT1,
        key: "M",
      };
    case "enabling":
      return { title: texts.lineEnabling, done: texts.lineEnablingDone, how: texts.lineEnablingHow, button: texts.hold, key: "V" };
    case "stop": {
      const isReleased = app.choice.value.isStopReleased;
      return {
        title: texts.lineStop,
        done: texts.lineStopDone,
        how: isDone ? texts.lineStopClear : texts.lineStopHow,
        button: isReleased ? texts.reset : texts.release,
        key: "",
      };
    }
    case "prepare":
      return { title: texts.linePrepare, done: texts.linePrepare, how: said, button: texts.prepare, key: "" };
    case "limits": {
      const way = waysOut(cell)[0];
      const how = cell.holds.map((each) => each.text).join(" ") || said;
      return { title: texts.lineLimits, done: texts.lineLimits, how, button: needsRecovery(cell) ? texts.setRecovery : (way?.press ?? ""), key: "" };
    }
    case "other":
      return { title: texts.lineOther, done: texts.lineOther, how: said, button: texts.again, key: "" };
    case "key": {
      const joint = jointRows(cell)[0]?.name ?? texts.joint;
      return { title: texts.lineKey, done: texts.lineKey, how: texts.lineKeyHow(joint), button: `${joint} +`, key: "1" };
    }
  }
}

/** Outside its limits a robot is led back in Recovery alone. */
function needsRecovery(cell: Cell): boolean {
  return isInControl(cell) && outside(cell).length > 0 && cell.state?.operating_mode !== OperatingMode.RECOVERY;
}

/** Hold the key that leads out; the jog panel shows the axes that it belongs to. */
function leadOut(app: App, source: string): void {
  const cell = app.cell.value;
  const way = waysOut(cell)[0];
  if (way === undefined) return;
  const known = way.frame === "base" || way.frame === "tool";
  const axes = way.space === JogSpace.JOINTS ? "joint" : known ? (way.frame as AxesFrame) : "user";
  app.choice.set({ axes, step: 0, ...(axes === "user" ? { userFrame: way.frame } : {}) });
  app.holding.setAim(aimOf(axes, way.frame, way.values.length));
  way.values.forEach((value, axis) => {
    if (value !== 0) app.holding.press(`${source} ${axis}`, { axis, direction: value > 0 ? 1 : -1 });
  });
}

function letWayGo(app: App, source: string): void {
  for (let axis = 0; axis < MOST_AXES; axis += 1) app.holding.release(`${source} ${axis}`);
}

/** A real controller does to the robot what its answer says: it is asked twice. */
function prepare(app: App, button: HTMLButtonElement): void {
  const token = Number(button.dataset["token"] ?? 0);
  delete button.dataset["token"];
  app.attempt(async () => {
    try {
      await app.session.askNow({ type: "prepare", action: PrepareAction.PREPARE, token });
    } catch (error) {
      const isAsked = error instanceof Refused && error.refusal.code === VerdictCode.CONFIRM_FIRST;
      if (isAsked) button.dataset["token"] = String(error.refusal.value);
      throw error;
    }
  });
}
