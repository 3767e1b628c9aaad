// A button that wants to be pressed twice where that is dear. Pure: time is an argument [ms].

/** The second press of a nervous finger is none. */
const SOONEST = 400;
const LATEST = 5000;

export class Twice {
  #askedAt: number | null = null;

  /** It was pressed; whether that counts. `isDear`: only the second time. */
  press(isDear: boolean, now: number): boolean {
    if (!isDear || (this.asks(now) && now - (this.#askedAt ?? now) >= SOONEST)) {
      this.#askedAt = null;
      return true;
    }
    if (!this.asks(now)) this.#askedAt = now;
    return false;
  }

  /** Whether it was pressed once, and asks. */
  asks(now: number): boolean {
    return this.#askedAt !== null && now - this.#askedAt <= LATEST;
  }

  forget(): void {
    this.#askedAt = null;
  }
}
