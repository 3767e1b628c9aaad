// What the keys of a run do in each state: run or resume, step, step back, pause, end.
import { Activity, MotionControlAction, ProgramState, RunKind } from "../protocol.ts";
import type { State } from "../protocol.ts";
import type { RequestDraft } from "../wire/link.ts";

export type RunKey = "back" | "run" | "step" | "pause" | "end";

/** Why a key is off; empty where it is on. */
export type Off = "" | "conditions" | "noProgram" | "otherRuns" | "underWay" | "notUnderWay" | "standing";

export interface Situation {
  isInControl: boolean;
  /** Whether a motion may begin. */
  mayMove: boolean;
  state: Pick<State, "program_state" | "activity"> | null;
  /** Whether a program is open that has statements. */
  hasProgram: boolean;
  /** Whether the program under way is the open one. */
  isOpenOne: boolean;
}

export interface Transport {
  /** Whether a program is under way, running or paused. */
  isUnderWay: boolean;
  isPaused: boolean;
  off: Readonly<Record<RunKey, Off>>;
}

const PAUSED: number[] = [ProgramState.PAUSED, ProgramState.AT_BREAKPOINT, ProgramState.STEPPED];
const GOING: number[] = [Activity.MOVING, Activity.PAUSING, Activity.PLANNING];

/** Return which keys of a run are on. */
export function transport(at: Situation): Transport {
  const program = at.state?.program_state ?? ProgramState.NONE;
  const activity = at.state?.activity ?? Activity.IDLE;
  // A program counts as paused while it still brakes; it can go on once it stands.
  const isPaused = PAUSED.includes(program) && !GOING.includes(activity);
  const isUnderWay = program !== ProgramState.NONE;
  const isGoing = program === ProgramState.RUNNING || (GOING.includes(activity) && !PAUSED.includes(program));
  const begin = ((): Off => {
    if (!at.isInControl) return "conditions";
    if (isUnderWay && !isPaused) return "underWay";
    if (isUnderWay && !at.isOpenOne) return "otherRuns";
    if (!at.hasProgram) return "noProgram";
    return at.mayMove ? "" : "conditions";
  })();
  const pause: Off = !at.isInControl ? "conditions" : isGoing && !isPaused ? "" : "standing";
  const end: Off = !at.isInControl ? "conditions" : isGoing || isUnderWay || activity === Activity.PAUSED ? "" : "notUnderWay";
  const back = begin !== "" ? begin : isPaused ? "" : "notUnderWay";
  return { isUnderWay, isPaused, off: { back, run: begin, step: begin, pause, end } };
}

export interface Run {
  program: string;
  revision: number;
  /** Line to begin at; 0 for the first. */
  line: number;
  /** How often; 0 until it is ended. */
  times: number;
}

/** Return the request to run a program, from its beginning or from a line. */
export function runRequest(run: Run): RequestDraft {
  return { type: "program_run", run: RunKind.ALL, line: run.line, loops: run.times, revision: run.revision, speed: 1, program: run.program };
}

/** Return the request of one step. While a program is paused, line 0 goes on where it stands. */
export function stepRequest(run: Run, way: 1 | -1, isPaused: boolean): RequestDraft {
  const kind = way > 0 ? RunKind.STEP_FORWARD : RunKind.STEP_BACKWARD;
  return {
    type: "program_run",
    run: kind,
    line: isPaused ? 0 : run.line,
    loops: isPaused ? run.times : 1,
    // Of a paused run the revision is that of the run, whatever was edited since.
    revision: isPaused ? 0 : run.revision,
    speed: 1,
    program: run.program,
  };
}

export function controlRequest(key: "pause" | "resume" | "end"): RequestDraft {
  const action = { pause: MotionControlAction.PAUSE, resume: MotionControlAction.RESUME, end: MotionControlAction.PROGRAM_STOP }[key];
  return { type: "motion_control", action };
}
