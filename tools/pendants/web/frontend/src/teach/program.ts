// A taught program as it was loaded: its points, its statements, and the rows that a table shows.
import type { InsertStatements, TeachPoint } from "../operations.ts";

export type Statement = InsertStatements["statements"][number];
export type Move = Extract<Statement, { statement: "move" }>;

/** The JSON form of a program, as far as the page reads it. */
export interface ProgramDocument {
  name: string;
  points: TeachPoint[];
  statements: Statement[];
  tool?: string;
  frame?: string;
}

export interface Program {
  name: string;
  revision: number;
  savedBy: string;
  points: readonly TeachPoint[];
  statements: readonly Statement[];
  /** The canonical text, which ends with one line for each statement. */
  text: string;
  /** Line of the first statement in the text, from 1. */
  firstLine: number;
  /** Statements that a run pauses before, from 0. */
  breakpoints: readonly number[];
}

export interface Row {
  index: number;
  /** How many blocks it stands in. */
  depth: number;
  /** What stands in front of the bold word; for a move "move". */
  words: string;
  strong: string;
  point: string;
  speed: string;
  zone: string;
  comment: string;
}

/** Make a program from both of its forms, of one revision. */
export function programOf(
  head: { name: string; revision: number; saved_by: string; breakpoints?: number[] },
  document: ProgramDocument,
  text: string,
): Program {
  const count = lines(text).length - document.statements.length;
  return {
    name: head.name,
    revision: head.revision,
    savedBy: head.saved_by,
    points: document.points,
    statements: document.statements,
    text,
    firstLine: count + 1,
    breakpoints: head.breakpoints ?? [],
  };
}

function lines(text: string): string[] {
  const split = text.split("\n");
  return split.at(-1) === "" ? split.slice(0, -1) : split;
}

/** Return the line of a statement in the program's text. */
export function lineOf(program: Program, index: number): number {
  return program.firstLine + index;
}

/** Return the statement on a line of the text; -1 where none stands there. */
export function indexOf(program: Program, line: number): number {
  const index = line - program.firstLine;
  return index >= 0 && index < program.statements.length ? index : -1;
}

/** Return a row for each statement, in its order. */
export function rowsOf(program: Program): Row[] {
  const told = lines(program.text);
  let depth = 0;
  return program.statements.map((statement, index) => {
    const kind = statement.statement;
    if (kind === "end") depth = Math.max(0, depth - 1);
    const own = kind === "else" ? Math.max(0, depth - 1) : depth;
    if (opens(statement)) depth += 1;
    const line = told[program.firstLine - 1 + index] ?? kind;
    return { index, depth: own, comment: commentOf(statement), ...cellsOf(statement, line) };
  });
}

type Cells = Pick<Row, "words" | "strong" | "point" | "speed" | "zone">;

function cellsOf(statement: Statement, line: string): Cells {
  if (statement.statement !== "move") {
    return { words: withoutComment(statement, line), strong: "", point: "", speed: "", zone: "" };
  }
  const via = statement.via ?? [];
  return {
    words: "move",
    strong: statement.way,
    point: via.length === 0 ? statement.point : `${statement.point} via ${via.join(", ")}`,
    speed: speedText(statement),
    zone: zoneText(statement),
  };
}

function withoutComment(statement: Statement, line: string): string {
  const words = line.trim();
  const comment = commentOf(statement);
  if (statement.statement === "comment" || comment === "") return words;
  return words.endsWith(`# ${comment}`) ? words.slice(0, -comment.length - 2).trimEnd() : words;
}

export function commentOf(statement: Statement): string {
  return statement.comment ?? "";
}

/** Return the speed of a move as its text has it. */
export function speedText(move: Move): string {
  const { kind, value } = move.speed ?? { kind: "fraction", value: 1 };
  return kind === "fraction" ? `${plain(value * 100)} %` : `${plain(value * 1000)} mm/s`;
}

/** Return the zone of a move, or how long it stands; empty for a stop. */
export function zoneText(move: Move): string {
  const { zone = 0, dwell = 0 } = move;
  if (dwell > 0) return `${plain(dwell)} s`;
  if (zone === 0) return "";
  return move.way === "PTP" ? `${plain((zone * 180) / Math.PI)}°` : `${plain(zone * 1000)} mm`;
}

/** Return a number without decimals that nobody typed. */
function plain(value: number): string {
  return String(Number(value.toFixed(4)));
}

export function opens(statement: Statement): boolean {
  return ["loop", "if-input", "if-flag"].includes(statement.statement);
}

/** Return the statements that go or move together with one: a block goes whole. */
export function blockOf(statements: readonly Statement[], index: number): { first: number; count: number } {
  const statement = statements[index];
  if (statement === undefined) return { first: index, count: 0 };
  const { statement: kind } = statement;
  if (!opens(statement) && kind !== "else" && kind !== "end") return { first: index, count: 1 };
  const first = opens(statement) ? index : openerOf(statements, index);
  let depth = 0;
  for (let at = first; at < statements.length; at += 1) {
    const each = statements[at];
    if (each === undefined) break;
    if (opens(each)) depth += 1;
    if (each.statement === "end") depth -= 1;
    if (depth === 0) return { first, count: at - first + 1 };
  }
  return { first, count: 1 };
}

function openerOf(statements: readonly Statement[], index: number): number {
  let depth = 1;
  for (let at = index - 1; at >= 0; at -= 1) {
    const each = statements[at];
    if (each === undefined) break;
    if (each.statement === "end") depth += 1;
    if (opens(each)) depth -= 1;
    if (depth === 0) return at;
  }
  return index;
}

/** Return the first unused name of a point: P1, P2 and so on. */
export function freshPoint(points: readonly TeachPoint[]): string {
  const taken = new Set(points.map((each) => each.name));
  for (let number = 1; ; number += 1) {
    const name = `P${number}`;
    if (!taken.has(name)) return name;
  }
}

/** Return how many moves go to a point, or through it. */
export function usesOf(program: Program, point: string): number {
  return program.statements.filter(
    (each) => each.statement === "move" && (each.point === point || (each.via ?? []).includes(point)),
  ).length;
}

export function pointOf(program: Program, index: number): TeachPoint | null {
  const statement = program.statements[index];
  if (statement?.statement !== "move") return null;
  return program.points.find((each) => each.name === statement.point) ?? null;
}

/** Return why a name cannot be given; empty where it can. */
export function nameProblem(name: string, taken: readonly string[]): "" | "empty" | "long" | "signs" | "taken" {
  if (name.trim() === "") return "empty";
  if ([...name].length > 64 || new TextEncoder().encode(name).length > 64) return "long";
  if (/[/\\"\p{Cc}]/u.test(name)) return "signs";
  return taken.includes(name) ? "taken" : "";
}
