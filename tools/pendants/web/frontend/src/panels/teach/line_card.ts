// The chosen line: what the dry run found of it, its point in numbers, and what can be done with it.
import { rollPitchYaw } from "../../kinematics/pose.ts";
import type { Quaternion } from "../../kinematics/pose.ts";
import type { TeachPoint } from "../../operations.ts";
import type { Cell } from "../../pendant/cell.ts";
import { Motion, OperatingMode } from "../../protocol.ts";
import { comment, renamePoint, replace, touchUp } from "../../teach/edits.ts";
import { beyond, touchesItself, waysOut } from "../../teach/findings.ts";
import type { Finding } from "../../teach/findings.ts";
import { commentOf, lineOf, nameProblem, pointOf } from "../../teach/program.ts";
import type { Move, Statement } from "../../teach/program.ts";
import { readSpeed, readZone, typedSpeed, typedZone } from "../../teach/typed.ts";
import type { App, Part } from "../../ui/app.ts";
import { attribute, h, mark, off, say, show } from "../../ui/elements.ts";
import { holdButton } from "../../ui/hold-button.ts";
import { icon } from "../../ui/icons.ts";
import type { RequestDraft } from "../../wire/link.ts";
import { enablingPad } from "../enabling-pad.ts";
import { shown, whyNoMotion } from "../jog.ts";
import { addForm } from "./add_form.ts";
import type { Desk } from "./desk.ts";
import { beyondWords, sentence, wayOutWords } from "./finding.ts";
import { renameForm } from "./rename_form.ts";

const SLOTS = 10;
const AXES = ["X", "Y", "Z", "R", "P", "Y"];

export function lineCard(desk: Desk): Part {
  const { app, texts } = desk;
  const title = h("strong", {});
  const where = h("span", { class: "muted" });
  const chosen = (): Statement | null => desk.program?.statements[desk.teaching.selected] ?? null;
  const point = (): TeachPoint | null => (desk.program === null ? null : pointOf(desk.program, desk.teaching.selected));
  const rename = renameForm(desk, {
    name: () => point()?.name ?? "",
    problem: (name) => nameProblem(name, (desk.program?.points ?? []).map((each) => each.name)),
    rename: (from, to) => desk.teaching.change((program) => renamePoint(program, from, to, desk.teaching.selected)),
  });
  const found = findingBox(desk);
  const fields = moveFields(desk, chosen);
  const numbers = pointNumbers(app);
  const add = addForm(desk);
  const touch = h("button", { type: "button" }, texts.touchUp);
  touch.addEventListener("click", () => {
    const name = point()?.name;
    if (name === undefined) return;
    desk.attempt(() => desk.teaching.change((program) => touchUp(program, name, desk.teaching.selected)));
  });
  const go = goButton(desk, point);
  const acts = h("div", { class: "line-acts" }, touch, go.element);
  const pad = enablingPad(app);
  const element = h(
    "section",
    { class: "line-card", "aria-label": texts.line },
    h("header", {}, title, where, rename.element),
    found.element,
    fields.element,
    numbers.element,
    acts,
    add.element,
    pad.element,
  );
  return {
    element,
    update(cell) {
      const statement = chosen();
      const at = point();
      const { program, teaching } = desk;
      const isChosen = program !== null && statement !== null;
      say(title, at?.name ?? (isChosen ? statement.statement : texts.endOfProgram));
      say(where, isChosen ? texts.lineOf(lineOf(program, teaching.selected)) : "");
      const finding = desk.findingAt(teaching.selected);
      attribute(element, "data-mark", isChosen ? (finding?.mark ?? "none") : "none");
      show(rename.element, at !== null);
      show(acts, at !== null);
      mark(touch, "orange", finding?.mark === "bad" && !desk.transport(cell).isUnderWay);
      for (const each of [rename, found, fields, go, add]) each.update(cell);
      numbers.tell(at, cell);
      const isAsked = cell.state?.operating_mode !== OperatingMode.AUTOMATIC;
      show(pad.element, isAsked);
      if (isAsked) pad.update(cell);
    },
  };
}

