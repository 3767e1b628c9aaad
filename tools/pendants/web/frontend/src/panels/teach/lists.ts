// The lists of teaching: programs, points of the open one, recordings.
import type { ProgramHeading, RecordingHeading, TeachPoint } from "../../operations.ts";
import { deletePoint, renamePoint, touchUp } from "../../teach/edits.ts";
import { nameProblem, usesOf } from "../../teach/program.ts";
import { fixed } from "../../texts/texts.ts";
import type { Part } from "../../ui/app.ts";
import { h, mark, off, say, show } from "../../ui/elements.ts";
import { whyNoMotion } from "../jog.ts";
import type { Desk } from "./desk.ts";
import { problemWords, renameForm } from "./rename_form.ts";

export function programList(desk: Desk): Part {
  const { texts } = desk;
  const hint = h("p", { class: "muted" });
  const list = h("ul", { class: "entries" });
  const input = h("input", { type: "text", "aria-label": texts.newName, placeholder: texts.newName });
  const make = h("button", { type: "submit" }, texts.create);
  const problem = h("span", { class: "problem", role: "alert" });
  const form = h("form", { class: "new-program" }, input, make, problem);
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const name = input.value.trim();
    const wrong = nameProblem(name, (desk.teaching.programs ?? []).map((each) => each.name));
    say(problem, problemWords(texts, wrong));
    if (wrong !== "") return;
    desk.attempt(async () => {
      await desk.teaching.create(name);
      input.value = "";
      desk.show("table");
    });
  });
  let shown: readonly ProgramHeading[] | null = null;
  return {
    element: h("div", { class: "list programs" }, form, hint, list),
    update() {
      const { programs } = desk.teaching;
      const isEmpty = programs !== null && programs.length === 0;
      say(hint, isEmpty ? texts.noPrograms : texts.programsHint);
      mark(make, "orange", isEmpty && !desk.app.choice.value.isChecklistOpen);
      if (programs === shown) return;
      shown = programs;
      list.replaceChildren(...(programs ?? []).map((each) => programEntry(desk, each)));
    },
  };
}

function programEntry(desk: Desk, heading: ProgramHeading): HTMLElement {
  const { texts, app } = desk;
  const when = new Date(heading.saved_at).toLocaleString(app.settings.value.language);
  const open = (): void =>
    desk.attempt(async () => {
      await desk.teaching.open(heading.name);
      desk.show("table");
    });
  return h(
    "li",
    {},
    h("button", { type: "button", class: "entry", onclick: open }, h("strong", {}, heading.name), h("span", { class: "muted" }, `${texts.revision(heading.revision)} · ${texts.savedBy(heading.saved_by, when)}`)),
    asked(texts.delete, texts.deleteAsks(heading.name), texts.keep, () => desk.attempt(() => desk.teaching.delete(heading))),
  );
}

/** A button that asks once more before it does something that is not taken back. */
function asked(word: string, question: string, no: string, act: () => void): HTMLElement {
  const first = h("button", { type: "button", class: "danger" }, word);
  const yes = h("button", { type: "button", class: "danger" }, word);
  const back = h("button", { type: "button" }, no);
  const ask = h("span", { class: "asked", role: "group", "aria-label": question }, h("span", {}, question), yes, back);
  const turn = (isAsked: boolean): void => {
    show(ask, isAsked);
    show(first, !isAsked);
    (isAsked ? back : first).focus();
  };
  show(ask, false);
  first.addEventListener("click", () => turn(true));
  back.addEventListener("click", () => turn(false));
  yes.addEventListener("click", act);
  return h("span", { class: "asking" }, first, ask);
}

export function pointList(desk: Desk): Part {
  const { texts } = desk;
  const hint = h("p", { class: "muted" }, texts.noPoints);
  const list = h("ul", { class: "entries" });
  let shown: readonly TeachPoint[] | null = null;
  let forms: Part[] = [];
  return {
    element: h("div", { class: "list points" }, hint, list),
    update(cell) {
      const points = desk.program?.points ?? [];
      show(hint, points.length === 0);
      if (points !== shown) {
        shown = points;
        const entries = points.map((each) => pointEntry(desk, each));
        forms = entries.map((each) => each.form);
        list.replaceChildren(...entries.map((each) => each.element));
      }
      for (const each of forms) each.update(cell);
    },
  };
}

