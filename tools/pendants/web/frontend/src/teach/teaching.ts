// The open program of this page: loaded in parts, changed by requests one after the other, walked
// through by dry runs. The server owns it; what it keeps is loaded again after each change.
import type { Operations, ProgramHeading } from "../operations.ts";
import { VerdictCode } from "../protocol.ts";
import { Refused } from "../wire/errors.ts";
import type { Change } from "./edits.ts";
import { partsOf } from "./edits.ts";
import { findingsOf } from "./findings.ts";
import type { Findings } from "./findings.ts";
import { programOf } from "./program.ts";
import type { Program, ProgramDocument } from "./program.ts";

/** What is needed of a session. */
export interface Wire {
  call<Op extends keyof Operations>(request: Operations[Op][0]): Promise<Operations[Op][1]>;
}

export interface TeachingEvents {
  /** Something is to be shown anew. */
  changed(): void;
  /** Somebody else changed the program meanwhile: it was loaded again, and nothing was done. */
  overtaken(program: Program): void;
  /** The open program was deleted or renamed by somebody else. */
  gone(name: string): void;
}

export class Teaching {
  programs: readonly ProgramHeading[] | null = null;
  program: Program | null = null;
  findings: Findings | null = null;
  isWalking = false;
  #selected = 0;
  #wire: Wire;
  #events: TeachingEvents;
  #last: Promise<unknown> = Promise.resolve();
  /** Counts what made findings old, so that a dry run under way is not believed. */
  #age = 0;

  constructor(wire: Wire, events: TeachingEvents) {
    this.#wire = wire;
    this.#events = events;
  }

  /** The chosen statement, from 0; their number where the end is chosen. */
  get selected(): number {
    return this.#selected;
  }

  select(index: number): void {
    this.#selected = Math.max(0, Math.min(index, this.program?.statements.length ?? 0));
    this.#events.changed();
  }

  /** Forget everything: another cell was entered. */
  forget(): void {
    this.programs = null;
    this.close();
  }

  close(): void {
    this.program = null;
    this.#selected = 0;
    this.makeOld();
  }

  /** The scene, the frames, the tools or the robot changed: nothing is checked any more. */
  makeOld(): void {
    this.#age += 1;
    this.findings = null;
    this.#events.changed();
  }

  /** Ask which programs there are. */
  list(): Promise<void> {
    return this.#inTurn(() => this.#list());
  }

