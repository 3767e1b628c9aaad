// What a dry run found of each line: reachable, with a remark, not reachable, or not checked.
//
// Findings are those of one revision and of the cell as it stood: any edit, and any notice that the
// scene, the frames or the tools changed, makes all lines not checked.
import type { Operations } from "../operations.ts";
import { VerdictCode } from "../protocol.ts";
import { lineOf } from "./program.ts";
import type { Program } from "./program.ts";

export type Mark = "good" | "remark" | "bad" | "unchecked" | "none";

export type Remark = "" | "zone" | "signal" | "branch";

export interface Finding {
  mark: Mark;
  /** Entry of the catalogue for what is not reachable; 0 for none. */
  code: number;
  /** The server's sentence. */
  text: string;
  /** Of a remark, or of a line that was not checked: why. */
  why: Remark;
}

export interface Findings {
  name: string;
  revision: number;
  /** Of the whole program [s]. */
  duration: number;
  isEndless: boolean;
  isComplete: boolean;
  refused: number;
  lines: ReadonlyMap<number, Finding>;
  /** Lines whose move stops although it has a zone. */
  stopsAt: ReadonlySet<number>;
  points: ReadonlyMap<string, Finding>;
  /** Refusals in programs that it calls. */
  elsewhere: readonly { program: string; line: number; code: number; text: string }[];
  /** x, y, z of the tool in base, one after the other [m]. */
  path: Float32Array;
}

type Reply = Operations["programs.dry_run"][1];
type Verdict = { reachable: boolean; code?: number; text?: string };

const UNCHECKED: Finding = { mark: "unchecked", code: 0, text: "", why: "" };
const NONE: Finding = { mark: "none", code: 0, text: "", why: "" };

/** Read the answer to `programs.dry_run`. */
export function findingsOf(reply: Reply): Findings {
  const { program: name } = reply;
  const told = [...reply.moves, ...reply.scene, ...reply.statements];
  const lines = new Map<number, Finding>();
  for (const each of told) if (each.program === name) keep(lines, each.line, findingOf(each));
  for (const each of reply.unchecked) mark(lines, name, each, "signal");
  for (const each of reply.not_walked) mark(lines, name, each, "branch");
  const points = new Map<string, Finding>();
  for (const each of reply.points) keep(points, each.point, findingOf(each));
  return {
    name,
    revision: reply.revision,
    duration: reply.duration,
    isEndless: reply.endless,
    isComplete: reply.complete,
    refused: reply.refused,
    lines,
    stopsAt: new Set(reply.moves.filter((each) => each.program === name && !each.zone_used).map((each) => each.line)),
    points,
    elsewhere: told
      .filter((each) => each.program !== name && !each.reachable)
      .map(({ program, line, code = 0, text = "" }) => ({ program, line, code, text: withoutPlace(text) })),
    path: new Float32Array(reply.path.flatMap((each) => each.slice(1, 4))),
  };
}

function mark(
  lines: Map<number, Finding>,
  name: string,
  place: { program: string; line: number },
  why: Remark,
): void {
  if (place.program === name && !lines.has(place.line)) lines.set(place.line, { ...UNCHECKED, why });
}

function findingOf(verdict: Verdict): Finding {
  if (verdict.reachable) return { mark: "good", code: 0, text: "", why: "" };
  return { mark: "bad", code: verdict.code ?? 0, text: withoutPlace(verdict.text ?? ""), why: "" };
}

/** One verdict for each key; a refusal replaces what can be done. */
function keep<Key>(found: Map<Key, Finding>, key: Key, finding: Finding): void {
  if (found.get(key)?.mark !== "bad") found.set(key, finding);
}

/** The place that a sentence begins with is known from where it is shown. */
function withoutPlace(text: string): string {
  return text.replace(/^[^:]*, line \d+(, point [^:]*)?: /, "");
}

/** Whether findings are of the shown program, as it is now. */
export function isOf(findings: Findings | null, program: Program): findings is Findings {
  return findings !== null && findings.name === program.name && findings.revision === program.revision;
}

