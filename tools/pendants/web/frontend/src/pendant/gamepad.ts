// Sticks and buttons of a gamepad in the browser's standard map: what they hold, aim and let go.
//
// Pure: it is told what each animation frame shows and when [ms]. Nothing moves before sticks and
// enabling button were seen let go: at the first frame, after a gap between frames, after whatever
// else ended a press. The map and the dead zone are those of `openpendant gamepad`.

/** Part of a stick's way that counts as none. */
export const DEAD_ZONE = 0.15;

/** Shortest time between two aims [ms]. */
export const AIM_EVERY = 40;

/** A smaller change of all axes is no other aim. */
const LEAST_CHANGE = 0.02;

/** All is let go so long after the gamepad's last news: a wireless one may be dead [ms]. */
export const LONGEST_STILL = 2_000;

/** Likewise so long after the last frame [ms]. */
export const LONGEST_GAP = 100;

const AXES = 6;

/** Axis of the robot and direction, by axis of the gamepad. */
type Sticks = ReadonlyMap<number, readonly [number, 1 | -1]>;

const STICKS: Sticks = new Map([
  [1, [0, -1]],
  [0, [1, -1]],
  [3, [2, -1]],
  [2, [5, -1]],
]);
const SHIFTED: Sticks = new Map([...STICKS, [0, [3, 1]], [1, [4, -1]]]);

const FRAME = 0;
const STOP = 1;
const SLOWER = 2;
const FASTER = 3;
const ENABLING = 4;
const SHIFT = 5;

/** What a frame shows of a gamepad. */
export interface PadState {
  axes: readonly number[];
  /** Which buttons are down. */
  buttons: readonly boolean[];
  /** Changes with each news of the gamepad. */
  timestamp: number;
}

export type PadAct =
  | { act: "stop" }
  | { act: "hold" }
  | { act: "letGo" }
  | { act: "aim"; values: number[] }
  | { act: "centre" }
  | { act: "frame" }
  | { act: "speed"; by: 1 | -1 };

/** Return what sticks ask for along each axis, -1 to 1. */
export function aimOfSticks(axes: readonly number[], isShifted: boolean): number[] {
  const values = new Array<number>(AXES).fill(0);
  for (const [number, [axis, direction]] of isShifted ? SHIFTED : STICKS) {
    const share = outsideDeadZone(axes[number] ?? 0);
    if (share !== 0) values[axis] = direction * share;
  }
  return values;
}

function outsideDeadZone(value: number): number {
  const outside = Math.abs(value) - DEAD_ZONE;
  return outside > 0 ? Math.sign(value) * Math.min(1, outside / (1 - DEAD_ZONE)) : 0;
}

export class GamepadHand {
  #down = new Set<number>();
  #isHeld = false;
  #mustLetGo = true;
  #aimed: number[] | null = null;
  #aimedAt = 0;
  #news = 0;
  #heard = 0;
  /** When the last frame was; null without a gamepad. */
  #frameAt: number | null = null;

  /** Whether sticks move something, or would. */
  get isAiming(): boolean {
    return this.#aimed !== null;
  }

  /** What a frame shows; null where there is no gamepad. */
  poll(pad: PadState | null, now: number): PadAct[] {
    if (pad === null) {
      this.#frameAt = null;
      this.#down.clear();
      return this.letGo();
    }
    const isFirst = this.#frameAt === null;
    const acts = isFirst ? [] : this.watch(now);
    this.#frameAt = now;
    if (isFirst || pad.timestamp !== this.#news) this.#heard = now;
    this.#news = pad.timestamp;
    acts.push(...this.#buttons(pad, isFirst));
    const isEnabling = this.#down.has(ENABLING);
    if (!isEnabling && isCentred(pad.axes)) this.#mustLetGo = false;
    if (this.#isHeld && now - this.#heard >= LONGEST_STILL) acts.push(...this.letGo());
    if (this.#isHeld) acts.push(...this.#follow(pad, now));
    return acts;
  }

  /** Let go where no frame came for too long; to be asked between frames, too. */
  watch(now: number): PadAct[] {
    const isLate = this.#frameAt !== null && now - this.#frameAt > LONGEST_GAP;
    return isLate ? this.letGo() : [];
  }

  /** Let go of all; what is still pressed counts once it was let go. */
  letGo(): PadAct[] {
    this.#mustLetGo = true;
    return this.#release();
  }

  #release(): PadAct[] {
    const wasHeld = this.#isHeld;
    this.#isHeld = false;
    this.#aimed = null;
    return wasHeld ? [{ act: "letGo" }] : [];
  }

  #buttons(pad: PadState, isFirst: boolean): PadAct[] {
    const acts: PadAct[] = [];
    pad.buttons.forEach((isDown, number) => {
      if (isDown === this.#down.has(number)) return;
      if (isDown) this.#down.add(number);
      else this.#down.delete(number);
      // What is down already does nothing when a gamepad is first seen, but for the stop.
      if (!isFirst || number === STOP) acts.push(...this.#turned(number, isDown));
    });
    return acts;
  }

  #turned(number: number, isDown: boolean): PadAct[] {
    if (number === ENABLING) return isDown ? this.#hold() : this.#release();
    if (!isDown) return [];
    switch (number) {
      case STOP:
        return [{ act: "stop" }, ...this.letGo()];
      case FRAME:
        return this.#isHeld ? [] : [{ act: "frame" }];
      case SLOWER:
        return [{ act: "speed", by: -1 }];
      case FASTER:
        return [{ act: "speed", by: 1 }];
      default:
        return [];
    }
  }

  #hold(): PadAct[] {
    if (this.#mustLetGo) return [];
    this.#isHeld = true;
    return [{ act: "hold" }];
  }

  #follow(pad: PadState, now: number): PadAct[] {
    const values = aimOfSticks(pad.axes, this.#down.has(SHIFT));
    const before = this.#aimed;
    if (values.every((each) => each === 0)) {
      this.#aimed = null;
      return before === null ? [] : [{ act: "centre" }];
    }
    const isSame = before !== null && !differ(values, before);
    if (isSame || (before !== null && now - this.#aimedAt < AIM_EVERY)) return [];
    this.#aimed = values;
    this.#aimedAt = now;
    return [{ act: "aim", values }];
  }
}

function isCentred(axes: readonly number[]): boolean {
  return [...SHIFTED.keys()].every((number) => outsideDeadZone(axes[number] ?? 0) === 0);
}

/** Whether an axis has another aim, or begins or ends to move. */
function differ(values: readonly number[], before: readonly number[]): boolean {
  return values.some((value, axis) => {
    const old = before[axis] ?? 0;
    return Math.abs(value - old) > LEAST_CHANGE || (value === 0) !== (old === 0);
  });
}
