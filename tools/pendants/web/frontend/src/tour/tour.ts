// The moves of a tour: single joints, a straight line of the tool, a taught path.
//
// It knows a robot only by what the server tells and refuses: of the lines and circles on its list
// it runs the first that the robot can do, from where it stands or with the arm bent, and says what
// it leaves out. Times and requests are the pendant's.
import { Motion, VerdictCode } from "../protocol.ts";
import type { Message, Outcome } from "../protocol.ts";
import { Refused } from "../wire/errors.ts";
import type { Refusal } from "../wire/errors.ts";
import type { RequestDraft } from "../wire/link.ts";

/** Part of the joints' largest speed. */
export const SPEED = 0.3;
const SLOTS = 10;
const TAUGHT = 8;
/** Distance of a single joint's move [rad, m]. */
const STEPS: Readonly<Record<string, number>> = { rad: (12 * Math.PI) / 180, m: 0.05 };
/** Part of a narrow joint's range that a single move takes at most. */
const LEAST_ROOM = 0.4;
/** Parts of the room by which all joints but the first bend an arm that may be stretched out. */
const BENDS = [0.15, 0.3];
const LENGTHS = [0.08, 0.03];
const RADII = [0.05, 0.02];

type Three = readonly [number, number, number];

const [DOWN, UP, FORTH, BACK, LEFT, RIGHT]: readonly Three[] = [[0, 0, -1], [0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]] as const;
const LINES: readonly Three[] = [DOWN, UP, LEFT, BACK, FORTH, RIGHT] as readonly Three[];
const CIRCLES = [[UP, LEFT], [UP, FORTH], [FORTH, LEFT], [BACK, LEFT]] as readonly (readonly [Three, Three])[];

/** Refusals that speak of this robot's geometry, so that another move may do. */
const CANNOT: readonly number[] = [
  VerdictCode.UNREACHABLE,
  VerdictCode.BRANCH_CHANGE,
  VerdictCode.OUT_OF_RANGE,
  VerdictCode.NOT_TIMEABLE,
  VerdictCode.START_IN_COLLISION,
  VerdictCode.GOAL_IN_COLLISION,
  VerdictCode.PATH_IN_COLLISION,
];

export interface TourJoint {
  name: string;
  lower: number;
  upper: number;
  unit: string;
}

export interface ToolPlace {
  position: readonly number[];
  orientation: readonly number[];
}

/** What a tour asks of the page. */
export interface TouringPendant {
  joints(): readonly number[];
  tool(): ToolPlace;
  move(draft: RequestDraft): Promise<{ ended: Promise<Message> }>;
  /** End the motion that is under way. */
  endMotion(): void;
}

export type StepKind = "joint" | "back" | "line" | "lineBack" | "bend" | "poses" | "positions";

/** What the tour does, or has done. */
export interface Step {
  kind: StepKind;
  /** Of the joint. */
  name: string;
  /** Of the points of a path. */
  count: number;
  /** How long it took [s]; null while it is under way. */
  took: number | null;
}

export type LeftOut = { kind: "joint"; name: string } | { kind: "line" | "circle" | "path"; name: "" };

/** A motion did not come to its end. */
export class Ended extends Error {
  /** Null where whoever watches ended the tour. */
  readonly refusal: Refusal | null;

  constructor(refusal: Refusal | null) {
    super("the tour was ended");
    this.refusal = refusal;
  }
}

export class Tour {
  readonly steps: Step[] = [];
  readonly leftOut: LeftOut[] = [];
  #pendant: TouringPendant;
  #joints: readonly TourJoint[];
  #changed: () => void;
  #isEnded = false;

  constructor(pendant: TouringPendant, joints: readonly TourJoint[], changed: () => void) {
    this.#pendant = pendant;
    this.#joints = joints;
    this.#changed = changed;
  }

