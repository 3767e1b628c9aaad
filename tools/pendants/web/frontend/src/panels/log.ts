// The log: what happened in the cell while this page looked on, and the same as a file.
import "../log.css";
import type { LogKind, LogLine } from "../pendant/event-log.ts";
import { csvRow } from "../plots/csv.ts";
import type { App, TaskPart } from "../ui/app.ts";
import { choose, download, h, say, show } from "../ui/elements.ts";
import { icon } from "../ui/icons.ts";
import type { IconName } from "../ui/icons.ts";

const TROUBLES: readonly LogKind[] = ["stop", "fault", "refusal"];
const ICONS: Readonly<Record<LogKind, IconName>> = {
  event: "eye",
  motion: "play",
  remark: "hand",
  refusal: "warning",
  stop: "stop",
  fault: "cross",
};

export function logTask(app: App): TaskPart {
  return new LogTask(app);
}

class LogTask implements TaskPart {
  readonly element: HTMLElement;
  readonly #app: App;
  readonly #list: HTMLElement;
  readonly #none = h("p", { class: "muted", role: "status" });
  readonly #choices: HTMLButtonElement[];
  readonly #rows = new Map<number, HTMLElement>();
  #isShown = false;
  #areTroublesOnly = false;

  constructor(app: App) {
    this.#app = app;
    const { logWords: words, log } = app.texts;
    this.#choices = [words.all, words.troubles].map((word, index) =>
      h("button", { type: "button", onclick: () => this.#sift(index === 1) }, word),
    );
    this.#list = h("ol", { class: "log-lines", role: "list", "aria-label": words.list, tabindex: 0 });
    this.element = h(
      "section",
      { class: "log", "aria-label": log },
      h("p", { class: "muted" }, words.hint(String(app.log.most))),
      h("div", { class: "tabs", role: "group", "aria-label": words.kinds }, ...this.#choices),
      this.#none,
      this.#list,
      h("button", { type: "button", class: "save", onclick: () => this.#save() }, words.save),
    );
    this.#sift(false);
  }

  shown(isShown: boolean): void {
    this.#isShown = isShown;
  }

  update(): void {
    if (!this.#isShown) return;
    const lines = this.#app.log.lines.filter(({ kind }) => !this.#areTroublesOnly || TROUBLES.includes(kind));
    const { none, noneSuch } = this.#app.texts.logWords;
    say(this.#none, this.#areTroublesOnly ? noneSuch : none);
    show(this.#none, lines.length === 0);
    this.#drop(lines[0]?.number ?? Infinity);
    for (const line of lines) if (!this.#rows.has(line.number)) this.#prepend(line);
  }

  #sift(areTroublesOnly: boolean): void {
    this.#areTroublesOnly = areTroublesOnly;
    this.#choices.forEach((each, index) => choose(each, areTroublesOnly === (index === 1)));
    this.#drop(Infinity);
  }

  /** Take away the rows in front of a line. */
  #drop(before: number): void {
    for (const [number, row] of this.#rows) {
      if (number >= before) break; // they stand in their order
      row.remove();
      this.#rows.delete(number);
    }
  }

  #prepend(line: LogLine): void {
    const { language } = this.#app.settings.value;
    const when = new Date(line.at);
    const time = h("time", { datetime: when.toISOString(), title: when.toLocaleString(language, { dateStyle: "long", timeStyle: "medium" }) }, when.toLocaleTimeString(language));
    const kind = h("span", { class: "sr-only" }, this.#app.texts.logWords.kindWords[line.kind]);
    const row = h("li", { "data-kind": line.kind }, icon(ICONS[line.kind]), time, kind, h("span", {}, line.text));
    this.#rows.set(line.number, row);
    this.#list.prepend(row);
  }

  #save(): void {
    const { cell, log, texts } = this.#app;
    const rows = log.lines.map(({ at, kind, text }) => csvRow([new Date(at).toISOString(), kind, text]));
    const table = [csvRow(texts.logWords.columns), ...rows].join("\r\n");
    download(`${cell.value.hello?.cell ?? "openpendant"}-log.csv`, new Blob([`${table}\r\n`], { type: "text/csv" }));
  }
}
