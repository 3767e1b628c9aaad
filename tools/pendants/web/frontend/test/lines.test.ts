import assert from "node:assert/strict";
import { test } from "node:test";

import { extremes, linePath, seen, type Line } from "../src/plots/lines.ts";
import type { Gap } from "../src/plots/series.ts";

const COUNT = 100_003;
const column = Float32Array.from({ length: COUNT }, (_, index) => Math.sin(index * 0.37) * (index % 101));

test("extremes by blocks are those of the samples, wherever a view begins and ends", () => {
  for (const [first, last] of [[0, COUNT - 1], [1, 6], [7, 8], [5, 5], [1001, 77_777], [99_999, COUNT - 1]] as const) {
    const part = column.subarray(first, last + 1);
    const sorted = part.toSorted();
    assert.deepEqual(extremes(column, first, last), [sorted[0], sorted.at(-1)]);
  }
});

test("a single peak among a hundred thousand samples is found", () => {
  const flat = new Float32Array(100_000);
  flat[54_321] = 9;
  assert.deepEqual(extremes(flat, 0, 99_999), [0, 9]);
});

test("a view has one sample more at each end, so that lines go to its edge", () => {
  const times = Float64Array.from([0, 1, 2, 3, 4]);
  assert.deepEqual(seen(times, 1.5, 2.5), [1, 3]);
  assert.deepEqual(seen(times, -1, 9), [0, 4]);
});

/** What is drawn, as the browser's own path would take it. */
class DrawnPath {
  readonly corners: [number, number][] = [];
  readonly rects: [number, number][] = [];

  lineTo(x: number, y: number): void {
    this.corners.push([x, y]);
  }

  rect(x: number, _y: number, width: number): void {
    this.rects.push([x, x + width]);
  }
}

const AREA = { left: 100, top: 10, width: 400, height: 100 };

function drawn(times: number[], values: number[], gaps: Gap[] = []) {
  Object.assign(globalThis, { Path2D: DrawnPath });
  const samples = { times: Float64Array.from(times), positions: [], velocities: [], accelerations: [], gaps };
  const line: Line = { samples, column: Float32Array.from(values), colour: "", width: 1, dash: [2, 4] };
  const { path, known, dash } = linePath(line, AREA, [0, 4], [-1, 1]);
  return { path: path as unknown as DrawnPath, known: known as unknown as DrawnPath | null, dash };
}

test("a line goes through its samples, times to the right and values up", () => {
  const { path, known, dash } = drawn([0, 1, 4], [-1, 0, 1]);
  assert.deepEqual(path.corners, [[100, 110], [200, 60], [500, 10]]);
  assert.equal(known, null);
  assert.deepEqual(dash, [2, 4]);
});

test("a line is left out from the beginning of a gap to its end", () => {
  const { rects } = drawn([0, 1, 3, 4], [0, 0, 0, 0], [[1, 3]]).known!;
  assert.deepEqual(rects.map(([, end]) => end)[0], 200);
  assert.deepEqual(rects.map(([begin]) => begin)[1], 400);
  assert.equal(rects.length, 2);
});

test("a line that goes up and down all over its plot has no dashes", () => {
  const times = Array.from({ length: 200 }, (_, index) => index / 50);
  assert.deepEqual(drawn(times, times.map((_, index) => (index % 2 === 0 ? 1 : -1))).dash, []);
});
