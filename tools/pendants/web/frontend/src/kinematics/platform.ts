// Where a platform is at the lengths of its legs: Newton's method (Merlet, Parallel Robots, ch. 4).
import {
  added,
  cross,
  difference,
  ofRotationVector,
  product,
  rotated,
  scaled,
  unitQuaternion,
  type Pose,
  type Vector3,
} from "./pose.ts";

/** The two ends of a leg, each in the frame of its plate [m]. */
export interface Leg {
  base: Vector3;
  top: Vector3;
}

const LEGS = 6;
const ITERATIONS = 40;
const CLOSURE = 1e-10; // m
const LONGEST_STEP = 0.3; // m, rad

/** Return the platform's pose in the base plate; null where no pose near `start` closes the legs. */
export function closedLegs(
  legs: readonly Leg[],
  lengths: readonly number[],
  start: Pose,
): Pose | null {
  if (legs.length !== LEGS || lengths.length !== LEGS) return null;
  let at = start;
  for (let round = 0; round < ITERATIONS; round++) {
    const rows: number[][] = [];
    let worst = 0;
    legs.forEach(({ base, top }, index) => {
      const arm = rotated(at.quaternion, top);
      const leg = difference(added(at.position, arm), base);
      const length = Math.hypot(...leg);
      const way = scaled(leg, 1 / length);
      const error = (lengths[index] ?? 0) - length;
      worst = Math.max(worst, Math.abs(error));
      rows.push([...way, ...cross(arm, way), error]);
    });
    if (worst <= CLOSURE) return at;
    const step = solved(rows);
    if (step === null) return null;
    const share = Math.min(1, LONGEST_STEP / Math.max(...step.map(Math.abs)));
    const [x, y, z, a, b, c] = step.map((each) => each * share) as [
      number, number, number, number, number, number,
    ];
    at = {
      position: added(at.position, [x, y, z]),
      quaternion: unitQuaternion(product(ofRotationVector([a, b, c]), at.quaternion)),
    };
  }
  return null;
}

/** Solve linear equations given as rows with the right side last; null where they are singular. */
function solved(rows: number[][]): number[] | null {
  const count = rows.length;
  const cell = (row: number, column: number): number => rows[row]?.[column] ?? 0;
  for (let column = 0; column < count; column++) {
    let pivot = column;
    for (let row = column + 1; row < count; row++) {
      if (Math.abs(cell(row, column)) > Math.abs(cell(pivot, column))) pivot = row;
    }
    if (!(Math.abs(cell(pivot, column)) > 1e-12)) return null;
    [rows[column], rows[pivot]] = [rows[pivot] ?? [], rows[column] ?? []];
    for (let row = 0; row < count; row++) {
      if (row === column) continue;
      const factor = cell(row, column) / cell(column, column);
      rows[row] = (rows[row] ?? []).map((each, index) => each - factor * cell(column, index));
    }
  }
  return rows.map((_, row) => cell(row, count) / cell(row, row));
}
