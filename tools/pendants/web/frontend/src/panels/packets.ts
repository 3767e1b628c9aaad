// The packet inspector: the frames of this tab, and one of them taken apart.
import "../packets.css";
import { anatomyOf } from "../packets/fields.ts";
import type { FrameAnatomy, FrameField } from "../packets/fields.ts";
import { frameText, hexOf, valueText } from "../packets/lines.ts";
import { answersOf, bodyOf, idOf, meaningOf, requestOf } from "../packets/meaning.ts";
import type { Refuse } from "../packets/meaning.ts";
import type { Caught, PacketRing } from "../packets/ring.ts";
import { Sieve } from "../packets/sieve.ts";
import type { Kind } from "../packets/sieve.ts";
import { CommType } from "../codec.ts";
import type { PacketTexts } from "../texts/packets.ts";
import { refusalSentence } from "../texts/texts.ts";
import type { App, TaskPart } from "../ui/app.ts";
import { attribute, h, mark, say, show } from "../ui/elements.ts";

/** Of a row of the list [px]. */
const ROW = 30;
/** Between two pictures of the list [ms]. */
const EVERY = 100;
const COLOURS = 12;
/** Of a frame that are shown, beginning with its header. */
const MOST_BYTES = 2048;
const IN_A_ROW = 16;

export function packetsTask(app: App): TaskPart {
  const words = app.texts.packetWords;
  const refuse: Refuse = (told) => refusalSentence(told, app.settings.value.language, app.jointNames());
  const detail = new PacketDetail(app, words, refuse);
  const list = new PacketList(app, words, refuse, (caught) => detail.show(caught));
  let isShown = false;
  let dueAt = 0;
  return {
    element: detail.element,
    stage: list.element,
    shown(is) {
      isShown = is;
    },
    update() {
      if (!isShown || app.now() < dueAt) return;
      dueAt = app.now() + EVERY;
      list.update();
      detail.update();
    },
  };
}

/** One line of the list; a few of them stand for all, as it is scrolled. */
interface Row {
  element: HTMLButtonElement;
  cells: HTMLElement[];
  shown: string;
}

class PacketList {
  readonly element: HTMLElement;
  readonly #app: App;
  readonly #words: PacketTexts;
  readonly #refuse: Refuse;
  readonly #chosen: (caught: Caught) => void;
  readonly #sieve: Sieve;
  readonly #rows: Row[] = [];
  readonly #sheet = h("div", { class: "sheet" });
  readonly #box: HTMLElement;
  readonly #none: HTMLElement;
  readonly #pause: HTMLButtonElement;
  readonly #kinds: HTMLButtonElement[];
  readonly #rates = h("span", {});
  readonly #kept = h("span", {});
  #isPaused = false;
  #selected = 0;
  /** Whether the chosen packet is to come into sight among those of another filter. */
  #isSought = false;
  #ratesAt = 0;

