// Draws long lines quickly. Where a point of the picture has many samples, a line is drawn by blocks
// of them, each from its least to its greatest value: no peak is lost, and a hundred thousand samples
// cost as much as a few thousand.
import type uPlot from "uplot";
import { indexAt, type Gap } from "./series.ts";

/** Samples of the smallest blocks; a level further up has twice as many. */
const FINEST = 8;
/** Length of a line, in widths of its plot, from which on it is drawn without dashes. */
const DENSE = 12;

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

/** Return a line as it is drawn, without what lies in gaps, and give it its dashes. */
export function linePath(plot: uPlot, line: number, gaps: readonly Gap[], dash: number[]): uPlot.Series.Paths {
  const column = plot.data[line] as unknown as Float32Array;
  const { left, top, width, height } = plot.bbox;
  const [x, y] = [plot.scales["x"]!, plot.scales["y"]!];
  const across = (time: number): number => left + ((time - x.min!) / (x.max! - x.min!)) * width;
  const down = (value: number): number => top + height - ((value - y.min!) / (y.max! - y.min!)) * height;
  const times = plot.data[0] as unknown as Float64Array;
  const [first, last] = seen(times, x.min!, x.max!);
  const stroke = new Path2D();
  const level = levelsOf(column).findLast(({ size }) => size * width <= last - first);
  const { size, least, most } = level ?? { size: 1, least: column, most: column };
  let [at, length] = [down(least[Math.floor(first / size)]!), 0];
  for (let block = Math.floor(first / size); block * size <= last; block++) {
    const place = across(times[block * size]!);
    const [low, high] = [down(least[block]!), down(most[block]!)];
    // The nearer end first: a line has no stroke that its samples do not have.
    const [near, far] = Math.abs(low - at) <= Math.abs(high - at) ? [low, high] : [high, low];
    stroke.lineTo(place, near);
    if (size > 1) stroke.lineTo(place, far);
    length += Math.abs(near - at) + Math.abs(far - near);
    at = far;
  }
  // Where strokes stand so near to one another, dots between them cannot be seen, and cost the most.
  plot.series[line]!.dash = length > DENSE * width ? [] : dash;
  return { stroke, clip: between(gaps, across, top, height), flags: 0 };
}

/** Return what lies between gaps, the first and last of which have no outer end. */
function between(gaps: readonly Gap[], across: (time: number) => number, top: number, height: number): Path2D {
  const clip = new Path2D();
  gaps.slice(1).forEach(([from], index) => {
    const begin = across(gaps[index]![1]);
    clip.rect(begin, top, across(from) - begin, height);
  });
  return clip;
}
