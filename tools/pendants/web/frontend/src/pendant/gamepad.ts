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

/** What a gamepad does to the page. */
export interface PadActs {
  stop(): void;
  /** The enabling button went down. */
  hold(): void;
  /** All is let go. */
  letGo(): void;
  /** Sticks ask for parts of the speed along each axis; null where they are centred. */
  aim(values: number[] | null): void;
  nextFrame(): void;
  changeSpeed(by: 1 | -1): void;
}

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
  #acts: PadActs;
  #down = new Set<number>();
  #isHeld = false;
  #mustLetGo = true;
  #aimed: number[] | null = null;
  #aimedAt = 0;
  #news = 0;
  #heard = 0;
  /** When the last frame was; null without a gamepad. */
  #frameAt: number | null = null;

  constructor(acts: PadActs) {
    this.#acts = acts;
  }

  /** Whether the enabling button is held, and counts. */
  get isHeld(): boolean {
    return this.#isHeld;
  }

  /** Whether sticks move something, or would. */
  get isAiming(): boolean {
    return this.#aimed !== null;
  }

  /** What a frame shows; null where there is no gamepad. */
  poll(pad: PadState | null, now: number): void {
    if (pad === null) {
      this.#frameAt = null;
      this.#down.clear();
      this.letGo();
      return;
    }
    const isFirst = this.#frameAt === null;
    this.watch(now);
    this.#frameAt = now;
    if (isFirst || pad.timestamp !== this.#news) this.#heard = now;
    this.#news = pad.timestamp;
    this.#look(pad, isFirst);
    if (!this.#down.has(ENABLING) && isCentred(pad.axes)) this.#mustLetGo = false;
    if (this.#isHeld && now - this.#heard >= LONGEST_STILL) this.letGo();
    if (this.#isHeld) this.#follow(pad, now);
  }

  /** Let go where no frame came for too long; to be asked between frames, too. */
  watch(now: number): void {
    if (this.#frameAt !== null && now - this.#frameAt > LONGEST_GAP) this.letGo();
  }

  /** Let go of all; what is still pressed counts once it was let go. */
  letGo(): void {
    this.#mustLetGo = true;
    this.#release();
  }

  #release(): void {
    this.#aimed = null;
    if (this.#isHeld) this.#acts.letGo();
    this.#isHeld = false;
  }

  #look(pad: PadState, isFirst: boolean): void {
    pad.buttons.forEach((isDown, number) => {
      if (isDown === this.#down.has(number)) return;
      if (isDown) this.#down.add(number);
      else this.#down.delete(number);
      // What is down already does nothing when a gamepad is first seen, but for the stop.
      if (!isFirst || number === STOP) this.#turned(number, isDown);
    });
  }

  #turned(number: number, isDown: boolean): void {
    if (number === ENABLING) {
      if (!isDown) this.#release();
      else if (!this.#mustLetGo) {
        this.#isHeld = true;
        this.#acts.hold();
      }
    } else if (isDown) {
      if (number === STOP) {
        this.#acts.stop();
        this.letGo();
      }
      if (number === FRAME && !this.#isHeld) this.#acts.nextFrame();
      if (number === SLOWER) this.#acts.changeSpeed(-1);
      if (number === FASTER) this.#acts.changeSpeed(1);
    }
  }

  #follow(pad: PadState, now: number): void {
    const values = aimOfSticks(pad.axes, this.#down.has(SHIFT));
    const before = this.#aimed;
    if (values.every((each) => each === 0)) {
      this.#aimed = null;
      if (before !== null) this.#acts.aim(null);
    } else if (before === null || (now - this.#aimedAt >= AIM_EVERY && differ(values, before))) {
      this.#aimed = values;
      this.#aimedAt = now;
      this.#acts.aim(values);
    }
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
