// The objects of a scene: what the server tells of them, where they are, how far from a point.
// Pure. Units: m; a scene file's capsule has the length of its straight part.
import type { Chain } from "../kinematics/chain.ts";
import { composed, conjugate, difference, inverse, pose as poseOf, rotated, unitQuaternion, vector3 } from "../kinematics/pose.ts";
import type { Pose, Vector3 } from "../kinematics/pose.ts";
import type { SceneObject, Shape } from "../view/view.ts";

export type Kind = "box" | "cylinder" | "sphere" | "capsule" | "mesh";

export const KINDS: readonly Exclude<Kind, "mesh">[] = ["box", "cylinder", "sphere", "capsule"];

/** What can be measured of each kind, in the order of its boxes. */
export const MEASURES: Readonly<Record<Kind, readonly string[]>> = {
  box: ["width", "depth", "height"],
  cylinder: ["radius", "length"],
  sphere: ["radius"],
  capsule: ["radius", "length"],
  mesh: [],
};

/** An object as its file has it. */
export interface Entry {
  name: string;
  kind: Kind;
  /** As `MEASURES` names them. */
  sizes: readonly number[];
  pose: Pose;
  frame: "base" | "root";
  /** The link that holds it; null where it stands. */
  link: string | null;
  /** That in which pages draw it; no file has it. */
  colour: string;
  /** As it came, for what is not changed here. */
  raw: Readonly<Record<string, unknown>>;
}

export interface Scene {
  revision: number;
  entries: readonly Entry[];
  /** Pairs that may touch. */
  allowed: readonly (readonly [string, string])[];
}

export const NO_SCENE: Scene = { revision: 0, entries: [], allowed: [] };

/** Read the content of a scene file; what is no object is left out. */
export function readScene(content: Readonly<Record<string, unknown>>, revision: number): Scene {
  const objects = Array.isArray(content["objects"]) ? (content["objects"] as unknown[]) : [];
  const allowed = Array.isArray(content["allowed"]) ? (content["allowed"] as [string, string][]) : [];
  const entries: Entry[] = [];
  for (const each of objects) {
    const entry = readEntry(each);
    if (entry !== null) entries.push({ ...entry, colour: freeColour(entry.name, entries) });
  }
  return { revision, entries, allowed };
}

function readEntry(told: unknown): Omit<Entry, "colour"> | null {
  if (typeof told !== "object" || told === null) return null;
  const raw = told as Record<string, unknown>;
  const shape = (raw["shape"] ?? {}) as Record<string, unknown>;
  const kind = String(shape["type"]) as Kind;
  if (!(kind in MEASURES)) return null;
  const sizes = kind === "box" ? (shape["size"] as number[]) : MEASURES[kind].map((each) => Number(shape[each]));
  return {
    name: String(raw["name"]),
    kind,
    sizes,
    pose: poseOf((raw["position"] as number[] | undefined) ?? [0, 0, 0], (raw["quaternion"] as number[] | undefined) ?? [0, 0, 0, 1]),
    frame: raw["frame"] === "root" ? "root" : "base",
    link: typeof raw["link"] === "string" ? raw["link"] : null,
    raw,
  };
}

/** Return an entry as a request or a file wants it. */
export function written(entry: Entry): Record<string, unknown> {
  const [first = 0, second = 0] = entry.sizes;
  const shape: Record<string, unknown> =
    entry.kind === "mesh"
      ? (entry.raw["shape"] as Record<string, unknown>)
      : entry.kind === "box"
        ? { type: "box", size: [...entry.sizes] }
        : entry.kind === "sphere"
          ? { type: "sphere", radius: first }
          : { type: entry.kind, radius: first, length: second };
  const { position, quaternion } = entry.pose;
  return {
    name: entry.name,
    shape,
    position: [...position],
    quaternion: [...quaternion],
    frame: entry.frame,
    ...(entry.link === null ? {} : { link: entry.link }),
  };
}

/** Return the whole scene as a file's content. */
export function contentOf({ entries, allowed }: Scene): Record<string, unknown> {
  return {
    schema: "openpendant-scene/1",
    objects: entries.map((each) => written(each)),
    allowed: allowed.map((each) => [...each]),
  };
}

/** Return the pose of an object in base. */
export function inBase(entry: Entry, chain: Chain | null, joints: readonly number[] | null): Pose {
  if (chain === null) return entry.pose;
  if (entry.link !== null) {
    const link = chain.linkPoses(joints).get(entry.link);
    return link === undefined ? entry.pose : composed(link, entry.pose);
  }
  return entry.frame === "root" ? composed(chain.root, entry.pose) : entry.pose;
}

/** Return a pose in base as the entry's own file would have it. */
export function ownPose(entry: Entry, inBaseFrame: Pose, chain: Chain | null): Pose {
  if (entry.frame === "base" || entry.link !== null || chain === null) return inBaseFrame;
  return composed(inverse(chain.root), inBaseFrame);
}

const COLOURS = ["#6d7a86", "#4c6a86", "#c0443c", "#d8a51f", "#4c8dff", "#8f6bb8", "#3f9a78", "#b9784a"];

/** Return a colour that none of the seven objects before it has; the same on every page. */
function freeColour(name: string, others: readonly Entry[]): string {
  let sum = 0;
  for (const each of name) sum = (sum * 31 + (each.codePointAt(0) ?? 0)) % 9973;
  const used = new Set(others.slice(-(COLOURS.length - 1)).map(({ colour }) => colour));
  const from = sum % COLOURS.length;
  return [...COLOURS.slice(from), ...COLOURS.slice(0, from)].find((each) => !used.has(each)) ?? "#6d7a86";
}

