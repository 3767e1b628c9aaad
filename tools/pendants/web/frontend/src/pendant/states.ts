// The states of the page: what its banner says, and what may be pressed.
import { Activity, LinkState, ProgramState, StopKind, TriState } from "../protocol.ts";
import { isInControl } from "./cell.ts";
import type { Cell } from "./cell.ts";

export type PageState =
  | "disconnected"
  | "observer"
  | "control"
  | "running"
  | "stopped"
  | "fault";

/** Return the state; what keeps people safe goes before what is only going on. */
export function pageState(cell: Cell): PageState {
  const { state } = cell;
  if (cell.stage !== "up" || state === null) return "disconnected";
  if (state.stop !== StopKind.NONE || state.e_stopped === TriState.TRUE) return "stopped";
  if (isFaulty(cell)) return "fault";
  if (!isInControl(cell)) return "observer";
  return isRunning(cell) ? "running" : "control";
}

/** Whether a motion or a program of somebody is under way, or paused. */
export function isRunning(cell: Cell): boolean {
  const { state } = cell;
  if (state === null) return false;
  const program: number[] = [ProgramState.RUNNING, ProgramState.PAUSED, ProgramState.AT_BREAKPOINT];
  const motion: number[] = [Activity.MOVING, Activity.PAUSED, Activity.PAUSING];
  return program.includes(state.program_state) || motion.includes(state.activity);
}

export function isPaused(cell: Cell): boolean {
  const { state } = cell;
  if (state === null) return false;
  const program: number[] = [ProgramState.PAUSED, ProgramState.AT_BREAKPOINT];
  return state.activity === Activity.PAUSED || program.includes(state.program_state);
}

function isFaulty(cell: Cell): boolean {
  const { state } = cell;
  if (state === null) return false;
  // An error that a controller only remembers keeps it from nothing.
  const isBroken = state.in_error === TriState.TRUE && state.motion_possible !== TriState.TRUE;
  return state.link !== LinkState.UP || isBroken || outside(cell).length > 0;
}

/** Return the numbers of the joints that stand outside their limits. */
export function outside(cell: Cell): number[] {
  const joints = cell.snapshot?.joints ?? [];
  const at = cell.state?.positions ?? [];
  const beyond = 1e-3;
  return joints.flatMap((joint, index) => {
    const value = at[index] ?? 0;
    return value < joint.lower - beyond || value > joint.upper + beyond ? [index] : [];
  });
}
