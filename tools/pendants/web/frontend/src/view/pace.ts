// When the next picture may be drawn, so that slow drawing never holds up the beats of a press.
// Pure: the time is an argument [ms].

/** A picture that takes longer stops the drawing until it is done, and as long again. */
export const SLOW = 100;
const SLOW_ONES = 4;

export class Pace {
  #began: number | null = null;
  #restsUntil = 0;
  #slowOnes = 0;

  /** Whether a picture may be begun now: the one before is done, and was quick or long ago. */
  mayDraw(now: number): boolean {
    return this.#began === null && now >= this.#restsUntil;
  }

  began(now: number): void {
    this.#began = now;
  }

  /** Note that the picture begun last is on the screen. */
  ended(now: number): void {
    const took = now - (this.#began ?? now);
    this.#began = null;
    const isSlow = took > SLOW;
    this.#slowOnes = isSlow ? this.#slowOnes + 1 : Math.max(0, this.#slowOnes - 1);
    this.#restsUntil = isSlow ? now + took : now;
  }

  get isDrawing(): boolean {
    return this.#began !== null;
  }

  /** Whether most pictures of late were slow. */
  get isTooSlow(): boolean {
    return this.#slowOnes >= SLOW_ONES;
  }

  /** Forget how slow it was: something cheaper is drawn from now on. */
  restarted(): void {
    this.#slowOnes = 0;
    this.#restsUntil = 0;
  }
}
