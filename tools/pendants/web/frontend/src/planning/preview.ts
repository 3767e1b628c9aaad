// A plan as the page knows it: made, looked at, executed, or no longer what would be driven.
// Pure: time is an argument [ms].
import { NoticeKind, PlanStage, PlanState } from "../protocol.ts";
import type { PlanChanged, PlansMakeReply } from "../protocol.ts";
import type { Refusal } from "../wire/errors.ts";

export type Stage = "none" | "planning" | "refused" | "ready" | "running" | "done" | "stale";

/** What made a plan stale, as far as the page can tell without reading a sentence. */
export type Cause = "expired" | "dropped" | "scene" | "tools" | "frames" | "moved" | "link" | "other";

/** Nearer than that is told in amber [m]. */
export const NEAR = 0.02;
/** Joints that moved farther make a plan stale [rad or m]. */
const MOVED = 1e-3;

export interface Preview {
  stage: Stage;
  plan: PlansMakeReply | null;
  /** When it is kept no longer [ms]. */
  until: number;
  /** When its execution began [ms]. */
  startedAt: number;
  refusal: Refusal | null;
  cause: Cause | null;
  /** Words of the server about why. */
  why: string;
  progress: { stage: number; fraction: number };
}

export const NO_PREVIEW: Preview = {
  stage: "none",
  plan: null,
  until: 0,
  startedAt: 0,
  refusal: null,
  cause: null,
  why: "",
  progress: { stage: PlanStage.NONE, fraction: 0 },
};

export function begun(): Preview {
  return { ...NO_PREVIEW, stage: "planning" };
}

export function made(plan: PlansMakeReply, now: number): Preview {
  return { ...NO_PREVIEW, stage: "ready", plan, until: now + plan.expires_in * 1000 };
}

export function refused(refusal: Refusal): Preview {
  return { ...NO_PREVIEW, stage: "refused", refusal };
}

/** The link ended, and the plan with its connection. */
export function linkLost(preview: Preview): Preview {
  const isLive = ["planning", "ready", "running"].includes(preview.stage);
  return isLive ? { ...preview, stage: preview.plan === null ? "none" : "stale", cause: "link" } : preview;
}

/** Take what was told of a plan; `changes` counts what others changed since it was made. */
export function changed(preview: Preview, told: PlanChanged, around: Around, now: number): Preview {
  if (preview.stage === "planning" && told.state === PlanState.PLANNING) {
    return { ...preview, progress: { stage: told.stage, fraction: told.fraction } };
  }
  if (preview.plan?.plan !== told.plan) return preview;
  switch (told.state) {
    case PlanState.RUNNING:
      return { ...preview, stage: "running", startedAt: now };
    case PlanState.DONE:
      return { ...preview, stage: "done", why: told.code === 0 ? "" : told.text };
    case PlanState.EXPIRED:
      return { ...preview, stage: "stale", cause: "expired", why: told.text };
    case PlanState.DROPPED:
      return { ...preview, stage: "stale", cause: "dropped", why: told.text };
    case PlanState.STALE:
      return { ...preview, stage: "stale", cause: causeOf(preview.plan, around), why: told.text };
  }
  return preview;
}

/** What the page knows of the cell when a plan ends. */
export interface Around {
  joints: readonly number[] | null;
  /** Kinds of documents that were changed since the plan was made. */
  changed: readonly number[];
}

function causeOf(plan: PlansMakeReply, { joints, changed: kinds }: Around): Cause {
  if (kinds.includes(NoticeKind.SCENE)) return "scene";
  if (kinds.includes(NoticeKind.TOOLS)) return "tools";
  if (kinds.includes(NoticeKind.FRAMES)) return "frames";
  const isAway = joints !== null && plan.start.some((each, index) => Math.abs(each - (joints[index] ?? each)) > MOVED);
  return isAway ? "moved" : "other";
}

/** Return for how long a plan is still kept [s]; 0 where it is not. */
export function left(preview: Preview, now: number): number {
  return preview.stage === "ready" ? Math.max(0, (preview.until - now) / 1000) : 0;
}

/** Return a duration as a clock has it. */
export function clock(seconds: number): string {
  const whole = Math.ceil(seconds);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}

export interface Moment {
  kind: "nearest" | "fastest";
  /** In the plan [s]. */
  at: number;
}

/** Return the moments that a slider marks. */
export function moments({ clearance, certificate }: PlansMakeReply): Moment[] {
  const found: Moment[] = [];
  if (clearance !== null) found.push({ kind: "nearest", at: clearance.at });
  const fastest = worstOf(certificate.worst, "velocity");
  if (fastest !== null) found.push({ kind: "fastest", at: fastest.at });
  return found;
}

export function worstOf<T extends { quantity: string; ratio: number }>(
  worst: readonly T[],
  quantity: string,
): T | null {
  const of = worst.filter((each) => each.quantity === quantity);
  return of.reduce<T | null>((most, each) => (most === null || each.ratio > most.ratio ? each : most), null);
}

/** One row of the verdict. */
export interface Row {
  kind: "touch" | "points" | "velocity" | "acceleration" | "limits" | "duration";
  tone: "good" | "remark";
  joint: string;
  object: string;
  value: number;
  at: number;
}

/** Return the rows beneath the verdict of a plan that can run. */
export function rowsOf(plan: PlansMakeReply): Row[] {
  const { clearance, certificate, samples, duration } = plan;
  const none = { tone: "good", joint: "", object: "", value: 0, at: 0 } as const;
  const rows: Row[] = [];
  if (clearance === null) rows.push({ ...none, kind: "touch", value: Number.POSITIVE_INFINITY });
  else {
    const tone = clearance.distance < NEAR ? "remark" : "good";
    const object = `${clearance.first}, ${clearance.second}`;
    rows.push({ ...none, kind: "touch", tone, object, value: clearance.distance, at: clearance.at });
  }
  rows.push({ ...none, kind: "points", value: samples });
  for (const quantity of ["velocity", "acceleration"] as const) {
    const worst = worstOf(certificate.worst, quantity);
    if (worst !== null) rows.push({ ...none, kind: quantity, joint: worst.joint, value: worst.ratio, at: worst.at });
  }
  rows.push({ ...none, kind: "limits", value: certificate.margin });
  rows.push({ ...none, kind: "duration", value: duration });
  return rows;
}
