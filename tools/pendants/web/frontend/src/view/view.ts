// What a view of the cell shows, and what it tells of: the stick view and the 3-D view are two of
// one kind. Poses are in the robot's base frame [m].
import type { RobotDescription } from "../kinematics/chain.ts";
import type { Pose, Quaternion, Vector3 } from "../kinematics/pose.ts";
import type { DrawnShape } from "../operations.ts";
import type { LinkMesh } from "./meshes.ts";
import type { RobotMeshes } from "./robot_meshes.ts";

export type { Pose, Quaternion, RobotDescription, Vector3 };

/** A solid of the scene; `form` and `size` are as in a drawn shape of a robot. */
export type Shape = Pick<DrawnShape, "form" | "size" | "colour">;

export interface FrameMark extends Pose {
  name: string;
}

export interface SceneObject extends Pose {
  name: string;
  shape: Shape;
  /** carried by the robot: outlined green */
  held: boolean;
  /** see-through */
  keepOut: boolean;
  /** where the object was before it was moved */
  shadow?: boolean;
  /** chosen in the list: outlined orange */
  chosen?: boolean;
}

/** Handles that drag the tool's target or an object. */
export interface Gizmo {
  /** name of the object; null for the tool's target */
  object: string | null;
  pose: Pose;
  drags: "place" | "turn" | "size";
  /** steps of the place [m]; 0 for none */
  snap: number;
}

export interface Ghost {
  joints: readonly number[];
  /** `good` of a preview, `reached` or `bad` of a place that was asked for */
  verdict: "good" | "reached" | "bad";
}

export interface Content {
  robot: RobotDescription | null;
  /** meshes of an imported robot that have come so far; its simple shapes stand until then */
  meshes?: readonly LinkMesh[];
  /** measured; null where they are not known */
  joints: readonly number[] | null;
  /** greyed */
  stale: boolean;
  ghost: Ghost | null;
  /** driven joints that move now: orange */
  driven: readonly number[];
  /** x, y, z of the tool centre point, oldest first */
  trace: Float32Array;
  /** planned path: x, y, z */
  path: Float32Array;
  frames: readonly FrameMark[];
  objects: readonly SceneObject[];
  gizmo?: Gizmo | null;
  theme: "dark" | "light";
}

export const EMPTY: Content = {
  robot: null,
  joints: null,
  stale: false,
  ghost: null,
  driven: [],
  trace: new Float32Array(),
  path: new Float32Array(),
  frames: [],
  objects: [],
  theme: "dark",
};

export type Side = "iso" | "top" | "front";

export interface View {
  /** Return what fetches the meshes of an imported robot, for a view that shows them. */
  newMeshes?(...around: ConstructorParameters<typeof RobotMeshes>): RobotMeshes;
  /**
   * Show this content; what is the same as before costs nothing. Called in a frame of the page, in
   * which it draws where it can: with the next one, each state would cost two.
   */
  show(content: Content): void;
  /** Look from there, at all of the robot. */
  look(side: Side): void;
  /** Fit a host of another size. */
  resize(): void;
  dispose(): void;
}

export interface ViewEvents {
  /** The tool's target was dragged; `isDone` once it is let go. */
  gizmoMoved(pose: Pose, isDone: boolean): void;
  objectMoved(name: string, pose: Pose, isDone: boolean): void;
  /** An object was pulled along its own axes to so many times its size when it was seized. */
  objectScaled(name: string, by: Vector3, isDone: boolean): void;
  /** An object was pressed; null for a press beside all of them. */
  picked(name: string | null): void;
  /** This view cannot keep up here: another one is wanted. */
  tooSlow?(): void;
}

export type MakeView = (host: HTMLElement, events: ViewEvents) => View;