/** Thinner than that, and a box that is large else is a wall: seen through, or it hides the robot. */
const WALL = 0.03;
const LARGE = 0.5;

export function isWall({ kind, sizes, link }: Entry): boolean {
  if (kind !== "box" || link !== null) return false;
  const [width = 0, depth = 0, height = 0] = sizes;
  return Math.min(width, depth) <= WALL && Math.max(width, depth) >= LARGE && height >= LARGE;
}

/** Return the solid that a view draws. */
export function shapeOf({ kind, sizes, colour }: Entry): Shape {
  const [first = 0, second = 0, third = 0] = sizes;
  switch (kind) {
    case "box":
      return { form: "box", size: [first, second, third], colour };
    case "sphere":
      return { form: "sphere", size: [2 * first, 2 * first, 2 * first], colour };
    case "cylinder":
      return { form: "cylinder", size: [2 * first, 2 * first, second], colour };
    case "capsule":
      return { form: "capsule", size: [2 * first, 2 * first, second + 2 * first], colour };
    case "mesh":
      // Its triangles are not told: a small box says that something is there.
      return { form: "box", size: [0.05, 0.05, 0.05], colour };
  }
}

/** Return an object as a view wants it. */
export function drawn(entry: Entry, at: Pose, mark: Partial<SceneObject> = {}): SceneObject {
  return { ...at, name: entry.name, shape: shapeOf(entry), held: entry.link !== null, keepOut: isWall(entry), ...mark };
}

/** Return how far a point in base is from a body [m], 0 inside; null for a mesh, which only the server knows. */
export function distanceTo({ kind, sizes }: Entry, at: Pose, point: Vector3): number | null {
  const [x, y, z] = rotated(conjugate(at.quaternion), difference(point, at.position));
  const [first = 0, second = 0, third = 0] = sizes;
  const across = Math.hypot(x, y);
  switch (kind) {
    case "box": {
      const out = [Math.abs(x) - first / 2, Math.abs(y) - second / 2, Math.abs(z) - third / 2];
      return Math.hypot(...out.map((each) => Math.max(0, each)));
    }
    case "sphere":
      return Math.max(0, Math.hypot(x, y, z) - first);
    case "cylinder":
      return Math.hypot(Math.max(0, across - first), Math.max(0, Math.abs(z) - second / 2));
    case "capsule":
      return Math.max(0, Math.hypot(across, Math.max(0, Math.abs(z) - second / 2)) - first);
    case "mesh":
      return null;
  }
}

/** Where a tool grasps, and how near an object must be. */
export interface Grasp {
  /** In base. */
  point: Vector3;
  reach: number;
}

const REACH = 0.01;

/** Return the grasp of the selected tool, from a file's content of frames and tools. */
export function graspOf(content: Readonly<Record<string, unknown>>, tool: string | null, at: Pose): Grasp {
  const tools = Array.isArray(content["tools"]) ? (content["tools"] as Record<string, unknown>[]) : [];
  const found = tools.find((each) => each["name"] === tool);
  const told = (found?.["grasp"] ?? {}) as { point?: number[]; reach?: number };
  const offset = vector3(told.point ?? [0, 0, 0]);
  return { point: composed(at, { position: offset, quaternion: unitQuaternion([0, 0, 0, 1]) }).position, reach: told.reach ?? REACH };
}

/** Return a name for a new object that none has yet. */
export function freeName(kind: Kind, entries: readonly Entry[]): string {
  const taken = new Set(entries.map(({ name }) => name));
  for (let number = 1; ; number += 1) {
    const name = number === 1 ? kind : `${kind} ${number}`;
    if (!taken.has(name)) return name;
  }
}

const FIRST_SIZES: Readonly<Record<Exclude<Kind, "mesh">, readonly number[]>> = {
  box: [0.1, 0.1, 0.1],
  cylinder: [0.05, 0.2],
  sphere: [0.05],
  capsule: [0.05, 0.2],
};

/** Return a new object of a kind, at a place. */
export function newEntry(kind: Exclude<Kind, "mesh">, position: Vector3, entries: readonly Entry[]): Entry {
  const name = freeName(kind, entries);
  const colour = freeColour(name, entries);
  return { name, kind, sizes: FIRST_SIZES[kind], pose: poseOf(position, [0, 0, 0, 1]), frame: "base", link: null, colour, raw: {} };
}

/** Nothing is made smaller than that [m]. */
const LEAST = 0.001;

/** Return an object that was pulled along its own axes, to whole steps of `snap` [m]; 0 for none. */
export function resized(entry: Entry, by: Vector3, snap: number): Entry {
  const [x, y, z] = by;
  const factors = { box: [x, y, z], cylinder: [x * y, z], capsule: [x * y, z], sphere: [x * y * z], mesh: [] }[entry.kind];
  const sizes = entry.sizes.map((size, index) => {
    const factor = factors[index] ?? 1;
    if (factor === 1) return size;
    const wanted = size * factor;
    return Math.max(snap > 0 ? snap : LEAST, snap > 0 ? Math.round(wanted / snap) * snap : wanted);
  });
  return { ...entry, sizes };
}

/** Whether two entries say the same. */
export function isSame(one: Entry, other: Entry): boolean {
  return JSON.stringify(written(one)) === JSON.stringify(written(other));
}

/** Round a place to a raster [m]; 0 leaves it. */
export function snapped(at: Pose, snap: number): Pose {
  if (snap <= 0) return at;
  const round = (value: number): number => Math.round(value / snap) * snap;
  return { ...at, position: vector3(at.position.map(round)) };
}
