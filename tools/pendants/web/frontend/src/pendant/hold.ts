// Presses of jog keys: which are held, what they ask for together, and which are dead.
//
// Pure: it is told what happened and when [ms], and returns what is to be sent. Keys that are held
// together ask as one press, the newest; an earlier press is beaten until its successor is accepted.
// Whatever ended a press kills the keys that held it: they move nothing until they are pressed anew.

/** Time between beats [ms]. */
export const BEAT = 50;

/** A press ends so long after its last beat [ms]. */
export const DEADLINE = 250;

/** What the values of a press mean. */
export interface Aim {
  space: "joints" | "tool";
  /** Of the axes; empty for joints. */
  frame: string;
  /** Driven joints, or 6. */
  count: number;
}

export function isSameAim(one: Aim, other: Aim): boolean {
  return one.space === other.space && one.frame === other.frame && one.count === other.count;
}

/** An axis and a direction, as a jog button has them. */
export interface JogKey {
  axis: number;
  direction: 1 | -1;
}

export type Order =
  | { order: "start"; press: number; aim: Aim; values: number[] }
  | { order: "beat"; press: number; beat: number }
  | { order: "release"; press: number };

interface Press {
  press: number;
  beat: number;
  /** When it was pressed or beaten last. */
  at: number;
}

export class Holds {
  #aim: Aim = { space: "joints", frame: "", count: 0 };
  #lastPress = 0;
  #keys = new Map<string, JogKey>();
  #dead = new Set<string>();
  /** What sticks ask for along each axis; null where they ask for nothing, or may not. */
  #sticks: readonly number[] | null = null;
  #areSticksDead = false;
  /** Those that the server may take as held, the newest last. */
  #presses: Press[] = [];

  /** The keys that move something, or would. */
  get held(): JogKey[] {
    return [...this.#keys.values()];
  }

  get aim(): Aim {
    return this.#aim;
  }

  /** Whether sticks move something, or would. */
  get isSteered(): boolean {
    return this.#sticks !== null;
  }

  get isHolding(): boolean {
    return this.#presses.length > 0;
  }

  /** Number of the newest press; 0 where none is held. */
  get newest(): number {
    return this.#presses.at(-1)?.press ?? 0;
  }

  /** Choose what keys mean; what is held ends. */
  setAim(aim: Aim): Order[] {
    if (isSameAim(aim, this.#aim)) return [];
    const orders = this.letGo();
    this.#aim = aim;
    return orders;
  }

  /** A key went down; `source` is the finger, the pointer or the key of the keyboard. */
  down(source: string, key: JogKey, speed: number, now: number): Order[] {
    if (this.#keys.has(source) || this.#dead.has(source)) return [];
    for (const [other, each] of this.#keys) {
      if (each.axis !== key.axis || each.direction === key.direction) continue;
      // Two keys of one axis against each other: it stands, and neither goes on by itself.
      this.#dead.add(source);
      this.#kill(other);
      return this.#pressed(speed, now);
    }
    this.#keys.set(source, key);
    return this.#pressed(speed, now);
  }

  /** A key was let go. */
  up(source: string, speed: number, now: number): Order[] {
    this.#dead.delete(source);
    if (!this.#keys.delete(source)) return [];
    return this.#pressed(speed, now);
  }

  /** Sticks ask for parts of the speed along each axis; null where they are centred. */
  steer(values: readonly number[] | null, speed: number, now: number): Order[] {
    if (values === null) this.#areSticksDead = false;
    if (this.#areSticksDead || (values === null && this.#sticks === null)) return [];
    this.#sticks = values;
    return this.#pressed(speed, now);
  }

  /** All is let go at once; keys that are down are dead until they come up, sticks until centred. */
  letGo(): Order[] {
    for (const source of [...this.#keys.keys()]) this.#kill(source);
    if (this.#sticks !== null) this.#areSticksDead = true;
    this.#sticks = null;
    return this.#released();
  }

  /** Forget which keys are down: no event tells any more when they come up. */
  forget(): Order[] {
    const orders = this.letGo();
    this.#dead.clear();
    return orders;
  }

  /** Beat, each 50 ms; what was not beaten in time is over, and is told so. */
  tick(now: number): Order[] {
    const newest = this.#presses.at(-1);
    if (newest !== undefined && now - newest.at >= DEADLINE) return this.letGo();
    return this.#presses
      .filter((each) => now - each.at < DEADLINE)
      .map((each) => {
        each.at = now;
        each.beat += 1;
        return { order: "beat", press: each.press, beat: each.beat };
      });
  }

  /** The server took a press; those before it are over. */
  accepted(press: number): void {
    this.#presses = this.#presses.filter((each) => each.press >= press);
  }

  /** The server refused a press: nothing goes on, not even what was held before it. */
  refused(press: number): Order[] {
    this.#presses = this.#presses.filter((each) => each.press !== press);
    return this.letGo();
  }

  /** The server ended a press; unless another took its place, the keys are dead. */
  ended(press: number): Order[] {
    const wasNewest = press === this.newest;
    this.#presses = this.#presses.filter((each) => each.press !== press);
    return wasNewest ? this.letGo() : [];
  }

  /** The link ended, and with it every press. */
  lost(): void {
    this.#presses = [];
    this.letGo();
    this.#lastPress = 0;
  }

  #kill(source: string): void {
    if (this.#keys.delete(source)) this.#dead.add(source);
  }

  #pressed(speed: number, now: number): Order[] {
    const steered = this.#sticks ?? [];
    const values = Array.from({ length: this.#aim.count }, (_, axis) => speed * (steered[axis] ?? 0));
    for (const { axis, direction } of this.#keys.values()) {
      if (axis < values.length) values[axis] = direction * speed;
    }
    if (values.every((each) => each === 0)) return this.#released();
    this.#lastPress += 1;
    const press = this.#lastPress;
    this.#presses.push({ press, beat: 0, at: now });
    return [{ order: "start", press, aim: this.#aim, values }];
  }

  #released(): Order[] {
    const orders: Order[] = this.#presses.map(({ press }) => ({ order: "release", press }));
    this.#presses = [];
    return orders.reverse();
  }
}
