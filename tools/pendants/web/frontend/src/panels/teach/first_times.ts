// What happens for the first time is explained by one sentence, once per browser.
import type { Desk } from "./desk.ts";

const told = new Set<string>();

/** Say a sentence where something happened for the first time in this browser. */
export function once(desk: Desk, what: string, sentence: string): void {
  if (told.has(what)) return;
  told.add(what);
  const name = `openpendant.first.${what}`;
  try {
    if (localStorage.getItem(name) !== null) return;
    localStorage.setItem(name, "1");
  } catch {
    // A browser that remembers nothing is told once per visit.
  }
  desk.app.choice.set({ note: { text: sentence, kind: "remark" } });
}
