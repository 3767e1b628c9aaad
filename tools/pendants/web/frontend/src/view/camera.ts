// A camera that goes round a point: how it is turned, and where points of the world come to be in
// a picture. Pure; the z axis of the world stays upright.
import {
  added,
  cross,
  difference,
  dot,
  scaled,
  type Vector3,
} from "../kinematics/pose.ts";
import type { Side } from "./view.ts";

export interface Orbit {
  readonly target: Vector3;
  /** from x towards y [rad] */
  readonly azimuth: number;
  /** above the horizon [rad] */
  readonly elevation: number;
  /** from the target [m] */
  readonly distance: number;
}

/** Vertical angle of the picture [rad]. */
export const FIELD_OF_VIEW = (38 * Math.PI) / 180;

const STEEPEST = Math.PI / 2 - 0.01;
const NEAREST = 0.05; // of the robot's size
const FARTHEST = 20;

const SIDES: Readonly<Record<Side, readonly [azimuth: number, elevation: number]>> = {
  iso: [(-52 * Math.PI) / 180, (22 * Math.PI) / 180],
  top: [-Math.PI / 2, STEEPEST],
  front: [0, 0.02],
};

/** Return the orbit that sees a robot of this size from a side. */
export function lookingFrom(side: Side, size: number): Orbit {
  const [azimuth, elevation] = SIDES[side];
  return { target: [0, 0, 0.33 * size], azimuth, elevation, distance: 1.75 * size };
}

/** Return the orbit after a drag by points of a picture of this height. */
export function orbited(orbit: Orbit, right: number, down: number, height: number): Orbit {
  const turn = Math.PI / Math.max(1, height);
  const elevation = orbit.elevation + down * turn;
  return {
    ...orbit,
    azimuth: orbit.azimuth - right * turn,
    elevation: Math.min(STEEPEST, Math.max(-STEEPEST, elevation)),
  };
}

/** Return the orbit nearer by a factor below 1, or farther. */
export function zoomed(orbit: Orbit, factor: number, size: number): Orbit {
  const distance = Math.min(FARTHEST * size, Math.max(NEAREST * size, orbit.distance * factor));
  return { ...orbit, distance };
}

/** Return the orbit with its target moved along the picture, as if the world were dragged. */
export function shifted(orbit: Orbit, right: number, down: number, height: number): Orbit {
  const [x, y] = axesOf(orbit);
  const perPoint = (2 * orbit.distance * Math.tan(FIELD_OF_VIEW / 2)) / Math.max(1, height);
  const move = added(scaled(x, -right * perPoint), scaled(y, down * perPoint));
  return { ...orbit, target: added(orbit.target, move) };
}

/** Return where the camera is. */
export function eyeOf(orbit: Orbit): Vector3 {
  return added(orbit.target, scaled(axesOf(orbit)[2], orbit.distance));
}

/** Return the unit vectors right, up and towards the camera. */
function axesOf({ azimuth, elevation }: Orbit): [Vector3, Vector3, Vector3] {
  const [ca, sa] = [Math.cos(azimuth), Math.sin(azimuth)];
  const [ce, se] = [Math.cos(elevation), Math.sin(elevation)];
  const towards: Vector3 = [ce * ca, ce * sa, se];
  const right: Vector3 = [-sa, ca, 0];
  return [right, cross(towards, right), towards];
}

/** Return by what a picture that is higher than wide is drawn smaller, so that the robot is not cut. */
export function zoomOf(width: number, height: number): number {
  return Math.min(1, (1.2 * width) / height);
}

/** A point of the picture, from its top left corner, and how far it is before the camera [m]. */
export interface Projected {
  x: number;
  y: number;
  depth: number;
}

/** Where points come to be in a picture of one size; points behind the camera have depth ≤ 0. */
export class Projection {
  readonly #orbit: Orbit;
  readonly #axes: readonly [Vector3, Vector3, Vector3];
  readonly #focal: number;
  readonly #middle: readonly [number, number];
  /** Nearest depth that is drawn [m]. */
  readonly near: number;

  constructor(orbit: Orbit, width: number, height: number) {
    this.#orbit = orbit;
    this.#axes = axesOf(orbit);
    this.#focal = (zoomOf(width, height) * height) / 2 / Math.tan(FIELD_OF_VIEW / 2);
    this.#middle = [width / 2, height / 2];
    this.near = 0.02 * orbit.distance;
  }

  at(point: Vector3): Projected {
    const from = difference(point, this.#orbit.target);
    const [right, up, towards] = this.#axes;
    const depth = this.#orbit.distance - dot(from, towards);
    const scale = this.#focal / Math.max(depth, this.near);
    return {
      x: this.#middle[0] + dot(from, right) * scale,
      y: this.#middle[1] - dot(from, up) * scale,
      depth,
    };
  }

  /** Return how many points of the picture a length [m] has at a depth. */
  length(metres: number, depth: number): number {
    return (metres * this.#focal) / Math.max(depth, this.near);
  }

  /** Return both ends of a line with what is behind the camera cut off; null where all of it is. */
  line(from: Vector3, to: Vector3): [Projected, Projected] | null {
    const [first, second] = [this.at(from), this.at(to)];
    if (first.depth < this.near && second.depth < this.near) return null;
    if (first.depth >= this.near && second.depth >= this.near) return [first, second];
    const share = (this.near - first.depth) / (second.depth - first.depth);
    const cut = this.at(added(from, scaled(difference(to, from), share)));
    return first.depth < this.near ? [cut, second] : [first, cut];
  }
}
