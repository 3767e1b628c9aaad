// Frames of a Denavit-Hartenberg table in base, standard convention: Rz(θ) Tz(d) Tx(a) Rx(α) a row.
import type { Chain } from "./chain.ts";
import { aboutAxis, composed, ofRpy, pose, product } from "./pose.ts";
import type { Pose } from "./pose.ts";

export interface DhRow {
  joint: string;
  theta_offset: number;
  d: number;
  a: number;
  alpha: number;
  variable: string;
}

export interface DhTable {
  base: Pose;
  rows: readonly DhRow[];
  tool: Pose;
}

/** Read the table of a robot's facts; null where it has none. */
export function dhTable(facts: Readonly<Record<string, unknown>>): DhTable | null {
  const told = facts["dh"];
  if (typeof told !== "object" || told === null) return null;
  const { base, rows, tool } = told as Record<string, unknown>;
  if (!Array.isArray(rows) || rows.length === 0) return null;
  return { base: placed(base), rows: rows as DhRow[], tool: placed(tool) };
}

function placed(told: unknown): Pose {
  const { xyz = [0, 0, 0], rpy = [0, 0, 0] } = (told ?? {}) as { xyz?: number[]; rpy?: number[] };
  return pose(xyz, ofRpy(rpy));
}

/** Return the frames in base: 0, with joint 1's axis as z, then the end of each row. */
export function dhFrames({ base, rows }: DhTable, chain: Chain, joints: readonly number[]): Pose[] {
  const frames = [composed(chain.root, base)];
  for (const row of rows) {
    const value = movingValue(chain, row.joint, joints);
    const turns = row.variable === "theta";
    const theta = row.theta_offset + (turns ? value : 0);
    const d = row.d + (turns ? 0 : value);
    const about = aboutAxis([0, 0, 1], theta);
    const step = pose(
      [row.a * Math.cos(theta), row.a * Math.sin(theta), d],
      product(about, aboutAxis([1, 0, 0], row.alpha)),
    );
    const last = frames.at(-1);
    if (last !== undefined) frames.push(composed(last, step));
  }
  return frames;
}

/** Return how far a joint of the chain has moved: its own value, and what others turn it by. */
function movingValue({ robot, driven }: Chain, name: string, joints: readonly number[]): number {
  const index = new Map(driven.map((each, at) => [each.name, at]));
  const joint = robot.joints.find((each) => each.name === name);
  if (joint === undefined) return 0;
  const own = joints[index.get(name) ?? -1] ?? 0;
  const others = joint.coupled_to.map(({ joint: other, gain }) => gain * (joints[index.get(other) ?? -1] ?? 0));
  return joint.offset + own + others.reduce((sum, each) => sum + each, 0);
}
