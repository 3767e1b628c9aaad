// The keys of a run, and how far it is.
import { isInControl } from "../../pendant/cell.ts";
import type { Cell } from "../../pendant/cell.ts";
import { isManual } from "../../pendant/checklist.ts";
import { pageState } from "../../pendant/states.ts";
import { lineOf } from "../../teach/program.ts";
import { controlRequest, runRequest, stepRequest } from "../../teach/transport.ts";
import type { Off, Run, RunKey, Transport } from "../../teach/transport.ts";
import { fixed } from "../../texts/texts.ts";
import type { Part } from "../../ui/app.ts";
import { attribute, h, isOff, mark, off, say, show } from "../../ui/elements.ts";
import { icon } from "../../ui/icons.ts";
import type { IconName } from "../../ui/icons.ts";
import type { Desk } from "./desk.ts";
import { once } from "./first_times.ts";

export function runKeys(desk: Desk): Part {
  const { texts } = desk;
  const key = (name: IconName, act: () => void, look = "") => {
    const word = h("span", {});
    const button = h("button", { type: "button", class: `run-key ${look}` }, icon(name), word);
    button.addEventListener("click", () => (isOff(button) ? explain(desk) : act()));
    return { button, word };
  };
  const keys = {
    back: key("back", () => step(desk, -1)),
    run: key("play", () => run(desk), "go"),
    step: key("step", () => step(desk, 1)),
    pause: key("pause", () => desk.attempt(() => desk.app.session.askNow(controlRequest("pause")))),
    end: key("stop", () => desk.attempt(() => desk.app.session.askNow(controlRequest("end")))),
  };
  const words: Record<RunKey, string> = { back: texts.back, run: texts.runAll, step: texts.step, pause: texts.pause, end: texts.end };
  const where = h("strong", {});
  const pass = h("span", {});
  const took = h("span", { class: "figure" });
  const bar = h("progress", { max: 1, value: 0, "aria-label": texts.progress });
  const begin = beginChoice(desk);
  const progress = h("div", { class: "run-progress" }, h("div", { class: "told" }, where, pass, took), bar);
  return {
    element: h("div", { class: "transport", role: "group", "aria-label": texts.runAll }, ...Object.values(keys).map((each) => each.button), begin.element, progress),
    update(cell) {
      const told = desk.transport(cell);
      for (const name of Object.keys(keys) as RunKey[]) {
        off(keys[name].button, whyOff(desk, told.off[name]));
        say(keys[name].word, name === "run" && told.isPaused ? texts.resume : words[name]);
      }
      say(where, whereText(desk, cell, told));
      const { report } = desk;
      say(pass, told.isUnderWay && report !== null && report.loop > 0 ? texts.pass(report.loop) : "");
      const duration = desk.teaching.findings?.duration;
      say(took, duration === undefined ? "" : `${fixed(duration, 1)} s`);
      const current = desk.current(cell);
      const count = desk.program?.statements.length ?? 0;
      bar.value = current < 0 || count === 0 ? 0 : current / count;
      show(begin.element, !told.isUnderWay);
      begin.update(cell);
    },
  };
}

function explain(desk: Desk): void {
  desk.app.session.refreshWhy();
  const { off } = desk.transport(desk.app.cell.value);
  if (off.run !== "conditions") return;
  const { value } = desk.app.cell;
  // Who could jog lacks the enabling device only; the list of steps speaks of jogging.
  const isManualRun = isInControl(value) && isManual(value) && pageState(value) === "control";
  desk.app.choice.set(isManualRun ? { note: { text: desk.texts.runInManual, kind: "remark" } } : { isChecklistOpen: true });
}

function whyOff(desk: Desk, why: Off): string {
  const { texts } = desk;
  return {
    "": "",
    conditions: texts.whyConditions,
    noProgram: texts.whyNoProgram,
    otherRuns: texts.whyOtherRuns,
    underWay: texts.whyUnderWay,
    notUnderWay: texts.whyNotUnderWay,
    standing: texts.whyStanding,
  }[why];
}

function whereText(desk: Desk, cell: Cell, told: Transport): string {
  const { texts } = desk;
  if (!told.isUnderWay) return texts.ready;
  if (!desk.isOpenOne(cell)) return texts.otherProgram(desk.underWay(cell));
  const line = cell.state?.program_line ?? 0;
  return told.isPaused ? texts.beforeLine(line) : texts.inLine(line);
}

/** Return what the open program would be run with; null where none is open. */
function wanted(desk: Desk): Run | null {
  const { program, teaching } = desk;
  if (program === null) return null;
  const isFrom = desk.isFromLine && teaching.selected < program.statements.length;
  return {
    program: program.name,
    revision: program.revision,
    line: isFrom ? lineOf(program, teaching.selected) : 0,
    times: desk.times,
  };
}

function run(desk: Desk): void {
  const { app } = desk;
  if (desk.transport(app.cell.value).isPaused) {
    desk.attempt(() => app.session.askNow(controlRequest("resume")));
    return;
  }
  const asked = wanted(desk);
  if (asked === null) return;
  desk.attempt(async () => {
    const { ended } = await app.session.move(runRequest(asked));
    app.choice.set({ isChecklistOpen: false });
    once(desk, "run", desk.texts.firstRun);
    await ended;
  });
}

function step(desk: Desk, way: 1 | -1): void {
  const asked = wanted(desk);
  if (asked === null) return;
  const { isPaused } = desk.transport(desk.app.cell.value);
  desk.attempt(async () => {
    const { ended } = await desk.app.session.move(stepRequest(asked, way, isPaused));
    desk.app.choice.set({ isChecklistOpen: false });
    await ended;
  });
}

/** Where a run begins, and how often it goes. */
function beginChoice(desk: Desk): Part {
  const { texts } = desk;
  const from = h("button", { type: "button", class: "begin" });
  from.addEventListener("click", () => {
    desk.isFromLine = !desk.isFromLine;
    desk.app.choice.set({});
  });
  const times = h("input", { type: "number", min: 0, max: 1000000, value: desk.times, title: texts.timesHint, "aria-label": texts.timesHint });
  times.addEventListener("input", () => {
    const value = Math.round(Number(times.value));
    if (Number.isFinite(value) && value >= 0) desk.times = value;
  });
  return {
    element: h("div", { class: "begin-choice" }, from, h("label", {}, times, h("span", {}, "×"))),
    update() {
      const { program, teaching } = desk;
      const isFrom = desk.isFromLine && program !== null && teaching.selected < program.statements.length;
      say(from, isFrom ? texts.fromLine(lineOf(program, teaching.selected)) : texts.fromBegin);
      mark(from, "on", isFrom);
      attribute(from, "aria-pressed", String(isFrom));
    },
  };
}