/** Why a line cannot be done, and two ways out. */
function findingBox(desk: Desk): Part {
  const { texts } = desk;
  const sign = icon("cross");
  const why = h("span", {});
  const out = h("span", {});
  const ptp = h("button", { type: "button" }, texts.makePtp);
  ptp.addEventListener("click", () => {
    const at = desk.teaching.selected;
    desk.attempt(() =>
      desk.teaching.change((program) => {
        const move = program.statements[at];
        return move?.statement === "move" ? replace(program, at, asPtp(move)) : null;
      }),
    );
  });
  const element = h("div", { class: "finding-box", role: "status" }, sign, h("div", {}, why, " ", h("strong", {}, texts.waysOut), " ", out, " ", ptp));
  return {
    element,
    update() {
      const at = desk.teaching.selected;
      const finding = desk.findingAt(at);
      show(element, finding?.mark === "bad");
      if (finding?.mark !== "bad") return;
      const statement = desk.program?.statements[at];
      const way = statement?.statement === "move" ? statement.way : "";
      const links = (desk.app.cell.value.robot?.links ?? []).map((each) => each.link);
      const [first, second] = waysOut(finding.code, way, touchesItself(finding.text, links));
      say(why, whyText(desk, at, finding));
      say(out, `${wayOutWords(desk, first)}, ${texts.or} ${wayOutWords(desk, second)}.`);
      show(ptp, first === "ptp");
    },
  };
}

/** Take away what PTP has not: a speed in mm/s, a zone in mm, points in between. */
function asPtp(move: Move): Move {
  const { via: _via, zone: _zone, speed, ...rest } = move;
  const kept = speed?.kind === "fraction" ? { speed } : {};
  return { ...rest, ...kept, way: "PTP" };
}

function whyText(desk: Desk, at: number, finding: Finding): string {
  const words = beyondWords(desk, at);
  const told = sentence(desk, finding);
  const text = words === "" ? told : `${words}. ${told}`;
  return /[.!?]$/.test(text) ? text : `${text}.`;
}

/** Way, speed, zone and comment of the chosen line. */
function moveFields(desk: Desk, chosen: () => Statement | null): Part {
  const { texts } = desk;
  const way = h("select", { "aria-label": texts.way }, ...["PTP", "LIN"].map((each) => h("option", { value: each }, each)));
  const speed = h("input", { type: "text", "aria-label": texts.speed, title: texts.speedHint, size: 8 });
  const zone = h("input", { type: "text", "aria-label": texts.zone, size: 6 });
  const said = h("input", { type: "text", "aria-label": texts.comment, placeholder: texts.comment, maxlength: 200 });
  const problem = h("span", { class: "problem", role: "alert" });
  let shownOf = "";
  const put = (make: (move: Move) => Move | null, wrong: string): void => {
    const at = desk.teaching.selected;
    const statement = chosen();
    if (statement?.statement !== "move") return;
    say(problem, make(statement) === null ? wrong : "");
    desk.attempt(() =>
      desk.teaching.change((program) => {
        const now = program.statements[at];
        const made = now?.statement === "move" ? make(now) : null;
        return made === null ? null : replace(program, at, made);
      }),
    );
  };
  way.addEventListener("change", () => put((move) => (way.value === "PTP" ? asPtp(move) : asLine(move)), ""));
  speed.addEventListener("change", () => put((move) => typedSpeed(move, speed.value), texts.speedWrong));
  zone.addEventListener("change", () => put((move) => typedZone(move, zone.value), texts.zoneWrong));
  said.addEventListener("change", () => {
    const at = desk.teaching.selected;
    desk.attempt(() => desk.teaching.change((program) => comment(program, at, said.value)));
  });
  for (const each of [speed, zone, said]) {
    each.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      shownOf = "";
      each.blur();
    });
  }
  const ofMove = h("div", { class: "pair" }, way, speed, zone);
  const element = h("div", { class: "line-fields" }, ofMove, said, problem);
  return {
    element,
    update() {
      const statement = chosen();
      show(element, statement !== null);
      const isMove = statement?.statement === "move" && ["PTP", "LIN"].includes(statement.way);
      show(ofMove, isMove);
      show(said, statement !== null);
      const key = `${desk.program?.name} ${desk.program?.revision} ${desk.teaching.selected}`;
      if (statement === null || key === shownOf) return;
      shownOf = key;
      say(problem, "");
      said.value = commentOf(statement);
      if (statement.statement !== "move") return;
      way.value = statement.way;
      speed.value = readSpeed(statement);
      zone.value = readZone(statement);
      zone.title = statement.way === "PTP" ? texts.zoneHintPtp : texts.zoneHint;
    },
  };
}

