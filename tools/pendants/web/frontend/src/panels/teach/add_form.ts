// Adds a statement that is no move to a new point: before the chosen line, or at the end.
import { insert } from "../../teach/edits.ts";
import { freshStatement, KINDS } from "../../teach/fresh.ts";
import type { Field, Kind } from "../../teach/fresh.ts";
import type { TeachTexts } from "../../texts/teach.ts";
import type { Part } from "../../ui/app.ts";
import { h, say, show } from "../../ui/elements.ts";
import type { Desk } from "./desk.ts";

export function addForm(desk: Desk): Part {
  const { texts } = desk;
  const kind = h("select", { "aria-label": texts.addStatement }, ...KINDS.map((each) => h("option", { value: each.kind }, kindWord(texts, each.kind))));
  const fields = h("span", { class: "add-fields" });
  const problem = h("span", { class: "problem", role: "alert" });
  const form = h("form", { class: "add-form" }, kind, fields, h("button", { type: "submit" }, texts.add), problem);
  const details = h("details", { class: "add" }, h("summary", {}, texts.addStatement), form);
  let inputs = new Map<Field, HTMLInputElement | HTMLSelectElement>();
  const chosen = (): Kind => kind.value as Kind;
  const make = (): void => {
    const names = KINDS.find((each) => each.kind === chosen())?.fields ?? [];
    inputs = new Map(names.map((each) => [each, fieldElement(desk, each)]));
    fields.replaceChildren(...inputs.values());
    say(problem, "");
  };
  kind.addEventListener("change", make);
  details.addEventListener("toggle", () => details.open && make());
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const typed = Object.fromEntries([...inputs].map(([name, each]) => [name, each.value]));
    const statements = freshStatement(chosen(), typed);
    say(problem, statements === null ? texts.badNumber : "");
    if (statements === null) return;
    desk.attempt(() =>
      desk.teaching.change((program) => {
        const at = desk.teaching.selected;
        return insert(program, statements, at >= program.statements.length ? null : at);
      }),
    );
  });
  return {
    element: details,
    update() {
      show(details, desk.program !== null);
    },
  };
}

function fieldElement(desk: Desk, field: Field): HTMLInputElement | HTMLSelectElement {
  const { texts, program } = desk;
  const choices = {
    point: (program?.points ?? []).map((each) => each.name),
    program: (desk.teaching.programs ?? []).map((each) => each.name).filter((each) => each !== program?.name),
    value: ["on", "off"],
  };
  const word = fieldWord(texts, field);
  if (field === "point" || field === "program" || field === "value") {
    return h("select", { "aria-label": word }, ...choices[field].map((each) => h("option", { value: each }, each === "on" ? texts.on : each === "off" ? texts.off : each)));
  }
  return h("input", { type: "text", "aria-label": word, placeholder: word, size: field === "comment" || field === "object" ? 16 : 8 });
}

function fieldWord(texts: TeachTexts, field: Field): string {
  return {
    point: texts.point,
    program: texts.program,
    value: texts.value,
    seconds: texts.seconds,
    signal: texts.signal,
    passes: texts.passes,
    object: texts.object,
    comment: texts.comment,
  }[field];
}

function kindWord(texts: TeachTexts, kind: Kind): string {
  return {
    move: texts.kindMove,
    wait: texts.kindWait,
    "wait-input": texts.kindWaitInput,
    "set-output": texts.kindSetOutput,
    loop: texts.kindLoop,
    attach: texts.kindAttach,
    detach: texts.kindDetach,
    call: texts.kindCall,
    comment: texts.kindComment,
  }[kind];
}
