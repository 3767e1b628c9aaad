// A value that can be watched; whoever watches is told once for all changes of one turn.

export class Observable<T extends object> {
  #value: T;
  #watchers = new Set<(value: T) => void>();
  #isDue = false;

  constructor(value: T) {
    this.#value = value;
  }

  get value(): T {
    return this.#value;
  }

  /** Change some fields. */
  set(change: Partial<T>): void {
    this.#value = { ...this.#value, ...change };
    if (this.#isDue) return;
    this.#isDue = true;
    queueMicrotask(() => {
      this.#isDue = false;
      for (const each of [...this.#watchers]) each(this.#value);
    });
  }

  /** Be told of changes; returns how to end that. */
  watch(told: (value: T) => void): () => void {
    this.#watchers.add(told);
    return () => this.#watchers.delete(told);
  }
}
