// One WebSocket to the gateway: messages out and in, the requests that are open, and STOP first.
//
// Owns request ids. At most four requests are open at once, so that nothing of ours lies in front
// of a STOP for long; what stops, beats or lets go is never put off, and neither is what moves: a
// motion that waited in a queue would begin when nobody expects it any more.
import { CommType, ReplyCode } from "../codec.ts";
import { decode, encode, LAYOUTS, VerdictCode } from "../protocol.ts";
import type { Message, Operations, Verdict } from "../protocol.ts";
import { LinkLost, Refused, refusalOf, unknownRequest } from "./errors.ts";
import type { Refusal } from "./errors.ts";
import { framesOf, joined } from "./frames.ts";

const MOST_OPEN = 4;
const NO_REFUSAL: Refusal = { code: VerdictCode.MALFORMED, joint: -1, value: 0, limit: 0, text: "" };
const utf8 = new TextEncoder();
const text = new TextDecoder();

/** State of a WebSocket that takes what is sent. */
const OPEN = 1;

/** What is needed of a WebSocket. */
export interface Socket {
  binaryType: string;
  readonly bufferedAmount: number;
  readonly readyState: number;
  send(data: ArrayBuffer): void;
  close(): void;
  onopen: ((event: Event) => unknown) | null;
  onmessage: ((event: MessageEvent) => unknown) | null;
  onclose: ((event: CloseEvent) => unknown) | null;
}

export interface LinkEvents {
  opened(): void;
  /** Everything that is no answer to an open request. */
  told(message: Message): void;
  /** Each message that came, before it is told or is an answer. */
  heard(message: Message): void;
  closed(why: string): void;
}

export type Way = "out" | "in";

/** Sees every frame of the link as it goes; must be quick. */
export type FrameTap = (way: Way, frame: Uint8Array) => void;

type Requested = Message & { request_id: number };
type Draft<T> = T extends { request_id: number } ? Omit<T, "request_id"> : never;

/** A request without its id, which the link adds. */
export type RequestDraft = Draft<Message>;

interface Open {
  type: string;
  answer(message: Message): void;
  fail(error: Error): void;
}

export class Link {
  tap: FrameTap | null = null;
  #socket: Socket;
  #events: LinkEvents;
  #lastId = 0;
  #open = new Map<number, Open>();
  #waiting: (() => void)[] = [];
  #outcomes = new Map<number, Open>();
  #isOver = false;

  constructor(socket: Socket, events: LinkEvents) {
    this.#socket = socket;
    this.#events = events;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => events.opened();
    socket.onmessage = (event) => this.#take(event.data as ArrayBuffer);
    socket.onclose = (event) => this.#end(event.reason);
  }

  /** Whether nothing can be sent any more. */
  get isOver(): boolean {
    return this.#isOver;
  }

  /** Bytes that the browser has not sent yet. */
  get unsent(): number {
    return this.#socket.bufferedAmount;
  }

  /** Return the id of a new request. */
  newId(): number {
    this.#lastId += 1;
    return this.#lastId;
  }

