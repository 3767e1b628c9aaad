import assert from "node:assert/strict";
import { test } from "node:test";

import { extremes, seen } from "../src/plots/lines.ts";

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
