// The frames that fit a filter, found a few at a time, so that nothing else waits for it.
import { anatomyOf } from "./fields.ts";
import type { FrameAnatomy } from "./fields.ts";
import { idOf, isRefusal } from "./meaning.ts";
import type { Caught, PacketRing } from "./ring.ts";

export type Kind = "all" | "no state" | "refused";

/** Frames that are judged in one go. */
const AT_ONCE = 400;
const STATE = 65020;

export class Sieve {
  /** Oldest first. */
  readonly matches: Caught[] = [];
  kind: Kind = "all";
  #text = "";
  #ring: PacketRing;
  #meaning: (caught: Caught, anatomy: FrameAnatomy) => string;
  #judged = 0;
  #until = 0;

  constructor(ring: PacketRing, meaning: (caught: Caught, anatomy: FrameAnatomy) => string) {
    this.#ring = ring;
    this.#meaning = meaning;
  }

  /** Begin anew with another filter. */
  sift(change: { text?: string; kind?: Kind }): void {
    this.kind = change.kind ?? this.kind;
    this.#text = (change.text ?? this.#text).trim().toLowerCase();
    this.matches.length = 0;
    this.#judged = this.#ring.oldest - 1;
    this.#until = Math.max(this.#until, this.#ring.count);
  }

  /** Let in what came since. */
  takeNew(): void {
    this.#until = this.#ring.count;
    const { oldest } = this.#ring;
    const gone = this.matches.findIndex(({ number }) => number >= oldest);
    if (gone !== 0) this.matches.splice(0, gone < 0 ? this.matches.length : gone);
  }

  /** Judge some more frames; whether all are judged. */
  goOn(): boolean {
    const first = Math.max(this.#judged + 1, this.#ring.oldest);
    const last = Math.min(this.#until, first + AT_ONCE - 1);
    for (let each = first; each <= last; each += 1) {
      const caught = this.#ring.at(each);
      if (caught !== undefined && this.#fits(caught)) this.matches.push(caught);
    }
    this.#judged = Math.max(this.#judged, last);
    return this.#judged >= this.#until;
  }

  isRefused(caught: Caught): boolean {
    return isRefusal(anatomyOf(caught.frame));
  }

  #fits(caught: Caught): boolean {
    if (this.kind === "no state" && typeOf(caught.frame) === STATE) return false;
    if (this.kind !== "refused" && this.#text === "") return true;
    const anatomy = anatomyOf(caught.frame);
    if (this.kind === "refused" && !isRefusal(anatomy)) return false;
    if (this.#text === "") return true;
    const told = [anatomy.name, idOf(anatomy.message), this.#meaning(caught, anatomy)].join(" ");
    return told.toLowerCase().includes(this.#text);
  }
}

function typeOf(frame: Uint8Array): number {
  if (frame.length < 8) return 0;
  const view = new DataView(frame.buffer, frame.byteOffset, frame.byteLength);
  return view.getInt32(4, view.getInt32(0, true) === frame.length - 4);
}
