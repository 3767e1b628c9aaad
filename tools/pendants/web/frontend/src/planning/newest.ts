// Questions that follow a hand: one at a time, so many a second, and of those that wait the newest.

export interface Clock {
  now(): number;
  after(wait: number, then: () => void): void;
}

export class Newest<Question, Answer> {
  #ask: (question: Question) => Promise<Answer>;
  #answered: (question: Question, answer: Answer) => void;
  #failed: (question: Question, error: unknown) => void;
  #every: number;
  #clock: Clock;
  #waiting: { question: Question } | null = null;
  #isAsking = false;
  #askedAt = Number.NEGATIVE_INFINITY;
  #isDue = false;

  constructor(
    ask: (question: Question) => Promise<Answer>,
    answered: (question: Question, answer: Answer) => void,
    failed: (question: Question, error: unknown) => void,
    every: number,
    clock: Clock,
  ) {
    this.#ask = ask;
    this.#answered = answered;
    this.#failed = failed;
    this.#every = every;
    this.#clock = clock;
  }

  /** Ask this as soon as it may be; what waited is forgotten. */
  ask(question: Question): void {
    this.#waiting = { question };
    this.#next();
  }

  #next(): void {
    if (this.#isAsking || this.#waiting === null) return;
    const wait = this.#askedAt + this.#every - this.#clock.now();
    if (wait > 0) {
      if (this.#isDue) return;
      this.#isDue = true;
      this.#clock.after(wait, () => {
        this.#isDue = false;
        this.#next();
      });
      return;
    }
    const { question } = this.#waiting;
    this.#waiting = null;
    void this.#run(question);
  }

  async #run(question: Question): Promise<void> {
    this.#isAsking = true;
    this.#askedAt = this.#clock.now();
    try {
      this.#answered(question, await this.#ask(question));
    } catch (error) {
      this.#failed(question, error);
    }
    this.#isAsking = false;
    this.#next();
  }
}
