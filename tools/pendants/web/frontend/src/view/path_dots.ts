// Dots on a planned path.

const MOST_DOTS = 12;

/** Return points of a path that are equal times apart, so that near ones show where it is slow. */
export function pathDots(path: Float32Array): Float32Array {
  const last = Math.floor(path.length / 3) - 1;
  if (last < 1) return new Float32Array();
  const count = Math.min(MOST_DOTS, last);
  const dots = Array.from({ length: count + 1 }, (_, index) => 3 * Math.round((index * last) / count));
  return Float32Array.from(dots.flatMap((at) => [...path.subarray(at, at + 3)]));
}
