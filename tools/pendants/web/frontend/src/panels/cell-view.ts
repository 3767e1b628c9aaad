// The picture of the cell, with what stands over it: the tool's place, what is held, the checklist.
import { isStale } from "../wire/session.ts";
import { isInControl, measuredJoints, OVERDUE } from "../pendant/cell.ts";
import type { Cell } from "../pendant/cell.ts";
import { jointRows, toolRows, toolValues } from "../pendant/axes.ts";
import { cellFrames } from "../scene/frames.ts";
import { sceneModel } from "../scene/model.ts";
import { fixed } from "../texts/texts.ts";
import type { App, Part } from "../ui/app.ts";
import { attribute, choose, h, say, sayOrHide } from "../ui/elements.ts";
import { isSameOverlay } from "../view/changes.ts";
import type { LinkMesh } from "../view/meshes.ts";
import type { RobotMeshes } from "../view/robot_meshes.ts";
import { EMPTY } from "../view/view.ts";
import type { Content, FrameMark, Side, View } from "../view/view.ts";
import { shown } from "./jog.ts";

const NO_MESHES: readonly LinkMesh[] = [];
const NAMES = ["X", "Y", "Z", "R", "P", "Y"];
/** Points of the trace; a point every 5 mm. */
const MOST_POINTS = 2000;
const POINT_EVERY = 0.005;

export interface CellView extends Part {
  /** Give it a view, once that was loaded. */
  use(make: (host: HTMLElement) => View): void;
  /** Returns whether that is another one than before. */
  overlay(part: Partial<Content> | null): boolean;
  /** Give back what the view holds: this part is shown no more. */
  close(): void;
}

export function cellView(app: App, over: HTMLElement): CellView {
  const { texts } = app;
  const host = h("div", { class: "host", role: "img", "aria-label": texts.viewOf });
  const values = NAMES.map(() => h("td", {}));
  const tool = h(
    "table",
    { "aria-label": texts.tcpInBase },
    ...values.map((each, index) => h("tr", {}, h("th", { scope: "row" }, NAMES[index] ?? ""), each)),
  );
  const held = h("div", { class: "held-line" });
  const age = h("div", { class: "age" });
  let view: View | null = null;
  let added: Partial<Content> = {};
  const seen = { trace: true, frames: false };
  /** Where the robot was known to stand last; greyed from then on. */
  let standing: { robot: Cell["robot"]; joints: number[] } | null = null;
  const trace = new Trace();
  const scene = sceneModel(app);
  let meshes: RobotMeshes | null = null;
  const missing = ({ length }: readonly unknown[]): void => {
    app.choice.set({ note: { text: texts.meshesMissing(length), kind: "remark" } });
  };
  let greeted: Cell["hello"] = null;
  const sides: [Side, string][] = [["iso", texts.iso], ["top", texts.top], ["front", texts.front]];
  const toggles = (["trace", "frames"] as const).map((what) => {
    const button = h("button", { type: "button", "data-shows": what }, texts[what]);
    button.addEventListener("click", () => {
      seen[what] = !seen[what];
      choose(button, seen[what]);
    });
    choose(button, seen[what]);
    return button;
  });
  const frames = new ShownFrames(app);
  const looks = h(
    "div",
    { class: "looks" },
    ...sides.map(([side, word]) => h("button", { type: "button", onclick: () => view?.look(side) }, word)),
    ...toggles,
  );
  const place = h("div", { class: "tool-place" }, h("strong", {}, texts.tcpInBase), tool);
  const element = h("div", { class: "view" }, host, held, place, age, looks, over);
  new ResizeObserver(() => view?.resize()).observe(host);
  return {
    element,
    use(make) {
      this.close();
      view = make(host);
      meshes = view.newMeshes?.((request) => app.session.call(request), missing) ?? null;
    },
    overlay(part) {
      const isSame = isSameOverlay(added, part ?? {});
      if (!isSame) added = part ?? {};
      return !isSame;
    },
    close() {
      meshes?.of(null); // none are fetched any more
      meshes = null;
      view?.dispose();
      view = null;
    },
    update(cell) {
      const stale = isStale(cell, app.now(), OVERDUE);
      const told = toolValues(cell);
      values.forEach((each, index) => {
        const value = told?.[index];
        say(each, value === undefined ? "–" : shown(value, index > 2, app.settings.value.areRadians).join(""));
      });
      sayOrHide(held, heldText(app, cell));
      const seconds = (app.now() - cell.stateAt) / 1000;
      sayOrHide(age, stale && cell.state !== null ? texts.stale(fixed(seconds, 1)) : "");
      if (told !== null) trace.add(told);
      if (cell.hello !== greeted) {
        greeted = cell.hello;
        meshes?.linked();
      }
      const joints = measuredJoints(cell);
      if (joints !== null) standing = { robot: cell.robot, joints };
      const last = standing?.robot === cell.robot ? standing.joints : null;
      attribute(host, "data-shows-robot", cell.robot !== null && last !== null);
      view?.show({
        ...EMPTY,
        robot: cell.robot,
        meshes: meshes?.of(cell.robot) ?? NO_MESHES,
        joints: joints ?? last,
        stale: stale || joints === null,
        driven: drivenJoints(app, cell),
        objects: scene.objects(cell),
        trace: seen.trace ? trace.points() : EMPTY.trace,
        theme: app.settings.value.theme,
        ...added,
        frames: seen.frames ? frames.beside(added.frames ?? EMPTY.frames, cell) : added.frames ?? EMPTY.frames,
      });
    },
  };
}

