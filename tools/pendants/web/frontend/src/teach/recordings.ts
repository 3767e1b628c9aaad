// The recordings of a cell: listed, begun, ended, played, deleted.
import type { Operations, RecordingHeading, RecordingProgress } from "../operations.ts";
import type { Message } from "../protocol.ts";

/** What is needed of a session. */
export interface RecordingWire {
  call<Op extends keyof Operations>(request: Operations[Op][0]): Promise<Operations[Op][1]>;
  callMotion<Op extends keyof Operations>(
    request: Operations[Op][0],
  ): Promise<{ reply: Operations[Op][1]; ended: Promise<Message> }>;
}

export class Recordings {
  all: readonly RecordingHeading[] | null = null;
  /** The one under way; null where nothing is recorded. */
  underWay: RecordingProgress | null = null;
  #wire: RecordingWire;
  #changed: () => void;

  constructor(wire: RecordingWire, changed: () => void) {
    this.#wire = wire;
    this.#changed = changed;
  }

  async list(): Promise<void> {
    const found: RecordingHeading[] = [];
    let total = 1;
    while (found.length < total) {
      const request = { op: "recordings.list", first: found.length } as const;
      const part = await this.#wire.call<"recordings.list">(request);
      found.push(...part.recordings);
      this.underWay = part.recording;
      total = part.recordings.length === 0 ? 0 : part.total;
    }
    this.all = found;
    this.#changed();
  }

  async start(name: string): Promise<void> {
    await this.#wire.call<"recordings.start">({ op: "recordings.start", name });
    await this.list();
  }

  async stop(): Promise<void> {
    try {
      await this.#wire.call<"recordings.stop">({ op: "recordings.stop" });
    } finally {
      await this.list();
    }
  }

  async delete(heading: RecordingHeading): Promise<void> {
    const request = { name: heading.name, expected_revision: heading.revision };
    await this.#wire.call<"recordings.delete">({ op: "recordings.delete", ...request });
    await this.list();
  }

  /** Play one; resolves once it has ended, and tells how long it takes when it begins. */
  async play(name: string, began: (seconds: number) => void): Promise<void> {
    const { reply, ended } = await this.#wire.callMotion<"recordings.play">({ op: "recordings.play", name });
    began(reply.total);
    await ended;
  }
}
