// Teach and playback: the program as table, text and points, the keys of a run, recordings.
import type { Cell } from "../pendant/cell.ts";
import { isInControl } from "../pendant/cell.ts";
import { history, recordHere, remove, shift } from "../teach/edits.ts";
import type { Change } from "../teach/edits.ts";
import { isOf } from "../teach/findings.ts";
import { nameProblem } from "../teach/program.ts";
import type { Program } from "../teach/program.ts";
import { fixed } from "../texts/texts.ts";
import { onePerPage } from "../ui/app.ts";
import type { App, Part, TaskPart } from "../ui/app.ts";
import { attribute, h, mark, off, say, show } from "../ui/elements.ts";
import { icon } from "../ui/icons.ts";
import "../teach.css";
import { Desk } from "./teach/desk.ts";
import type { Tab } from "./teach/desk.ts";
import { sentence } from "./teach/finding.ts";
import { once } from "./teach/first_times.ts";
import { lineCard } from "./teach/line_card.ts";
import { pointList, programList, recordingList } from "./teach/lists.ts";
import { renameForm } from "./teach/rename_form.ts";
import { inView } from "./teach/in_view.ts";
import { programTable } from "./teach/table.ts";
import { textView } from "./teach/text_view.ts";
import { runKeys } from "./teach/transport.ts";

/** The open program and what was chosen outlive a panel that is made anew in another language. */
const deskOf = onePerPage((app) => new Desk(app));

export function teachTask(app: App): TaskPart {
  const desk = deskOf(app);
  const head = heading(desk);
  const views: Record<Tab, Part> = {
    programs: programList(desk),
    table: programTable(desk),
    text: textView(desk),
    points: pointList(desk),
    recordings: recordingList(desk),
  };
  const bar = editBar(desk);
  const legend = legendLine(desk);
  const keys = runKeys(desk);
  const card = lineCard(desk);
  const parts = Object.values(views).map((each) => each.element);
  const element = h("section", { class: "teach", "aria-label": app.texts.teach }, head.element, bar.element, ...parts, legend.element, keys.element);
  let isShown = false;
  return {
    element,
    dock: card.element,
    shown(isNow) {
      isShown = isNow;
      desk.isInView = false;
      if (!isNow) app.overlay(null);
    },
    update(cell: Cell) {
      desk.follow(cell);
      desk.followWalk();
      if (desk.program === null && desk.tab !== "recordings") desk.tab = "programs";
      for (const [name, part] of Object.entries(views)) {
        show(part.element, name === desk.tab);
        if (name === desk.tab) part.update(cell);
      }
      for (const each of [head, bar, legend, keys, card]) each.update(cell);
      show(bar.element, desk.tab === "table");
      show(legend.element, desk.tab === "table");
      mark(card.element, "away", desk.program === null || desk.tab === "programs" || desk.tab === "recordings");
      if (isShown) inView(desk);
    },
  };
}

function change(desk: Desk, make: (program: Program) => Change | null): void {
  desk.attempt(() => desk.teaching.change(make));
}

/** Name and revision, the views, undo, redo, dry run. */
function heading(desk: Desk): Part {
  const { texts } = desk;
  const name = h("strong", { class: "program-name" });
  const revision = h("span", { class: "muted" });
  const programs = h("button", { type: "button", class: "programs-button", title: texts.programs, onclick: () => desk.show("programs") }, icon("teach"), name);
  const rename = renameForm(desk, {
    name: () => desk.program?.name ?? "",
    problem: (to) => nameProblem(to, (desk.teaching.programs ?? []).map((each) => each.name)),
    rename: (_from, to) => desk.teaching.rename(to),
  });
  const words: [Tab, string][] = [["table", texts.table], ["text", texts.text], ["points", texts.points], ["recordings", texts.recordings]];
  const tabs = words.map(([tab, word]) => [tab, h("button", { type: "button", onclick: () => desk.show(tab) }, word)] as const);
  const step = (op: "programs.undo" | "programs.redo") => (): void =>
    change(desk, (program) => history(program, op, desk.teaching.selected));
  const undo = h("button", { type: "button", onclick: step("programs.undo"), "aria-label": texts.undo, title: texts.undo }, icon("undo"), h("span", { class: "word" }, texts.undo));
  const redo = h("button", { type: "button", onclick: step("programs.redo"), "aria-label": texts.redo, title: texts.redo }, icon("redo"));
  const dry = h("button", { type: "button", class: "dry-run", onclick: () => desk.attempt(() => desk.teaching.dryRun()) });
  const title = h("div", { class: "program-title" }, programs, revision, rename.element);
  const acts = h("div", { class: "program-acts" }, undo, redo, dry);
  return {
    element: h("header", { class: "teach-head" }, title, h("div", { class: "tabs", role: "group", "aria-label": texts.views }, ...tabs.map(([, each]) => each)), acts),
    update(cell) {
      const { program, teaching } = desk;
      say(name, program?.name ?? texts.programs);
      attribute(programs, "aria-label", program === null ? null : `${texts.programs}: ${program.name}`);
      say(revision, program === null ? "" : texts.revision(program.revision));
      show(rename.element, program !== null && desk.tab === "programs");
      rename.update(cell);
      mark(programs, "on", desk.tab === "programs");
      attribute(programs, "aria-current", desk.tab === "programs" ? "page" : null);
      for (const [tab, each] of tabs) {
        mark(each, "chosen", tab === desk.tab);
        attribute(each, "aria-pressed", String(tab === desk.tab));
        off(each, program === null && tab !== "recordings" ? texts.programsHint : "");
      }
      show(acts, program !== null);
      say(dry, teaching.isWalking ? texts.dryRunning(desk.walked) : texts.dryRun);
      off(dry, teaching.isWalking ? texts.dryRunning(desk.walked) : "");
    },
  };
}

