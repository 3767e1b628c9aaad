// What a frame means in a few words, and which frames belong to it.
import { VALUE_NAMES } from "../field-words.ts";
import type { Message } from "../protocol.ts";
import type { PacketTexts } from "../texts/packets.ts";
import { anatomyOf } from "./fields.ts";
import type { FrameAnatomy } from "./fields.ts";
import { frameLine } from "./lines.ts";
import type { Caught, PacketRing } from "./ring.ts";

/** How far back a request is sought [frames]. */
const REACH = 600;
const utf8 = new TextDecoder();

export type Refuse = (told: { code: number; joint: number; value: number; limit: number; text: string }) => string;

/** Return what identifies a frame to a person: request, press or sequence; empty for nothing. */
export function idOf(message: Message | null): string {
  if (message === null) return "";
  if ("request_id" in message && message.type !== "state") return String(message.request_id);
  if ("press" in message) return String(message.press);
  if ("sequence" in message) return String(message.sequence);
  return "";
}

/** Whether a frame says no. */
export function isRefusal({ message, fault }: FrameAnatomy): boolean {
  if (fault !== "") return true;
  if (message === null) return false;
  if (message.type === "verdict" || message.type === "outcome") return message.code !== 0;
  return message.reply_code === 2;
}

/** The request that a reply answers, or that an outcome or a jog's end belongs to. */
export function requestOf(ring: PacketRing, { number, way }: Caught, message: Message): Caught | null {
  if (way === "out") return null;
  for (let each = number - 1; each >= Math.max(ring.oldest, number - REACH); each -= 1) {
    const caught = ring.at(each);
    if (caught === undefined || caught.way === "in") continue;
    const asked = anatomyOf(caught.frame).message;
    if (asked !== null && belongs(asked, message)) return caught;
  }
  return null;
}

/** The frames that came for a request: its answer, and how its motion ended. */
export function answersOf(ring: PacketRing, { number, way }: Caught, asked: Message) {
  const found: { answer: Caught | null; end: Caught | null } = { answer: null, end: null };
  if (way === "in" || !("request_id" in asked)) return found;
  for (let each = number + 1; each <= Math.min(ring.count, number + REACH); each += 1) {
    const caught = ring.at(each);
    if (caught === undefined || caught.way === "out") continue;
    const { message } = anatomyOf(caught.frame);
    if (message === null || !belongs(asked, message)) continue;
    if (message.type === "outcome" || message.type === "jog_ended") found.end ??= caught;
    else found.answer ??= caught;
    if (found.end !== null) break;
  }
  return found;
}

function belongs(asked: Message, told: Message): boolean {
  if (told.type === "jog_ended") return asked.type === "jog_start" && asked.press === told.press;
  if (told.type === "state" || !("request_id" in told) || !("request_id" in asked)) return false;
  return asked.request_id === told.request_id && told.request_id !== 0;
}

/** What is asked or told in a management message; null where it is no JSON. */
export function bodyOf(message: Message): Record<string, unknown> | null {
  if (!("body" in message) || message.type === "opaque") return null;
  try {
    return JSON.parse(utf8.decode(message.body)) as Record<string, unknown>;
  } catch {
    return null;
  }
}

/** Return a frame's meaning in a few words. */
export function meaningOf(
  ring: PacketRing,
  caught: Caught,
  anatomy: FrameAnatomy,
  words: PacketTexts,
  refuse: Refuse,
): string {
  const { message, fault } = anatomy;
  if (message === null) return words.malformed(fault);
  switch (message.type) {
    case "state":
      return [named("Activity", message.activity), named("OperatingMode", message.operating_mode)].join(", ");
    case "verdict":
      if (message.code !== 0) return refuse(message);
      return withTime(ring, caught, message, words);
    case "outcome":
      return message.code === 0 ? `${words.completed}, ${message.motion_time.toFixed(2)} s` : refuse(message);
    case "enabling":
      return [words.letGo, words.held, words.panic][message.position] ?? String(message.position);
    case "jog_start":
      return [jogAxes(message.values, message.space === 1), words.press(message.press)].join(", ");
    case "jog_beat":
      return words.beat(message.beat);
    case "jog_release":
      return words.press(message.press);
    case "jog_ended":
      return `${named("JogEnd", message.reason)}, ${Math.round(message.stop_time * 1000)} ms`;
    case "management":
      return operationOf(ring, caught, message);
  }
  // Name and id stand in columns of their own.
  return frameLine(anatomy).replace(/^\S+ (reply )?\S+ ?(request_id=\S+ ?)?/, "");
}

function named(values: string, value: number): string {
  const found = Object.entries(VALUE_NAMES[values]?.named ?? {}).find((each) => each[1] === value);
  return found?.[0].toLowerCase().replaceAll("_", " ") ?? String(value);
}

function withTime(ring: PacketRing, caught: Caught, message: Message, words: PacketTexts): string {
  const asked = requestOf(ring, caught, message);
  return asked === null ? words.accepted : words.acceptedAfter(`${caught.at - asked.at} ms`);
}

function jogAxes(values: readonly number[], areJoints: boolean): string {
  return values
    .flatMap((value, index) => {
      const name = areJoints ? String(index + 1) : ("XYZABC"[index] ?? String(index + 1));
      return value === 0 ? [] : [`${name} ${value > 0 ? "+" : "−"}${Math.round(Math.abs(value) * 100)} %`];
    })
    .join(" ");
}

function operationOf(ring: PacketRing, caught: Caught, message: Message): string {
  const body = bodyOf(message);
  const asked = caught.way === "out" ? body : askedBody(ring, caught, message);
  const op = String(asked?.["op"] ?? "");
  const about = caught.way === "out" ? (body ?? {}) : {};
  const name = ["name", "program", "plan"].map((key) => about[key]).find((each) => each !== undefined);
  return [op, name === undefined ? "" : `“${String(name)}”`].filter((each) => each !== "").join(" ");
}

function askedBody(ring: PacketRing, caught: Caught, message: Message): Record<string, unknown> | null {
  const request = requestOf(ring, caught, message);
  const asked = request === null ? null : anatomyOf(request.frame).message;
  return asked === null ? null : bodyOf(asked);
}