function pointEntry(desk: Desk, point: TeachPoint): { element: HTMLElement; form: Part } {
  const { texts } = desk;
  const { name } = point;
  const chosen = (): number => desk.teaching.selected;
  const uses = desk.program === null ? 0 : usesOf(desk.program, name);
  const form = renameForm(desk, {
    name: () => name,
    problem: (to) => nameProblem(to, (desk.program?.points ?? []).map((each) => each.name)),
    rename: (from, to) => desk.teaching.change((program) => renamePoint(program, from, to, chosen())),
  });
  const touch = h("button", { type: "button" }, texts.touchUp);
  touch.addEventListener("click", () => desk.attempt(() => desk.teaching.change((program) => touchUp(program, name, chosen()))));
  const remove = h("button", { type: "button", class: "danger" }, texts.delete);
  off(remove, uses > 0 ? texts.pointInUse : "");
  remove.addEventListener("click", () => {
    if (uses === 0) desk.attempt(() => desk.teaching.change((program) => deletePoint(program, name, chosen())));
  });
  const select = (): void => {
    const index = desk.program?.statements.findIndex((each) => each.statement === "move" && each.point === name) ?? -1;
    if (index >= 0) desk.teaching.select(index);
  };
  const told = uses === 0 ? texts.unusedPoint : texts.usedTimes(uses);
  return {
    form,
    element: h(
      "li",
      {},
      h("button", { type: "button", class: "entry", onclick: select }, h("strong", {}, name), h("span", { class: "muted" }, told)),
      form.element,
      touch,
      remove,
    ),
  };
}

export function recordingList(desk: Desk): Part {
  const { texts } = desk;
  const input = h("input", { type: "text", "aria-label": texts.recordName, placeholder: texts.recordName });
  const begin = h("button", { type: "submit" }, texts.record);
  const problem = h("span", { class: "problem", role: "alert" });
  const form = h("form", { class: "new-program" }, input, begin, problem);
  const now = h("strong", {});
  const end = h("button", { type: "button", onclick: () => desk.attempt(() => desk.recordings.stop()) }, texts.stopRecording);
  const underWay = h("div", { class: "under-way" }, now, end);
  const hint = h("p", { class: "muted" }, texts.noRecordings);
  const list = h("ul", { class: "entries" });
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const name = input.value.trim();
    const wrong = nameProblem(name, (desk.recordings.all ?? []).map((each) => each.name));
    say(problem, problemWords(texts, wrong));
    if (wrong !== "") return;
    desk.attempt(async () => {
      await desk.recordings.start(name);
      input.value = "";
    });
  });
  let shown: readonly RecordingHeading[] | null = null;
  let plays: HTMLButtonElement[] = [];
  const since = new Since();
  return {
    element: h("div", { class: "list recordings" }, form, underWay, hint, list),
    update(cell) {
      const { all, underWay: going } = desk.recordings;
      show(form, going === null);
      show(underWay, going !== null);
      if (going !== null) say(now, texts.recordingNow(going.name, fixed(since.seconds(going.name, desk.app.now()), 0)));
      show(hint, all !== null && all.length === 0 && going === null);
      if (all !== shown) {
        shown = all;
        const entries = (all ?? []).map((each) => recordingEntry(desk, each));
        plays = entries.map((each) => each.play);
        list.replaceChildren(...entries.map((each) => each.element));
      }
      const why = whyNoMotion(desk.app, cell);
      const told = desk.transport(cell).isUnderWay ? texts.whyUnderWay : why;
      for (const each of plays) off(each, told);
    },
  };
}

/** How long something that was seen to begin is under way. */
class Since {
  #name = "";
  #at = 0;

  seconds(name: string, now: number): number {
    if (name !== this.#name) {
      this.#name = name;
      this.#at = now;
    }
    return (now - this.#at) / 1000;
  }
}

function recordingEntry(desk: Desk, heading: RecordingHeading): { element: HTMLElement; play: HTMLButtonElement } {
  const { texts, app } = desk;
  const play = h("button", { type: "button" }, texts.play);
  play.addEventListener("click", () => {
    if (play.getAttribute("aria-disabled") === "true") return app.choice.set({ isChecklistOpen: true });
    const began = (seconds: number): void =>
      app.choice.set({ isChecklistOpen: false, note: { text: texts.playing(fixed(seconds, 1)), kind: "remark" } });
    desk.attempt(() => desk.recordings.play(heading.name, began));
  });
  const facts = texts.recordingFacts(fixed(heading.duration ?? 0, 1), heading.samples ?? 0);
  const cut = heading.finished === false ? ` · ${texts.recordingCut}` : "";
  const problem = heading.problem === "" ? "" : ` · ${heading.problem}`;
  return {
    play,
    element: h(
      "li",
      {},
      h("span", { class: "entry" }, h("strong", {}, heading.name), h("span", { class: "muted" }, facts + cut + problem)),
      play,
      asked(texts.delete, texts.recordingDelete(heading.name), texts.keep, () => desk.attempt(() => desk.recordings.delete(heading))),
    ),
  };
}
