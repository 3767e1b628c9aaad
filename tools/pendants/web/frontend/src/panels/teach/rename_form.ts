// A button that opens a box for another name.
import type { Part } from "../../ui/app.ts";
import { h, say, show } from "../../ui/elements.ts";
import type { TeachTexts } from "../../texts/teach.ts";
import type { Desk } from "./desk.ts";

type Problem = "" | "empty" | "long" | "signs" | "taken";

export interface Renaming {
  name(): string;
  problem(name: string): Problem;
  rename(from: string, to: string): Promise<void>;
}

export function problemWords(texts: TeachTexts, problem: Problem): string {
  return { "": "", empty: texts.nameEmpty, long: texts.nameLong, signs: texts.nameSigns, taken: texts.nameTaken }[problem];
}

export function renameForm(desk: Desk, renaming: Renaming): Part {
  const { texts } = desk;
  const open = h("button", { type: "button" }, texts.rename);
  const input = h("input", { type: "text", "aria-label": texts.renameTo });
  const problem = h("span", { class: "problem", role: "alert" });
  const form = h("form", { class: "rename" }, input, h("button", { type: "submit" }, texts.apply), problem);
  let from = "";
  show(form, false);
  open.addEventListener("click", () => {
    from = renaming.name();
    input.value = from;
    say(problem, "");
    show(form, true);
    show(open, false);
    input.select();
    input.focus();
  });
  const close = (): void => {
    show(form, false);
    show(open, true);
  };
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const to = input.value.trim();
    if (to === from) return close();
    const wrong = renaming.problem(to);
    say(problem, problemWords(texts, wrong));
    if (wrong !== "") return;
    close();
    desk.attempt(() => renaming.rename(from, to));
  });
  form.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    event.stopPropagation();
    close();
    open.focus();
  });
  return {
    element: h("div", { class: "renaming" }, open, form),
    update() {
      if (renaming.name() !== from && form.hidden === false) close();
    },
  };
}
