// The scene of the cell, as the server has it, and what the page changes in it.
//
// There is one for the whole page: every picture shows the objects. What is edited is a draft until
// it is saved; a saved change can be undone until somebody else changes the scene.
import { Chain } from "../kinematics/chain.ts";
import type { RobotDescription } from "../kinematics/chain.ts";
import { measuredJoints } from "../pendant/cell.ts";
import type { Cell } from "../pendant/cell.ts";
import { Observable } from "../pendant/observable.ts";
import { NoticeKind } from "../protocol.ts";
import type { SceneNearestReply } from "../protocol.ts";
import { onePerPage } from "../ui/app.ts";
import type { App } from "../ui/app.ts";
import { LinkLost, Refused } from "../wire/errors.ts";
import type { SceneObject } from "../view/view.ts";
import { contentOf, drawn, inBase, NO_SCENE, readScene, written } from "./objects.ts";
import type { Entry, Scene } from "./objects.ts";

export interface SceneState {
  scene: Scene;
  /** The two bodies that are nearest to each other; null where nothing is known. */
  nearest: SceneNearestReply | null;
  /** Scenes before our own changes, the last one last. */
  past: readonly Scene[];
}

const MOST_PAST = 50;

export const sceneModel = onePerPage((app) => new SceneModel(app));

export class SceneModel extends Observable<SceneState> {
  readonly #app: App;
  #askedFor = "";
  /** Revision that our own last change made. */
  #ours = -1;
  #chain: Chain | null = null;
  #drawn: { scene: Scene; joints: string; objects: readonly SceneObject[] } | null = null;

  constructor(app: App) {
    super({ scene: NO_SCENE, nearest: null, past: [] });
    this.#app = app;
    this.watch(() => app.choice.set({})); // has it drawn
    app.cell.watch((cell) => this.#learn(cell));
    this.#learn(app.cell.value);
  }

  /** The kinematics of the cell's robot; null before it is known. */
  chain(robot: RobotDescription | null): Chain | null {
    if (robot === null) return null;
    if (this.#chain?.robot !== robot) this.#chain = new Chain(robot);
    return this.#chain;
  }

  /** Return the objects at their places; the same list as long as nothing is another. */
  objects(cell: Cell): readonly SceneObject[] {
    const { scene } = this.value;
    const isCarried = scene.entries.some(({ link }) => link !== null);
    const joints = measuredJoints(cell);
    const key = isCarried ? String(joints) : String(cell.robot !== null);
    if (this.#drawn?.scene !== scene || this.#drawn.joints !== key) {
      const chain = this.chain(cell.robot);
      const objects = scene.entries.map((each) => drawn(each, inBase(each, chain, joints)));
      this.#drawn = { scene, joints: key, objects };
    }
    return this.#drawn.objects;
  }

  /** Put an object into the scene. */
  async add(entry: Entry): Promise<void> {
    const object = written(entry);
    await this.#change((revision) => this.#app.session.call<"scene.add">({ op: "scene.add", object, expected_revision: revision }));
  }

  async remove(name: string): Promise<void> {
    await this.#change((revision) => this.#app.session.call<"scene.remove">({ op: "scene.remove", name, expected_revision: revision }));
  }

  /** Save an object that was moved, turned, or made another size or name. */
  async save(before: Entry, after: Entry): Promise<void> {
    const isMove = JSON.stringify(written({ ...after, pose: before.pose })) === JSON.stringify(written(before));
    if (isMove && after.frame === "base") {
      const { position, quaternion } = after.pose;
      const [x, y, z] = position;
      const [qx, qy, qz, qw] = quaternion;
      const pose = { position: [x, y, z] as [number, number, number], orientation: [qx, qy, qz, qw] as [number, number, number, number] };
      await this.#change((revision) => this.#app.session.call<"scene.move">({ op: "scene.move", name: before.name, pose, expected_revision: revision }));
      return;
    }
    const { scene } = this.value;
    const renamed = (name: string): string => (name === before.name ? after.name : name);
    const entries = scene.entries.map((each) => (each.name === before.name ? after : each));
    const allowed = scene.allowed.map(([one, other]) => [renamed(one), renamed(other)] as const);
    await this.#replace({ ...scene, entries, allowed });
  }

  async attach(name: string): Promise<number> {
    let distance = 0;
    await this.#change(async (revision) => {
      const reply = await this.#app.session.call<"scene.attach">({ op: "scene.attach", name, expected_revision: revision });
      distance = reply.distance ?? 0;
      return reply;
    });
    return distance;
  }

  async detach(name: string): Promise<void> {
    await this.#change((revision) => this.#app.session.call<"scene.detach">({ op: "scene.detach", name, expected_revision: revision }));
  }

  /** Let two bodies touch, or no more. */
  async allow(first: string, second: string, isAllowed: boolean): Promise<void> {
    await this.#change((revision) => {
      const pair = { first, second, expected_revision: revision };
      return isAllowed
        ? this.#app.session.call<"scene.allow">({ op: "scene.allow", ...pair })
        : this.#app.session.call<"scene.forbid">({ op: "scene.forbid", ...pair });
    });
  }

  /** Bring back the scene before our last change. */
  async undo(): Promise<void> {
    const before = this.value.past.at(-1);
    if (before === undefined) return;
    await this.#replace(before);
    // What was brought back is no change to be undone again.
    this.set({ past: this.value.past.slice(0, -2) });
  }

  async learnNearest(): Promise<void> {
    const nearest = await this.#app.session.call<"scene.nearest">({ op: "scene.nearest" });
    this.set({ nearest });
  }

  async #replace(scene: Scene): Promise<void> {
    const content = contentOf(scene);
    await this.#change((revision) => this.#app.session.call<"scene.import">({ op: "scene.import", content, expected_revision: revision }));
  }

  async #change(ask: (revision: number) => Promise<{ revision: number }>): Promise<void> {
    const { scene, past } = this.value;
    const { revision } = await ask(scene.revision);
    this.#ours = revision;
    this.set({ past: [...past, scene].slice(-MOST_PAST) });
    await this.#read();
  }

  #learn(cell: Cell): void {
    const { changes, hello, stage, snapshot } = cell;
    if (stage !== "up" || snapshot === null) return;
    const wanted = `${hello?.session ?? 0} ${changes[NoticeKind.SCENE] ?? 0} ${changes[NoticeKind.EVERYTHING] ?? 0}`;
    if (wanted === this.#askedFor) return;
    this.#askedFor = wanted;
    this.#read().catch((error: unknown) => {
      if (error instanceof Refused) this.#app.refused(error.refusal);
      else if (!(error instanceof LinkLost)) throw error;
    });
  }

  async #read(): Promise<void> {
    const { content, revision } = await this.#app.session.call<"scene.show">({ op: "scene.show" });
    const scene = readScene(content, revision);
    // Somebody else's change is no state of ours to go back over.
    const isOthers = revision !== this.#ours && revision !== this.value.scene.revision;
    this.set({ scene, ...(isOthers ? { past: [] } : {}) });
    await this.learnNearest();
  }
}
