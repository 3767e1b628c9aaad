// The fields of a frame one by one: where each is, how many bytes it has, what it says.
//
// The same as `openpendant packets decode` makes of it: whether a frame is of a layout says the
// codec; this only walks along the layout.
import { CommType, ReplyCode } from "../codec.ts";
import type { RealSize } from "../codec.ts";
import { VALUE_NAMES, WORDS } from "../field-words.ts";
import type { FieldWords } from "../field-words.ts";
import { decode, LAYOUTS } from "../protocol.ts";
import type { Message } from "../protocol.ts";

export const HEADER = 16;
const MASK = "********";

interface Declared {
  name: string;
  type: string;
  count: number;
  width(real: RealSize): number;
}

/** Return the fields that a layout declares. */
export function fieldsOf(declared: string): Declared[] {
  return declared
    .split(" ")
    .filter((each) => each !== "")
    .map((each) => {
      const [name = "", code = ""] = each.split(":");
      const type = code.charAt(0);
      const count = Number(code.slice(1)) || 1;
      const widths: Readonly<Record<string, (real: RealSize) => number>> = {
        i: () => 4, r: (real) => real, R: (real) => count * real, t: () => count,
      };
      return { name, type, count, width: widths[type] ?? (() => 0) };
    });
}

export type Value = number | string | Uint8Array | readonly number[];

/** One field of a frame, in the order of the wire. */
export interface FrameField {
  path: string;
  offset: number;
  size: number;
  kind: "int" | "real" | "reals" | "text" | "bytes";
  value: Value;
  /** empty for a pure number */
  unit: string;
  /** name of the value; empty where it has none */
  label: string;
}

export interface FrameAnatomy {
  /** as on the wire: a reply is called as its request */
  name: string;
  /** What the codec makes of it; null for what it refuses. */
  message: Message | null;
  /** Why the codec refuses it; empty for nothing. */
  fault: string;
  isLittle: boolean;
  header: FrameField[];
  fields: FrameField[];
}

/** Return what a frame is made of; a frame that the codec refuses has a header at most. */
export function anatomyOf(frame: Uint8Array, real: RealSize = 4): FrameAnatomy {
  const view = new DataView(frame.buffer, frame.byteOffset, frame.byteLength);
  const isLittle = frame.length >= 4 && view.getInt32(0, true) === frame.length - 4;
  let message: Message | null = null;
  let fault = "";
  try {
    message = decode(view, real);
  } catch (error) {
    if (!(error instanceof RangeError)) throw error;
    fault = error.message;
  }
  const header = frame.length < HEADER ? [] : headerOf(view, isLittle);
  const name = nameOf(message, header);
  const fields = message === null ? [] : [...bodyOf(view, message, isLittle, real)];
  return { name, message, fault, isLittle, header, fields };
}

function nameOf(message: Message | null, header: readonly FrameField[]): string {
  if (message !== null && message.type !== "bare" && message.type !== "opaque") {
    return WORDS[message.type]?.name ?? message.type;
  }
  return header[1]?.label ?? "unknown";
}

const typeNames = new Map<number, string>(
  Object.entries(LAYOUTS).map(([name, [number]]) => [number, WORDS[name]?.name ?? name]),
);

const commNames = namesOf(CommType);
const replyNames = namesOf(ReplyCode);

function namesOf(values: Readonly<Record<string, number>>): Map<number, string> {
  return new Map(Object.entries(values).map(([name, value]) => [value, name.toLowerCase()]));
}

/** Return the name of a communication type, such as `request`. */
export function commName(number: number): string {
  return commNames.get(number) ?? `comm ${number}`;
}

export function replyName(number: number): string {
  return replyNames.get(number) ?? `code ${number}`;
}

