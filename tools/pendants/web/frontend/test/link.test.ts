import assert from "node:assert/strict";
import { test } from "node:test";
import { decode, encode } from "../src/protocol.ts";
import type { Message } from "../src/protocol.ts";
import { LinkLost, Refused } from "../src/wire/errors.ts";
import { framesOf, joined } from "../src/wire/frames.ts";
import { Link } from "../src/wire/link.ts";
import type { Socket } from "../src/wire/link.ts";

class Wire implements Socket {
  binaryType = "";
  bufferedAmount = 0;
  readyState = 1;
  onopen: ((event: Event) => unknown) | null = null;
  onmessage: ((event: MessageEvent) => unknown) | null = null;
  onclose: ((event: CloseEvent) => unknown) | null = null;
  sent: Message[][] = [];

  send(data: ArrayBuffer): void {
    this.sent.push(framesOf(data).map((each) => read(each)));
  }

  close(): void {
    this.onclose?.({ reason: "" } as CloseEvent);
  }

  answer(...messages: Message[]): void {
    const data = joined(messages.map((each) => encode(each)));
    this.onmessage?.({ data } as MessageEvent);
  }

  accept(id: number): void {
    this.answer(verdict(id, 0));
  }
}

function read(frame: Uint8Array): Message {
  return decode(new DataView(frame.buffer, frame.byteOffset, frame.byteLength));
}

function verdict(request_id: number, code: number): Message {
  const numbers = { joint: -1, value: 0, limit: 0, text: "" };
  return { type: "verdict", comm_type: 3, request_id, code, ...numbers };
}

function linked(): { wire: Wire; link: Link; told: Message[]; ends: string[] } {
  const wire = new Wire();
  const told: Message[] = [];
  const ends: string[] = [];
  const link = new Link(wire, {
    opened: () => undefined,
    told: (message) => told.push(message),
    heard: () => undefined,
    closed: (why) => ends.push(why),
  });
  return { wire, link, told, ends };
}

const SUBSCRIBE = { type: "subscribe", state_rate: 30 } as const;

test("messages that are sent together travel in one WebSocket message, in order", () => {
  const { wire, link } = linked();
  link.send({ type: "enabling", position: 1 }, { type: "jog_beat", press: 3, beat: 7 });
  assert.equal(wire.sent.length, 1);
  assert.deepEqual(
    wire.sent[0]?.map((each) => each.type),
    ["enabling", "jog_beat"],
  );
});

test("a socket that closes is sent nothing, and what was asked fails with its end", async () => {
  const { wire, link } = linked();
  wire.readyState = 2;
  const asked = link.ask(SUBSCRIBE);
  link.send({ type: "enabling", position: 1 });
  assert.equal(wire.sent.length, 0);
  wire.close();
  await assert.rejects(asked, (error: unknown) => error instanceof LinkLost);
});

test("a request resolves with the verdict of its id", async () => {
  const { wire, link } = linked();
  const first = link.ask(SUBSCRIBE);
  const second = link.ask(SUBSCRIBE);
  wire.accept(2);
  wire.accept(1);
  assert.equal((await first).request_id, 1);
  assert.equal((await second).request_id, 2);
});

test("a refused request throws with the numbers of its refusal", async () => {
  const { wire, link } = linked();
  const asked = link.ask(SUBSCRIBE);
  wire.answer(verdict(1, 42));
  await assert.rejects(asked, (error: unknown) => {
    return error instanceof Refused && error.refusal.code === 42;
  });
});

test("a fifth request waits until one of four is answered", async () => {
  const { wire, link } = linked();
  for (let each = 0; each < 5; each += 1) void link.ask(SUBSCRIBE);
  assert.equal(wire.sent.length, 4);
  wire.accept(1);
  await Promise.resolve();
  await Promise.resolve();
  assert.equal(wire.sent.length, 5);
});

test("a stop goes out whatever is open", () => {
  const { wire, link } = linked();
  for (let each = 0; each < 9; each += 1) void link.ask(SUBSCRIBE);
  void link.askNow({ type: "software_stop", reason: "" });
  assert.equal(wire.sent.at(-1)?.[0]?.type, "software_stop");
});

test("a motion that was accepted ends with its outcome", async () => {
  const { wire, link } = linked();
  const moving = link.move({ type: "home", speed: 1, target: "home" });
  wire.accept(1);
  const { ended } = await moving;
  wire.answer({
    type: "outcome",
    request_id: 1,
    outcome: 2,
    code: 27,
    joint: -1,
    value: 0,
    limit: 0,
    plan_time: 0,
    motion_time: 0,
    text: "",
  });
  await assert.rejects(ended, (error: unknown) => {
    return error instanceof Refused && error.refusal.code === 27;
  });
});

test("a request that the server does not know is refused, and leaves its place free", async () => {
  const { wire, link } = linked();
  const asked = link.ask(SUBSCRIBE);
  wire.answer({ type: "bare", msg_type: 65004, comm_type: 3, reply_code: 2 });
  await assert.rejects(asked, Refused);
});

test("what is no answer is told", () => {
  const { wire, told } = linked();
  wire.answer({ type: "mode_changed", mode: 1, session: 2, client: "x" });
  assert.equal(told[0]?.type, "mode_changed");
});

test("a link that ends fails all that is open, and says so once", async () => {
  const { wire, link, ends } = linked();
  const asked = link.ask(SUBSCRIBE);
  wire.close();
  wire.close();
  await assert.rejects(asked, LinkLost);
  assert.equal(ends.length, 1);
});

test("nothing is sent on a link that has ended", () => {
  const { wire, link } = linked();
  wire.close();
  link.send({ type: "authority_beat" });
  assert.deepEqual(wire.sent, []);
});

test("an answer that is no JSON ends the link and says why", async () => {
  const { wire, link, ends } = linked();
  const asked = link.call({ op: "snapshot" });
  wire.answer({ type: "management", comm_type: 3, reply_code: 1, request_id: 1, body: new TextEncoder().encode("{") } as Message);
  await assert.rejects(asked, LinkLost);
  assert.equal(ends.length, 1);
  assert.match(ends[0] ?? "", /JSON/);
});

test("a cut frame ends the link and says why", () => {
  const { wire, ends } = linked();
  wire.onmessage?.({ data: new ArrayBuffer(7) } as MessageEvent);
  assert.match(ends[0] ?? "", /cut/);
});

function reply(request_id: number, reply_code: number, data: unknown): Message {
  const body = new TextEncoder().encode(JSON.stringify(data));
  return { type: "management", comm_type: 3, reply_code, request_id, body };
}

test("data that was asked for and refused throws the refusal with its numbers", async () => {
  const { wire, link } = linked();
  const asked = link.call<"programs.list">({ op: "programs.list" });
  wire.answer(reply(1, 2, { code: 100, text: "revision 3", joint: -1, value: 2, limit: 3 }));
  await assert.rejects(asked, (error: Refused) => error.refusal.code === 100 && error.refusal.limit === 3);
});

test("data that begins a motion is told at once, and its end once it has ended", async () => {
  const { wire, link } = linked();
  const asked = link.callMotion<"recordings.play">({ op: "recordings.play", name: "arc" });
  wire.answer(reply(1, 1, { total: 4 }));
  const { reply: told, ended } = await asked;
  assert.equal(told.total, 4);
  const numbers = { joint: -1, value: 0, limit: 0, plan_time: 0, motion_time: 0, text: "" };
  wire.answer({ type: "outcome", request_id: 1, outcome: 2, code: 39, ...numbers });
  await assert.rejects(ended, Refused);
});
