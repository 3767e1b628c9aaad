// The requests that change a program. Each names the revision that it was made from, so that two
// clients cannot overwrite each other's; the server checks each, and what it takes is the truth.
import type { Operations, Way } from "../operations.ts";
import { blockOf, freshPoint } from "./program.ts";
import type { Move, Program, Statement } from "./program.ts";

type Edit = Operations["programs.edit"][0]["edit"];
type EditOperation =
  | "programs.edit"
  | "programs.record"
  | "programs.touch_up"
  | "programs.undo"
  | "programs.redo";

/** A request, and the statement that is chosen once it is done. */
export interface Change {
  request: Operations[EditOperation][0];
  chosen: number;
}

function from(program: Program) {
  return { name: program.name, expected_revision: program.revision };
}

function edited(program: Program, edit: Edit, chosen: number): Change {
  return { request: { op: "programs.edit", ...from(program), edit }, chosen };
}

/** Add a point where the robot stands, and a move to it: before a statement, or at the end. */
export function recordHere(program: Program, way: Way, at: number | null): Change {
  const point = freshPoint(program.points);
  const move: Move = { statement: "move", way, point };
  return {
    request: { op: "programs.record", ...from(program), point, move, at },
    chosen: at ?? program.statements.length,
  };
}

/** Put a point where the robot stands now. */
export function touchUp(program: Program, point: string, chosen: number): Change {
  return { request: { op: "programs.touch_up", ...from(program), point }, chosen };
}

export function history(program: Program, op: "programs.undo" | "programs.redo", chosen: number): Change {
  return { request: { op, ...from(program) }, chosen };
}

/** Put statements before another, or at the end. */
export function insert(program: Program, statements: Statement[], at: number | null): Change {
  return edited(program, { edit: "insert", statements, at }, at ?? program.statements.length);
}

/** Delete a statement; a block goes whole. */
export function remove(program: Program, index: number): Change | null {
  const { first, count } = blockOf(program.statements, index);
  if (count === 0) return null;
  return edited(program, { edit: "delete", first, count }, Math.max(0, first - 1));
}

/** Move a statement, and its whole block, up or down past its neighbour; null where none is. */
export function shift(program: Program, index: number, by: 1 | -1): Change | null {
  const { statements } = program;
  const { first, count } = blockOf(statements, index);
  const next = by < 0 ? first - 1 : first + count;
  if (count === 0 || next < 0 || next >= statements.length) return null;
  const to = first + by;
  return edited(program, { edit: "reorder", first, count, to }, index + by);
}

/** Put a statement, and its whole block, in front of another; the number behind the last is the end. */
export function drop(program: Program, index: number, before: number): Change | null {
  const { first, count } = blockOf(program.statements, index);
  if (count === 0 || (before >= first && before <= first + count)) return null;
  const to = before > first ? before - count : before;
  return edited(program, { edit: "reorder", first, count, to }, to + (index - first));
}

export function replace(program: Program, index: number, statement: Statement): Change {
  return edited(program, { edit: "replace", at: index, statement }, index);
}

export function comment(program: Program, index: number, text: string): Change {
  return edited(program, { edit: "comment", at: index, comment: text }, index);
}

export function renamePoint(program: Program, name: string, newName: string, chosen: number): Change {
  return edited(program, { edit: "rename-point", name, new_name: newName }, chosen);
}

export function deletePoint(program: Program, name: string, chosen: number): Change {
  return edited(program, { edit: "delete-point", name }, chosen);
}

const PART = 15_000;

/** Return a text in parts that fit a frame, none of which cuts a character. */
export function partsOf(text: string, size = PART): string[] {
  const parts: string[] = [];
  for (let at = 0; at < text.length; ) {
    let end = Math.min(text.length, at + size);
    const last = text.charCodeAt(end - 1);
    if (end < text.length && last >= 0xd800 && last <= 0xdbff) end -= 1;
    parts.push(text.slice(at, end));
    at = end;
  }
  return parts.length === 0 ? [""] : parts;
}

/** Return line and column of what a refusal finds wrong in a text, from 1; null where it has none. */
export function placeOf(text: string): { line: number; column: number; rest: string } | null {
  const found = /^(?:[^:]*:)?(\d+):(\d+): (.*)$/s.exec(text);
  if (found === null) return null;
  return { line: Number(found[1]), column: Number(found[2]), rest: found[3] ?? "" };
}