function drivenJoints(app: App, cell: Cell): number[] {
  if (app.holding.aim.space === "joints" && app.holding.held.length > 0) {
    return app.holding.held.map((each) => each.axis);
  }
  return jointRows(cell).flatMap((row, index) => (Math.abs(row.speed ?? 0) > 0.005 ? [index] : []));
}

function heldText(app: App, cell: Cell): string {
  const { texts } = app;
  if (!isInControl(cell) || app.holding.held.length === 0) return "";
  const rows = app.holding.aim.space === "joints" ? jointRows(cell) : toolRows(cell);
  const keys = app.holding.held.map(
    ({ axis, direction }) => `${rows[axis]?.name ?? ""} ${direction > 0 ? "+" : "−"}`,
  );
  const cap = cell.state?.tool_speed_cap ?? 0;
  const speed = `${fixed((cell.state?.tool_speed ?? 0) * 1000, 0)}${cap > 0 ? ` / ${fixed(cap * 1000, 0)}` : ""} mm/s`;
  return [texts.heldBy(keys.join(", ")), speed, texts.stopsWithin("0.25")].join("  ·  ");
}

/** The cell's own frames, beside those that a task shows. */
class ShownFrames {
  readonly #app: App;
  #joined: Record<"own" | "others" | "marks", readonly FrameMark[]> = { own: [], others: [], marks: [] };

  constructor(app: App) {
    this.#app = app;
  }

  beside(others: readonly FrameMark[], cell: Cell): readonly FrameMark[] {
    const chain = sceneModel(this.#app).chain(cell.robot);
    if (chain === null) return others;
    const own = cellFrames(this.#app).all(cell, chain);
    if (own !== this.#joined.own || others !== this.#joined.others) {
      const names = new Set(others.map(({ name }) => name));
      this.#joined = { own, others, marks: [...own.filter(({ name }) => !names.has(name)), ...others] };
    }
    return this.#joined.marks;
  }
}

/** The way of the tool, in points that are apart. */
class Trace {
  #points: number[] = [];
  #told = EMPTY.trace;

  add(at: readonly number[]): void {
    const [x = 0, y = 0, z = 0] = at;
    const [lastX = NaN, lastY = NaN, lastZ = NaN] = this.#points.slice(-3);
    const way = Math.hypot(x - lastX, y - lastY, z - lastZ);
    if (way < POINT_EVERY) return;
    this.#points.push(x, y, z);
    if (this.#points.length > 3 * MOST_POINTS) this.#points.splice(0, 3);
    this.#told = new Float32Array(this.#points);
  }

  points(): Float32Array {
    return this.#told;
  }
}