  constructor(app: App, words: PacketTexts, refuse: Refuse, chosen: (caught: Caught) => void) {
    this.#app = app;
    this.#words = words;
    this.#refuse = refuse;
    this.#chosen = chosen;
    this.#sieve = new Sieve(app.packets, (caught, anatomy) => this.#meaning(caught, anatomy));
    const filter = h("input", { type: "search", "aria-label": words.filter, placeholder: words.filter });
    filter.addEventListener("input", () => this.#sift({ text: filter.value }));
    const kinds: [Kind, string][] = [["all", words.all], ["no state", words.noState], ["refused", words.refused]];
    this.#kinds = kinds.map(([kind, word]) =>
      h("button", { type: "button", "data-kind": kind, onclick: () => this.#sift({ kind }) }, word),
    );
    this.#pause = h("button", { type: "button", class: "pause", onclick: () => this.#hold(!this.#isPaused) }, words.pause);
    this.#box = h("div", { class: "list", role: "group", "aria-label": words.list, tabindex: 0 }, this.#sheet);
    this.#box.addEventListener("scroll", () => this.#draw());
    this.#box.addEventListener("wheel", () => this.#hold(true), { passive: true });
    this.#box.addEventListener("keydown", (event) => this.#key(event));
    this.#none = h("p", { class: "none" }, words.none);
    const heads = [words.time, words.way, words.message, words.id, words.bytes, words.meaning];
    this.element = h(
      "section",
      { class: "packets", "aria-label": app.texts.packets },
      h(
        "header",
        {},
        h("h2", {}, app.texts.packets),
        h("span", { class: "muted" }, words.ofTab),
        filter,
        h("div", { class: "tabs", role: "group", "aria-label": words.kinds }, ...this.#kinds),
        this.#pause,
      ),
      h("div", { class: "heads packet", "aria-hidden": "true" }, ...heads.map((each) => h("span", {}, each))),
      this.#none,
      this.#box,
      h("footer", {}, this.#rates, this.#kept),
    );
    this.#sift({});
  }

  update(): void {
    if (!this.#isPaused) this.#sieve.takeNew();
    const isDone = this.#sieve.goOn();
    const { length } = this.#sieve.matches;
    this.#sheet.style.height = `${length * ROW}px`;
    show(this.#none, length === 0);
    if (!this.#isPaused) this.#box.scrollTop = this.#box.scrollHeight;
    else if (this.#isSought) this.#seek(isDone);
    this.#draw();
    this.#tellRates();
  }

  #sift(change: { text?: string; kind?: Kind }): void {
    this.#sieve.sift(change);
    this.#isSought = this.#isPaused;
    for (const each of this.#kinds) {
      const isChosen = each.dataset["kind"] === this.#sieve.kind;
      mark(each, "chosen", isChosen);
      attribute(each, "aria-pressed", String(isChosen));
    }
  }

  /** Bring the chosen packet into the middle, once it is among those that fit. */
  #seek(isDone: boolean): void {
    const at = this.#sieve.matches.findIndex(({ number }) => number === this.#selected);
    if (at >= 0) this.#box.scrollTop = at * ROW - this.#box.clientHeight / 2;
    this.#isSought = at < 0 && !isDone;
  }

  #hold(isPaused: boolean): void {
    this.#isPaused = isPaused;
    say(this.#pause, isPaused ? this.#words.goOn : this.#words.pause);
    attribute(this.#pause, "aria-pressed", String(isPaused));
  }

  /** Up and down go from packet to packet, as in any list. */
  #key(event: KeyboardEvent): void {
    const step = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    this.#hold(true);
    const { matches } = this.#sieve;
    const at = matches.findIndex(({ number }) => number === this.#selected);
    const to = Math.min(matches.length - 1, Math.max(0, at < 0 ? matches.length - 1 : at + step));
    const caught = matches[to];
    if (caught === undefined) return;
    this.#select(caught);
    const { scrollTop, clientHeight } = this.#box;
    const seen = Math.min(to * ROW, Math.max(scrollTop, (to + 1) * ROW - clientHeight));
    this.#box.scrollTop = seen;
    this.#draw();
    this.#rows.find((each) => each.element.dataset["number"] === String(caught.number))?.element.focus();
  }

  #select(caught: Caught): void {
    this.#selected = caught.number;
    this.#chosen(caught);
    this.#draw();
  }

  #draw(): void {
    const { matches } = this.#sieve;
    const first = Math.max(0, Math.floor(this.#box.scrollTop / ROW));
    const wanted = Math.min(matches.length - first, Math.ceil(this.#box.clientHeight / ROW) + 1);
    while (this.#rows.length < wanted) this.#rows.push(this.#newRow());
    this.#rows.forEach((row, index) => {
      const caught = index < wanted ? matches[first + index] : undefined;
      show(row.element, caught !== undefined);
      if (caught === undefined) return;
      row.element.style.top = `${(first + index) * ROW}px`;
      this.#fill(row, caught);
    });
  }

  #newRow(): Row {
    const cells = ["time", "way", "name", "id", "bytes", "meaning"].map((each) => h("span", { class: each }));
    const element = h("button", { type: "button", class: "packet" }, ...cells);
    element.addEventListener("click", () => {
      const caught = this.#app.packets.at(Number(element.dataset["number"]));
      this.#hold(true);
      if (caught !== undefined) this.#select(caught);
    });
    this.#sheet.append(element);
    return { element, cells, shown: "" };
  }

  #fill(row: Row, caught: Caught): void {
    mark(row.element, "selected", caught.number === this.#selected);
    attribute(row.element, "aria-pressed", String(caught.number === this.#selected));
    const key = String(caught.number);
    if (row.shown === key) return;
    row.shown = key;
    row.element.dataset["number"] = key;
    const anatomy = anatomyOf(caught.frame);
    const isOut = caught.way === "out";
    const texts = [
      clock(caught.at),
      isOut ? `↑ ${this.#words.out}` : `↓ ${this.#words.in}`,
      anatomy.name,
      idOf(anatomy.message),
      String(caught.frame.length),
      this.#meaning(caught, anatomy),
    ];
    row.cells.forEach((cell, index) => say(cell, texts[index] ?? ""));
    mark(row.element, "out", isOut);
    mark(row.element, "state", anatomy.name === "state");
    mark(row.element, "refused", this.#sieve.isRefused(caught));
  }

  #meaning(caught: Caught, anatomy: FrameAnatomy): string {
    return meaningOf(this.#app.packets, caught, anatomy, this.#words, this.#refuse);
  }

  #tellRates(): void {
    if (this.#app.now() < this.#ratesAt) return;
    this.#ratesAt = this.#app.now() + 1000;
    const { into, out, bytes } = ratesOf(this.#app.packets, Date.now());
    const { language } = this.#app.settings.value;
    const kilobytes = (bytes / 1000).toLocaleString(language, { maximumFractionDigits: 1 });
    say(this.#rates, `${this.#words.rates(into, out)}  ·  ${this.#words.rate(kilobytes)}`);
    say(this.#kept, this.#words.kept(this.#app.packets.most.toLocaleString(language)));
  }
}

function clock(at: number): string {
  const time = new Date(at);
  const part = (value: number, digits = 2): string => String(value).padStart(digits, "0");
  return `${part(time.getHours())}:${part(time.getMinutes())}:${part(time.getSeconds())}.${part(time.getMilliseconds(), 3)}`;
}

/** Count the frames of the last second. */
function ratesOf(ring: PacketRing, now: number): { into: number; out: number; bytes: number } {
  const rates = { into: 0, out: 0, bytes: 0 };
  for (let each = ring.count; each >= ring.oldest; each -= 1) {
    const caught = ring.at(each);
    if (caught === undefined || caught.at < now - 1000) break;
    if (caught.way === "out") rates.out += 1;
    else rates.into += 1;
    rates.bytes += caught.frame.length;
  }
  return rates;
}

/** One frame: its bytes with a colour for each field, the fields, and what belongs to it. */
class PacketDetail {
  readonly element: HTMLElement;
  readonly #app: App;
  readonly #words: PacketTexts;
  readonly #refuse: Refuse;
  readonly #name = h("h2", {});
  readonly #about = h("span", { class: "muted" });
  readonly #bytes = h("div", { class: "bytes" });
  readonly #fields = h("div", { class: "fields" });
  readonly #json = h("pre", { class: "json", tabindex: 0 });
  readonly #reference: HTMLAnchorElement;
  readonly #after = h("p", { class: "after" });
  readonly #copied = h("span", { class: "muted", role: "status" });
  readonly #whole: HTMLElement;
  readonly #hint: HTMLElement;
  #caught: Caught | null = null;
  #marked = -1;

  constructor(app: App, words: PacketTexts, refuse: Refuse) {
    this.#app = app;
    this.#words = words;
    this.#refuse = refuse;
    this.#bytes.addEventListener("click", (event) => {
      const field = (event.target as HTMLElement).dataset["field"];
      if (field !== undefined) this.#mark(Number(field));
    });
    this.#reference = h("a", { target: "_blank", rel: "noopener" }, words.reference);
    this.#hint = h("p", { class: "muted" }, words.choose);
    this.#whole = h(
      "div",
      { class: "packet-detail" },
      h("header", {}, this.#name, this.#about),
      h(
        "div",
        { class: "acts" },
        h("button", { type: "button", onclick: () => this.#copy("hex") }, words.copyHex),
        h("button", { type: "button", onclick: () => this.#copy("text") }, words.copyText),
        this.#copied,
      ),
      h("div", { class: "hex", role: "group", "aria-label": words.hexOf, tabindex: 0 }, this.#bytes),
      this.#fields,
      this.#json,
      h("footer", {}, this.#after, this.#reference),
    );
    this.element = h("section", { "aria-label": words.fields }, this.#hint, this.#whole);
    show(this.#whole, false);
  }

  show(caught: Caught): void {
    this.#caught = caught;
    this.#marked = -1;
    show(this.#hint, false);
    show(this.#whole, true);
    const anatomy = anatomyOf(caught.frame);
    const [, type, comm] = anatomy.header.map((each) => Number(each.value));
    say(this.#name, anatomy.name);
    const size = caught.frame.length;
    const kinds: Readonly<Record<number, (type: string, bytes: number) => string>> = {
      [CommType.REQUEST]: this.#words.aRequest,
      [CommType.REPLY]: this.#words.aReply,
    };
    say(this.#about, (kinds[comm ?? 0] ?? this.#words.aTopic)(String(type ?? "–"), size));
    say(this.#copied, "");
    const fields = [...anatomy.header, ...anatomy.fields];
    this.#bytes.replaceChildren(...hexRows(caught.frame, fields, this.#words));
    this.#fields.replaceChildren(...fields.map((each, index) => this.#fieldRow(each, index, anatomy)));
    const body = anatomy.message === null ? null : bodyOf(anatomy.message);
    say(this.#json, body === null ? "" : JSON.stringify(body, null, 1));
    show(this.#json, body !== null);
    const told = anatomy.message?.type ?? "opaque";
    // The page of reference is built beside this one; what it does not know has no place there.
    attribute(this.#reference, "href", `reference.html#${told}`);
    show(this.#reference, told !== "bare" && told !== "opaque");
    this.update();
  }

  /** What came after the frame may have come since. */
  update(): void {
    if (this.#caught === null) return;
    say(this.#after, this.#belonging(this.#caught));
  }

  #belonging(caught: Caught): string {
    const { message } = anatomyOf(caught.frame);
    if (message === null) return "";
    const { packets } = this.#app;
    const words = this.#words;
    const asked = requestOf(packets, caught, message);
    if (asked !== null) return words.answers(anatomyOf(asked.frame).name, `${caught.at - asked.at} ms`);
    if (caught.way === "in" || !("request_id" in message)) return "";
    const { answer, end } = answersOf(packets, caught, message);
    if (answer === null) return words.unanswered;
    const how = (told: Caught): string => {
      const { message: said } = anatomyOf(told.frame);
      if (said?.type === "verdict") return said.code === 0 ? words.accepted : this.#refuse(said);
      if (said?.type === "management" || said?.type === "lobby_reply") return words.answer;
      return meaningOf(packets, told, anatomyOf(told.frame), words, this.#refuse);
    };
    const ended = end === null ? "" : words.ended(`${end.at - caught.at} ms`, how(end));
    return `${words.answered(`${answer.at - caught.at} ms`, how(answer))} ${ended}`.trim();
  }

  #fieldRow(field: FrameField, index: number, anatomy: FrameAnatomy): HTMLElement {
    const value = valueText(field.value, field.kind, false);
    const label = this.#labelOf(field, anatomy);
    const more = [field.unit, label].filter((each) => each !== "").join(" · ");
    const row = h(
      "button",
      { type: "button", class: "field", "data-field": index, "aria-pressed": "false", onclick: () => this.#mark(index) },
      h("i", { class: `colour-${index % COLOURS}`, "aria-hidden": "true" }),
      h("span", { class: "path" }, field.path),
      h("span", { class: "value" }, value),
      h("span", { class: "sort" }, field.kind),
      h("span", { class: "label" }, more),
    );
    return row;
  }

  #labelOf(field: FrameField, { message }: FrameAnatomy): string {
    if (field.path !== "state_sequence" || this.#caught === null || message === null) return field.label;
    const { packets } = this.#app;
    for (let each = this.#caught.number; each >= packets.oldest && each > this.#caught.number - 200; each -= 1) {
      const caught = packets.at(each);
      const told = caught === undefined ? null : anatomyOf(caught.frame).message;
      if (caught === undefined || told?.type !== "state" || told.sequence !== field.value) continue;
      return this.#words.stateOfBefore(`${this.#caught.at - caught.at} ms`);
    }
    return field.label;
  }

  #mark(index: number): void {
    this.#marked = this.#marked === index ? -1 : index;
    for (const each of this.element.querySelectorAll<HTMLElement>("[data-field]")) {
      const isMarked = Number(each.dataset["field"]) === this.#marked;
      mark(each, "marked", isMarked);
      if (each.tagName !== "BUTTON") continue;
      attribute(each, "aria-pressed", String(isMarked));
      if (isMarked) each.scrollIntoView({ block: "nearest" });
    }
  }

  #copy(what: "hex" | "text"): void {
    const caught = this.#caught;
    if (caught === null) return;
    const text = what === "hex" ? hexOf(caught.frame) : frameText(caught.frame);
    // Without encryption a browser keeps the clipboard to itself: then the text is only marked.
    if (navigator.clipboard === undefined) {
      getSelection()?.selectAllChildren(what === "hex" ? this.#bytes : this.#fields);
      say(this.#copied, this.#words.marked);
      return;
    }
    navigator.clipboard.writeText(text).then(
      () => say(this.#copied, this.#words.copied),
      () => {
        getSelection()?.selectAllChildren(what === "hex" ? this.#bytes : this.#fields);
        say(this.#copied, this.#words.marked);
      },
    );
  }
}

function hexRows(frame: Uint8Array, fields: readonly FrameField[], words: PacketTexts): HTMLElement[] {
  const owner = new Int32Array(frame.length).fill(-1);
  fields.forEach(({ offset, size }, index) => owner.fill(index, offset, offset + size));
  const shown = Math.min(frame.length, MOST_BYTES);
  const rows: HTMLElement[] = [];
  for (let at = 0; at < shown; at += IN_A_ROW) {
    const row = h("div", {}, h("span", { class: "at" }, at.toString(16).padStart(4, "0")));
    for (let each = at; each < Math.min(at + IN_A_ROW, shown); each += 1) {
      const field = owner[each] ?? -1;
      const colour = field < 0 ? "" : ` colour-${field % COLOURS}`;
      const digits = hexOf(frame.subarray(each, each + 1));
      row.append(h("span", { class: `byte${colour}`, "data-field": field < 0 ? null : field }, digits));
    }
    rows.push(row);
  }
  if (frame.length > shown) rows.push(h("div", { class: "muted" }, words.more(frame.length - shown)));
  return rows;
}
