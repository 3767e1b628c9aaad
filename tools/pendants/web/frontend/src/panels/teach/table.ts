// The table of a program: only the rows in sight are elements, so that thousands of lines are no more
// work than twenty.
import type { Cell } from "../../pendant/cell.ts";
import { drop, history, remove, shift } from "../../teach/edits.ts";
import type { Change } from "../../teach/edits.ts";
import type { Finding } from "../../teach/findings.ts";
import { lineOf, rowsOf } from "../../teach/program.ts";
import type { Program, Row } from "../../teach/program.ts";
import { attribute, h, mark, say, show } from "../../ui/elements.ts";
import type { Part } from "../../ui/app.ts";
import { icon } from "../../ui/icons.ts";
import type { Desk } from "./desk.ts";
import { findingWords } from "./finding.ts";

const HEIGHT = 32;
/** Rows that are made beyond what is in sight. */
const SPARE = 4;

interface Shown {
  element: HTMLElement;
  index: number;
  fill(row: Row | null): void;
}

export function programTable(desk: Desk): Part {
  const { texts } = desk;
  const names = ["", "#", texts.statement, texts.point, texts.speed, texts.zone, texts.dryRun];
  const head = h("div", { class: "program-head", "aria-hidden": "true" }, ...names.map((each) => h("span", {}, each)));
  const room = h("div", { class: "program-room", role: "rowgroup" });
  const empty = h("p", { class: "remark" }, texts.emptyProgram);
  const grid = h("div", { class: "program-grid", role: "grid", tabindex: 0 }, room);
  const hint = h("p", { class: "sr-only", id: "program-keys" }, texts.tableKeys);
  attribute(grid, "aria-describedby", "program-keys");
  const dropLine = h("div", { class: "drop-line" });
  room.append(dropLine);
  show(dropLine, false);
  const shown: Shown[] = [];
  let program: Program | null = null;
  let rows: Row[] = [];
  let current = -1;
  let followed = -1;
  let selected = -1;
  const change = (make: (program: Program) => Change | null): void =>
    desk.attempt(() => desk.teaching.change(make));
  const fill = (): void => {
    const first = Math.max(0, Math.floor(grid.scrollTop / HEIGHT) - SPARE);
    const count = Math.ceil((grid.clientHeight || 600) / HEIGHT) + 2 * SPARE;
    while (shown.length < count) shown.push(shownRow(shown.length));
    shown.forEach((each, at) => {
      const index = first + at;
      each.index = index;
      each.fill(at < count ? (rows[index] ?? null) : null);
    });
  };
  const shownRow = (number: number): Shown => {
    const made = rowElement(desk, number, {
      choose: (index) => desk.teaching.select(index),
      dragged: (index, event) => drag(index, event),
    });
    room.append(made.element);
    return made;
  };
  const reveal = (index: number): void => {
    const top = index * HEIGHT;
    if (top < grid.scrollTop) grid.scrollTop = top;
    else if (top + HEIGHT > grid.scrollTop + grid.clientHeight) grid.scrollTop = top + HEIGHT - grid.clientHeight;
  };
  const drag = (index: number, event: PointerEvent): void => {
    const end = new AbortController();
    let before = index;
    const moved = (at: PointerEvent): void => {
      const y = at.clientY - room.getBoundingClientRect().top;
      before = Math.max(0, Math.min(rows.length, Math.round(y / HEIGHT)));
      show(dropLine, true);
      dropLine.style.top = `${before * HEIGHT - 1}px`;
    };
    const ended = (isDone: boolean): void => {
      end.abort();
      const isMoved = dropLine.hidden === false;
      show(dropLine, false);
      if (isDone && isMoved) change((each) => drop(each, index, before));
    };
    event.preventDefault();
    const { signal } = end;
    window.addEventListener("pointermove", moved, { signal });
    window.addEventListener("pointerup", () => ended(true), { signal });
    for (const name of ["pointercancel", "blur"]) window.addEventListener(name, () => ended(false), { signal });
    window.addEventListener("keydown", (key) => key.key === "Escape" && ended(false), { signal });
  };
  grid.addEventListener("scroll", fill, { passive: true });
  new ResizeObserver(fill).observe(grid);
  grid.addEventListener("keydown", (event) => {
    if (event.target !== grid && !(event.target instanceof HTMLButtonElement)) return;
    if (tableKey(desk, event, change, Math.floor(grid.clientHeight / HEIGHT))) event.preventDefault();
  });
  return {
    element: h("div", { class: "program-table" }, head, hint, empty, grid),
    update(cell: Cell) {
      if (desk.program !== program) {
        program = desk.program;
        rows = program === null ? [] : rowsOf(program);
        room.style.height = `${rows.length * HEIGHT}px`;
        attribute(grid, "aria-label", texts.programTable(program?.name ?? ""));
        attribute(grid, "aria-rowcount", rows.length);
      }
      show(empty, rows.length === 0);
      current = desk.current(cell);
      if (current !== followed && current >= 0) {
        reveal(current);
        // The chosen line goes along until a person chooses another.
        if (followed < 0 || desk.teaching.selected === followed) desk.teaching.select(current);
      }
      followed = current;
      if (desk.teaching.selected !== selected) {
        selected = desk.teaching.selected;
        if (selected < rows.length) reveal(selected);
      }
      fill();
      for (const each of shown) {
        mark(each.element, "current", each.index === current);
        attribute(each.element, "aria-selected", String(each.index === selected));
      }
      const active = shown.find((each) => each.index === selected && each.element.hidden === false);
      attribute(grid, "aria-activedescendant", active?.element.id ?? null);
    },
  };
}

