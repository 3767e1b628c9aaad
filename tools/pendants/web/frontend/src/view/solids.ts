// Outlines of simple solids in a picture: which faces of a box are seen, and the hull of what is
// round. Pure.
import { composed, dot, pose, rotated, transformed, type Pose, type Vector3 } from "../kinematics/pose.ts";
import type { Projected, Projection } from "./camera.ts";

export interface Solid {
  /** `box`, `cylinder`, `capsule` or `sphere`; anything else is shown as its box */
  form: string;
  /** extents along its own x, y, z [m]; a capsule's length includes its caps */
  size: readonly number[];
}

export interface Flat {
  x: number;
  y: number;
}

/** A filled part of a picture, and how light it is. */
export interface Face {
  points: readonly Flat[];
  light: number;
}

/** How a solid is seen. */
export interface Seen {
  /** of its middle [m] */
  depth: number;
  outline: readonly Flat[];
  /** within the outline: the faces of a box, or the end of a cylinder that is seen */
  faces: readonly Face[];
  /** for what is round: across which line light turns to dark */
  across: readonly [Flat, Flat] | null;
}

const ROUND = 20;
const LIGHT: Vector3 = [0.35, -0.55, 0.76];
const AMBIENT = 0.55;

const BOX_FACES: readonly (readonly [number, number, number, number])[] = [
  [0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6], [0, 1, 3, 2], [4, 6, 7, 5],
];
const BOX_NORMALS: readonly Vector3[] = [
  [0, 0, -1], [0, 0, 1], [0, -1, 0], [0, 1, 0], [-1, 0, 0], [1, 0, 0],
];

/** Return how light a face is, by its outward unit normal in the world. */
export function lightOn(normal: Vector3): number {
  return AMBIENT + (1 - AMBIENT) * Math.max(0, dot(normal, LIGHT));
}

/** Return how a solid at a pose is seen; null where it is not before the camera. */
export function seenSolid(solid: Solid, at: Pose, eye: Vector3, by: Projection): Seen | null {
  const middle = by.at(at.position);
  if (middle.depth <= by.near) return null;
  const [x = 0, y = 0, z = 0] = solid.size;
  if (solid.form === "sphere") return seenBall(at.position, x / 2, by);
  if (solid.form === "cylinder") return seenCylinder(x / 2, z / 2, at, eye, by);
  if (solid.form === "capsule") return seenCapsule(x / 2, Math.max(0, z / 2 - x / 2), at, by);
  return seenBox([x / 2, y / 2, z / 2], at, eye, by);
}

/** Return the corners of a box in the world; bit 4 of the number is x, 2 is y, 1 is z. */
export function boxCorners(half: Vector3, at: Pose): Vector3[] {
  return Array.from({ length: 8 }, (_, corner) =>
    transformed(at, [
      corner & 4 ? half[0] : -half[0],
      corner & 2 ? half[1] : -half[1],
      corner & 1 ? half[2] : -half[2],
    ]),
  );
}

export const BOX_EDGES: readonly (readonly [number, number])[] = [
  [0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7],
];

function seenBox(half: Vector3, at: Pose, eye: Vector3, by: Projection): Seen {
  const corners = boxCorners(half, at);
  const flat = corners.map((corner) => by.at(corner));
  const faces: Face[] = [];
  BOX_FACES.forEach((numbers, index) => {
    const normal = rotated(at.quaternion, BOX_NORMALS[index] ?? [0, 0, 1]);
    const corner = corners[numbers[0]] ?? at.position;
    const towards: Vector3 = [eye[0] - corner[0], eye[1] - corner[1], eye[2] - corner[2]];
    if (dot(normal, towards) <= 0) return;
    faces.push({ points: numbers.map((each) => flat[each]!), light: lightOn(normal) });
  });
  return { depth: by.at(at.position).depth, outline: hull(flat), faces, across: null };
}

function circle(radius: number, z: number, at: Pose, by: Projection): Projected[] {
  return Array.from({ length: ROUND }, (_, index) => {
    const angle = (2 * Math.PI * index) / ROUND;
    return by.at(transformed(at, [radius * Math.cos(angle), radius * Math.sin(angle), z]));
  });
}

