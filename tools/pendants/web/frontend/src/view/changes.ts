// What is the same in two contents, so that nothing is drawn for nothing; and whose joint a link is.
import type { Chain } from "../kinematics/chain.ts";
import type { Content, Ghost } from "./view.ts";

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
