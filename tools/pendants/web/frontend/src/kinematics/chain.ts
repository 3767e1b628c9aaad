// Where the links of a robot are, from its description by the server and joint values.
//
// The world here is the robot's base frame, in which STATE gives the tool. A joint's value is its
// own controller-side one, where it is driven, plus its couplings, plus its offset. A platform's
// joints are its legs; its place follows from their lengths.
import type { DrawnJoint, ShapesShowReply } from "../operations.ts";
import { closedLegs, type Leg } from "./platform.ts";
import {
  aboutAxis,
  composed,
  distance,
  IDENTITY,
  inverse,
  ofRpy,
  pose,
  rotated,
  scaled,
  transformed,
  vector3,
  type Pose,
  type Vector3,
} from "./pose.ts";

const SMALLEST = 0.1; // m

/** What `shapes.show` and the facts of `robots.describe` say of a robot. */
export interface RobotDescription extends ShapesShowReply {
  /** pose of its root link in its base frame; none where the two are one */
  rootInBase?: Pose;
}

/** Where a joint is, in base. */
export interface JointPlace {
  name: string;
  /** its number in a joint position; -1 where it has none */
  index: number;
  /** of its child link */
  pose: Pose;
  /** unit vector; null where it has none */
  axis: Vector3 | null;
}

interface Placement {
  parent: string;
  xyz: readonly number[];
  rpy: readonly number[];
}

/** Return the description of a robot, from the two replies of the server. */
export function describedRobot(
  shown: ShapesShowReply,
  facts: Readonly<Record<string, unknown>>,
): RobotDescription {
  const at = basePlacement(facts["base_frame"]);
  const baseInParent = at === null ? IDENTITY : pose(at.xyz, ofRpy(at.rpy));
  let parentInRoot = IDENTITY;
  // A base frame hangs on the root link, or on one that is fixed to it.
  for (const joint of shown.joints) {
    if (at === null || at.parent === joint.parent || joint.type === "floating") break;
    parentInRoot = composed(parentInRoot, pose(joint.xyz, joint.quat));
  }
  return { ...shown, rootInBase: inverse(composed(parentInRoot, baseInParent)) };
}

function basePlacement(told: unknown): Placement | null {
  if (typeof told !== "object" || told === null) return null;
  const { parent, xyz, rpy } = told as Record<string, unknown>;
  if (typeof parent !== "string" || !areNumbers(xyz) || !areNumbers(rpy)) return null;
  return { parent, xyz, rpy };
}

function areNumbers(value: unknown): value is number[] {
  return Array.isArray(value) && value.length === 3 && value.every((each) => Number.isFinite(each));
}

/** Kinematics of one robot. */
export class Chain {
  readonly robot: RobotDescription;
  /** The driven joints, in the order of a joint position. */
  readonly driven: readonly DrawnJoint[];
  readonly toolLink: string;
  /** Pose of the root link in base. */
  readonly root: Pose;
  /** A length of the order of the robot's reach [m]. */
  readonly size: number;
  readonly #index: ReadonlyMap<string, number>;
  readonly #legs: readonly Leg[];
  /** The platform's last place in the root link: the next search starts there. */
  #platform: Pose;

  constructor(robot: RobotDescription) {
    this.robot = robot;
    this.root = robot.rootInBase ?? IDENTITY;
    this.driven = robot.joints.filter((joint) => joint.driven);
    this.toolLink = robot.links.at(-1)?.link ?? "";
    this.#index = new Map(this.driven.map((joint, index) => [joint.name, index]));
    this.#legs = robot.joints.some((joint) => joint.type === "leg")
      ? robot.struts.map(({ first, second }) => ({ base: vector3(first), top: vector3(second) }))
      : [];
    this.#platform = this.#platformAtHome();
    this.size = this.#sizeOf();
  }

  /** Return the poses of all links in base; home where no joint values are known. */
  linkPoses(joints: readonly number[] | null): Map<string, Pose> {
    const values = this.#fitting(joints);
    const root = this.root;
    const places = new Map<string, Pose>([[this.robot.links[0]?.link ?? "", root]]);
    for (const joint of this.robot.joints) {
      if (joint.type === "leg") continue;
      if (joint.type === "floating") {
        places.set(joint.child, composed(root, this.#platformAt(values)));
        continue;
      }
      const parent = places.get(joint.parent) ?? root;
      places.set(joint.child, composed(parent, this.#moved(joint, values)));
    }
    return places;
  }

  /** Return the pose of the robot's tool link in base, without a tool on it. */
  flange(joints: readonly number[] | null): Pose {
    return this.linkPoses(joints).get(this.toolLink) ?? this.root;
  }

  /** Return where the joints of the chain are, root to tool, the fixed ones left out. */
  jointPlaces(places: ReadonlyMap<string, Pose>): JointPlace[] {
    return this.robot.joints
      .filter(({ type }) => type === "revolute" || type === "prismatic")
      .map((joint) => {
        const at = places.get(joint.child) ?? IDENTITY;
        const axis = joint.axis === null ? null : rotated(at.quaternion, vector3(joint.axis));
        return { name: joint.name, index: this.#index.get(joint.name) ?? -1, pose: at, axis };
      });
  }

  /** Return the joint values, or those of home where they do not fit this robot. */
  #fitting(joints: readonly number[] | null): readonly number[] {
    const fits = joints !== null && joints.length === this.driven.length;
    return fits && joints.every((each) => Number.isFinite(each)) ? joints : this.robot.home;
  }

  #moved(joint: DrawnJoint, values: readonly number[]): Pose {
    const origin = pose(joint.xyz, joint.quat);
    if (joint.axis === null) return origin;
    const own = this.#index.get(joint.name);
    let value = joint.offset + (own === undefined ? 0 : (values[own] ?? 0));
    for (const { joint: other, gain } of joint.coupled_to) {
      value += gain * (values[this.#index.get(other) ?? -1] ?? 0);
    }
    const axis = vector3(joint.axis);
    const motion: Pose =
      joint.type === "prismatic"
        ? { position: scaled(axis, value), quaternion: IDENTITY.quaternion }
        : { position: IDENTITY.position, quaternion: aboutAxis(axis, value) };
    return composed(origin, motion);
  }

  #sizeOf(): number {
    const reach = this.robot.joints
      .filter((joint) => joint.type !== "leg")
      .reduce((sum, joint) => sum + Math.hypot(...joint.xyz), 0);
    const places = this.linkPoses(null);
    const away = this.robot.shapes.map(({ link, xyz, size }) => {
      const middle = transformed(places.get(link) ?? this.root, vector3(xyz));
      return distance(middle, this.root.position) + Math.hypot(...size) / 2;
    });
    // A platform is as wide as it is high, where an arm is tall.
    const wide = this.#legs.length > 0 ? 1.6 : 1;
    return Math.max(SMALLEST, reach, ...away) * wide;
  }

  #platformAtHome(): Pose {
    const floating = this.robot.joints.find((joint) => joint.type === "floating");
    return floating === undefined ? IDENTITY : pose(floating.xyz, floating.quat);
  }

  #platformAt(lengths: readonly number[]): Pose {
    // From where it last was, then from home: a platform that jumped is found all the same.
    const found =
      closedLegs(this.#legs, lengths, this.#platform) ??
      closedLegs(this.#legs, lengths, this.#platformAtHome());
    if (found !== null) this.#platform = found;
    return found ?? this.#platform;
  }
}
