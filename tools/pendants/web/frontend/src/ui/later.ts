// A task whose program is fetched when it is first shown.
import type { Cell } from "../pendant/cell.ts";
import type { App, MakeTask, TaskPart } from "./app.ts";
import { h } from "./elements.ts";

/** What of the screen it will want, which has to be known before it is there. */
export interface Wants {
  dock?: boolean;
  stage?: boolean;
}

export function later(load: () => Promise<MakeTask>, wants: Wants): MakeTask {
  return (app) => new LaterTask(app, load, wants);
}

class LaterTask implements TaskPart {
  readonly element = h("div", { class: "later" });
  readonly dock?: HTMLElement;
  readonly stage?: HTMLElement;
  readonly #app: App;
  readonly #load: () => Promise<MakeTask>;
  #part: TaskPart | null = null;
  #isShown = false;
  #isAsked = false;

  constructor(app: App, load: () => Promise<MakeTask>, { dock, stage }: Wants) {
    this.#app = app;
    this.#load = load;
    if (dock === true) this.dock = h("div", { class: "later" });
    if (stage === true) this.stage = h("div", { class: "later" });
  }

  shown(isShown: boolean): void {
    this.#isShown = isShown;
    if (isShown) void this.#fetch();
    this.#part?.shown?.(isShown);
  }

  update(cell: Cell): void {
    this.#part?.update(cell);
  }

  async #fetch(): Promise<void> {
    if (this.#isAsked) return;
    this.#isAsked = true;
    try {
      const part = (await this.#load())(this.#app);
      this.element.replaceChildren(part.element);
      if (part.dock !== undefined) this.dock?.replaceChildren(part.dock);
      if (part.stage !== undefined) this.stage?.replaceChildren(part.stage);
      this.#part = part;
      part.shown?.(this.#isShown);
      part.update(this.#app.cell.value);
    } catch {
      // The gateway is away, or has a newer page: the next time it is shown it is asked for again.
      this.#isAsked = false;
      this.element.replaceChildren(h("p", { class: "remark" }, this.#app.texts.connectionFailed));
    }
  }
}
