// The samples of a plan, fetched a chunk at a time, so that a STOP never waits behind them.
import type { Operations } from "../operations.ts";
import { indexAt, plannedSamples, type Samples } from "./series.ts";

/** A plan as it would be driven. */
export interface PlannedMotion {
  plan: number;
  samples: Samples;
  /** x, y, z of the tool in base at each sample [m] */
  path: Float32Array;
}

export type AskSamples = (
  request: Operations["plans.samples"][0],
) => Promise<Operations["plans.samples"][1]>;

const ROWS = 100;
/** Between two chunks [ms]: the server gives 20 a second. */
const BETWEEN = 55;
/** Most samples of a plan: the server makes none longer. */
export const MOST_OF_PLAN = 12_001;

/** Fetch all samples of a plan; rejects where the server refuses, as it does once the plan is old. */
export async function readPlan(
  ask: AskSamples,
  plan: number,
  wait: (duration: number) => Promise<void> = (duration) =>
    new Promise((done) => setTimeout(done, duration)),
  signal?: AbortSignal,
): Promise<PlannedMotion> {
  const rows: number[][] = [];
  const path: number[] = [];
  let columns: readonly string[] = [];
  for (let hasMore = true; hasMore && rows.length < MOST_OF_PLAN; ) {
    signal?.throwIfAborted();
    const told = await ask({
      op: "plans.samples", plan, first: rows.length, count: ROWS, with_tool: true,
    });
    ({ columns } = told);
    rows.push(...told.rows);
    for (const [x = 0, y = 0, z = 0] of told.tool ?? []) path.push(x, y, z);
    hasMore = told.more && told.rows.length > 0;
    if (hasMore) await wait(BETWEEN);
  }
  return { plan, samples: plannedSamples(columns, rows), path: Float32Array.from(path) };
}

/** Return the joints of a plan at a time: its first before it begins, its last at its end. */
export function jointsAt(samples: Samples, time: number): number[] {
  const { times, positions } = samples;
  const at = Math.min(Math.max(0, indexAt(times, time)), Math.max(0, times.length - 2));
  const [from, to] = [times[at] ?? 0, times[at + 1] ?? times[at] ?? 0];
  const share = to > from ? Math.min(1, Math.max(0, (time - from) / (to - from))) : 0;
  return positions.map((column) => {
    const [one, other] = [column[at] ?? 0, column[at + 1] ?? column[at] ?? 0];
    return one + share * (other - one);
  });
}