  /** Look again, after a notice: at the list, and at the open program if it has changed. */
  refresh(): Promise<void> {
    return this.#inTurn(async () => {
      await this.#list();
      const { program, programs } = this;
      if (program === null) return;
      const heading = programs?.find((each) => each.name === program.name);
      if (heading === undefined) {
        this.close();
        this.#events.gone(program.name);
      } else if (heading.revision !== program.revision) await this.#load(program.name);
      else await this.#loadBreakpoints(program);
    });
  }

  open(name: string): Promise<void> {
    return this.#inTurn(async () => {
      this.#selected = 0;
      await this.#load(name);
      this.select((this.program?.statements.length ?? 1) - 1);
    });
  }

  create(name: string): Promise<void> {
    return this.#inTurn(async () => {
      await this.#wire.call<"programs.create">({ op: "programs.create", name });
      this.#selected = 0;
      await this.#load(name);
      await this.#list();
    });
  }

  rename(newName: string): Promise<void> {
    return this.#changed(async (program) => {
      const request = { name: program.name, new_name: newName, expected_revision: program.revision };
      await this.#wire.call<"programs.rename">({ op: "programs.rename", ...request });
      await this.#load(newName);
      await this.#list();
    });
  }

  /** Delete a program of the list. */
  delete(heading: { name: string; revision: number }): Promise<void> {
    return this.#inTurn(async () => {
      const request = { name: heading.name, expected_revision: heading.revision };
      await this.#wire.call<"programs.delete">({ op: "programs.delete", ...request });
      if (this.program?.name === heading.name) this.close();
      await this.#list();
    });
  }

  /** Change the program; the request is made when its turn comes, from the revision that is then. */
  change(make: (program: Program) => Change | null): Promise<void> {
    return this.#changed(async (program) => {
      const change = make(program);
      if (change === null) return;
      await this.#wire.call<typeof change.request.op>(change.request);
      await this.#load(program.name);
      this.select(change.chosen);
    });
  }

  /** Save a whole text, in parts; `revision` is the one that it was made from. */
  save(text: string, revision: number): Promise<void> {
    return this.#changed(async ({ name }) => {
      const parts = partsOf(text);
      for (const [index, body] of parts.entries()) {
        const part = parts.length === 1 ? {} : { part: index + 1, parts: parts.length };
        const request = { name, body, expected_revision: revision, ...part };
        await this.#wire.call<"programs.save">({ op: "programs.save", ...request });
      }
      await this.#load(name);
    });
  }

  /** Pause before a statement, or no more. */
  toggleBreakpoint(index: number): Promise<void> {
    return this.#changed(async (program) => {
      const has = program.breakpoints.includes(index);
      const statements = has
        ? program.breakpoints.filter((each) => each !== index)
        : [...program.breakpoints, index].sort((a, b) => a - b);
      const request = { name: program.name, statements };
      const kept = await this.#wire.call<"programs.breakpoints">({ op: "programs.breakpoints", ...request });
      this.program = { ...program, breakpoints: kept.statements };
    });
  }

  /** Walk through the program without moving: nothing else waits for it. */
  async dryRun(): Promise<void> {
    const { program } = this;
    if (program === null || this.isWalking) return;
    this.isWalking = true;
    this.#events.changed();
    const age = this.#age;
    try {
      const reply = await this.#wire.call<"programs.dry_run">({ op: "programs.dry_run", name: program.name });
      if (age === this.#age) this.findings = findingsOf(reply);
    } finally {
      this.isWalking = false;
      this.#events.changed();
    }
  }

  async #changed(act: (program: Program) => Promise<void>): Promise<void> {
    return this.#inTurn(async () => {
      const { program } = this;
      if (program === null) return;
      try {
        await act(program);
      } catch (error) {
        if (!(error instanceof Refused) || error.refusal.code !== VerdictCode.REVISION_CONFLICT) throw error;
        await this.#load(program.name);
        if (this.program !== null) this.#events.overtaken(this.program);
      }
    });
  }

  /** One change after the other, each from what the one before left. */
  #inTurn(act: () => Promise<void>): Promise<void> {
    const mine = this.#last.then(act);
    this.#last = mine.catch(() => undefined);
    return mine.finally(() => this.#events.changed());
  }

  async #list(): Promise<void> {
    const found: ProgramHeading[] = [];
    let first: number | null = 0;
    while (first !== null) {
      const part: Operations["programs.list"][1] = await this.#wire.call<"programs.list">({ op: "programs.list", first });
      found.push(...part.programs);
      first = part.next;
    }
    this.programs = found.filter((each) => !each.deleted);
  }

  async #load(name: string): Promise<void> {
    const json = await this.#body(name, "json", null);
    const text = await this.#body(name, "text", json.head.revision);
    const before = this.program;
    this.program = programOf(json.head, JSON.parse(json.body) as ProgramDocument, text.body);
    if (before?.name !== name || before.revision !== this.program.revision) this.#age += 1;
    this.select(this.#selected);
  }

  /** Breakpoints change without a new revision. */
  async #loadBreakpoints(program: Program): Promise<void> {
    const head = await this.#wire.call<"programs.load">({ op: "programs.load", name: program.name, format: "json" });
    if (head.revision !== program.revision) await this.#load(program.name);
    else this.program = { ...program, breakpoints: head.breakpoints ?? [] };
  }

  /** Load one form of a program, part by part, all of one revision. */
  async #body(name: string, format: "text" | "json", revision: number | null) {
    const asked = { op: "programs.load", name, format } as const;
    const head = await this.#wire.call<"programs.load">({ ...asked, revision });
    let { body, next } = head;
    while (next !== null) {
      const part: Operations["programs.load"][1] = await this.#wire.call<"programs.load">({ ...asked, revision: head.revision, offset: next });
      body += part.body;
      next = part.next;
    }
    return { head, body };
  }
}