/** Return what is known of a statement; null findings are those of no dry run, or an old one. */
export function findingAt(findings: Findings | null, program: Program, index: number): Finding {
  const statement = program.statements[index];
  if (statement === undefined || isOnlyRead(statement.statement)) return NONE;
  if (!isOf(findings, program)) return UNCHECKED;
  const isMove = statement.statement === "move";
  const line = findings.lines.get(lineOf(program, index));
  const point = isMove ? findings.points.get(statement.point) : undefined;
  if (line?.mark !== "bad" && point?.mark === "bad") return point;
  if (line === undefined) return isMove ? UNCHECKED : NONE;
  const stops = isMove && line.mark === "good" && (statement.zone ?? 0) > 0;
  return stops && findings.stopsAt.has(lineOf(program, index)) ? { ...line, mark: "remark", why: "zone" } : line;
}

/** Statements that a dry run has nothing to say of. */
function isOnlyRead(kind: string): boolean {
  return ["comment", "end", "else", "loop", "call", "wait"].includes(kind);
}

export interface Beyond {
  joint: number;
  value: number;
  limit: number;
}

/** Return the joints of a point that are outside their limits, the farthest first. */
export function beyond(
  joints: readonly number[],
  limits: readonly { lower: number; upper: number }[],
): Beyond[] {
  const found = joints.flatMap((value, joint): Beyond[] => {
    const each = limits[joint];
    if (each === undefined || (value >= each.lower && value <= each.upper)) return [];
    return [{ joint, value, limit: value < each.lower ? each.lower : each.upper }];
  });
  return found.sort((a, b) => Math.abs(b.value - b.limit) - Math.abs(a.value - a.limit));
}

/** What would help: always two ways out, by what was refused. */
export type WayOut = "ptp" | "touchUp" | "around" | "moveObject" | "closer" | "raise" | "slower" | "text" | "other";

/** Return two ways out of what a line was refused for; `isOwn` where the robot touches itself. */
export function waysOut(code: number, way: string, isOwn = false): [WayOut, WayOut] {
  const { OUT_OF_RANGE, UNREACHABLE, BRANCH_CHANGE, NOTHING_GRIPPED } = VerdictCode;
  const collisions: number[] = [VerdictCode.START_IN_COLLISION, VerdictCode.GOAL_IN_COLLISION, VerdictCode.PATH_IN_COLLISION];
  const isStraight = way === "LIN" || way === "CIRC";
  if (code === NOTHING_GRIPPED) return ["closer", "moveObject"];
  if (collisions.includes(code)) {
    if (!isOwn) return ["around", "moveObject"];
    return isStraight ? ["ptp", "around"] : ["around", "touchUp"];
  }
  if (isStraight) return ["ptp", "touchUp"];
  const isOut = ([OUT_OF_RANGE, UNREACHABLE, BRANCH_CHANGE] as number[]).includes(code);
  if (isOut) return ["touchUp", "raise"];
  return way === "" ? ["text", "other"] : ["touchUp", "slower"];
}

/** Whether a refusal names two bodies that are both of the robot. */
export function touchesItself(text: string, links: readonly string[]): boolean {
  const found = /^(\S+) and (\S+) touch/.exec(text);
  return found !== null && links.includes(found[1] ?? "") && links.includes(found[2] ?? "");
}

const NUMBER = String.raw`-?\d+(?:\.\d+)?(?:e[+-]?\d+)?`;
const QUANTITY = new RegExp(String.raw`(?<![\w.])(${NUMBER})(?: to (${NUMBER}))? (rad|m)(/s²?)?(?![\w/²])`, "g");

/** Return a sentence with its angles in degrees and its lengths in mm. */
export function inScreenUnits(sentence: string): string {
  return sentence.replace(QUANTITY, (...found: (string | undefined)[]) => {
    const [, first = "0", second, unit, per = ""] = found;
    const isAngle = unit === "rad";
    const numbers = second === undefined ? [first] : [first, second];
    const told = numbers.map((each) =>
      isAngle ? ((Number(each) * 180) / Math.PI).toFixed(1) : (Number(each) * 1000).toFixed(1),
    );
    return `${told.join(" to ")}${isAngle ? "°" : " mm"}${per}`;
  });
}
