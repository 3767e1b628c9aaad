// The rows of the jog panel: joints, or the axes of a frame, with value, limits and units.
import { rollPitchYaw, unitQuaternion } from "../kinematics/pose.ts";
import { StateField } from "../protocol.ts";
import type { Aim } from "./hold.ts";
import type { Cell } from "./cell.ts";

export interface Row {
  name: string;
  /** Rad or m; null where it is not known. */
  value: number | null;
  /** Rad/s or m/s. */
  speed: number | null;
  isAngle: boolean;
  /** Null for the axes of a frame, which have none. */
  limits: readonly [lower: number, upper: number] | null;
}

const AXES = ["X", "Y", "Z", "A", "B", "C"];

/** Return the rows of the joints. */
export function jointRows(cell: Cell): Row[] {
  const { snapshot, state } = cell;
  const isKnown = state !== null && (state.valid_fields & StateField.POSITION) !== 0;
  const moves = state !== null && (state.valid_fields & StateField.VELOCITY) !== 0;
  return (snapshot?.joints ?? []).map((joint, index) => ({
    name: joint.display_name ?? joint.name,
    value: isKnown ? (state.positions[index] ?? null) : null,
    speed: moves ? (state.velocities[index] ?? null) : null,
    isAngle: joint.unit === "rad",
    limits: [joint.lower, joint.upper],
  }));
}

/** Return the rows of a frame; its values are those of the tool in base. */
export function toolRows(cell: Cell): Row[] {
  const values = toolValues(cell);
  return AXES.map((name, index) => ({
    name,
    value: values?.[index] ?? null,
    speed: null,
    isAngle: index > 2,
    limits: null,
  }));
}

/** Return x, y, z [m] and roll, pitch, yaw [rad] of the tool in base; null where not known. */
export function toolValues(cell: Cell): number[] | null {
  const { state } = cell;
  if (state === null || (state.valid_fields & StateField.TOOL) === 0) return null;
  const turned = rollPitchYaw(unitQuaternion(state.tool_orientation));
  return [...state.tool_position.slice(0, 3), ...turned];
}

/** How near to a limit a joint is called so: a tenth of its range. */
export const NEAR = 0.1;

/** Return where in its range a value is, 0 to 1. */
export function fraction(row: Row): number | null {
  if (row.limits === null || row.value === null) return null;
  const [lower, upper] = row.limits;
  return Math.min(1, Math.max(0, (row.value - lower) / (upper - lower)));
}

/** Whether a row is at the end of its range towards a direction. */
export function isAtEnd(row: Row, direction: 1 | -1): boolean {
  if (row.limits === null || row.value === null) return false;
  const [lower, upper] = row.limits;
  return direction > 0 ? row.value >= upper - 1e-4 : row.value <= lower + 1e-4;
}

export function aimOf(axes: "joint" | "base" | "tool" | "user", user: string, dof: number): Aim {
  if (axes === "joint") return { space: "joints", frame: "", count: dof };
  return { space: "tool", frame: axes === "user" ? user : axes, count: 6 };
}

/** Frames that are neither the robot's own nor the tool. */
export function userFrames(cell: Cell): string[] {
  const own = new Set(["base", "root", "tool", "flange"]);
  return (cell.snapshot?.frames ?? []).filter((each) => !own.has(each));
}
