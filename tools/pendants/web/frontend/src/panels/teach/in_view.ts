// What teaching adds to the picture of the cell: the points, the path of the dry run, the chosen point.
import { pose } from "../../kinematics/pose.ts";
import type { TeachPoint } from "../../operations.ts";
import { isOf } from "../../teach/findings.ts";
import { pointOf } from "../../teach/program.ts";
import type { Program } from "../../teach/program.ts";
import { EMPTY } from "../../view/view.ts";
import type { Content, FrameMark } from "../../view/view.ts";
import type { Desk } from "./desk.ts";

/** Points that are marked; with more nobody can tell them apart. */
const MOST = 40;

/** Joints closer than this [rad or m] stand at the point. */
const THERE = 2e-3;

interface Told {
  program: Program | null;
  findings: unknown;
  selected: number;
  isThere: boolean;
}

const last = new WeakMap<Desk, Told>();

/** Tell the view, where something changed. */
export function inView(desk: Desk): void {
  const { program, teaching } = desk;
  const now = { program, findings: teaching.findings, selected: teaching.selected, isThere: isThere(desk) };
  const before = last.get(desk);
  const isSame =
    before?.program === now.program &&
    before.findings === now.findings &&
    before.selected === now.selected &&
    before.isThere === now.isThere;
  if (isSame && desk.isInView) return;
  last.set(desk, now);
  desk.isInView = true;
  desk.app.overlay(program === null ? null : content(desk, program));
}

/** Whether the robot stands at the chosen point: then it would only hide behind its own ghost. */
function isThere(desk: Desk): boolean {
  const at = desk.app.cell.value.state?.positions ?? [];
  const chosen = desk.program === null ? null : pointOf(desk.program, desk.teaching.selected);
  return chosen !== null && chosen.joints.every((each, index) => Math.abs(each - (at[index] ?? 0)) < THERE);
}

function content(desk: Desk, program: Program): Partial<Content> {
  const { findings, selected } = desk.teaching;
  const chosen = pointOf(program, selected);
  const dof = desk.app.cell.value.hello?.dof ?? 0;
  const verdict = desk.findingAt(selected)?.mark === "bad" ? "bad" : "good";
  const used = program.points.slice(0, MOST);
  return {
    path: isOf(findings, program) ? findings.path : EMPTY.path,
    frames: used.flatMap(frameMark),
    ghost: chosen === null || isThere(desk) || chosen.joints.length !== dof ? null : { joints: chosen.joints, verdict },
  };
}

function frameMark(point: TeachPoint): FrameMark[] {
  const at = point.pose;
  if (at == null || (at.frame !== "base" && at.frame !== "root")) return [];
  return [{ name: point.name, ...pose(at.position, at.quaternion) }];
}
