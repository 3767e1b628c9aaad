// User frames of a cell, placed in base. Pure.
import { composed, IDENTITY, pose as poseOf } from "../kinematics/pose.ts";
import type { Pose } from "../kinematics/pose.ts";
import type { FrameMark } from "../view/view.ts";

interface Told {
  name: string;
  parent: string;
  xyz: number[];
  quat: number[];
}

/** Return the frames of a file's content whose parents are known; `known` are the robot's own. */
export function frameMarks(
  content: Readonly<Record<string, unknown>>,
  known: Readonly<Record<string, Pose>>,
): FrameMark[] {
  const told = Array.isArray(content["frames"]) ? (content["frames"] as Told[]) : [];
  const places = new Map<string, Pose>(Object.entries({ base: IDENTITY, ...known }));
  const marks: FrameMark[] = [];
  // Parents stand before their children.
  for (const { name, parent, xyz, quat } of told) {
    const from = places.get(parent);
    if (from === undefined) continue;
    const place = composed(from, poseOf(xyz, quat));
    places.set(name, place);
    marks.push({ name, ...place });
  }
  return marks;
}
