// Stops of a way: named positions, and the points of taught programs. Pure.
import type { ProgramDocument } from "../teach/program.ts";

export interface Stop {
  name: string;
  joints: readonly number[];
}

/** Return the points of a program in the order of its moves; all of them where nothing moves. */
export function stopsOf({ points, statements }: Pick<ProgramDocument, "points" | "statements">): Stop[] {
  const named = new Map(points.map((each) => [each.name, each]));
  const found = statements
    .flatMap((each) => (each.statement === "move" ? [...(each.via ?? []), each.point] : []))
    .flatMap((name) => named.get(name) ?? []);
  return (found.length > 0 ? found : points).map(({ name, joints }) => ({ name, joints }));
}