  /** Run the whole tour; throws what was refused for another reason than the robot's geometry. */
  async run(): Promise<void> {
    const home = [...this.#pendant.joints()];
    const steps = await this.#singleJoints(home);
    if (await this.#toolMoves(home)) return;
    this.#leave({ kind: "line", name: "" });
    await this.#positions(home, steps);
  }

  /** End it: the motion that is under way, and all that would come. */
  end(): void {
    this.#isEnded = true;
    this.#pendant.endMotion();
  }

  /** Move each joint away, then all back; return the steps that were possible. */
  async #singleJoints(home: readonly number[]): Promise<number[]> {
    const steps = home.map(() => 0);
    for (const [index, joint] of this.#joints.entries()) {
      for (const step of stepsOf(joint, home[index] ?? 0)) {
        const target = home.map((at, each) => (each === index ? at + step : at));
        if (!(await this.#can("joint", jointMove(target), joint.name))) continue;
        steps[index] = step;
        break;
      }
      if (steps[index] === 0) this.#leave({ kind: "joint", name: joint.name });
    }
    if (steps.some((each) => each !== 0)) await this.#do("back", jointMove(home));
    return steps;
  }

  /** Run a line and a taught path from home, or else with the arm bent. */
  async #toolMoves(home: readonly number[]): Promise<boolean> {
    let isBent = false;
    for (const stance of [home, ...bent(this.#joints, home)]) {
      if (stance !== home && !(await this.#can("bend", jointMove(stance)))) continue;
      isBent = stance !== home;
      const start = this.#pendant.tool();
      const goal = await this.#line(start);
      if (goal === null) continue;
      await this.#poses(start, goal);
      return true;
    }
    if (isBent) await this.#do("back", jointMove(home));
    return false;
  }

  /** Move the tool along the first line that the robot can do, and back; return its end. */
  async #line(start: ToolPlace): Promise<ToolPlace | null> {
    for (const length of LENGTHS) {
      for (const direction of LINES) {
        const goal = shifted(start, direction, length);
        if (!(await this.#can("line", poseMove(goal)))) continue;
        await this.#do("lineBack", poseMove(start));
        return goal;
      }
    }
    return null;
  }

  /** Run through poses without stopping: on the first circle that can be done, else along the line. */
  async #poses(start: ToolPlace, lineEnd: ToolPlace): Promise<void> {
    for (const radius of RADII) {
      for (const [first, second] of CIRCLES) {
        const poses = circle(start, first, second, radius);
        if (await this.#can("poses", posePath(poses), "", poses.length)) return;
      }
    }
    this.#leave({ kind: "circle", name: "" });
    await this.#do("poses", posePath([lineEnd, start]), 2);
  }

  /** Run through joint positions near home, within the single moves that were possible. */
  async #positions(home: readonly number[], steps: readonly number[]): Promise<void> {
    if (steps.every((each) => each === 0)) {
      this.#leave({ kind: "path", name: "" });
      return;
    }
    const waypoints = turns().map((phase) => ({
      joints: padded(home.map((at, index) => at + ((steps[index] ?? 0) * (1 - Math.cos(phase * (1 + (index % 2))))) / 2)),
    }));
    await this.#do("positions", { type: "joint_path", speed: SPEED, joint_count: home.length, waypoints }, TAUGHT);
  }

  /** Run a motion unless the robot's geometry forbids it; return whether it was run. */
  async #can(kind: StepKind, draft: RequestDraft, name = "", count = 0): Promise<boolean> {
    try {
      await this.#run({ kind, name, count, took: null }, draft);
      return true;
    } catch (error) {
      const isGeometry = error instanceof Refused && CANNOT.includes(error.refusal.code);
      if (!isGeometry) throw error;
      return false;
    }
  }

  /** Run a motion that has to be possible. */
  async #do(kind: StepKind, draft: RequestDraft, count = 0): Promise<void> {
    await this.#run({ kind, name: "", count, took: null }, draft);
  }

  async #run(step: Step, draft: RequestDraft): Promise<void> {
    this.#mayGoOn();
    this.steps.push(step);
    this.#changed();
    const { ended } = await this.#begun(draft);
    if (this.#isEnded) this.#pendant.endMotion();
    try {
      step.took = ((await ended) as Outcome).motion_time;
    } catch (error) {
      // What ends a motion on its way says nothing of what the robot can do.
      throw error instanceof Refused ? new Ended(this.#isEnded ? null : error.refusal) : error;
    } finally {
      this.#changed();
    }
    this.#mayGoOn();
  }

  /** Ask for the motion of the newest step; refused, it is none. */
  async #begun(draft: RequestDraft): Promise<{ ended: Promise<Message> }> {
    try {
      return await this.#pendant.move(draft);
    } catch (error) {
      this.steps.pop();
      this.#changed();
      throw error;
    }
  }

  #mayGoOn(): void {
    if (this.#isEnded) throw new Ended(null);
  }

  #leave(what: LeftOut): void {
    this.leftOut.push(what);
    this.#changed();
  }
}

function padded(joints: readonly number[]): number[] {
  return [...joints, ...new Array<number>(Math.max(0, SLOTS - joints.length)).fill(0)];
}

function jointMove(joints: readonly number[]): RequestDraft {
  return { type: "joint_move", speed: SPEED, joint_count: joints.length, joints: padded(joints) };
}

function poseMove({ position, orientation }: ToolPlace): RequestDraft {
  return { type: "pose_move", motion: Motion.LIN, speed: SPEED, frame: "base", position: [...position], orientation: [...orientation] };
}

function posePath(places: readonly ToolPlace[]): RequestDraft {
  const waypoints = places.map(({ position, orientation }) => ({ position: [...position], orientation: [...orientation] }));
  return { type: "pose_path", motion: Motion.PTP, speed: SPEED, frame: "base", waypoints };
}

function turns(): number[] {
  return Array.from({ length: TAUGHT }, (_, index) => (2 * Math.PI * (index + 1)) / TAUGHT);
}

/** Return places on a circle that passes a place and comes back to it. */
export function circle(start: ToolPlace, first: Three, second: Three, radius: number): ToolPlace[] {
  return turns().map((angle) => {
    const out = shifted(start, first, radius * (Math.cos(angle) - 1));
    return shifted(out, second, radius * Math.sin(angle));
  });
}

/** Return how far to move a joint from home: up if there is room, then down. */
function stepsOf({ unit, lower, upper }: TourJoint, home: number): number[] {
  const size = Math.min(STEPS[unit] ?? 0, LEAST_ROOM * (upper - lower));
  return [upper - home >= size ? size : 0, home - lower >= size ? -size : 0].filter((each) => each !== 0);
}

/** Return joint positions with the arm bent: all joints but the first, by little. */
function bent(joints: readonly TourJoint[], home: readonly number[]): number[][] {
  return BENDS.map((bend) =>
    home.map((at, index) => {
      const joint = joints[index];
      if (index === 0 || joint === undefined) return at;
      const [above, below] = [joint.upper - at, at - joint.lower];
      return above >= below ? at + bend * above : at - bend * below;
    }),
  );
}

function shifted({ position, orientation }: ToolPlace, direction: Three, distance: number): ToolPlace {
  return { position: position.map((at, index) => at + distance * (direction[index] ?? 0)), orientation };
}