function headerOf(view: DataView, isLittle: boolean): FrameField[] {
  const [length, type, comm, code] = [0, 4, 8, 12].map((at) => view.getInt32(at, isLittle)) as [
    number, number, number, number,
  ];
  const row = (path: string, offset: number, value: number, unit: string, label: string): FrameField => ({
    path, offset, size: 4, kind: "int", value, unit, label,
  });
  return [
    row("length", 0, length, "byte", ""),
    row("msg_type", 4, type, "", typeNames.get(type) ?? "unknown"),
    row("comm_type", 8, comm, "", commName(comm)),
    row("reply_code", 12, code, "", replyName(code)),
  ];
}

function* bodyOf(
  view: DataView,
  message: Message,
  isLittle: boolean,
  real: RealSize,
): Generator<FrameField> {
  if (message.type === "bare") return;
  if (message.type === "opaque") {
    const { body } = message;
    if (body.length === 0) return;
    yield { path: "body", offset: HEADER, size: body.length, kind: "bytes", value: body, unit: "", label: "" };
    return;
  }
  const layout = LAYOUTS[message.type];
  if (layout === undefined || layout[1] === "ignored") return;
  const [, , declared, records] = layout;
  const words = WORDS[message.type]?.fields ?? {};
  const walk = new Walk(view, isLittle, real, words);
  yield* walk.along(message as unknown as Record<string, unknown>, declared, "");
  if (records === undefined) return;
  const list = (message as unknown as Record<string, Record<string, unknown>[]>)[records.name] ?? [];
  const count = words[records.name]?.count ?? "count";
  if (records.count === "before") yield walk.count(count, list.length);
  for (const [index, each] of list.entries()) {
    yield* walk.along(each, records.of, `${records.name}[${index}].`);
  }
  if (records.count === "after") yield walk.count(count, list.length);
}

class Walk {
  #at = HEADER;
  #view: DataView;
  #isLittle: boolean;
  #real: RealSize;
  #words: Readonly<Record<string, FieldWords>>;

  constructor(
    view: DataView,
    isLittle: boolean,
    real: RealSize,
    words: Readonly<Record<string, FieldWords>>,
  ) {
    this.#view = view;
    this.#isLittle = isLittle;
    this.#real = real;
    this.#words = words;
  }

  *along(values: Record<string, unknown>, declared: string, prefix: string): Generator<FrameField> {
    for (const field of fieldsOf(declared)) {
      const words: Partial<FieldWords> = this.#words[field.name] ?? {};
      const told = values[field.name] as Value;
      const value = words.isSecret === true && told !== "" ? MASK : told;
      const label = words.values === undefined ? "" : valueName(words.values, Number(value));
      const kinds = { i: "int", r: "real", R: "reals", t: "text", b: "bytes" } as const;
      const kind = kinds[field.type as keyof typeof kinds];
      const size = kind === "bytes" ? (value as Uint8Array).length : field.width(this.#real);
      yield { path: prefix + field.name, offset: this.#at, size, kind, value, unit: words.unit ?? "", label };
      this.#at += size;
    }
  }

  count(path: string, value: number): FrameField {
    const offset = this.#at;
    this.#at += 4;
    const told = this.#view.getInt32(offset, this.#isLittle);
    return { path, offset, size: 4, kind: "int", value: told === value ? value : told, unit: "", label: "" };
  }
}

/** Return the name of a value, such as `BUSY` or `TIME|0x30`; empty where it has none. */
function valueName(name: string, value: number): string {
  const values = VALUE_NAMES[name];
  if (values === undefined) return "";
  const named = Object.entries(values.named);
  if (!values.areBits) return named.find((each) => each[1] === value)?.[0] ?? "";
  let rest = value >>> 0;
  const names: string[] = [];
  for (const [each, bit] of named) {
    if ((rest & bit) === 0) continue;
    names.push(each);
    rest = (rest & ~bit) >>> 0;
  }
  if (names.length === 0) return "";
  return [...names, ...(rest === 0 ? [] : [`0x${rest.toString(16)}`])].join("|");
}
