// What is missing until the robot moves, in the order in which a person can act.
//
// It states only what the server said: its state messages, and its answer to `why`.
import {
  EnablingPosition,
  LinkState,
  OperatingMode,
  StopKind,
  TriState,
} from "../protocol.ts";
import type { ConditionReport, JogRetreatReply } from "../protocol.ts";
import { isInControl } from "./cell.ts";
import type { Cell } from "./cell.ts";
import { outside } from "./states.ts";

export type LineName =
  | "connected"
  | "prepare"
  | "control"
  | "mode"
  | "enabling"
  | "stop"
  | "limits"
  | "other"
  | "key";

export interface Line {
  name: LineName;
  /** Null for the last one, which is the jog itself. */
  done: boolean | null;
  /** What the server said of it; null for nothing. */
  report: ConditionReport | null;
}

const MANUAL: number[] = [
  OperatingMode.MANUAL_REDUCED,
  OperatingMode.MANUAL_HIGH,
  OperatingMode.RECOVERY,
];

/** Conditions of `why` that have no line of their own. */
const OTHERS = ["controller", "override", "scene", "program", "standing", "role", "feedback"];

/** Whether the mode is one in which people jog. */
export function isManual(cell: Cell): boolean {
  return cell.state !== null && MANUAL.includes(cell.state.operating_mode);
}

/** Whether the controller was prepared to be moved; null where it needs no such thing. */
function isPrepared(cell: Cell): boolean | null {
  const prepared = cell.controller?.prepared ?? "not needed";
  return prepared === "not needed" ? null : prepared === "yes";
}

/** Return the keys that lead out of what keeps the robot from its other ways, the best first. */
export function waysOut(cell: Cell): JogRetreatReply["holds"][number]["ways"] {
  const isFree = outside(cell).length === 0;
  const holds = cell.holds.filter((each) => !isFree || each.reason !== "joint-limit");
  return holds.flatMap((each) => each.ways.slice(0, 1));
}

/** Return the lines for a jog. */
export function checklist(cell: Cell): Line[] {
  const { state } = cell;
  const broken = (name: string): ConditionReport | null =>
    cell.why?.conditions.find((each) => each.condition === name && !each.holds) ?? null;
  const other = OTHERS.map(broken).find((each) => each !== null) ?? null;
  const lines: Line[] = [
    {
      name: "connected",
      done: cell.stage === "up" && state?.link === LinkState.UP,
      report: broken("link"),
    },
    { name: "control", done: isInControl(cell), report: broken("authority") },
    { name: "mode", done: isManual(cell), report: broken("mode") },
    {
      name: "enabling",
      done: state?.enabling === EnablingPosition.HELD && isInControl(cell),
      report: broken("enabling"),
    },
    {
      name: "stop",
      done: state !== null && state.stop === StopKind.NONE && state.e_stopped !== TriState.TRUE,
      report: broken("stop"),
    },
  ];
  if (isPrepared(cell) === false) {
    lines.splice(1, 0, { name: "prepare", done: false, report: broken("controller") });
  }
  if (outside(cell).length > 0 || waysOut(cell).length > 0) {
    lines.push({ name: "limits", done: false, report: broken("limits") });
  }
  if (other !== null) lines.push({ name: "other", done: false, report: other });
  lines.push({ name: "key", done: null, report: null });
  return lines;
}

/** Return the line that is to be mended next. */
export function nextLine(lines: readonly Line[]): Line | undefined {
  return lines.find((each) => each.done !== true);
}
