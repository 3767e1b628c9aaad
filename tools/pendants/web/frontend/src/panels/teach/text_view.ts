// The program as text: typed freely, checked and saved as a whole, with breakpoints by its margin.
import { placeOf } from "../../teach/edits.ts";
import { indexOf } from "../../teach/program.ts";
import { VerdictCode } from "../../protocol.ts";
import type { Part } from "../../ui/app.ts";
import { attribute, h, mark, off, say, show } from "../../ui/elements.ts";
import { Refused } from "../../wire/errors.ts";
import type { Desk } from "./desk.ts";

const HEIGHT = 20;
const SPARE = 4;
const WRONG: number[] = [VerdictCode.PROGRAM_SYNTAX, VerdictCode.PROGRAM_INVALID, VerdictCode.PROGRAM_WRONG_ROBOT];

export function textView(desk: Desk): Part {
  const { texts } = desk;
  const area = h("textarea", { spellcheck: "false", wrap: "off", autocomplete: "off", autocapitalize: "off", "aria-label": texts.textLabel });
  const margin = new Margin(desk);
  const told = h("p", { class: "text-told", role: "status" });
  const save = h("button", { type: "button" }, texts.save);
  const check = h("button", { type: "button" }, texts.check);
  const revert = h("button", { type: "button" }, texts.revert);
  let of = "";
  let name = "";
  let kept = "";
  let revision = 0;
  let wrongLine = 0;
  let current = -1;
  const isChanged = (): boolean => area.value !== kept;
  const take = (): void => {
    const { program } = desk;
    if (program === null) return;
    name = program.name;
    revision = program.revision;
    kept = program.text;
    area.value = kept;
    of = `${name} ${revision}`;
    wrongLine = 0;
    say(told, "");
  };
  const redraw = (): void => margin.fill(area, wrongLine, current, isChanged());
  const attempt = (act: () => Promise<string>): void =>
    desk.attempt(async () => {
      try {
        wrongLine = 0;
        say(told, await act());
      } catch (error) {
        if (!(error instanceof Refused) || !WRONG.includes(error.refusal.code)) throw error;
        const place = placeOf(error.refusal.text);
        wrongLine = place?.line ?? 0;
        say(told, place === null ? error.refusal.text : texts.textError(place.line, place.column, place.rest));
        if (place !== null) toPlace(area, place.line, place.column);
      }
      redraw();
    });
  save.addEventListener("click", () =>
    attempt(async () => {
      const text = area.value;
      const from = revision;
      await desk.teaching.save(text, from);
      // Overtaken by somebody else nothing was saved, and what was typed stays.
      if (desk.program !== null && desk.program.revision === from + 1) take();
      return "";
    }),
  );
  check.addEventListener("click", () =>
    attempt(async () => {
      const found = await desk.app.session.call<"programs.check">({ op: "programs.check", body: area.value });
      return texts.textGood(found.statements);
    }),
  );
  revert.addEventListener("click", () => {
    take();
    redraw();
  });
  area.addEventListener("input", () => {
    wrongLine = 0;
    say(told, "");
    desk.app.choice.set({});
  });
  area.addEventListener("scroll", redraw, { passive: true });
  new ResizeObserver(redraw).observe(area);
  return {
    element: h("div", { class: "text-view" }, h("div", { class: "text-room" }, margin.element, area), h("div", { class: "text-acts" }, save, check, revert, told)),
    update(cell) {
      const { program } = desk;
      if (program === null) return;
      const now = `${program.name} ${program.revision}`;
      if (now !== of && (!isChanged() || program.name !== name)) take();
      const isOld = isChanged() && now !== of;
      if (isOld && told.textContent === "") say(told, texts.textOld(program.revision));
      current = desk.current(cell);
      off(save, isChanged() ? "" : texts.unsaved);
      mark(save, "orange", isChanged() && !isOld);
      attribute(save, "aria-disabled", isChanged() ? null : "true");
      off(revert, isChanged() || isOld ? "" : texts.unsaved);
      show(told, told.textContent !== "");
      redraw();
    },
  };
}

/** Put the caret on a place, and show it. */
function toPlace(area: HTMLTextAreaElement, line: number, column: number): void {
  const before = area.value.split("\n").slice(0, line - 1);
  const at = before.reduce((sum, each) => sum + each.length + 1, 0) + column - 1;
  area.focus();
  area.setSelectionRange(at, at);
  area.scrollTop = Math.max(0, (line - 4) * HEIGHT);
}

/** Line numbers and breakpoints beside the text; only what is in sight is made. */
class Margin {
  readonly element = h("div", { class: "margin" });
  #desk: Desk;
  #made: { element: HTMLButtonElement; index: number }[] = [];

  constructor(desk: Desk) {
    this.#desk = desk;
  }

  fill(area: HTMLTextAreaElement, wrongLine: number, current: number, isChanged: boolean): void {
    const first = Math.max(0, Math.floor(area.scrollTop / HEIGHT) - SPARE);
    const count = Math.ceil((area.clientHeight || 400) / HEIGHT) + 2 * SPARE;
    while (this.#made.length < count) this.#add();
    const lines = countLines(area.value);
    this.#made.forEach((each, at) => this.#fill(each, first + at, { area, lines, wrongLine, current, isChanged, isIn: at < count }));
  }

  #fill(
    made: { element: HTMLButtonElement; index: number },
    number: number,
    at: { area: HTMLTextAreaElement; lines: number; wrongLine: number; current: number; isChanged: boolean; isIn: boolean },
  ): void {
    const { program, texts } = this.#desk;
    const { element } = made;
    show(element, at.isIn && number < at.lines);
    if (element.hidden !== false || program === null) return;
    const line = number + 1;
    // In a changed text a line is not yet that of a statement.
    made.index = at.isChanged ? -1 : indexOf(program, line);
    const has = made.index >= 0 && program.breakpoints.includes(made.index);
    element.style.top = `${8 + number * HEIGHT - at.area.scrollTop}px`;
    say(element, String(line));
    attribute(element, "aria-label", made.index < 0 ? texts.lineOf(line) : texts.breakpoint(line));
    attribute(element, "aria-pressed", made.index < 0 ? null : String(has));
    mark(element, "wrong", line === at.wrongLine);
    mark(element, "current", made.index >= 0 && made.index === at.current);
  }

  #add(): void {
    const element = h("button", { type: "button", class: "break", tabindex: -1 });
    const made = { element, index: -1 };
    element.addEventListener("click", () => {
      if (made.index >= 0) this.#desk.attempt(() => this.#desk.teaching.toggleBreakpoint(made.index));
    });
    this.#made.push(made);
    this.element.append(element);
  }
}

function countLines(text: string): number {
  let count = 1;
  for (let at = text.indexOf("\n"); at >= 0; at = text.indexOf("\n", at + 1)) count += 1;
  return text.endsWith("\n") ? count - 1 : count;
}
