// The enabling device (training): who holds it, how long it is kept, and what is to be said of it.
//
// Pure: it is told what happened and when [ms]. `signs` are the positions to send, in order.
import { EnablingPosition } from "../protocol.ts";
import { DEADLINE } from "./hold.ts";

/** Kept so long after the last key or touch [ms]. */
export const KEPT_FOR = 30_000;

/** The question comes so long before the end [ms]. */
export const ASKED_BEFORE = 5_000;

/** A touch of the pad that is shorter keeps it [ms]. */
export const TAP = 400;

export type EnablingState = "released" | "held" | "kept" | "pressed";

export type Sign = (typeof EnablingPosition)[keyof typeof EnablingPosition];

/** Why it ended by itself; empty for a hand that let go. */
export type EndedBy = "" | "unanswered" | "silent";

export class Enabling {
  /** Whether it may be kept: only where the controller is known to be emulated. */
  mayBeKept = false;
  endedBy: EndedBy = "";
  #state: EnablingState = "released";
  #sources = new Map<string, number>();
  #keptUntil = 0;
  #signed = 0;

  get state(): EnablingState {
    return this.#state;
  }

  get isOn(): boolean {
    return this.#state === "held" || this.#state === "kept";
  }

  /** Time until it ends by itself [ms]; null where it is not kept. */
  left(now: number): number | null {
    return this.#state === "kept" ? Math.max(0, this.#keptUntil - now) : null;
  }

  /** Whether the person is to be asked if anybody is there. */
  asks(now: number): boolean {
    const left = this.left(now);
    return left !== null && left <= ASKED_BEFORE;
  }

  /** A hand takes it. One that stays on it after its end has to let go first. */
  down(source: string, now: number): Sign[] {
    if (this.#sources.has(source)) return [];
    this.#sources.set(source, now);
    if (this.#state === "kept") {
      this.#keptUntil = now + KEPT_FOR;
      return [];
    }
    return this.#take("held", now);
  }

  /** A hand leaves it; a tap on the pad keeps it. */
  up(source: string, now: number, isPad: boolean): Sign[] {
    const since = this.#sources.get(source);
    if (since === undefined) return [];
    this.#sources.delete(source);
    if (this.#state === "pressed") return this.#sources.size === 0 ? this.#leave() : [];
    if (this.#state !== "held" || this.#sources.size > 0) return [];
    if (isPad && this.mayBeKept && now - since < TAP) return this.keep(now);
    return this.#leave();
  }

  /** Keep it without a hand. */
  keep(now: number): Sign[] {
    if (!this.mayBeKept) return [];
    this.#keptUntil = now + KEPT_FOR;
    if (this.#state === "kept") return [];
    return this.#take("kept", now);
  }

  /** Any key or touch renews what is kept. */
  touched(now: number): void {
    if (this.#state === "kept") this.#keptUntil = now + KEPT_FOR;
  }

  /** Pressed through: a stop, in the way of such devices. */
  pressThrough(source: string, now: number): Sign[] {
    this.#sources.set(source, now);
    this.#state = "pressed";
    return [EnablingPosition.PANIC];
  }

  /** It is let go at once, whoever holds it. */
  letGo(): Sign[] {
    this.endedBy = "";
    return this.isOn || this.#state === "pressed" ? this.#leave() : [];
  }

  /** Forget which hands are on it: no event tells any more when they leave. */
  forget(): Sign[] {
    const signs = this.letGo();
    this.#sources.clear();
    return signs;
  }

  /**
   * Say that it is held, each 50 ms and with every beat of a press: where both fall silent, a
   * device that is older than its key is stopped, and does not ramp. What was not said in time has
   * ended at the server.
   */
  tick(now: number): Sign[] {
    if (!this.isOn) return [];
    if (now - this.#signed >= DEADLINE) return this.#end("silent");
    if (this.#state === "kept" && now >= this.#keptUntil) return this.#end("unanswered");
    this.#signed = now;
    return [EnablingPosition.HELD];
  }

  /** The sign that goes in front of a press. */
  ahead(now: number): Sign[] {
    if (!this.isOn) return [];
    this.#signed = now;
    return [EnablingPosition.HELD];
  }

  #take(state: "held" | "kept", now: number): Sign[] {
    this.endedBy = "";
    this.#state = state;
    this.#signed = now;
    return [EnablingPosition.HELD];
  }

  #leave(): Sign[] {
    this.#state = "released";
    return [EnablingPosition.RELEASED];
  }

  #end(why: EndedBy): Sign[] {
    this.endedBy = why;
    return this.#leave();
  }
}
