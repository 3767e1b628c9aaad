// The stops of a path: named positions and all points of a program, in the order of the way.
import { stopsOf } from "../planning/stops.ts";
import type { Stop } from "../planning/stops.ts";
import type { NamedPosition, ProgramHeading, ProgramsLoadReply } from "../protocol.ts";
import type { ProgramDocument } from "../teach/program.ts";
import type { PlanTexts } from "../texts/plan.ts";
import type { App } from "../ui/app.ts";
import { h, off, sayOrHide, show } from "../ui/elements.ts";

/** Stops that are listed at once. */
const MOST_SHOWN = 50;
const PROGRAM = "program ";
const POSITION = "position ";

export class PathStops {
  readonly element: HTMLElement;
  readonly #app: App;
  readonly #words: PlanTexts;
  readonly #from: HTMLSelectElement;
  readonly #list = h("ol", { class: "stops" });
  readonly #more = h("p", { class: "muted" });
  readonly #clear: HTMLButtonElement;
  #positions: readonly NamedPosition[] = [];
  #programs: readonly ProgramHeading[] = [];
  #stops: readonly Stop[] = [];

  constructor(app: App, words: PlanTexts) {
    this.#app = app;
    this.#words = words;
    this.#from = h("select", { "aria-label": words.addFrom });
    this.#clear = h("button", { type: "button", onclick: () => this.#take([]) }, words.clearStops);
    const add = h("button", { type: "button", class: "add-stop", onclick: () => this.#add() }, words.addStop);
    this.element = h("div", { class: "path-stops" }, h("div", { class: "stop-source" }, this.#from, add, this.#clear), this.#list, this.#more);
    this.#take([]);
  }

  get joints(): readonly (readonly number[])[] {
    return this.#stops.map((each) => each.joints);
  }

  takePositions(positions: readonly NamedPosition[]): void {
    this.#positions = positions;
    this.#offer();
  }

  async learnPrograms(): Promise<void> {
    const found: ProgramHeading[] = [];
    for (let first: number | null = 0; first !== null; ) {
      const part: { programs: ProgramHeading[]; next: number | null } = await this.#app.session.call<"programs.list">({ op: "programs.list", first });
      found.push(...part.programs);
      first = part.next;
    }
    this.#programs = found.filter((each) => !each.deleted);
    this.#offer();
  }

  #offer(): void {
    const words = this.#words;
    const before = this.#from.value;
    const positions = this.#positions.map(({ name, legal }) =>
      h("option", { value: POSITION + name, disabled: !legal }, legal ? name : words.notLegal(name)),
    );
    const programs = this.#programs.map(({ name }) => h("option", { value: PROGRAM + name }, words.pointsOf(name)));
    this.#from.replaceChildren(...positions, ...programs);
    if (before !== "") this.#from.value = before;
  }

  #add(): void {
    const { value } = this.#from;
    const position = this.#positions.find(({ name }) => POSITION + name === value);
    if (position !== undefined) this.#take([...this.#stops, position]);
    else if (value.startsWith(PROGRAM)) this.#app.attempt(() => this.#addProgram(value.slice(PROGRAM.length)));
  }

  async #addProgram(name: string): Promise<void> {
    const ask = { op: "programs.load", name, format: "json" } as const;
    let part: ProgramsLoadReply = await this.#app.session.call<"programs.load">(ask);
    const { revision } = part;
    let { body } = part;
    while (part.next !== null) {
      part = await this.#app.session.call<"programs.load">({ ...ask, revision, offset: part.next });
      body += part.body;
    }
    this.#take([...this.#stops, ...stopsOf(JSON.parse(body) as ProgramDocument)]);
  }

  #take(stops: readonly Stop[]): void {
    const words = this.#words;
    this.#stops = stops;
    const listed = stops.slice(0, MOST_SHOWN).map(({ name }, index) => {
      const without = (): void => this.#take(stops.filter((_, each) => each !== index));
      return h("li", {}, name, h("button", { type: "button", class: "quiet", "aria-label": words.removeStop(name), onclick: without }, "×"));
    });
    this.#list.replaceChildren(...listed);
    show(this.#list, stops.length > 0);
    const over = stops.length - listed.length;
    sayOrHide(this.#more, stops.length === 0 ? words.noStops : over > 0 ? words.moreStops(over) : "");
    off(this.#clear, stops.length === 0 ? words.noStops : "");
  }
}
