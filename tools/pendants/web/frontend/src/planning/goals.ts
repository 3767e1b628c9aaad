// Goals of plans: what a person chose, as a request wants it. Pure.
import type { FoundPose, NamedPosition, PlansMakeRequest } from "../protocol.ts";
import type { Pose } from "../kinematics/pose.ts";

export type Way = "ptp" | "lin" | "path" | "free";

export interface Wish {
  way: Way;
  /** A named position; null for the place of the handles. */
  position: NamedPosition | null;
  /** In base. */
  pose: Pose | null;
  /** Of the answers of the inverse kinematics. */
  branch: number | null;
  /** Of the chosen answer; null where it is not known. */
  joints: readonly number[] | null;
  /** Of a path, in its order. */
  stops: readonly (readonly number[])[];
  planner: string;
  seed: number;
}

/** Return the goal of a request; null where nothing was chosen. */
export function goalOf(wish: Wish): PlansMakeRequest["goal"] | null {
  const { way, position, pose, joints, stops } = wish;
  if (way === "path") return stops.length === 0 ? null : { kind: "path", waypoints: stops.map((each) => [...each]) };
  if (position !== null) {
    if (way === "lin") return { kind: "lin", pose: placed(position.pose), frame: "base" };
    if (way === "free") return { kind: "free", joints: [...position.joints], ...drawn(wish) };
    return { kind: "position", name: position.name };
  }
  if (pose === null) return null;
  const to = placed({ position: [...pose.position], orientation: [...pose.quaternion] });
  if (way === "lin") return { kind: "lin", pose: to, frame: "base" };
  if (way === "ptp") return { kind: "ptp", pose: to, frame: "base", branch: wish.branch };
  if (joints !== null) return { kind: "free", joints: [...joints], ...drawn(wish) };
  return { kind: "free", pose: to, frame: "base", ...drawn(wish) };
}

function drawn({ planner, seed }: Wish): { planner?: string; seed: number } {
  return { ...(planner === "" ? {} : { planner }), seed };
}

function placed({ position, orientation }: FoundPose) {
  const [x = 0, y = 0, z = 0] = position;
  const [qx = 0, qy = 0, qz = 0, qw = 1] = orientation;
  return {
    position: [x, y, z] as [number, number, number],
    orientation: [qx, qy, qz, qw] as [number, number, number, number],
  };
}

/** Return the position that is chosen at first: the first legal one where the robot does not stand. */
export function firstGoal(
  positions: readonly NamedPosition[],
  joints: readonly number[] | null,
): NamedPosition | null {
  const isElsewhere = (each: NamedPosition): boolean =>
    joints === null || each.joints.some((value, index) => Math.abs(value - (joints[index] ?? value)) > 0.01);
  return positions.find((each) => each.legal && isElsewhere(each)) ?? null;
}

/** Read a seed as a person types it. */
export function readSeed(typed: string): number | null {
  if (!/^\d{1,10}$/.test(typed.trim())) return null;
  const seed = Number(typed);
  return seed < 2 ** 31 ? seed : null;
}
