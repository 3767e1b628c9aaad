// Draws long lines quickly. Where a point of the picture has many samples, a line is drawn by blocks
// of them, each from its least to its greatest value: no peak is lost, and a hundred thousand samples
// cost as much as a few thousand.
import { indexAt, type Gap, type Samples } from "./series.ts";

export type Range = readonly [from: number, to: number];

/** Where the lines of a plot are [points of the page]. */
export interface Area {
  left: number;
  top: number;
  width: number;
  height: number;
}

/** A column of samples as it is drawn. */
export interface Line {
  samples: Samples;
  column: Float32Array;
  colour: string;
  width: number;
  dash: readonly number[];
}

/** A line in its area; `known` leaves out its gaps, and is null where it has none. */
export interface LinePath {
  path: Path2D;
  dash: readonly number[];
  known: Path2D | null;
}

/** Samples of the smallest blocks; a level further up has twice as many. */
const FINEST = 8;
/** Length of a line, in widths of its plot, from which on it is drawn without dashes. */
const DENSE = 12;
/** Farther to the side than any plot reaches [points]; what is farther cannot be clipped by. */
const FAR = 1e5;

interface Level {
  size: number;
  least: Float32Array;
  most: Float32Array;
}

const known = new WeakMap<Float32Array, Level[]>();

function levelsOf(column: Float32Array): Level[] {
  let levels = known.get(column);
  if (levels === undefined) {
    levels = [];
    let below: Level = { size: 1, least: column, most: column };
    for (let size = FINEST; 2 * size <= column.length; size *= 2) {
      below = merged(below, size);
      levels.push(below);
    }
    known.set(column, levels);
  }
  return levels;
}

/** Return the blocks of so many samples, made of smaller ones. */
function merged(from: Level, size: number): Level {
  const each = size / from.size;
  const count = Math.ceil(from.least.length / each);
  const [least, most] = [new Float32Array(count), new Float32Array(count)];
  for (let block = 0; block < count; block++) {
    let [low, high] = [Infinity, -Infinity];
    const end = Math.min((block + 1) * each, from.least.length);
    for (let i = block * each; i < end; i++) {
      low = Math.min(low, from.least[i]!);
      high = Math.max(high, from.most[i]!);
    }
    least[block] = low;
    most[block] = high;
  }
  return { size, least, most };
}

/** Return the least and the greatest of the samples from one to another, both taken in. */
export function extremes(column: Float32Array, first: number, last: number): [number, number] {
  const levels = levelsOf(column);
  let [low, high] = [Infinity, -Infinity];
  for (let at = first; at <= last; ) {
    const fits = levels.findLast(({ size }) => at % size === 0 && at + size - 1 <= last);
    const { size, least, most } = fits ?? { size: 1, least: column, most: column };
    low = Math.min(low, least[at / size]!);
    high = Math.max(high, most[at / size]!);
    at += size;
  }
  return [low, high];
}

/** Return the samples that are seen, and one more at each end. */
export function seen(times: Float64Array, from: number, to: number): [number, number] {
  return [Math.max(0, indexAt(times, from)), Math.min(times.length - 1, indexAt(times, to) + 1)];
}

/** Return a line as it is drawn. */
export function linePath({ samples, column, dash }: Line, area: Area, [from, to]: Range, [low, high]: Range): LinePath {
  const { left, top, width, height } = area;
  const across = (time: number): number => left + ((time - from) / (to - from)) * width;
  const down = (value: number): number => top + ((high - value) / (high - low)) * height;
  const { times, gaps } = samples;
  const [first, last] = seen(times, from, to);
  const path = new Path2D();
  const dots = width * (globalThis.devicePixelRatio || 1);
  const level = levelsOf(column).findLast((each) => each.size * dots <= last - first);
  const { size, least, most } = level ?? { size: 1, least: column, most: column };
  let [at, length] = [down(least[Math.floor(first / size)]!), 0];
  for (let block = Math.floor(first / size); block * size <= last; block++) {
    const place = across(times[block * size]!);
    const [bottom, peak] = [down(least[block]!), down(most[block]!)];
    // The nearer end first: a line has no stroke that its samples do not have.
    const [near, far] = Math.abs(bottom - at) <= Math.abs(peak - at) ? [bottom, peak] : [peak, bottom];
    path.lineTo(place, near);
    if (size > 1) path.lineTo(place, far);
    length += Math.abs(near - at) + Math.abs(far - near);
    at = far;
  }
  // Where strokes stand so near to one another, dots between them cannot be seen, and cost the most.
  const known = gaps.length > 0 ? between(gaps, across, top, height) : null;
  return { path, dash: length > DENSE * width ? [] : dash, known };
}

/** Return what lies outside of all gaps. */
function between(gaps: readonly Gap[], across: (time: number) => number, top: number, height: number): Path2D {
  const known = new Path2D();
  const [begins, ends] = [[-Infinity, ...gaps.map(([, to]) => to)], [...gaps.map(([from]) => from), Infinity]];
  begins.forEach((begin, index) => {
    const [from, to] = [begin, ends[index]!].map((time) => Math.min(FAR, Math.max(-FAR, across(time))));
    known.rect(from!, top, to! - from!, height);
  });
  return known;
}
