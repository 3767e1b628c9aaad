// What happened in the cell while this page looked on: the newest lines, for people.
import {
  Activity,
  AuthorityReason,
  EnablingPosition,
  JogEnd,
  LinkState,
  NoticeKind,
  ProgramState,
  StopKind,
  TriState,
} from "../protocol.ts";
import type { AuthorityChanged, DocumentChanged, JogEnded, Message, ProgramReport, State, StopChanged } from "../protocol.ts";
import { fixed, modeWord } from "../texts/texts.ts";
import type { Texts } from "../texts/texts.ts";
import type { Cell } from "./cell.ts";

/** What a line tells of: the filter and its colour go by it. */
export type LogKind = "event" | "motion" | "remark" | "refusal" | "stop" | "fault";

export interface LogLine {
  /** Counts from 1. */
  number: number;
  /** Wall clock, for people [ms]. */
  at: number;
  kind: LogKind;
  /** In the language in which the page stood. */
  text: string;
}

type Place = Pick<ProgramReport, "state" | "line"> & { program: string | null };
const NO_PROGRAM: Place = { state: ProgramState.NONE, line: 0, program: null };
/** What the server says of a program that ended as it should. */
const FINISHED = "finished";

type Told = readonly [LogKind, string];

/** What a controller may not know of itself. */
const REPORTED = ["e_stopped", "in_error", "drives_powered"] as const;
type Reported = Record<(typeof REPORTED)[number], number>;

const NAMED: readonly number[] = [NoticeKind.PROGRAM, NoticeKind.RECORDING, NoticeKind.EXERCISE];
/** Signals change many times a second; `EVERYTHING` says that notices were left out. */
const NOT_TOLD: readonly number[] = [NoticeKind.EVERYTHING, NoticeKind.SIGNALS];

export class EventLog {
  /** Lines that are kept. */
  readonly most: number;
  #lines: LogLine[] = [];
  #count = 0;
  #clock: () => number;
  #state: State | null = null;
  /** What the controller reported last of what it may not know. */
  #reported: Partial<Reported> = {};
  /** How the motion began that is under way, by the server's clock [s]; null where nobody saw that. */
  #began: { at: number; isJog: boolean; isOfProgram: boolean } | null = null;
  /** Where the program stood last; the name is not known before its first report. */
  #program: Place = NO_PROGRAM;
  /** Who held control last. */
  #holder = "";

  constructor(clock: () => number, most = 500) {
    this.#clock = clock;
    this.most = most;
  }

  /** The lines that are kept, oldest first. */
  get lines(): readonly LogLine[] {
    return this.#lines;
  }

  add(kind: LogKind, text: string): void {
    this.#count += 1;
    this.#lines = [...this.#lines, { number: this.#count, at: this.#clock(), kind, text }].slice(-this.most);
  }

  /** Take what a message tells; `cell` is what is known with it. */
  hear(message: Message, cell: Cell, texts: Texts): void {
    switch (message.type) {
      case "state":
        this.#hearState(message, texts);
        break;
      case "authority_changed":
        this.add("event", this.#authorityText(message, cell, texts));
        break;
      case "authority_wanted":
        this.add("event", texts.wanted(message.client));
        break;
      case "stop_changed":
        this.add(message.stop === StopKind.NONE ? "event" : "stop", stopText(message, texts));
        break;
      case "program_report":
        this.#hearProgram(message, texts);
        break;
      case "jog_ended":
        this.#hearJogEnd(message, texts);
        break;
      case "document_changed":
        if (!NOT_TOLD.includes(message.kind)) this.add("event", documentText(message, texts));
        break;
    }
  }

  /** Take what became of the way to the server. */
  hearLink(before: Cell, after: Cell, texts: Texts): void {
    this.#holder = after.holderName;
    if (before.stage === after.stage) return;
    const words = texts.logWords;
    if (after.stage === "up") this.add("event", words.connected(after.hello?.cell ?? "", after.hello?.robot ?? ""));
    if (before.stage !== "up") return;
    // What changes without a link is no event that was seen.
    this.#state = this.#began = null;
    this.#reported = {};
    const isLost = after.stage === "lost" || after.stage === "ended";
    this.add(isLost ? "fault" : "event", isLost ? words.lost(after.linkText) : words.left);
  }

  #hearJogEnd({ reason, stop_time, tool_distance }: JogEnded, texts: Texts): void {
    const how = texts.logWords.jogEnds[reason];
    if (how === undefined) return;
    this.add(reason === JogEnd.STOPPED ? "stop" : "remark", how(fixed(stop_time, 2), fixed(tool_distance * 1000, 1)));
  }