  /**
   * Send messages at once, all in one WebSocket message. A socket that closes takes none: what was
   * asked fails as soon as its end is told.
   */
  send(...messages: Message[]): void {
    if (this.#isOver || this.#socket.readyState !== OPEN || messages.length === 0) return;
    const frames = messages.map((each) => encode(each));
    if (this.tap !== null) for (const each of frames) this.tap("out", new Uint8Array(each));
    this.#socket.send(joined(frames));
  }

  /** Send a request at once and return its verdict; refused it throws. */
  async askNow(draft: RequestDraft, ...ahead: Message[]): Promise<Verdict> {
    const request = { ...draft, request_id: this.newId() } as Requested;
    const answer = this.#expect(this.#open, request);
    this.send(...ahead, request);
    return judged(await answer);
  }

  /** Likewise, once fewer than four requests are open. */
  async ask(draft: RequestDraft): Promise<Verdict> {
    return judged(await this.#inTurn(draft));
  }

  /** Begin a motion at once; `ended` resolves where it completes, and throws where it is aborted. */
  async move(draft: RequestDraft): Promise<{ id: number; ended: Promise<Message> }> {
    const request = { ...draft, request_id: this.newId() } as Requested;
    const ended = this.#expect(this.#outcomes, request);
    ended.catch(() => undefined);
    const answer = this.#expect(this.#open, request);
    this.send(request);
    try {
      judged(await answer);
    } catch (error) {
      this.#outcomes.delete(request.request_id);
      throw error;
    }
    return { id: request.request_id, ended };
  }

  /** Ask for data; refused it throws. */
  async call<Op extends keyof Operations>(request: Operations[Op][0]): Promise<Operations[Op][1]> {
    const body = utf8.encode(JSON.stringify(request));
    return this.#data(await this.#inTurn({ type: "management", body })) as Operations[Op][1];
  }

  /** Ask for data whose answer begins a motion; `ended` is as that of `move`. */
  async callMotion<Op extends keyof Operations>(
    request: Operations[Op][0],
  ): Promise<{ reply: Operations[Op][1]; ended: Promise<Message> }> {
    const body = utf8.encode(JSON.stringify(request));
    const asked = { type: "management", body, request_id: this.newId() } as Requested;
    const ended = this.#expect(this.#outcomes, asked);
    ended.catch(() => undefined);
    const answered = this.#expect(this.#open, asked);
    this.send(asked);
    try {
      return { reply: this.#data(await answered) as Operations[Op][1], ended };
    } catch (error) {
      this.#outcomes.delete(asked.request_id);
      throw error;
    }
  }

  /** Ask which cells there are; works before hello. */
  async lobby(): Promise<Operations["cells"][1]> {
    const answer = await this.#inTurn({ type: "lobby" });
    if (answer.type !== "lobby_reply") {
      judged(answer);
      throw new RangeError(`${answer.type} answers no lobby request`);
    }
    return JSON.parse(text.decode(answer.body)) as Operations["cells"][1];
  }

  close(): void {
    this.#socket.close();
    this.#end("");
  }

  /** An answer that is none is believed no more than a cut frame. */
  #data(answer: Message): unknown {
    try {
      return replied(answer);
    } catch (error) {
      if (!(error instanceof SyntaxError || error instanceof RangeError)) throw error;
      this.#end(error.message);
      this.#socket.close();
      throw new LinkLost();
    }
  }

  async #inTurn(draft: RequestDraft): Promise<Message> {
    while (this.#open.size >= MOST_OPEN && !this.#isOver) {
      await new Promise<void>((resolve) => this.#waiting.push(resolve));
    }
    const request = { ...draft, request_id: this.newId() } as Requested;
    const answer = this.#expect(this.#open, request);
    this.send(request);
    return answer;
  }

  #expect(where: Map<number, Open>, request: Requested): Promise<Message> {
    return new Promise((resolve, reject) => {
      if (this.#isOver) reject(new LinkLost());
      else where.set(request.request_id, { type: request.type, answer: resolve, fail: reject });
    });
  }

  #take(data: ArrayBuffer): void {
    try {
      for (const frame of framesOf(data)) {
        this.tap?.("in", frame);
        const message = decode(new DataView(frame.buffer, frame.byteOffset, frame.byteLength));
        this.#events.heard(message);
        this.#sort(message);
      }
    } catch (error) {
      if (!(error instanceof RangeError)) throw error;
      this.#end(error.message);
      this.#socket.close();
    }
  }

  #sort(message: Message): void {
    if (message.type === "outcome") {
      const waiting = this.#outcomes.get(message.request_id);
      this.#outcomes.delete(message.request_id);
      if (message.code === 0) waiting?.answer(message);
      else waiting?.fail(new Refused(refusalOf(message)));
      this.#events.told(message);
      return;
    }
    const waiting = this.#answered(message);
    if (waiting === undefined) this.#events.told(message);
    else waiting.answer(message);
  }

  #answered(message: Message): Open | undefined {
    if (message.type === "bare") return this.#unknown(message.msg_type);
    if (message.comm_type !== CommType.REPLY || !("request_id" in message)) return undefined;
    return this.#closed(message.request_id);
  }

  /** A server that does not know a request answers with a header alone, which has no id. */
  #unknown(type: number): undefined {
    for (const [id, each] of this.#open) {
      if (LAYOUTS[each.type]?.[0] !== type) continue;
      this.#closed(id)?.fail(new Refused(unknownRequest(each.type)));
      return undefined;
    }
    return undefined;
  }

  #closed(id: number): Open | undefined {
    const waiting = this.#open.get(id);
    this.#open.delete(id);
    this.#waiting.shift()?.();
    return waiting;
  }

  #end(why: string): void {
    if (this.#isOver) return;
    this.#isOver = true;
    const lost = [...this.#open.values(), ...this.#outcomes.values()];
    this.#open.clear();
    this.#outcomes.clear();
    for (const each of lost) each.fail(new LinkLost());
    for (const each of this.#waiting.splice(0)) each();
    this.#events.closed(why);
  }
}

/** Return the data of a reply; one of failure has what it was refused for, and throws. */
function replied(answer: Message): unknown {
  if (answer.type !== "management") {
    judged(answer);
    throw new RangeError(`${answer.type} answers no management request`);
  }
  const data: unknown = JSON.parse(text.decode(answer.body));
  if (answer.reply_code !== ReplyCode.FAILURE) return data;
  throw new Refused({ ...NO_REFUSAL, ...(data as Partial<Refusal>) });
}

/** Return a verdict that accepts; throws where it refuses. */
function judged(answer: Message): Verdict {
  if (answer.type !== "verdict") throw new RangeError(`${answer.type} is no verdict`);
  if (answer.code !== 0) throw new Refused(refusalOf(answer));
  return answer;
}
