// What the server said of the cell, as one value that everything on the page reads.
import type { RobotDescription } from "../kinematics/chain.ts";
import { pose, unitQuaternion, vector3 } from "../kinematics/pose.ts";
import type { Pose } from "../kinematics/pose.ts";
import { StateField } from "../protocol.ts";
import type {
  AccessWhoamiReply,
  ControllerDescribeReply,
  HelloReply,
  JogRetreatReply,
  ServedCell,
  SnapshotReply,
  State,
  WhyReply,
} from "../protocol.ts";
import { Observable } from "./observable.ts";

/** How far the way to the server is. */
export type LinkStage =
  | "none" /** nothing was asked for */
  | "opening"
  | "lobby" /** a cell has to be chosen */
  | "up"
  | "lost" /** tried again by itself */
  | "ended"; /** the server said no; a person has to do something */

/** A stop as it was announced. */
export interface Stopped {
  client: string;
  reason: string;
  /** Wall clock, for people [ms]; null where it was latched before we came. */
  since: number | null;
}

export interface Cell {
  stage: LinkStage;
  /** Why there is no link, for a person; empty for nothing to say. */
  linkText: string;
  /** When the link is tried again [ms of the page's clock]; null where it is not. */
  retryAt: number | null;
  /** Cells to choose from; null before they are known. */
  cells: readonly ServedCell[] | null;
  server: string;
  hello: HelloReply | null;
  /** Empty where nobody logged in. */
  who: AccessWhoamiReply | null;
  state: State | null;
  /** When it came [ms of the page's clock]. */
  stateAt: number;
  /** When anything came last. */
  heardAt: number;
  /** Counts all that came but states: what asked for it may show more now. */
  answers: number;
  /** Way there and back [ms]; null before it was measured. */
  delay: number | null;
  holderName: string;
  /** Who else asked for the control that we hold; empty for nobody. */
  wantedBy: string;
  stopped: Stopped | null;
  controller: ControllerDescribeReply | null;
  snapshot: SnapshotReply | null;
  robot: RobotDescription | null;
  why: WhyReply | null;
  /** What the robot stood at when it came to rest last, and what leads out. */
  holds: JogRetreatReply["holds"];
  /** From DECLARE [s]: a press that ended is stopped where it still moves then. */
  rampTime: number;
  /** Counts notices of changed documents by kind, so that panels know when to look again. */
  changes: Readonly<Record<number, number>>;
}

export const NO_CELL: Cell = {
  stage: "none",
  linkText: "",
  retryAt: null,
  cells: null,
  server: "",
  hello: null,
  who: null,
  state: null,
  stateAt: 0,
  heardAt: 0,
  answers: 0,
  delay: null,
  holderName: "",
  wantedBy: "",
  stopped: null,
  controller: null,
  snapshot: null,
  robot: null,
  why: null,
  holds: [],
  rampTime: 0,
  changes: {},
};

export type CellModel = Observable<Cell>;

export function cellModel(): CellModel {
  return new Observable(NO_CELL);
}

const CLOCKS: ReadonlySet<string> = new Set(["sequence", "time_s", "time_ns", "age", "dropped"]);

/** Whether a page shows the same of both: of a robot that stands a state comes each 33 ms. */
export function showsTheSame(before: Cell, after: Cell): boolean {
  const { state: old, stateAt, heardAt, ...rest } = before;
  const { state } = after;
  const isFresh = after.stateAt - stateAt < OVERDUE && after.heardAt - heardAt < OVERDUE;
  if (!isFresh || old === null || state === null) return false;
  return areSame(rest, after) && areSame(old, state, CLOCKS);
}

function areSame<Of extends object>(one: Of, other: Of, but: ReadonlySet<string> = new Set()): boolean {
  for (const name of Object.keys(one) as (keyof Of & string)[]) {
    if (!but.has(name) && !isSameValue(one[name], other[name])) return false;
  }
  return true;
}

function isSameValue(one: unknown, other: unknown): boolean {
  if (!Array.isArray(one) || !Array.isArray(other)) return Object.is(one, other);
  return one.length === other.length && one.every((each, index) => Object.is(each, other[index]));
}

/** Whether this page has the motion authority. */
export function isInControl(cell: Cell): boolean {
  return (
    cell.stage === "up" &&
    cell.hello !== null &&
    cell.state !== null &&
    cell.state.holder === cell.hello.session
  );
}

/** Whether the robot is real, or not known to be emulated: what is dear asks twice. */
export function isReal(cell: Cell): boolean {
  return cell.controller !== null && !cell.controller.emulated;
}

/** Where the joints were measured [rad, m for a linear axis]; null where that is not known. */
export function measuredJoints({ state, hello, snapshot }: Cell): number[] | null {
  const count = hello?.dof ?? snapshot?.joints.length;
  if (state === null || count === undefined || (state.valid_fields & StateField.POSITION) === 0) return null;
  return state.positions.slice(0, count);
}

/** The tool's place in base; null where it is not known. */
export function toolPose({ state }: Cell): Pose | null {
  if (state === null || (state.valid_fields & StateField.TOOL) === 0) return null;
  return pose(vector3(state.tool_position), unitQuaternion(state.tool_orientation));
}

/** Frames are overdue after so long [ms]. */
export const OVERDUE = 300;