function seenCylinder(radius: number, half: number, at: Pose, eye: Vector3, by: Projection): Seen {
  const ends = [circle(radius, -half, at, by), circle(radius, half, at, by)];
  const faces: Face[] = [];
  ends.forEach((points, index) => {
    const side = index === 0 ? -1 : 1;
    const normal = rotated(at.quaternion, [0, 0, side]);
    const [x, y, z] = transformed(at, [0, 0, side * half]);
    if (dot(normal, [eye[0] - x, eye[1] - y, eye[2] - z]) > 0) {
      faces.push({ points, light: lightOn(normal) });
    }
  });
  const outline = hull(ends.flat());
  return { depth: by.at(at.position).depth, outline, faces, across: width(radius, half, at, by) };
}

function seenCapsule(radius: number, straight: number, at: Pose, by: Projection): Seen {
  const points = [-straight, straight].flatMap((z) =>
    around(by.at(transformed(at, [0, 0, z])), radius, by),
  );
  const across = width(radius, straight + radius, at, by);
  return { depth: by.at(at.position).depth, outline: hull(points), faces: [], across };
}

function seenBall(middle: Vector3, radius: number, by: Projection): Seen {
  const at = by.at(middle);
  const wide = by.length(radius, at.depth) * 0.7;
  const across = [{ x: at.x - wide, y: at.y - wide }, { x: at.x + wide, y: at.y + wide }] as const;
  return { depth: at.depth, outline: around(at, radius, by), faces: [], across };
}

function around(middle: Projected, radius: number, by: Projection): Flat[] {
  const wide = by.length(radius, middle.depth);
  return Array.from({ length: ROUND }, (_, index) => {
    const angle = (2 * Math.PI * index) / ROUND;
    return { x: middle.x + wide * Math.cos(angle), y: middle.y + wide * Math.sin(angle) };
  });
}

/** Return a line across a round solid, from its lighter side: the upper one, else the left. */
function width(radius: number, half: number, at: Pose, by: Projection): readonly [Flat, Flat] {
  const [low, high] = [-half, half].map((z) => by.at(transformed(at, [0, 0, z])));
  const middle = by.at(at.position);
  const wide = by.length(radius, middle.depth);
  const [dx, dy] = [(high?.x ?? 0) - (low?.x ?? 0), (high?.y ?? 0) - (low?.y ?? 0)];
  const length = Math.hypot(dx, dy);
  let [x, y] = length > 1e-6 ? [dy / length, -dx / length] : [-Math.SQRT1_2, -Math.SQRT1_2];
  if (y > 0.2 || (Math.abs(y) <= 0.2 && x > 0)) [x, y] = [-x, -y];
  return [
    { x: middle.x + x * wide, y: middle.y + y * wide },
    { x: middle.x - x * wide, y: middle.y - y * wide },
  ];
}

/** Return the convex hull of points, in order (A. M. Andrew, 1979). */
export function hull(points: readonly Flat[]): Flat[] {
  const sorted = [...points].sort((a, b) => a.x - b.x || a.y - b.y);
  if (sorted.length < 3) return sorted;
  const half = (from: readonly Flat[]): Flat[] => {
    const chain: Flat[] = [];
    for (const point of from) {
      while (chain.length >= 2 && turn(chain.at(-2)!, chain.at(-1)!, point) <= 0) chain.pop();
      chain.push(point);
    }
    return chain.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

function turn(a: Flat, b: Flat, c: Flat): number {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/** Whether a point is within a convex outline. */
export function isWithin(outline: readonly Flat[], point: Flat): boolean {
  const sides = outline.map((each, index) =>
    turn(each, outline[(index + 1) % outline.length] ?? each, point),
  );
  return outline.length > 2 && (sides.every((side) => side >= 0) || sides.every((side) => side <= 0));
}

/** A solid of a robot at its place, as `shapes.show` tells it. */
export function solidPose(link: Pose, shape: { xyz: readonly number[]; quat: readonly number[] }): Pose {
  return composed(link, pose(shape.xyz, shape.quat));
}
