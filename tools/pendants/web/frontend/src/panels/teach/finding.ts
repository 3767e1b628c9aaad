// The words of a finding, in the language of whoever reads it.
import { causeAndRemedy } from "../../texts/texts.ts";
import { beyond, inScreenUnits } from "../../teach/findings.ts";
import type { Finding, WayOut } from "../../teach/findings.ts";
import { pointOf } from "../../teach/program.ts";
import { shown } from "../jog.ts";
import type { Desk } from "./desk.ts";

/** Return a finding in a few words. */
export function findingWords(desk: Desk, index: number, found: Finding): string {
  const { texts, program } = desk;
  const kind = program?.statements[index]?.statement;
  switch (found.mark) {
    case "good":
      return kind === "move" ? texts.reachable : texts.done;
    case "remark":
      return texts.remarkZone;
    case "bad":
      // What would be accepted stands beside the chosen line.
      return beyondWords(desk, index) || (sentence(desk, found).split("; accepted")[0] ?? "");
    case "unchecked":
      return { "": texts.notChecked, zone: texts.notChecked, signal: texts.notCheckedSignal, branch: texts.notCheckedBranch }[found.why];
    case "none":
      return "";
  }
}

/** Return the joint of a point that is farthest outside, with its limit; empty where none is. */
export function beyondWords(desk: Desk, index: number): string {
  const { app, program, texts } = desk;
  const point = program === null ? null : pointOf(program, index);
  const joints = app.cell.value.snapshot?.joints ?? [];
  const first = point === null ? undefined : beyond(point.joints, joints)[0];
  if (first === undefined) return "";
  const joint = joints[first.joint];
  const isAngle = joint?.unit !== "m";
  const { areRadians } = app.settings.value;
  const [value, limit] = [first.value, first.limit].map((each) => shown(each, isAngle, areRadians).join(""));
  return texts.beyond(app.jointNames()[first.joint] ?? "", value ?? "", limit ?? "");
}

/** Return the server's sentence; another language has the cause of its code. */
export function sentence(desk: Desk, found: { code: number; text: string }): string {
  const { language, areRadians } = desk.app.settings.value;
  if (language === "en" && found.text !== "") return areRadians ? found.text : inScreenUnits(found.text);
  return causeAndRemedy(found.code, found.text, language)[0];
}

export function wayOutWords(desk: Desk, way: WayOut): string {
  const { texts } = desk;
  return {
    ptp: texts.outPtp,
    touchUp: texts.outTouchUp,
    around: texts.outAround,
    moveObject: texts.outMoveObject,
    closer: texts.outCloser,
    raise: texts.outRaise,
    slower: texts.outSlower,
    text: texts.outText,
    other: texts.outOther,
  }[way];
}