/** Save a point, insert one, move and delete lines. */
function editBar(desk: Desk): Part {
  const { texts, teaching } = desk;
  const ways = (["PTP", "LIN"] as const).map((way) => {
    const act = (): void => {
      desk.way = way;
      desk.app.choice.set({});
    };
    return [way, h("button", { type: "button", onclick: act }, way)] as const;
  });
  const record = (isBefore: boolean) => (): void =>
    desk.attempt(async () => {
      await teaching.change((program) => recordHere(program, desk.way, isBefore ? teaching.selected : after(desk, program)));
      once(desk, "point", texts.firstPoint);
    });
  const save = h("button", { type: "button", class: "save-point", onclick: record(false) }, icon("plus"), texts.savePoint);
  const insert = h("button", { type: "button", onclick: record(true) }, texts.insertPoint);
  const act = (sign: "up" | "down" | "cross", word: string, make: (program: Program) => Change | null) =>
    h("button", { type: "button", class: "small", "aria-label": word, title: word, onclick: () => change(desk, make) }, icon(sign));
  const up = act("up", texts.moveUp, (program) => shift(program, teaching.selected, -1));
  const down = act("down", texts.moveDown, (program) => shift(program, teaching.selected, 1));
  const gone = act("cross", texts.deleteLine, (program) => remove(program, teaching.selected));
  const way = h("div", { class: "tabs ways", role: "group", "aria-label": texts.way }, ...ways.map(([, each]) => each));
  return {
    element: h("div", { class: "edit-bar" }, save, way, insert, up, down, gone),
    update(cell) {
      const finding = desk.findingAt(teaching.selected);
      const isChosen = desk.program !== null && teaching.selected < desk.program.statements.length;
      const isAsked = desk.app.choice.value.isChecklistOpen;
      mark(save, "orange", isInControl(cell) && !isAsked && finding?.mark !== "bad" && !desk.transport(cell).isUnderWay);
      for (const [name, each] of ways) {
        mark(each, "on", name === desk.way);
        attribute(each, "aria-pressed", String(name === desk.way));
      }
      for (const each of [insert, up, down, gone]) off(each, isChosen ? "" : texts.endOfProgram);
    },
  };
}

/** Behind the chosen line, or at the end. */
function after(desk: Desk, program: Program): number | null {
  const next = desk.teaching.selected + 1;
  return next >= program.statements.length ? null : next;
}

/** What the colours mean, and what the dry run found. */
function legendLine(desk: Desk): Part {
  const { texts } = desk;
  const entries = ([["good", texts.legendGood], ["remark", texts.legendRemark], ["bad", texts.legendBad], ["unchecked", texts.legendUnchecked]] as const).map(
    ([name, word]) => h("span", { class: "legend-entry" }, h("i", { "data-mark": name }), word),
  );
  const found = h("span", { class: "found", role: "status" });
  const stops = h("span", { class: "legend-entry" }, h("i", { class: "stop-mark" }), texts.pausesBefore);
  const elsewhere = h("ul", { class: "elsewhere" });
  return {
    element: h("div", { class: "legend" }, ...entries, stops, found, elsewhere),
    update() {
      const { program, teaching } = desk;
      const findings = program !== null && isOf(teaching.findings, program) ? teaching.findings : null;
      say(found, findings === null ? "" : foundText(desk));
      const lines = (findings?.elsewhere ?? []).map((each) => texts.elsewhere(each.program, each.line, sentence(desk, each)));
      if (elsewhere.dataset["told"] === lines.join("\n")) return;
      elsewhere.dataset["told"] = lines.join("\n");
      elsewhere.replaceChildren(...lines.map((each) => h("li", {}, each)));
      show(elsewhere, lines.length > 0);
    },
  };
}

function foundText(desk: Desk): string {
  const { texts } = desk;
  const { findings } = desk.teaching;
  if (findings === null) return "";
  const seconds = fixed(findings.duration, 1);
  const told = findings.refused > 0 ? texts.dryRunBad(findings.refused, seconds) : texts.dryRunGood(seconds);
  return [told, findings.isEndless ? texts.dryRunEndless : "", findings.isComplete ? "" : texts.dryRunPart].filter((each) => each !== "").join(" ");
}
