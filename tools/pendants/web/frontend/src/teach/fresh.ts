// New statements from what a person typed.
import { readNumber } from "../texts/texts.ts";
import type { Statement } from "./program.ts";

export type Kind = "move" | "wait" | "wait-input" | "set-output" | "loop" | "attach" | "detach" | "call" | "comment";
export type Field = "point" | "program" | "value" | "seconds" | "signal" | "passes" | "object" | "comment";

export const KINDS: readonly { kind: Kind; fields: readonly Field[] }[] = [
  { kind: "wait", fields: ["seconds"] },
  { kind: "move", fields: ["point"] },
  { kind: "wait-input", fields: ["signal", "value"] },
  { kind: "set-output", fields: ["signal", "value"] },
  { kind: "loop", fields: ["passes"] },
  { kind: "attach", fields: ["object"] },
  { kind: "detach", fields: ["object"] },
  { kind: "call", fields: ["program"] },
  { kind: "comment", fields: ["comment"] },
];

/** Return the statements of a kind, a block with its end; null where something typed is no such value. */
export function freshStatement(kind: Kind, typed: Partial<Record<Field, string>>): Statement[] | null {
  const text = (field: Field): string => (typed[field] ?? "").trim();
  const number = (field: Field): number | null => readNumber(text(field));
  const signal = number("signal");
  const value = text("value") === "on";
  switch (kind) {
    case "move":
      return text("point") === "" ? null : [{ statement: "move", way: "PTP", point: text("point") }];
    case "wait": {
      const duration = number("seconds");
      return duration === null || duration < 0 ? null : [{ statement: "wait", duration }];
    }
    case "wait-input":
    case "set-output":
      return signal === null || !Number.isInteger(signal) ? null : [{ statement: kind, signal, value }];
    case "loop": {
      const passes = text("passes") === "" ? null : number("passes");
      if (text("passes") !== "" && (passes === null || !Number.isInteger(passes) || passes < 1)) return null;
      return [{ statement: "loop", passes }, { statement: "end" }];
    }
    case "attach":
    case "detach":
      return text("object") === "" ? null : [{ statement: kind, scene_object: text("object") }];
    case "call":
      return text("program") === "" ? null : [{ statement: "call", program: text("program") }];
    case "comment":
      return [{ statement: "comment", comment: text("comment") }];
  }
}
