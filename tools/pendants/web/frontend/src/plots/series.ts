// Samples of a motion: those of a plan, and those that the robot drove as STATE told them.
//
// Driven samples are kept in rings of typed arrays, each value twice, so that the newest are always
// one piece of memory without a copy. STATE has no acceleration: it is the difference of two
// velocities. Pure; times are the server's own [s].

/** Columns of equal length: joint positions, velocities, accelerations [rad or m, s]. */
export interface Samples {
  readonly times: Float64Array;
  readonly positions: readonly Float32Array[];
  readonly velocities: readonly Float32Array[];
  readonly accelerations: readonly Float32Array[];
  /** Times between which nothing is known. */
  readonly gaps: readonly Gap[];
}

/** Return samples that stay as they are: those of a ring are overwritten as it goes on. */
export function copied(samples: Samples): Samples {
  const all = (columns: readonly Float32Array[]): Float32Array[] => columns.map((column) => column.slice());
  const { times, positions, velocities, accelerations, gaps } = samples;
  return { times: times.slice(), positions: all(positions), velocities: all(velocities), accelerations: all(accelerations), gaps };
}

export type Gap = readonly [from: number, to: number];

export type Quantity = "positions" | "velocities" | "accelerations";
export const QUANTITIES: readonly Quantity[] = ["positions", "velocities", "accelerations"];

/** Most samples that are kept. */
export const MOST_SAMPLES = 100_000;

/** So many periods without a sample are a gap, where the sequence has one too. */
const GAP_PERIODS = 2.5;
/** A state that comes late is not later than this [s]. */
const LATEST = 10;
const FIRST_CAPACITY = 2048;

/** A ring of numbers of which the newest are one piece of memory. */
class Ring {
  #values: Float32Array | Float64Array;
  readonly #make: (length: number) => Float32Array | Float64Array;

  constructor(make: (length: number) => Float32Array | Float64Array, capacity: number) {
    this.#make = make;
    this.#values = make(2 * capacity);
  }

  put(index: number, value: number): void {
    const capacity = this.#values.length / 2;
    const at = index % capacity;
    this.#values[at] = value;
    this.#values[at + capacity] = value;
  }

  /** Return `count` values from the one of number `first` on, in place. */
  piece(first: number, count: number): Float32Array | Float64Array {
    const from = first % (this.#values.length / 2);
    return this.#values.subarray(from, from + count);
  }

  /** Make room for `capacity` values; `count` from number 0 on are there. */
  grow(capacity: number, count: number): void {
    const kept = this.#values.subarray(0, count);
    this.#values = this.#make(2 * capacity);
    this.#values.set(kept);
    this.#values.set(kept, capacity);
  }
}

/** What the robot drove, the newest samples of it. */
export class DrivenSeries {
  readonly #most: number;
  readonly #times: Ring;
  readonly #columns: Readonly<Record<Quantity, readonly Ring[]>>;
  #capacity: number;
  /** Number of the next sample, from 0. */
  #next = 0;
  #gaps: Gap[] = [];
  #last: { sequence: number; time: number; velocities: readonly number[] } | null = null;
  /** Whether the newest sample has none before it to take a difference to. */
  #isFirst = false;

