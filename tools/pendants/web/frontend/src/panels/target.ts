// The value of a row, which takes a typed target or increment and then a button to hold.
import { jointRows, toolValues } from "../pendant/axes.ts";
import { ofRpy } from "../kinematics/pose.ts";
import { Motion } from "../protocol.ts";
import { readNumber } from "../texts/texts.ts";
import type { App, Part } from "../ui/app.ts";
import { h, off, say, show } from "../ui/elements.ts";
import { holdButton } from "../ui/hold-button.ts";
import type { RequestDraft } from "../wire/link.ts";
import { shown, whyNoMotion } from "./jog.ts";

const SLOTS = 10;

/** Return what was typed as a target [rad or m]: with a sign in front of `+` it is an increment. */
export function readTarget(
  typed: string,
  isAngle: boolean,
  areRadians: boolean,
  from: number,
): number | null {
  const text = typed.trim().replace(/(°|rad|mm)$/, "");
  const isIncrement = /^\+/.test(text);
  const value = readNumber(isIncrement ? text.slice(1) : text);
  if (value === null) return null;
  const scale = !isAngle ? 1e-3 : areRadians ? 1 : Math.PI / 180;
  return isIncrement ? from + value * scale : value * scale;
}

export function targetBox(app: App, name: string, index: number, isAngle: boolean): Part {
  const { texts } = app;
  const value = h("button", { type: "button", class: "value-box", title: `${texts.target(name)}. ${texts.targetHint}` });
  const input = h("input", { type: "text", inputmode: "text", "aria-label": texts.target(name), placeholder: texts.targetHint });
  const problem = h("span", { class: "problem", role: "alert" });
  let target: number | null = null;
  const go = holdButton(
    "go",
    null,
    {
      down: (source) => {
        const draft = target === null ? null : draftOf(app, index, target);
        if (draft !== null) app.holding.holdMotion(source, draft);
      },
      up: (source) => app.holding.release(source),
      explain: () => app.choice.set({ note: { text: texts.holdHow, kind: "remark" } }),
    },
    texts.holdToGo(""),
  );
  const editor = h("div", { class: "editor" }, input, go, problem);
  editor.hidden = true;
  const close = (): void => {
    show(editor, false);
    target = null;
  };
  const read = (): void => {
    const { areRadians } = app.settings.value;
    target = readTarget(input.value, isAngle, areRadians, current(app, index) ?? 0);
    say(problem, input.value === "" ? "" : problemOf(app, index, isAngle, target));
    if (problem.textContent !== "") target = null;
    const told = target === null ? "" : shown(target, isAngle, areRadians).join("");
    say(go, texts.holdToGo(told));
  };
  value.addEventListener("click", () => {
    show(editor, editor.hidden === true);
    input.value = "";
    read();
    if (!editor.hidden) input.focus();
  });
  input.addEventListener("input", read);
  input.addEventListener("keydown", (event) => {
    if (event.key === "Escape") {
      close();
      value.focus();
      event.stopPropagation();
    }
    if (event.key === "Enter") go.focus();
  });
  return {
    element: h("div", { class: "target" }, value, editor),
    update(cell) {
      off(go, target === null ? texts.targetHint : whyNoMotion(app, cell));
    },
  };
}

function current(app: App, index: number): number | null {
  const cell = app.cell.value;
  if (app.choice.value.axes === "joint") return jointRows(cell)[index]?.value ?? null;
  return toolValues(cell)?.[index] ?? null;
}

function problemOf(app: App, index: number, isAngle: boolean, target: number | null): string {
  const { texts } = app;
  if (target === null) return texts.targetWrong;
  if (app.choice.value.axes !== "joint") return "";
  const limits = jointRows(app.cell.value)[index]?.limits;
  if (limits === null || limits === undefined) return "";
  const [lower, upper] = limits;
  const { areRadians } = app.settings.value;
  const ends = limits.map((each) => shown(each, isAngle, areRadians).join(""));
  if (target >= lower && target <= upper) return "";
  return texts.targetBeyond(ends[0] ?? "", ends[1] ?? "");
}

function draftOf(app: App, index: number, target: number): RequestDraft | null {
  const cell = app.cell.value;
  const { speed } = app.holding;
  if (app.choice.value.axes === "joint") {
    const dof = cell.hello?.dof ?? 0;
    const joints = new Array<number>(SLOTS).fill(0);
    for (let each = 0; each < dof; each += 1) joints[each] = cell.state?.positions[each] ?? 0;
    joints[index] = target;
    return { type: "joint_move", speed, joint_count: dof, joints };
  }
  const values = toolValues(cell);
  if (values === null) return null;
  values[index] = target;
  return {
    type: "pose_move",
    motion: Motion.LIN,
    speed,
    frame: "base",
    position: values.slice(0, 3),
    orientation: [...ofRpy(values.slice(3))],
  };
}