  /** Tell where a program began, stands or ended; through its lines it only runs. */
  #hearProgram(report: ProgramReport, texts: Texts): void {
    const before = this.#program;
    this.#program = report;
    const isElsewhere = report.line !== before.line || (before.program !== null && report.program !== before.program);
    if (report.state === before.state && (!isElsewhere || report.state === ProgramState.RUNNING)) return;
    const { program, line, state, text } = report;
    const words = texts.logWords;
    const told: Readonly<Record<number, string>> = {
      [ProgramState.NONE]: words.programEnded(program, text === FINISHED ? "" : text),
      [ProgramState.RUNNING]: before.state === ProgramState.NONE ? words.programBegan(program) : words.programGoesOn(program, line),
      [ProgramState.PAUSED]: words.programPaused(program, line),
      [ProgramState.AT_BREAKPOINT]: words.atBreakpoint(program, line),
      [ProgramState.STEPPED]: words.programStepped(program, line),
    };
    this.add("motion", told[state] ?? "");
  }

  #hearState(state: State, texts: Texts): void {
    const old = this.#state;
    this.#state = state;
    // What is so as the link begins, began before.
    if (old === null) this.#program = { state: state.program_state, line: state.program_line, program: null };
    const told = old === null ? [] : changesOf(old, state, texts);
    for (const [kind, text] of [...told, ...this.#reports(state, texts)]) this.add(kind, text);
    if (old !== null) this.#hearMotion(old, state, texts);
  }

  /** Return what the controller reports anew of itself: that it knows nothing is no end of a stop. */
  #reports(state: State, texts: Texts): Told[] {
    const told: Told[] = [];
    for (const what of REPORTED) {
      const [before, now] = [this.#reported[what], state[what]];
      if (now === TriState.UNKNOWN) continue;
      this.#reported[what] = now;
      if (before !== undefined && before !== now) told.push(reportText(what, state, texts));
    }
    return told;
  }

  /** One line for each motion, once the robot stands; those of a program are told by its lines. */
  #hearMotion(old: State, state: State, texts: Texts): void {
    const now = secondsOf(state);
    if (isUnderWay(state) && !isUnderWay(old)) {
      const isOfProgram = state.program_state !== ProgramState.NONE;
      this.#began = { at: now, isJog: state.activity === Activity.JOGGING, isOfProgram };
    }
    if (isUnderWay(state) || this.#began === null) return;
    const { at, isJog, isOfProgram } = this.#began;
    this.#began = null;
    if (isOfProgram) return;
    const { jogged, moved } = texts.logWords;
    this.add("motion", (isJog ? jogged : moved)(fixed(now - at, 1)));
  }

  #authorityText({ holder, reason, client }: AuthorityChanged, cell: Cell, texts: Texts): string {
    const words = texts.logWords;
    const how = words.reasons[reason] ?? "";
    const before = this.#holder;
    this.#holder = client;
    if (holder === 0) return words.controlFree(before, how);
    const who = holder === cell.hello?.session ? words.controlYours : words.controlOf(client || texts.notKnown);
    return reason === AuthorityReason.GRANTED ? `${who}.` : `${who}: ${how}.`;
  }
}

function changesOf(old: State, state: State, texts: Texts): Told[] {
  const words = texts.logWords;
  const told: Told[] = [];
  const when = (name: keyof State, ...line: Told): void => {
    if (old[name] !== state[name]) told.push(line);
  };
  when("link", ...linkText(state, texts));
  when("operating_mode", "event", words.mode(modeWord(texts, state.operating_mode)));
  when("override", "event", words.speed(Math.round(state.override * 100)));
  if (state.enabling === EnablingPosition.PANIC) when("enabling", "stop", words.pressedThrough);
  return told;
}

function linkText(state: State, texts: Texts): Told {
  if (state.link === LinkState.UP) return ["event", texts.logWords.controllerUp];
  return ["fault", state.link === LinkState.DOWN ? texts.faultController : texts.faultStale];
}

function reportText(what: keyof Reported, state: State, texts: Texts): Told {
  const words = texts.logWords;
  const isTrue = state[what] === TriState.TRUE;
  if (what === "drives_powered") return ["event", isTrue ? words.drivesOn : words.drivesOff];
  if (what === "in_error") return isTrue ? ["fault", texts.faultError(state.error_code)] : ["event", words.errorClear];
  return isTrue ? ["stop", texts.stoppedController] : ["event", words.emergencyClear];
}

function stopText({ stop, client, reason }: StopChanged, texts: Texts): string {
  if (stop === StopKind.PROTECTIVE) return texts.stoppedServer(reason);
  return stop === StopKind.NONE ? texts.logWords.stopReset(client) : texts.logWords.stopped(client, reason);
}

function documentText({ kind, what, name, from_name, client }: DocumentChanged, texts: Texts): string {
  const words = texts.logWords;
  const document = words.document(words.documents[kind] ?? "", NAMED.includes(kind) ? name : "");
  const renamed = from_name === "" ? "" : ` (${words.formerly(from_name)})`;
  return `${document}: ${words.changes[what] ?? ""}${renamed}${client === "" ? "" : ` · ${client}`}`;
}

/** Whether a motion is not yet at its end: paused it goes on, or ends without another step. */
function isUnderWay({ activity }: State): boolean {
  return activity !== Activity.IDLE && activity !== Activity.PLANNING;
}

function secondsOf({ time_s, time_ns }: State): number {
  return time_s + time_ns / 1e9;
}
