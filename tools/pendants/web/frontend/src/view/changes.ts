// What is the same in two contents, so that nothing is drawn for nothing; and whose joint a link is.
import type { Chain } from "../kinematics/chain.ts";
import { distance, type Pose } from "../kinematics/pose.ts";
import type { Content, Ghost, Gizmo } from "./view.ts";

/** Whether a picture of the two would be the same. */
export function isSame(one: Content, other: Content): boolean {
  return (
    one.robot === other.robot &&
    one.meshes === other.meshes &&
    areSameNumbers(one.joints, other.joints) &&
    one.stale === other.stale &&
    isSameGhost(one.ghost, other.ghost) &&
    areSameNumbers(one.driven, other.driven) &&
    one.trace === other.trace &&
    one.path === other.path &&
    one.frames === other.frames &&
    one.objects === other.objects &&
    one.gizmo === other.gizmo &&
    one.theme === other.theme
  );
}

/** Whether what a task adds to a view is the same as before. */
export function isSameOverlay(one: Partial<Content>, other: Partial<Content>): boolean {
  const { ghost: oldGhost = null, gizmo: oldGizmo = null, ...old } = one;
  const { ghost = null, gizmo = null, ...rest } = other;
  if (!isSameGhost(oldGhost, ghost) || !isSameGizmo(oldGizmo, gizmo)) return false;
  const names = [...Object.keys(old), ...Object.keys(rest)] as (keyof typeof rest)[];
  return names.every((name) => old[name] === rest[name]);
}

function isSameGizmo(one: Gizmo | null, other: Gizmo | null): boolean {
  if (one === null || other === null) return one === other;
  return (
    one.object === other.object &&
    one.drags === other.drags &&
    one.snap === other.snap &&
    areSameNumbers(one.pose.position, other.pose.position) &&
    areSameNumbers(one.pose.quaternion, other.pose.quaternion)
  );
}

export function isSameGhost(one: Ghost | null, other: Ghost | null): boolean {
  if (one === null || other === null) return one === other;
  return one.verdict === other.verdict && areSameNumbers(one.joints, other.joints);
}

export function areSameNumbers(
  one: readonly number[] | null,
  other: readonly number[] | null,
): boolean {
  if (one === null || other === null) return one === other;
  return one.length === other.length && one.every((each, index) => Object.is(each, other[index]));
}

/** Return the number of the driven joint right above a link; -1 where there is none. */
export function linkJoint(chain: Chain, link: string): number {
  return chain.driven.findIndex((joint) => joint.child === link && joint.type !== "leg");
}

const AS_NEAR = 1e-4; // m, and of a quaternion

/** Return the links that are at one place in both: a ghost there would only paint the robot blue. */
export function linksInPlace(
  one: ReadonlyMap<string, Pose>,
  other: ReadonlyMap<string, Pose>,
): Set<string> {
  const same = new Set<string>();
  for (const [link, at] of one) {
    const there = other.get(link);
    if (there !== undefined && areNear(at, there)) same.add(link);
  }
  return same;
}

function areNear(one: Pose, other: Pose): boolean {
  if (distance(one.position, other.position) > AS_NEAR) return false;
  const cosine = one.quaternion.reduce((sum, each, i) => sum + each * (other.quaternion[i] ?? 0), 0);
  return Math.abs(cosine) > 1 - AS_NEAR * AS_NEAR;
}
