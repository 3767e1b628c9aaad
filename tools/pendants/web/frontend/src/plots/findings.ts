// What is read off a motion's samples: how near it comes to the limits, and how far what was driven
// is from what was planned. Pure.
import { QUANTITIES, valueAt, type Quantity, type Samples } from "./series.ts";

/** A joint as plots need it. */
export interface PlotJoint {
  name: string;
  unit: "rad" | "m";
  lower: number;
  upper: number;
  /** greatest speed */
  velocity: number;
  acceleration: number;
}

/** Where a motion comes nearest to a limit; a share of 1 is at it. */
export interface Worst {
  quantity: Quantity;
  joint: number;
  time: number;
  share: number;
}

/** Return the ends of a joint's range of a quantity. */
export function limitsOf(joint: PlotJoint, quantity: Quantity): readonly [number, number] {
  if (quantity === "positions") return [joint.lower, joint.upper];
  const most = quantity === "velocities" ? joint.velocity : joint.acceleration;
  return [-most, most];
}

/** Return the worst share of a limit of each quantity, over all joints. */
export function worstShares(samples: Samples, joints: readonly PlotJoint[]): Worst[] {
  return QUANTITIES.flatMap((quantity) => {
    let worst: Worst | null = null;
    joints.forEach((joint, index) => {
      const [low, high] = limitsOf(joint, quantity);
      const [middle, half] = [(low + high) / 2, (high - low) / 2];
      if (!(half > 0) || !Number.isFinite(half)) return;
      (samples[quantity][index] ?? []).forEach((value, at) => {
        const share = Math.abs(value - middle) / half;
        if (share <= (worst?.share ?? -1)) return;
        worst = { quantity, joint: index, time: samples.times[at] ?? 0, share };
      });
    });
    return worst === null ? [] : [worst];
  });
}

export interface Difference {
  joint: number;
  time: number;
  /** driven less planned [rad or m] */
  value: number;
}

/** Return where the driven positions are farthest from the planned ones; null where none meet. */
export function largestDifference(planned: Samples, driven: Samples): Difference | null {
  let largest: Difference | null = null;
  driven.times.forEach((time, at) => {
    driven.positions.forEach((column, joint) => {
      const wanted = valueAt(planned, planned.positions[joint] ?? new Float32Array(), time);
      if (wanted === null) return;
      const value = column[at]! - wanted;
      if (Math.abs(value) > Math.abs(largest?.value ?? 0)) largest = { joint, time, value };
    });
  });
  return largest;
}

const LONGEST_DELAY = 0.3; // s
const DELAY_STEP = 0.002; // s
const FEWEST = 20; // samples that tell of a delay

/** Return how far the controller is behind the plan [s]: where the two fit best; null if unclear. */
export function controllerDelay(planned: Samples, driven: Samples): number | null {
  let best: { delay: number; error: number } | null = null;
  const stride = Math.max(1, Math.floor(driven.times.length / 400));
  for (let delay = 0; delay <= LONGEST_DELAY; delay += DELAY_STEP) {
    let [error, count] = [0, 0];
    for (let at = 0; at < driven.times.length; at += stride) {
      driven.positions.forEach((column, joint) => {
        const wanted = valueAt(planned, planned.positions[joint] ?? new Float32Array(), driven.times[at]! - delay);
        if (wanted === null) return;
        error += (column[at]! - wanted) ** 2;
        count++;
      });
    }
    if (count < FEWEST) continue;
    if (best === null || error / count < best.error) best = { delay, error: error / count };
  }
  return best?.delay ?? null;
}
