// What a view of the cell shows, and what it tells; the pages and the views agree on this alone.
import type { DrawnShape, ShapesShowReply } from "../operations.ts";

/** x, y, z [m]. */
export type Vector3 = readonly [number, number, number];

/** x, y, z, w. */
export type Quaternion = readonly [number, number, number, number];

export interface Pose {
  position: Vector3;
  quaternion: Quaternion;
}

/** Chain and shapes of a robot, as `shapes.show` tells them. */
export type RobotDescription = ShapesShowReply;

/** A solid of the scene: what `size` means is as in a drawn shape of a robot. */
export type Shape = Pick<DrawnShape, "form" | "size" | "colour">;

export interface FrameMark extends Pose {
  name: string;
}

export interface SceneObject extends Pose {
  name: string;
  shape: Shape;
  held: boolean;
  keepOut: boolean;
  /** Where it stood before it was dragged. */
  shadow?: boolean;
}

export interface Content {
  robot: RobotDescription | null;
  /** Measured, controller side; null: not known. */
  joints: readonly number[] | null;
  /** The values are old: the robot is drawn grey. */
  stale: boolean;
  ghost: { joints: readonly number[]; verdict: "good" | "bad" } | null;
  /** Numbers of the joints that move now: drawn orange. */
  driven: readonly number[];
  /** x, y, z of the tool centre point in base, oldest first. */
  trace: Float32Array;
  /** x, y, z of a planned path in base. */
  path: Float32Array;
  frames: readonly FrameMark[];
  objects: readonly SceneObject[];
  theme: "dark" | "light";
}

export interface ViewEvents {
  gizmoMoved(pose: Pose): void;
  objectMoved(name: string, pose: Pose): void;
  picked(name: string): void;
}

export interface View {
  show(content: Content): void;
  resize(): void;
  dispose(): void;
}

export type MakeView = (host: HTMLElement, events: ViewEvents) => View;
