// Where the lines of an axis are. Pure.

const STEPS = [1, 2, 2.5, 5, 10];

/** Return round values between two, as they are written times a factor. */
export function evenSteps(least: number, most: number, factor: number, wanted = 4): number[] {
  const span = (most - least) * factor;
  if (!(span > 0) || !Number.isFinite(span)) return [];
  const size = 10 ** Math.floor(Math.log10(span / wanted));
  const step = (STEPS.find((each) => each * size * wanted >= span) ?? 10) * size;
  const first = Math.ceil((least * factor) / step);
  const count = Math.floor((most * factor) / step) - first + 1;
  return Array.from({ length: Math.max(0, count) }, (_, index) => ((first + index) * step) / factor);
}