function tableKey(
  desk: Desk,
  event: KeyboardEvent,
  change: (make: (program: Program) => Change | null) => void,
  page: number,
): boolean {
  const { teaching } = desk;
  const at = teaching.selected;
  const isHistory = event.ctrlKey || event.metaKey;
  const op = historyOf(event);
  if (isHistory && op !== null) {
    change((program) => history(program, op, at));
    return true;
  }
  if (event.ctrlKey || event.metaKey) return false;
  const by = { ArrowUp: -1, ArrowDown: 1, PageUp: -page, PageDown: page, Home: -1e6, End: 1e6 }[event.key];
  if (event.altKey && (by === 1 || by === -1)) {
    change((program) => shift(program, at, by));
    return true;
  }
  if (by !== undefined) teaching.select(at + by);
  else if (event.key === "Delete") change((program) => remove(program, at));
  else if (event.key === "F9") desk.attempt(() => teaching.toggleBreakpoint(at));
  else return false;
  return true;
}

function historyOf(event: KeyboardEvent): "programs.undo" | "programs.redo" | null {
  const key = event.key.toLowerCase();
  if (key === "z") return event.shiftKey ? "programs.redo" : "programs.undo";
  return key === "y" ? "programs.redo" : null;
}

const SIGNS = { good: "check", remark: "warning", bad: "cross" } as const;

function rowElement(
  desk: Desk,
  number: number,
  acts: { choose(index: number): void; dragged(index: number, event: PointerEvent): void },
): Shown {
  const { texts } = desk;
  const stop = h("button", { type: "button", class: "break", tabindex: -1 });
  const line = h("span", { class: "line-number" });
  const arrow = h("span", { class: "arrow" });
  const words = h("span", {});
  const strong = h("strong", {});
  const said = h("em", {});
  const point = h("span", { role: "gridcell", class: "point" });
  const speed = h("span", { role: "gridcell", class: "figure" });
  const zone = h("span", { role: "gridcell", class: "figure zone" });
  const signs = Object.entries(SIGNS).map(([name, sign]) => [name, icon(sign)] as const);
  const verdict = h("span", {});
  const finding = h("span", { role: "gridcell", class: "finding" }, ...signs.map(([, each]) => each), verdict);
  const element = h(
    "div",
    { class: "program-row", role: "row", id: `program-row-${number}` },
    h("span", { role: "gridcell" }, stop),
    h("span", { role: "gridcell" }, line, arrow),
    h("span", { role: "gridcell", class: "words" }, words, strong, said),
    point,
    speed,
    zone,
    finding,
  );
  const made: Shown = {
    element,
    index: number,
    fill(row) {
      const { program } = desk;
      show(element, row !== null && program !== null);
      if (row === null || program === null) return;
      element.style.top = `${row.index * HEIGHT}px`;
      attribute(element, "aria-rowindex", row.index + 1);
      const told = lineOf(program, row.index);
      const has = program.breakpoints.includes(row.index);
      attribute(stop, "aria-label", texts.breakpoint(told));
      attribute(stop, "aria-pressed", String(has));
      say(line, String(told));
      attribute(line, "title", texts.drag(told));
      words.parentElement?.style.setProperty("--depth", String(row.depth));
      mark(element, "wide", row.point === "");
      say(words, row.words);
      say(strong, row.strong);
      say(said, row.comment !== "" && row.strong + row.words !== `# ${row.comment}` ? `# ${row.comment}` : "");
      say(point, row.point);
      say(speed, row.speed);
      say(zone, row.zone);
      fillFinding(desk, row.index, element, verdict, signs);
    },
  };
  stop.addEventListener("click", (event) => {
    event.stopPropagation();
    desk.attempt(() => desk.teaching.toggleBreakpoint(made.index));
  });
  line.addEventListener("pointerdown", (event) => {
    acts.choose(made.index);
    if (event.button === 0) acts.dragged(made.index, event);
  });
  element.addEventListener("click", () => acts.choose(made.index));
  return made;
}

function fillFinding(
  desk: Desk,
  index: number,
  element: HTMLElement,
  verdict: HTMLElement,
  signs: readonly (readonly [string, SVGElement])[],
): void {
  const found: Finding | null = desk.findingAt(index);
  attribute(element, "data-mark", found?.mark ?? "none");
  const words = found === null ? "" : findingWords(desk, index, found);
  say(verdict, words);
  attribute(verdict, "title", words === "" ? null : words);
  for (const [name, each] of signs) each.style.display = name === found?.mark ? "" : "none";
}