  constructor(joints: number, most = MOST_SAMPLES) {
    this.#most = most;
    this.#capacity = Math.min(FIRST_CAPACITY, most);
    this.#times = new Ring((length) => new Float64Array(length), this.#capacity);
    const rings = (): Ring[] =>
      Array.from({ length: joints }, () => new Ring((length) => new Float32Array(length), this.#capacity));
    this.#columns = { positions: rings(), velocities: rings(), accelerations: rings() };
  }

  get length(): number {
    return Math.min(this.#next, this.#most);
  }

  /**
   * Take what a STATE told.
   *
   * `sequence` counts what the cell told anybody, so it alone is no gap: a page that asked for
   * fewer states than another skips some. One that came twice, or late, is left out.
   */
  add(
    sequence: number,
    time: number,
    period: number,
    positions: readonly number[],
    velocities: readonly number[],
  ): void {
    const last = this.#last;
    if (last !== null && (sequence <= last.sequence || time <= last.time)) {
      // A server that began anew counts from 1, its clock going on or anew: another time begins.
      const isAnew = sequence < last.sequence && Math.abs(time - last.time) > LATEST;
      if (!isAnew && !(sequence < last.sequence && time > last.time)) return;
      this.clear();
    }
    const isGap = last !== null && this.#last !== null && sequence > last.sequence + 1
      && time - last.time > GAP_PERIODS * period;
    const before = isGap ? null : this.#last;
    if (isGap) this.#gaps.push([last.time, time]);
    this.#makeRoom();
    const at = this.#next++;
    this.#times.put(at, time);
    this.#columns.positions.forEach((ring, joint) => ring.put(at, positions[joint] ?? 0));
    this.#columns.velocities.forEach((ring, joint) => ring.put(at, velocities[joint] ?? 0));
    this.#columns.accelerations.forEach((ring, joint) => {
      const change = (velocities[joint] ?? 0) - (before?.velocities[joint] ?? 0);
      const value = before === null ? 0 : change / (time - before.time);
      ring.put(at, value);
      // The first after a gap has the acceleration of the next: there is no other.
      if (before !== null && this.#isFirst) ring.put(at - 1, value);
    });
    this.#isFirst = before === null;
    this.#last = { sequence, time, velocities: [...velocities] };
    this.#dropOldGaps();
  }

  /** Return all that is kept, in place: it changes with the next sample. */
  samples(): Samples {
    const [first, count] = [this.#next - this.length, this.length];
    const columns = (quantity: Quantity): Float32Array[] =>
      this.#columns[quantity].map((ring) => ring.piece(first, count) as Float32Array);
    return {
      times: this.#times.piece(first, count) as Float64Array,
      positions: columns("positions"),
      velocities: columns("velocities"),
      accelerations: columns("accelerations"),
      gaps: this.#gaps,
    };
  }

  clear(): void {
    this.#next = 0;
    this.#gaps = [];
    this.#last = null;
    this.#isFirst = false;
  }

  #makeRoom(): void {
    if (this.#next < this.#capacity || this.#capacity === this.#most) return;
    this.#capacity = Math.min(this.#most, 2 * this.#capacity);
    this.#times.grow(this.#capacity, this.#next);
    for (const quantity of QUANTITIES) {
      for (const ring of this.#columns[quantity]) ring.grow(this.#capacity, this.#next);
    }
  }

  #dropOldGaps(): void {
    const oldest = this.#times.piece(this.#next - this.length, 1)[0] ?? 0;
    const kept = this.#gaps.findIndex(([, to]) => to > oldest);
    if (kept !== 0) this.#gaps = kept < 0 ? [] : this.#gaps.slice(kept);
  }
}

/** Return the samples in rows of a plan: `t`, then the columns `q0`, `v0`, `a0` and so on. */
export function plannedSamples(columns: readonly string[], rows: readonly (readonly number[])[]): Samples {
  const joints = columns.filter((name) => /^q\d+$/.test(name)).length;
  const column = (letter: string, joint: number): Float32Array => {
    const at = columns.indexOf(`${letter}${joint}`);
    return Float32Array.from(rows, (row) => row[at] ?? 0);
  };
  const all = (letter: string): Float32Array[] =>
    Array.from({ length: joints }, (_, joint) => column(letter, joint));
  const time = columns.indexOf("t");
  return {
    times: Float64Array.from(rows, (row) => row[time] ?? 0),
    positions: all("q"),
    velocities: all("v"),
    accelerations: all("a"),
    gaps: [],
  };
}

/** Return the same samples at other times. */
export function delayed(samples: Samples, by: number): Samples {
  return {
    ...samples,
    times: samples.times.map((time) => time + by),
    gaps: samples.gaps.map(([from, to]): Gap => [from + by, to + by]),
  };
}

/** Return the number of the last time that is not after `time`; -1 where all are. */
export function indexAt(times: Float64Array, time: number): number {
  let [low, high] = [0, times.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle]! <= time) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/** Return a column's value at a time, between its samples; null before, behind, and in a gap. */
export function valueAt(samples: Samples, column: Float32Array, time: number): number | null {
  const { times, gaps } = samples;
  const at = indexAt(times, time);
  if (at < 0 || (at === times.length - 1 && time > times[at]!)) return null;
  if (gaps.some(([from, to]) => time > from && time < to)) return null;
  if (times[at] === time || at === times.length - 1) return column[at]!;
  const share = (time - times[at]!) / (times[at + 1]! - times[at]!);
  return column[at]! + share * (column[at + 1]! - column[at]!);
}

/** Return all times of two motions, each once. */
export function joinedTimes(one: Float64Array, other: Float64Array): Float64Array {
  const all = new Float64Array(one.length + other.length);
  let [i, j, count] = [0, 0, 0];
  while (i < one.length || j < other.length) {
    const [a, b] = [one[i] ?? Number.POSITIVE_INFINITY, other[j] ?? Number.POSITIVE_INFINITY];
    all[count++] = Math.min(a, b);
    if (a <= b) i++;
    if (b <= a) j++;
  }
  return all.subarray(0, count);
}
