// What the parts of teaching share: the open program, the recordings, the run under way, and what a
// person chose. It outlives the panel, which is made anew in another language or theme.
import { isInControl } from "../../pendant/cell.ts";
import type { Cell } from "../../pendant/cell.ts";
import type { Way } from "../../operations.ts";
import { NoticeKind, ProgramState } from "../../protocol.ts";
import type { Message, ProgramReport } from "../../protocol.ts";
import { findingAt } from "../../teach/findings.ts";
import type { Finding } from "../../teach/findings.ts";
import type { Program } from "../../teach/program.ts";
import { indexOf } from "../../teach/program.ts";
import { Recordings } from "../../teach/recordings.ts";
import { Teaching } from "../../teach/teaching.ts";
import { transport } from "../../teach/transport.ts";
import type { Transport } from "../../teach/transport.ts";
import type { TeachTexts } from "../../texts/teach.ts";
import type { App } from "../../ui/app.ts";
import { LinkLost, Refused } from "../../wire/errors.ts";
import { whyNoMotion } from "../jog.ts";

export type Tab = "programs" | "table" | "text" | "points" | "recordings";

/** Notices that make findings of a dry run old. */
const MAKE_OLD = [NoticeKind.SCENE, NoticeKind.FRAMES, NoticeKind.TOOLS, NoticeKind.ROBOT, NoticeKind.SIGNALS];

export class Desk {
  readonly app: App;
  readonly teaching: Teaching;
  readonly recordings: Recordings;
  tab: Tab = "programs";
  /** Of the next point that is saved. */
  way: Way = "PTP";
  /** How often a program runs; 0 until it is ended. */
  times = 1;
  /** Whether a run begins at the chosen line. */
  isFromLine = false;
  /** What was said last of the program under way. */
  report: ProgramReport | null = null;
  /** Whether the view was told of the open program. */
  isInView = false;
  #place = "";
  #programs = -1;
  #recorded = -1;
  #old = -1;
  #recordingOf: string | null = null;

  constructor(app: App) {
    this.app = app;
    const draw = (): void => app.choice.set({});
    const note = (text: string): void => app.choice.set({ note: { text, kind: "remark" } });
    this.teaching = new Teaching(app.session, {
      changed: draw,
      overtaken: (program) => note(this.texts.overtaken(program.revision)),
      gone: (name) => {
        this.tab = "programs";
        note(this.texts.gone(name));
      },
    });
    this.recordings = new Recordings(app.session, draw);
    app.session.listen((message) => this.#told(message));
  }

  get texts(): TeachTexts {
    return this.app.texts.teaching;
  }

  get program(): Program | null {
    return this.teaching.program;
  }

  /** Do something whose refusal is told. */
  attempt(act: () => Promise<unknown>): void {
    this.app.attempt(act);
  }

  show(tab: Tab): void {
    this.tab = tab;
    this.app.choice.set({});
  }

  findingAt(index: number): Finding | null {
    const { program } = this;
    return program === null ? null : findingAt(this.teaching.findings, program, index);
  }

  transport(cell: Cell): Transport {
    return transport({
      isInControl: isInControl(cell),
      mayMove: whyNoMotion(this.app, cell) === "",
      state: cell.state,
      hasProgram: (this.program?.statements.length ?? 0) > 0,
      isOpenOne: this.isOpenOne(cell),
    });
  }

  /** Name of the program under way; empty for none. */
  underWay(cell: Cell): string {
    if ((cell.state?.program_state ?? ProgramState.NONE) === ProgramState.NONE) return "";
    return this.report?.program ?? cell.snapshot?.program?.name ?? "";
  }

  isOpenOne(cell: Cell): boolean {
    const name = this.underWay(cell);
    return name !== "" && name === this.program?.name;
  }

  /** Return the statement of the open program that is under way; -1 for none. */
  current(cell: Cell): number {
    const { program } = this;
    if (program === null || !this.isOpenOne(cell)) return -1;
    return indexOf(program, cell.state?.program_line ?? 0);
  }

  /** Look at what has changed since the last time; ask again where a notice came. */
  follow(cell: Cell): void {
    if (cell.stage !== "up" || cell.snapshot === null) return;
    const place = `${cell.server} ${cell.hello?.cell ?? ""} ${cell.hello?.session ?? 0}`;
    const isElsewhere = place.replace(/ \d+$/, "") !== this.#place.replace(/ \d+$/, "");
    if (isElsewhere && this.#place !== "") {
      this.teaching.forget();
      this.tab = "programs";
    }
    const isNewLink = place !== this.#place;
    this.#place = place;
    const count = (kind: number): number => (cell.changes[kind] ?? 0) + (cell.changes[NoticeKind.EVERYTHING] ?? 0);
    const programs = count(NoticeKind.PROGRAM);
    const recorded = count(NoticeKind.RECORDING);
    const old = MAKE_OLD.reduce((sum, kind) => sum + count(kind), 0);
    const recordingOf = cell.snapshot.recording?.name ?? null;
    const isProgramChanged = isNewLink || programs !== this.#programs;
    const isRecordingChanged = isNewLink || recorded !== this.#recorded || recordingOf !== this.#recordingOf;
    const isOld = isNewLink || old !== this.#old;
    this.#programs = programs;
    this.#recorded = recorded;
    this.#old = old;
    this.#recordingOf = recordingOf;
    if (isProgramChanged) void this.#quietly(() => this.teaching.refresh());
    if (isRecordingChanged) void this.#quietly(() => this.recordings.list());
    if (isOld && this.teaching.findings !== null) this.teaching.makeOld();
  }

  /** What a notice makes us ask; it takes no refusal away that a person has yet to read. */
  async #quietly(act: () => Promise<void>): Promise<void> {
    try {
      await act();
    } catch (error) {
      if (error instanceof Refused) this.app.refused(error.refusal);
      else if (!(error instanceof LinkLost)) throw error;
    }
  }

  #told(message: Message): void {
    if (message.type !== "program_report") return;
    this.report = message;
    this.app.choice.set({});
  }
}
