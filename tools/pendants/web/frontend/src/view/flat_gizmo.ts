// Handles of the 2-D view that drag a pose along, or turn it about, one of its own axes. Pure.
import {
  aboutAxis,
  added,
  dot,
  difference,
  product,
  rotated,
  scaled,
  transformed,
  unitQuaternion,
  vector3,
  type Pose,
  type Vector3,
} from "../kinematics/pose.ts";
import { eyeOf, type Orbit, type Projection } from "./camera.ts";
import type { Flat } from "./solids.ts";
import type { Gizmo } from "./view.ts";

export type Axis = 0 | 1 | 2;

const LENGTH = 0.1; // of the camera's distance
const REACH = 12; // points from a handle that still take it
const RING = 32;
const LEAST_SCALE = 0.01;
const UNITS: readonly Vector3[] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

/** One handle as it is drawn. */
export interface Handle {
  axis: Axis;
  points: Flat[];
}

/** Return the handles of a gizmo: arrows along the world's axes or, for a size, the pose's own, or rings about those. */
export function gizmoLines(gizmo: Gizmo, orbit: Orbit, by: Projection): Handle[] {
  const length = LENGTH * orbit.distance;
  return ([0, 1, 2] as const).map((axis) => ({
    axis,
    points: gizmo.drags === "turn" ? ring(gizmo, axis, length, by) : arrow(gizmo, axis, length, by),
  }));
}

function along({ pose, drags }: Gizmo, axis: Axis): Vector3 {
  return drags === "size" ? rotated(pose.quaternion, UNITS[axis]!) : UNITS[axis]!;
}

function arrow(gizmo: Gizmo, axis: Axis, length: number, by: Projection): Flat[] {
  const { position } = gizmo.pose;
  const line = by.line(position, added(position, scaled(along(gizmo, axis), length)));
  return line === null ? [] : [...line];
}

function ring({ pose }: Gizmo, axis: Axis, radius: number, by: Projection): Flat[] {
  return Array.from({ length: RING + 1 }, (_, index) => {
    const angle = (2 * Math.PI * index) / RING;
    const point: [number, number, number] = [0, 0, 0];
    point[(axis + 1) % 3] = radius * Math.cos(angle);
    point[(axis + 2) % 3] = radius * Math.sin(angle);
    return by.at(transformed(pose, point));
  });
}

/** A handle that is held: where the pose is when the pointer is at a point. */
export interface Grab {
  axis: Axis;
  gizmo: Gizmo;
  at(point: Flat): Pose;
  /** How many times its size along each axis an object has that was seized by its size. */
  scale(point: Flat): Vector3;
}

/** Return the handle under a point, held there; null where there is none. */
export function grabbed(gizmo: Gizmo, orbit: Orbit, by: Projection, from: Flat): Grab | null {
  const near = gizmoLines(gizmo, orbit, by)
    .map(({ axis, points }) => ({ axis, away: distanceTo(points, from) }))
    .filter(({ away }) => away <= REACH)
    .sort((a, b) => a.away - b.away)[0];
  if (near === undefined) return null;
  const { axis } = near;
  const { pose, snap } = gizmo;
  const way = gone(gizmo, axis, by, from);
  const place = (to: Flat): Pose => {
    const steps = snap > 0 ? Math.round(way(to) / snap) * snap : way(to);
    return { ...pose, position: added(pose.position, scaled(UNITS[axis]!, steps)) };
  };
  const at = { place, turn: turned(gizmo, axis, orbit, by, from), size: () => pose }[gizmo.drags];
  const scale = (to: Flat): Vector3 => {
    const factor = Math.max(LEAST_SCALE, 1 + way(to) / (LENGTH * orbit.distance));
    return vector3([0, 1, 2].map((each) => (each === axis ? factor : 1)));
  };
  return { axis, gizmo, at, scale };
}

/** Return how far along an arrow a pointer went [m]. */
function gone(gizmo: Gizmo, axis: Axis, by: Projection, from: Flat): (to: Flat) => number {
  const { pose } = gizmo;
  const unit = along(gizmo, axis);
  const [start, tip] = [by.at(pose.position), by.at(added(pose.position, scaled(unit, 1e-3)))];
  const [dx, dy] = [(tip.x - start.x) / 1e-3, (tip.y - start.y) / 1e-3]; // points a metre
  const square = Math.max(1, dx * dx + dy * dy);
  return (to) => ((to.x - from.x) * dx + (to.y - from.y) * dy) / square;
}

function turned(
  { pose }: Gizmo,
  axis: Axis,
  orbit: Orbit,
  by: Projection,
  from: Flat,
): (to: Flat) => Pose {
  const middle = by.at(pose.position);
  const way = rotated(pose.quaternion, UNITS[axis]!);
  const isTowards = dot(way, difference(eyeOf(orbit), pose.position)) >= 0;
  const angleOf = ({ x, y }: Flat): number => Math.atan2(middle.y - y, x - middle.x);
  const start = angleOf(from);
  return (to) => {
    const angle = (angleOf(to) - start) * (isTowards ? 1 : -1);
    const turn = aboutAxis(way, angle);
    return { ...pose, quaternion: unitQuaternion(product(turn, pose.quaternion)) };
  };
}

function distanceTo(points: readonly Flat[], to: Flat): number {
  let least = Number.POSITIVE_INFINITY;
  for (let index = 1; index < points.length; index++) {
    const [a, b] = [points[index - 1]!, points[index]!];
    const [dx, dy] = [b.x - a.x, b.y - a.y];
    const share = ((to.x - a.x) * dx + (to.y - a.y) * dy) / Math.max(1e-9, dx * dx + dy * dy);
    const along = Math.min(1, Math.max(0, share));
    least = Math.min(least, Math.hypot(a.x + along * dx - to.x, a.y + along * dy - to.y));
  }
  return least;
}
