// The newest frames of this tab's own connection, as bytes: nothing is taken apart before it is
// shown, so that what is kept never slows what is held.
import type { Way } from "../wire/link.ts";
import { maskSecret } from "./masking.ts";

export const MOST_FRAMES = 10_000;
/** Frames of meshes and programs are large: the oldest go sooner where they come in numbers. */
const MOST_BYTES = 32 * 1024 * 1024;

export interface Caught {
  /** Counts up from 1 over the life of the tab. */
  number: number;
  /** Wall clock [ms]. */
  at: number;
  way: Way;
  /** Secrets in it are masked already. */
  frame: Uint8Array;
}

export class PacketRing {
  #slots: (Caught | undefined)[] = [];
  #length = 0;
  #bytes = 0;
  #count = 0;
  readonly most: number;
  readonly mostBytes: number;

  constructor(most = MOST_FRAMES, mostBytes = MOST_BYTES) {
    this.most = most;
    this.mostBytes = mostBytes;
  }

  /** Frames that came since the tab was opened. */
  get count(): number {
    return this.#count;
  }

  /** Frames that are kept. */
  get length(): number {
    return this.#length;
  }

  /** Number of the oldest frame that is kept. */
  get oldest(): number {
    return this.#count - this.#length + 1;
  }

  add(way: Way, frame: Uint8Array, at: number): void {
    if (this.#length === this.most) this.#drop();
    this.#count += 1;
    this.#length += 1;
    this.#bytes += frame.length;
    this.#slots[this.#count % this.most] = { number: this.#count, at, way, frame: maskSecret(frame) };
    while (this.#bytes > this.mostBytes && this.#length > 1) this.#drop();
  }

  /** Return the frame of that number; undefined where it went already. */
  at(number: number): Caught | undefined {
    const slot = this.#slots[number % this.most];
    return slot?.number === number ? slot : undefined;
  }

  #drop(): void {
    const slot = this.oldest % this.most;
    this.#bytes -= this.#slots[slot]?.frame.length ?? 0;
    this.#slots[slot] = undefined;
    this.#length -= 1;
  }
}