function asLine(move: Move): Move {
  const { zone: _zone, ...rest } = move;
  return { ...rest, way: "LIN" };
}

/** A point in numbers: the place of its tool, and its joints. */
function pointNumbers(app: App) {
  const place = h("dl", {});
  const joints = h("dl", {});
  const element = h("div", { class: "point-numbers" }, place, joints);
  let shownOf: TeachPoint | null = null;
  return {
    element,
    tell(point: TeachPoint | null, cell: Cell): void {
      show(element, point !== null);
      if (point === shownOf || point === null) return;
      shownOf = point;
      const { areRadians } = app.settings.value;
      const limits = cell.snapshot?.joints ?? [];
      const out = new Set(beyond(point.joints, limits).map((each) => each.joint));
      const names = app.jointNames();
      const pose = point.pose ?? null;
      const values = pose === null ? [] : [...pose.position, ...rollPitchYaw(pose.quaternion as unknown as Quaternion)];
      place.replaceChildren(
        ...values.flatMap((each, index) => pair(AXES[index] ?? "", shown(each, index > 2, areRadians).join(""), false)),
      );
      joints.replaceChildren(
        ...point.joints.flatMap((each, index) =>
          pair(names[index] ?? String(index + 1), shown(each, limits[index]?.unit !== "m", areRadians).join(""), out.has(index)),
        ),
      );
    },
  };
}

function pair(name: string, value: string, isOut: boolean): HTMLElement[] {
  return [h("dt", { class: isOut ? "bad" : null }, name), h("dd", { class: isOut ? "bad" : null }, value)];
}

/** Goes to the point for as long as it is held. */
function goButton(desk: Desk, point: () => TeachPoint | null): Part {
  const { app, texts } = desk;
  const button = holdButton(
    "go",
    texts.holdGo,
    {
      down: (source) => {
        const at = point();
        if (at !== null) app.holding.holdMotion(source, goingTo(at, app.holding.speed));
      },
      up: (source) => app.holding.release(source),
      explain: () => app.choice.set({ note: { text: app.texts.holdHow, kind: "remark" } }),
    },
    texts.holdGo,
  );
  return {
    element: button,
    update(cell) {
      const at = point();
      attribute(button, "aria-label", texts.holdGoTo(at?.name ?? ""));
      const dof = cell.hello?.dof ?? 0;
      const isOther = at !== null && dof > 0 && at.joints.length !== dof;
      off(button, isOther ? texts.otherRobot : desk.transport(cell).isUnderWay ? texts.whyUnderWay : whyNoMotion(app, cell));
    },
  };
}

/** Return the motion to a point: to its joints, or in a user frame to its place, which may have moved. */
function goingTo(point: TeachPoint, speed: number): RequestDraft {
  const { pose } = point;
  if (pose != null && pose.frame !== "base" && pose.frame !== "root") {
    return { type: "pose_move", motion: Motion.PTP, speed, frame: pose.frame, position: [...pose.position], orientation: [...pose.quaternion] };
  }
  const joints = [...point.joints, ...new Array<number>(Math.max(0, SLOTS - point.joints.length)).fill(0)];
  return { type: "joint_move", speed, joint_count: point.joints.length, joints };
}
