// The frames of a cell, placed in base.
import type { Chain } from "../kinematics/chain.ts";
import { composed, IDENTITY, pose as poseOf } from "../kinematics/pose.ts";
import type { Pose } from "../kinematics/pose.ts";
import { measuredJoints, toolPose } from "../pendant/cell.ts";
import type { Cell } from "../pendant/cell.ts";
import { NoticeKind } from "../protocol.ts";
import type { App } from "../ui/app.ts";
import type { FrameMark } from "../view/view.ts";

interface Told {
  name: string;
  parent: string;
  xyz: number[];
  quat: number[];
}

/** Return the frames of a file's content whose parents are known; `known` are the robot's own. */
export function frameMarks(
  content: Readonly<Record<string, unknown>>,
  known: Readonly<Record<string, Pose>>,
): FrameMark[] {
  const told = Array.isArray(content["frames"]) ? (content["frames"] as Told[]) : [];
  const places = new Map<string, Pose>(Object.entries({ base: IDENTITY, ...known }));
  const marks: FrameMark[] = [];
  // Parents stand before their children.
  for (const { name, parent, xyz, quat } of told) {
    const from = places.get(parent);
    if (from === undefined) continue;
    const place = composed(from, poseOf(xyz, quat));
    places.set(name, place);
    marks.push({ name, ...place });
  }
  return marks;
}

/** Frames as the server keeps them: asked for when they are first wanted, and again when they change. */
export class CellFrames {
  readonly #app: App;
  #askedFor = "";
  #content: Record<string, unknown> = {};
  #version = 0;
  #placed: { key: string; marks: readonly FrameMark[] } = { key: "", marks: [] };

  constructor(app: App) {
    this.#app = app;
  }

  /** Counts how often they came. */
  get version(): number {
    return this.#version;
  }

  /** Return the frames that people made. */
  ofUser(cell: Cell, chain: Chain): FrameMark[] {
    this.#learn(cell);
    const tool = toolPose(cell);
    const known = { root: chain.root, ...(tool === null ? {} : { tool }), flange: chain.flange(measuredJoints(cell)) };
    return frameMarks(this.#content, known);
  }

  /** Return those, base and the tool; the same list as long as they stand where they stood. */
  all(cell: Cell, chain: Chain): readonly FrameMark[] {
    const tool = toolPose(cell);
    const marks = [{ name: "base", ...IDENTITY }, ...(tool === null ? [] : [{ name: "tool", ...tool }]), ...this.ofUser(cell, chain)];
    const key = JSON.stringify(marks, (_, value: unknown) => (typeof value === "number" ? Number(value.toFixed(4)) : value));
    if (key !== this.#placed.key) this.#placed = { key, marks };
    return this.#placed.marks;
  }

  #learn({ changes, hello, stage }: Cell): void {
    const wanted = [hello?.session, ...[NoticeKind.FRAMES, NoticeKind.TOOLS, NoticeKind.EVERYTHING].map((each) => changes[each])].join();
    if (stage !== "up" || wanted === this.#askedFor) return;
    this.#askedFor = wanted;
    this.#app.attempt(async () => {
      this.#content = (await this.#app.session.call<"frames.show">({ op: "frames.show" })).content;
      this.#version += 1;
    });
  }
}
