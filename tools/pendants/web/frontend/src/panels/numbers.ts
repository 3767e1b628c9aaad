// For the curious: the tool's place in every form, the Jacobian, DH frames, the specification.
import "../numbers.css";
import type { Chain } from "../kinematics/chain.ts";
import { dhFrames, dhTable } from "../kinematics/dh.ts";
import type { DhTable } from "../kinematics/dh.ts";
import { measuredJoints, toolPose } from "../pendant/cell.ts";
import type { Cell } from "../pendant/cell.ts";
import { NoticeKind } from "../protocol.ts";
import type { KinematicsFkReply, KinematicsJacobianReply } from "../protocol.ts";
import { cellFrames } from "../scene/frames.ts";
import type { CellFrames } from "../scene/frames.ts";
import { sceneModel } from "../scene/model.ts";
import type { NumberTexts } from "../texts/numbers.ts";
import { fixed } from "../texts/texts.ts";
import type { App, TaskPart } from "../ui/app.ts";
import { attribute, h, say, show } from "../ui/elements.ts";
import type { FrameMark } from "../view/view.ts";
import { LinkLost, Refused } from "../wire/errors.ts";
import { displayName } from "./plan.ts";

/** Between two looks at where the robot is [ms]. */
const EVERY = 500;
const DEGREES = 180 / Math.PI;
const OWN_FRAMES = ["tool", "flange"];

export function numbersTask(app: App): TaskPart {
  return new NumbersTask(app);
}

class NumbersTask implements TaskPart {
  readonly element: HTMLElement;
  readonly #app: App;
  readonly #words: NumberTexts;
  readonly #frame: HTMLSelectElement;
  readonly #link: HTMLSelectElement;
  readonly #shows: HTMLInputElement;
  readonly #place = h("dl", {});
  readonly #matrix = h("table", { class: "matrix" });
  readonly #jacobian = h("table", { class: "matrix" });
  readonly #measures = h("dl", {});
  readonly #dh: HTMLElement;
  readonly #dhBody = h("tbody", {});
  readonly #specs = h("dl", {});
  readonly #limits = h("tbody", {});
  readonly #frames: CellFrames;
  #table: DhTable | null = null;
  #askedFor = "";
  #isShown = false;
  #isAsking = false;
  #dueAt = 0;
  #seen = "";
  #marks: { key: string; marks: readonly FrameMark[] } = { key: "", marks: [] };

