// What happened in the cell while this page looked on: the newest lines, for people.
import {
  Activity,
  AuthorityReason,
  EnablingPosition,
  JogEnd,
  LinkState,
  ProgramState,
  StopKind,
  TriState,
} from "../protocol.ts";
import type { AuthorityChanged, DocumentChanged, JogEnded, Message, State, StopChanged } from "../protocol.ts";
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

export class EventLog {
  /** Lines that are kept. */
  readonly most: number;
  #lines: LogLine[] = [];
  #count = 0;
  #clock: () => number;
  #state: State | null = null;
  /** That of the motion that is under way; time of the server's clock [s]. */
  #began = { at: 0, isJog: false };

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

  /** Take what a message tells; `cell` is what was known before and with it. */
  hear(message: Message, cell: Cell, texts: Texts): void {
    switch (message.type) {
      case "state":
        this.#hearState(message, texts);
        break;
      case "authority_changed":
        this.add("event", authorityText(message, cell, texts));
        break;
      case "authority_wanted":
        this.add("event", texts.wanted(message.client));
        break;
      case "stop_changed":
        this.add(message.stop === StopKind.NONE ? "event" : "stop", stopText(message, texts));
        break;
      case "jog_ended":
        this.#hearJogEnd(message, texts);
        break;
      case "document_changed":
        this.add("event", documentText(message, texts));
        break;
    }
  }

  /** Take what became of the way to the server. */
  hearLink(before: Cell, after: Cell, texts: Texts): void {
    if (before.stage === after.stage) return;
    const words = texts.logWords;
    if (after.stage === "up") this.add("event", words.connected(after.hello?.cell ?? "", after.hello?.robot ?? ""));
    if (before.stage !== "up") return;
    this.#state = null; // what changes without a link is no event that was seen
    const isLost = after.stage === "lost" || after.stage === "ended";
    this.add(isLost ? "fault" : "event", isLost ? words.lost(after.linkText) : words.left);
  }

  #hearJogEnd({ reason, stop_time, tool_distance }: JogEnded, texts: Texts): void {
    const why = texts.logWords.pressEnds[reason];
    if (why !== undefined) this.add(reason === JogEnd.STOPPED ? "stop" : "remark", texts.logWords.pressEnded(why, fixed(stop_time, 2), fixed(tool_distance * 1000, 1)));
  }

  #hearState(state: State, texts: Texts): void {
    const old = this.#state;
    this.#state = state;
    if (old === null) return;
    for (const [kind, text] of changesOf(old, state, texts)) this.add(kind, text);
    this.#hearMotion(old, state, texts);
  }

  /** One line for each motion, once the robot stands; those of a program are told by its lines. */
  #hearMotion(old: State, state: State, texts: Texts): void {
    const now = secondsOf(state);
    if (isUnderWay(state) && !isUnderWay(old)) this.#began = { at: now, isJog: state.activity === Activity.JOGGING };
    if (isUnderWay(state) || !isUnderWay(old) || isInProgram(old)) return;
    const { at, isJog } = this.#began;
    const { jogged, moved } = texts.logWords;
    this.add("motion", (isJog ? jogged : moved)(fixed(now - at, 1)));
  }
}

type Told = readonly [LogKind, string];

function changesOf(old: State, state: State, texts: Texts): Told[] {
  const words = texts.logWords;
  const told: Told[] = [];
  const when = (name: keyof State, ...line: Told): void => {
    if (old[name] !== state[name]) told.push(line);
  };
  when("link", ...linkText(state, texts));
  when("e_stopped", ...emergencyText(state, texts));
  when("in_error", ...errorText(state, texts));
  when("drives_powered", "event", state.drives_powered === TriState.TRUE ? words.drivesOn : words.drivesOff);
  when("operating_mode", "event", words.mode(modeWord(texts, state.operating_mode)));
  when("override", "event", words.speed(Math.round(state.override * 100)));
  if (state.enabling === EnablingPosition.PANIC) when("enabling", "stop", words.pressedThrough);
  if (old.program_state !== state.program_state || isNewStop(old, state)) told.push(programText(old, state, texts));
  return told;
}

function linkText(state: State, texts: Texts): Told {
  if (state.link === LinkState.UP) return ["event", texts.logWords.controllerUp];
  return ["fault", state.link === LinkState.DOWN ? texts.faultController : texts.faultStale];
}

function emergencyText(state: State, texts: Texts): Told {
  if (state.e_stopped === TriState.TRUE) return ["stop", texts.stoppedController];
  return ["event", texts.logWords.emergencyClear];
}

function errorText(state: State, texts: Texts): Told {
  if (state.in_error === TriState.TRUE) return ["fault", texts.faultError(state.error_code)];
  return ["event", texts.logWords.errorClear];
}

/** Whether a program that stands came to stand in another line, as it does step by step. */
function isNewStop(old: State, state: State): boolean {
  const standing: number[] = [ProgramState.PAUSED, ProgramState.AT_BREAKPOINT, ProgramState.STEPPED];
  return standing.includes(state.program_state) && old.program_line !== state.program_line;
}

function programText(old: State, state: State, texts: Texts): Told {
  const words = texts.logWords;
  const { program_line: line, program_state: now } = state;
  if (now === ProgramState.NONE) return ["motion", words.programEnded];
  if (now === ProgramState.PAUSED) return ["motion", words.programPaused(line)];
  if (now === ProgramState.AT_BREAKPOINT) return ["motion", words.atBreakpoint(line)];
  if (now === ProgramState.STEPPED) return ["motion", words.programStepped(line)];
  return ["motion", old.program_state === ProgramState.NONE ? words.programBegan : words.programGoesOn(line)];
}

function authorityText({ holder, reason, client }: AuthorityChanged, cell: Cell, texts: Texts): string {
  const words = texts.logWords;
  const how = words.reasons[reason] ?? "";
  if (holder === 0) return words.controlFree(how);
  const isGranted = reason === AuthorityReason.GRANTED;
  const who = holder === cell.hello?.session ? words.controlYours : words.controlOf(client || texts.notKnown);
  return isGranted ? `${who}.` : `${who}: ${how}.`;
}

function stopText({ stop, client, reason }: StopChanged, texts: Texts): string {
  if (stop === StopKind.PROTECTIVE) return texts.stoppedServer(reason);
  const who = client || texts.notKnown;
  return stop === StopKind.NONE ? texts.logWords.stopReset(who) : texts.logWords.stopped(who, reason);
}

function documentText({ kind, what, name, from_name, client }: DocumentChanged, texts: Texts): string {
  const words = texts.logWords;
  const document = `${words.documents[kind] ?? words.documents[0]}${name === "" ? "" : ` “${name}”`}`;
  const from = from_name === "" ? "" : ` (${words.before} “${from_name}”)`;
  return `${document} ${words.changes[what] ?? words.changes[2]}${from}${client === "" ? "" : ` · ${client}`}`;
}

function isUnderWay({ activity }: State): boolean {
  return activity === Activity.JOGGING || activity === Activity.MOVING || activity === Activity.STOPPING;
}

function isInProgram({ program_state }: State): boolean {
  return program_state !== ProgramState.NONE;
}

function secondsOf({ time_s, time_ns }: State): number {
  return time_s + time_ns / 1e9;
}
