// The meshes of the robot that is shown: fetched once, and only for a view that draws them.
import type { RobotDescription } from "../kinematics/chain.ts";
import { downloadedMeshes, type Ask, type Download, type LinkMesh } from "./meshes.ts";

export class RobotMeshes {
  readonly #ask: Ask;
  readonly #failed: (problems: Download["problems"]) => void;
  #hash: string | null = null;
  #isWhole = true;
  #meshes: readonly LinkMesh[] = [];
  #fetching: AbortController | null = null;

  constructor(ask: Ask, failed: (problems: Download["problems"]) => void) {
    this.#ask = ask;
    this.#failed = failed;
  }

  /** Return those of this robot that have come so far; the others are on their way. */
  of(robot: RobotDescription | null): readonly LinkMesh[] {
    const hash = robot?.hash ?? null;
    if (hash === this.#hash) return this.#meshes;
    this.#fetching?.abort();
    this.#hash = hash;
    this.#meshes = [];
    this.#isWhole = true;
    if (robot?.links.some(({ mesh }) => mesh !== null)) void this.#fetch();
    return this.#meshes;
  }

  /** The link is another: fetch them anew when next asked, if they did not all come. */
  linked(): void {
    if (this.#isWhole) return;
    this.#fetching?.abort();
    this.#hash = null;
    this.#meshes = [];
  }

  async #fetch(): Promise<void> {
    const fetching = new AbortController();
    this.#isWhole = false;
    this.#fetching = fetching;
    const came = (meshes: readonly LinkMesh[]): void => {
      if (!fetching.signal.aborted) this.#meshes = meshes;
    };
    try {
      const { problems } = await downloadedMeshes(this.#ask, came, undefined, fetching.signal);
      if (fetching.signal.aborted) return;
      this.#isWhole = problems.length === 0;
      if (problems.length > 0) this.#failed(problems);
    } catch (error) {
      // The list was refused, or the link ended: `linked` lets it be asked for again.
      if (!fetching.signal.aborted) this.#failed([{ hash: "", problem: "refused", text: String(error) }]);
    }
  }
}