  constructor(app: App) {
    this.#app = app;
    this.#frames = cellFrames(app);
    const words = (this.#words = app.texts.numberWords);
    this.#frame = h("select", { "aria-label": words.frame });
    this.#link = h("select", { "aria-label": words.link });
    for (const each of [this.#frame, this.#link]) each.addEventListener("change", () => this.#lookAgain());
    this.#shows = h("input", { type: "checkbox", checked: true });
    const heads = [words.dhJoint, "θ", "d", "a", "α"].map((each) => h("th", { scope: "col" }, each));
    this.#dh = h("table", { class: "values" }, h("thead", {}, h("tr", {}, ...heads)), this.#dhBody);
    const limitHeads = [words.dhJoint, words.range, words.greatest].map((each) => h("th", { scope: "col" }, each));
    const part = (title: string, ...children: HTMLElement[]): HTMLElement => h("section", {}, h("h3", {}, title), ...children);
    this.element = h(
      "section",
      { class: "numbers", "aria-label": app.texts.frames },
      part(
        words.where,
        h("div", { class: "pair" }, h("label", {}, h("span", {}, words.frame), this.#frame), h("label", {}, h("span", {}, words.link), this.#link)),
        this.#place,
        h("p", { class: "muted" }, words.live),
      ),
      part(words.matrix, this.#matrix),
      part(words.jacobian, h("div", { class: "wide", tabindex: 0, role: "group", "aria-label": words.jacobian }, this.#jacobian), this.#measures),
      part(words.dh, this.#dh, h("p", { class: "muted" }, words.dhHint), h("label", { class: "check" }, this.#shows, words.showFrames)),
      part(words.specification, this.#specs),
      part(words.limits, h("table", { class: "values" }, h("thead", {}, h("tr", {}, ...limitHeads)), this.#limits)),
    );
  }

  shown(isShown: boolean): void {
    this.#isShown = isShown;
    this.#app.overlay(null);
    if (!isShown) return;
    this.#app.choice.set({ isChecklistOpen: false });
    this.#askedFor = "";
    this.#lookAgain();
  }

  update(cell: Cell): void {
    if (!this.#isShown || cell.stage !== "up" || cell.snapshot === null) return;
    this.#learn(cell);
    this.#look(cell);
    this.#picture(cell);
  }

  #lookAgain(): void {
    this.#seen = "";
    this.#dueAt = 0;
  }

  /** What changes seldom: the robot's facts, frames, links. */
  #learn(cell: Cell): void {
    const { changes, hello, snapshot } = cell;
    if (snapshot === null) return;
    const wanted = [hello?.session, changes[NoticeKind.ROBOT], ...snapshot.frames].join();
    if (wanted === this.#askedFor) return;
    this.#askedFor = wanted;
    fill(this.#frame, ["base", ...snapshot.frames.filter((each) => each !== "base" && !OWN_FRAMES.includes(each))], "base");
    fill(this.#link, ["", ...(cell.robot?.links ?? []).map(({ link }) => link)], "", this.#words.toolCentre);
    this.#app.attempt(async () => {
      const { session } = this.#app;
      const { facts } = await session.call<"robots.describe">({ op: "robots.describe" });
      this.#table = dhTable(facts);
      this.#tellDh();
      this.#tellSpecification(cell, facts);
    });
  }

  /** Ask where the tool is, at most twice a second, and only where it is elsewhere. */
  #look(cell: Cell): void {
    const now = this.#app.now();
    const at = measuredJoints(cell)?.map((each) => each.toFixed(4)).join() ?? "";
    const wanted = `${at} ${this.#frame.value} ${this.#link.value} ${this.#frames.version}`;
    if (this.#isAsking || now < this.#dueAt || wanted === this.#seen) return;
    this.#isAsking = true;
    this.#dueAt = now + EVERY;
    this.#seen = wanted;
    void this.#ask();
  }

  async #ask(): Promise<void> {
    const { session } = this.#app;
    const link = this.#link.value === "" ? null : this.#link.value;
    const frame = this.#frame.value;
    try {
      const [fk, jacobian] = await Promise.all([
        session.call<"kinematics.fk">({ op: "kinematics.fk", frame, link }),
        session.call<"kinematics.jacobian">({ op: "kinematics.jacobian", frame: frame === "root" ? "root" : "base" }),
      ]);
      this.#tellPlace(fk);
      this.#tellJacobian(jacobian);
    } catch (error) {
      if (error instanceof Refused) this.#app.refused(error.refusal);
      else if (!(error instanceof LinkLost)) throw error;
    }
    this.#isAsking = false;
  }

  #tellPlace({ position, orientation, rpy, rpy_unique, axis_angle, matrix }: KinematicsFkReply): void {
    const words = this.#words;
    const unique = rpy_unique ? "" : ` (${words.notUnique})`;
    tell(this.#place, [
      [words.position, position.map((each) => fixed(each * 1000, 2)).join("  ")],
      [words.quaternion, orientation.map((each) => fixed(each, 5)).join("  ")],
      [words.rpy, rpy.map((each) => fixed(each * DEGREES, 3)).join("  ") + unique],
      [words.axisAngle, axis_angle.map((each) => fixed(each * DEGREES, 3)).join("  ")],
    ]);
    fillMatrix(this.#matrix, matrix, 5);
  }

  #tellJacobian({ jacobian, condition, manipulability, nearest_singularity: near }: KinematicsJacobianReply): void {
    const words = this.#words;
    fillMatrix(this.#jacobian, jacobian, 3);
    const distance = near.unit === "rad" ? `${fixed(near.distance * DEGREES, 1)}°` : near.unit === "m" ? `${fixed(near.distance * 1000, 0)} mm` : fixed(near.distance, 4);
    tell(this.#measures, [
      [words.condition, condition === null ? words.infinite : fixed(condition, 2)],
      [words.manipulability, fixed(manipulability, 5)],
      [words.singularity, words.singular(words.kinds[near.kind] ?? near.kind, distance)],
    ]);
  }

  #tellDh(): void {
    const table = this.#table;
    const words = this.#words;
    if (table === null) {
      this.#dhBody.replaceChildren(h("tr", {}, h("td", { colspan: 5 }, words.noDh)));
      return;
    }
    const rows = table.rows.map((row) => {
      const theta = `${row.variable === "theta" ? "q + " : ""}${fixed(row.theta_offset * DEGREES, 1)}`;
      const d = `${row.variable === "theta" ? "" : "q + "}${fixed(row.d * 1000, 1)}`;
      const cells = [theta, d, fixed(row.a * 1000, 1), fixed(row.alpha * DEGREES, 1)];
      return h("tr", {}, h("th", { scope: "row" }, displayName(this.#app, row.joint)), ...cells.map((each) => h("td", {}, each)));
    });
    this.#dhBody.replaceChildren(...rows);
  }

  #tellSpecification(cell: Cell, facts: Readonly<Record<string, unknown>>): void {
    const specs = Object.entries((facts["specs"] ?? {}) as Record<string, unknown>);
    const model = [facts["manufacturer"], facts["model"]].filter((each) => each !== undefined).join(" ");
    tell(this.#specs, [["", model], ...specs.flatMap(([name, value]): [string, string][] => (value === null ? [] : [specWord(name, value)]))]);
    this.#limits.replaceChildren(
      ...(cell.snapshot?.joints ?? []).map((joint) => {
        const [scale, unit] = joint.unit === "rad" ? [DEGREES, "°"] : [1000, " mm"];
        const range = `${fixed(joint.lower * scale, 1)} … ${fixed(joint.upper * scale, 1)}${unit}`;
        const most = `${fixed(joint.velocity * scale, 0)}${unit}/s, ${fixed(joint.acceleration * scale, 0)}${unit}/s²`;
        return h("tr", {}, h("th", { scope: "row" }, joint.display_name ?? joint.name), h("td", {}, range), h("td", {}, most));
      }),
    );
  }

  #picture(cell: Cell): void {
    const chain = sceneModel(this.#app).chain(cell.robot);
    const joints = measuredJoints(cell);
    this.#frames.content(cell); // asked for anew where it changed, also of a robot that stands
    const key = `${String(this.#shows.checked)} ${cell.robot?.robot ?? ""} ${this.#frames.version} ${this.#table?.rows.length ?? 0} ${joints?.map((each) => each.toFixed(4)).join() ?? ""} ${toolPose(cell)?.position.map((each) => each.toFixed(4)).join() ?? ""}`;
    if (key !== this.#marks.key) this.#marks = { key, marks: this.#shows.checked && chain !== null ? this.#marksAt(cell, chain, joints) : [] };
    this.#app.overlay({ frames: this.#marks.marks });
  }

  #marksAt(cell: Cell, chain: Chain, joints: readonly number[] | null): FrameMark[] {
    const own = this.#frames.ofUser(cell, chain);
    if (this.#table === null || joints === null) return own;
    return [...dhFrames(this.#table, chain, joints).map((place, index) => ({ name: String(index), ...place })), ...own];
  }
}

function fill(select: HTMLSelectElement, names: readonly string[], usual: string, emptyWord = ""): void {
  const before = select.options.length === 0 ? usual : select.value;
  select.replaceChildren(...names.map((each) => h("option", { value: each }, each === "" ? emptyWord : each)));
  select.value = names.includes(before) ? before : usual;
}

function tell(list: HTMLElement, rows: readonly (readonly [string, string])[]): void {
  if (list.children.length !== 2 * rows.length) list.replaceChildren(...rows.flatMap(() => [h("dt", {}), h("dd", {})]));
  rows.forEach(([word, value], index) => {
    const [term, detail] = [list.children[2 * index], list.children[2 * index + 1]];
    if (term === undefined || detail === undefined) return;
    say(term, word);
    say(detail, value);
    show(term as HTMLElement, word !== "");
    attribute(detail, "class", word === "" ? "whole" : null);
  });
}

function fillMatrix(table: HTMLTableElement, rows: readonly (readonly number[])[], decimals: number): void {
  const columns = rows[0]?.length ?? 0;
  if (table.rows.length !== rows.length || table.rows[0]?.cells.length !== columns) {
    table.replaceChildren(...rows.map((row) => h("tr", {}, ...row.map(() => h("td", {})))));
  }
  rows.forEach((row, at) =>
    row.forEach((value, column) => {
      const cell = table.rows[at]?.cells[column];
      if (cell !== undefined) say(cell, fixed(value, decimals));
    }),
  );
}

/** Return a specification's name and value as people write them: its key ends with the unit. */
function specWord(name: string, value: unknown): [string, string] {
  const [, word = name, unit = ""] = /^(.*)_(kg|m|deg|s)$/.exec(name) ?? [];
  const isLength = unit === "m" && typeof value === "number";
  const told = isLength ? `${fixed(value * 1000, 2).replace(/\.?0+$/, "")} mm` : `${String(value)} ${unit}`.trim();
  return [word.replaceAll("_", " "), told];
}
