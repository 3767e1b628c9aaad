// The frames of a cell, placed in base.
import type { Chain } from "../kinematics/chain.ts";
import { composed, IDENTITY, pose as poseOf } from "../kinematics/pose.ts";
import type { Pose } from "../kinematics/pose.ts";
import { measuredJoints, toolPose } from "../pendant/cell.ts";
import type { Cell } from "../pendant/cell.ts";
import { NoticeKind } from "../protocol.ts";
import type { FramesShowReply } from "../protocol.ts";
import { onePerPage } from "../ui/app.ts";
import type { App } from "../ui/app.ts";
import type { FrameMark } from "../view/view.ts";
import { LinkLost, Refused } from "../wire/errors.ts";

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

/** Return the frames of this page's cell. */
export const cellFrames = onePerPage((app) => new CellFrames(app));

/** Frames and tools as the server keeps them: asked for when they are first wanted, and when they change. */
export class CellFrames {
  readonly #app: App;
  #hello: Cell["hello"] = null;
  #askedFor = "";
  #content: Record<string, unknown> = {};
  #version = 0;
  #placed: { key: string; marks: readonly FrameMark[] } = { key: "", marks: [] };

  constructor(app: App) {
    this.#app = app;
  }

  /** Counts what they were, so that whoever keeps something of them sees that they are others. */
  get version(): number {
    return this.#version;
  }

  /** Return them as their file has them; empty until they came. */
  content(cell: Cell): Readonly<Record<string, unknown>> {
    const { changes, hello, stage } = cell;
    if (hello !== this.#hello && hello !== null) {
      this.#hello = hello;
      this.#askedFor = "";
      this.#take({});
    }
    const wanted = [NoticeKind.FRAMES, NoticeKind.TOOLS, NoticeKind.EVERYTHING].map((each) => changes[each] ?? 0).join();
    if (stage === "up" && wanted !== this.#askedFor) {
      this.#askedFor = wanted;
      void this.#read(hello);
    }
    return this.#content;
  }

  /** Return the frames that people made. */
  ofUser(cell: Cell, chain: Chain): FrameMark[] {
    const [tool, joints] = [toolPose(cell), measuredJoints(cell)];
    const own = { ...(tool === null ? {} : { tool }), ...(joints === null ? {} : { flange: chain.flange(joints) }) };
    return frameMarks(this.content(cell), { root: chain.root, ...own });
  }

  /** Return those, base and the tool; the same list as long as they stand where they stood. */
  all(cell: Cell, chain: Chain): readonly FrameMark[] {
    const tool = toolPose(cell);
    const marks = [{ name: "base", ...IDENTITY }, ...(tool === null ? [] : [{ name: "tool", ...tool }]), ...this.ofUser(cell, chain)];
    const key = JSON.stringify(marks, (_, value: unknown) => (typeof value === "number" ? Number(value.toFixed(4)) : value));
    if (key !== this.#placed.key) this.#placed = { key, marks };
    return this.#placed.marks;
  }

  async #read(hello: Cell["hello"]): Promise<void> {
    const whole: Record<string, unknown[]> = {};
    try {
      for (let first: number | null = 0; first !== null; ) {
        const { content, next }: FramesShowReply = await this.#app.session.call<"frames.show">({ op: "frames.show", first });
        for (const kind of ["tools", "frames"]) (whole[kind] ??= []).push(...((content[kind] ?? []) as unknown[]));
        first = next ?? null;
      }
      if (hello === this.#hello) this.#take(whole);
    } catch (error) {
      if (error instanceof Refused) this.#app.refused(error.refusal);
      else if (!(error instanceof LinkLost)) throw error;
    }
  }

  #take(content: Record<string, unknown>): void {
    this.#content = content;
    this.#version += 1;
    this.#app.choice.set({}); // has it drawn
  }
}
