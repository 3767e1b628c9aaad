// Packs and unpacks the frames of simple message by tables of layouts, with a DataView only.
//
// The tables are generated (`protocol.ts`, `simple-message.ts`); this file knows no message. A frame
// is a length of 4 bytes, then message type, communication type and reply code, then the body. It
// may be of either byte order, and its reals have 4 or 8 bytes.

/** Communication types of a header. */
export const CommType = { TOPIC: 1, REQUEST: 2, REPLY: 3 } as const;

/** Reply codes of a header; UNUSED in everything that is no reply. */
export const ReplyCode = { UNUSED: 0, SUCCESS: 1, FAILURE: 2 } as const;

/** What every message has besides its fields; encoding takes the usual values where it is left out. */
export interface Header {
  comm_type?: number;
  reply_code?: number;
}

/** A reply of a header alone: it says only whether a request was taken. */
export interface Bare extends Header {
  type: "bare";
  msg_type: number;
}

/** A message that these tables do not know, or a reply of another layout than theirs. */
export interface Opaque extends Header {
  type: "opaque";
  msg_type: number;
  body: Uint8Array;
}

/** Records at the end of a body: their fields, the place of their count, and how many may come. */
export interface Records {
  name: string;
  of: string;
  count: "before" | "after" | "none";
  least: number;
  most: number;
  /** Name of the field that says how many records are meant; the rest are padding. */
  meant?: string;
}

/**
 * Message type, how it usually travels, and its fields as `name:type`: `i` an integer of 32 bits
 * (`i&n` keeps the bits n), `r` a real, `R` and a number so many reals, `t` and a number text in so
 * many bytes, `b` bytes up to the end. An `answer` is a reply that differs from the request of its
 * type; a body that is `ignored` may be anything.
 */
export type Layout = readonly [
  number,
  "request" | "topic" | "reply" | "answer" | "ignored",
  string,
  Records?,
];

export type Layouts = Readonly<Record<string, Layout>>;

export type RealSize = 4 | 8;

interface Field {
  name: string;
  type: string;
  size: number;
}

interface Form {
  view: DataView;
  little: boolean;
  real: RealSize;
}

const HEADER = 16;
const utf8 = new TextEncoder();
// Bytes that are no UTF-8 are an error, and a byte order mark is a character like any other.
const text = new TextDecoder("utf-8", { fatal: true, ignoreBOM: true });

const parsed = new Map<string, Field[]>();

function fieldsOf(declared: string): Field[] {
  let fields = parsed.get(declared);
  if (fields === undefined) {
    fields = declared
      .split(" ")
      .filter((each) => each !== "")
      .map((each) => {
        const [name, type] = each.split(":") as [string, string];
        return { name, type: type.charAt(0), size: Number(type.slice(type.startsWith("i&") ? 2 : 1)) };
      });
    parsed.set(declared, fields);
  }
  return fields;
}

function sizeOf(fields: Field[], real: RealSize): number {
  return fields.reduce((size, each) => size + widthOf(each, real), 0);
}

function widthOf(field: Field, real: RealSize): number {
  switch (field.type) {
    case "i":
      return 4;
    case "r":
      return real;
    case "R":
      return field.size * real;
    case "t":
      return field.size;
    default:
      return 0;
  }
}

/** Packs a message by a table; throws a RangeError that names the field whose value does not fit. */
export function encodeBy(
  layouts: Layouts,
  message: Header & { type: string },
  littleEndian: boolean,
  real: RealSize,
): ArrayBuffer {
  const values = message as unknown as Record<string, unknown>;
  if (message.type === "bare" || message.type === "opaque") {
    const body = message.type === "opaque" ? (values["body"] as Uint8Array) : new Uint8Array(0);
    const form = framed(Number(values["msg_type"]), message, "reply", body.length, littleEndian, real);
    new Uint8Array(form.view.buffer).set(body, HEADER);
    return form.view.buffer as ArrayBuffer;
  }
  const layout = layouts[message.type];
  if (layout === undefined) throw new RangeError(`no message is called ${message.type}`);
  const [number, usual, declared, records] = layout;
  const fields = fieldsOf(declared);
  const tail = fields.find((each) => each.type === "b");
  const bytes = tail === undefined ? new Uint8Array(0) : (values[tail.name] as Uint8Array);
  const inner = records === undefined ? [] : fieldsOf(records.of);
  const list = records === undefined ? [] : (values[records.name] as Record<string, unknown>[]);
  if (records !== undefined && !fits(records, list.length, values)) {
    throw new RangeError(`${message.type}.${records.name}: ${list.length} records`);
  }
  const counted = records !== undefined && records.count !== "none" ? 4 : 0;
  const size = sizeOf(fields, real) + bytes.length + counted + list.length * sizeOf(inner, real);
  const form = framed(number, message, usual, size, littleEndian, real);
  let at = HEADER;
  const write = (some: Field[], from: Record<string, unknown>, path: string): void => {
    for (const each of some) {
      put(form, at, each, from[each.name], `${path}.${each.name}`);
      at += widthOf(each, real);
    }
  };
  write(fields, values, message.type);
  if (tail !== undefined) new Uint8Array(form.view.buffer).set(bytes, at);
  if (records !== undefined) {
    if (records.count === "before") {
      form.view.setInt32(at, list.length, littleEndian);
      at += 4;
    }
    list.forEach((each, index) => write(inner, each, `${message.type}.${records.name}[${index}]`));
    if (records.count === "after") form.view.setInt32(at, list.length, littleEndian);
  }
  return form.view.buffer as ArrayBuffer;
}

function fits(records: Records, count: number, head: Record<string, unknown>): boolean {
  if (count < records.least || count > records.most) return false;
  if (records.meant === undefined) return true;
  const meant = Number(head[records.meant]);
  return meant >= records.least && meant <= count && (count === meant || count === records.most);
}

function framed(
  type: number,
  message: Header,
  usual: string,
  size: number,
  little: boolean,
  real: RealSize,
): Form {
  const view = new DataView(new ArrayBuffer(HEADER + size));
  const isReply = usual === "reply" || usual === "answer";
  const plain = usual === "topic" ? CommType.TOPIC : CommType.REQUEST;
  const comm = message.comm_type ?? (isReply ? CommType.REPLY : plain);
  const code = message.reply_code ?? (comm === CommType.REPLY ? ReplyCode.SUCCESS : ReplyCode.UNUSED);
  [HEADER - 4 + size, type, comm, code].forEach((each, index) => {
    view.setInt32(4 * index, each, little);
  });
  return { view, little, real };
}

function put(form: Form, at: number, field: Field, value: unknown, path: string): void {
  switch (field.type) {
    case "i":
      if (!Number.isInteger(value) || (value as number) !== ((value as number) | 0)) {
        throw new RangeError(`${path}: ${String(value)} is no integer of 32 bits`);
      }
      form.view.setInt32(at, value as number, form.little);
      return;
    case "r":
      putReal(form, at, value, path);
      return;
    case "R": {
      const reals = value as ArrayLike<number> | undefined;
      if (reals?.length !== field.size) throw new RangeError(`${path}: not ${field.size} reals`);
      for (let index = 0; index < field.size; index += 1) {
        putReal(form, at + index * form.real, reals[index], `${path}[${index}]`);
      }
      return;
    }
    case "t": {
      const raw = utf8.encode(String(value));
      if (raw.length > field.size || raw.includes(0)) {
        throw new RangeError(`${path}: takes up to ${field.size} bytes without a zero byte`);
      }
      new Uint8Array(form.view.buffer).set(raw, at);
    }
  }
}

function putReal(form: Form, at: number, value: unknown, path: string): void {
  if (typeof value !== "number") throw new RangeError(`${path}: ${String(value)} is no number`);
  if (form.real === 8) {
    form.view.setFloat64(at, value, form.little);
    return;
  }
  if (Number.isFinite(value) && !Number.isFinite(Math.fround(value))) {
    throw new RangeError(`${path}: ${value} does not fit 4 bytes`);
  }
  form.view.setFloat32(at, value, form.little);
}

/**
 * Unpacks a whole frame by a table, whatever its byte order; throws a RangeError for what is none.
 * Numbers that no enumeration has a name for come through as numbers.
 */
export function decodeBy(
  layouts: Layouts,
  view: DataView,
  real: RealSize,
): Header & { type: string } {
  const length = view.byteLength - 4;
  if (length < HEADER - 4) throw new RangeError(`${view.byteLength} bytes are no frame`);
  const little = view.getInt32(0, true) === length;
  if (!little && view.getInt32(0, false) !== length) {
    throw new RangeError(`${view.byteLength} bytes are not as many as the frame says`);
  }
  const [type, comm, code] = [4, 8, 12].map((at) => view.getInt32(at, little)) as [
    number,
    number,
    number,
  ];
  const header = { comm_type: comm, reply_code: code };
  const found = layoutOf(layouts, type, comm === CommType.REPLY);
  if (found !== undefined) {
    const form = { view, little, real };
    const values = found[1][1] === "ignored" ? {} : bodyOf(form, found[1]);
    if (values !== undefined) return { type: found[0], ...header, ...values };
  }
  if (comm === CommType.REPLY && view.byteLength === HEADER) {
    return { type: "bare", msg_type: type, ...header } as Header & { type: string };
  }
  // Vendors answer one type with several layouts, so no reply is refused for its body.
  if (found !== undefined && comm !== CommType.REPLY) {
    throw new RangeError(`${found[0]}: the body has another layout`);
  }
  const body = new Uint8Array(view.buffer, view.byteOffset + HEADER, view.byteLength - HEADER);
  return { type: "opaque", msg_type: type, ...header, body } as Header & { type: string };
}

/** The layouts of a table by message type, an answer's with a minus. */
const byType = new WeakMap<Layouts, Map<number, [string, Layout]>>();

function layoutOf(
  layouts: Layouts,
  type: number,
  isReply: boolean,
): [string, Layout] | undefined {
  let known = byType.get(layouts);
  if (known === undefined) {
    known = new Map();
    for (const each of Object.entries(layouts)) {
      known.set(each[1][1] === "answer" ? -each[1][0] : each[1][0], each);
    }
    byType.set(layouts, known);
  }
  return (isReply ? known.get(-type) : undefined) ?? known.get(type);
}

function bodyOf(form: Form, layout: Layout): Record<string, unknown> | undefined {
  const [, , declared, records] = layout;
  const fields = fieldsOf(declared);
  const end = form.view.byteLength;
  const rest = end - HEADER - sizeOf(fields, form.real);
  const takesRest = records !== undefined || fields.some((each) => each.type === "b");
  if (rest < 0 || (rest > 0 && !takesRest)) return undefined;
  const values = read(form, HEADER, fields);
  if (values === undefined || records === undefined) return values;
  const inner = fieldsOf(records.of);
  const counted = records.count === "none" ? 0 : 4;
  const count = (rest - counted) / sizeOf(inner, form.real);
  if (!Number.isInteger(count) || !fits(records, count, values)) return undefined;
  const start = end - rest + (records.count === "before" ? 4 : 0);
  const told = records.count === "before" ? start - 4 : end - 4;
  if (counted > 0 && form.view.getInt32(told, form.little) !== count) return undefined;
  const list: Record<string, unknown>[] = [];
  for (let index = 0; index < count; index += 1) {
    const each = read(form, start + index * sizeOf(inner, form.real), inner);
    if (each === undefined) return undefined;
    list.push(each);
  }
  values[records.name] = list;
  return values;
}

function read(form: Form, from: number, fields: Field[]): Record<string, unknown> | undefined {
  const values: Record<string, unknown> = {};
  let at = from;
  for (const field of fields) {
    const value = get(form, at, field);
    if (value === undefined) return undefined;
    values[field.name] = value;
    at += widthOf(field, form.real);
  }
  return values;
}

function get(form: Form, at: number, field: Field): unknown {
  const { view, little, real } = form;
  const number = (place: number): number =>
    real === 8 ? view.getFloat64(place, little) : view.getFloat32(place, little);
  switch (field.type) {
    case "i":
      return field.size > 0 ? view.getInt32(at, little) & field.size : view.getInt32(at, little);
    case "r":
      return number(at);
    case "R":
      return Array.from({ length: field.size }, (_, index) => number(at + index * real));
    case "t": {
      const raw = new Uint8Array(view.buffer, view.byteOffset + at, field.size);
      const zero = raw.indexOf(0);
      try {
        return text.decode(zero < 0 ? raw : raw.subarray(0, zero));
      } catch {
        return undefined;
      }
    }
    default:
      return new Uint8Array(view.buffer, view.byteOffset + at, view.byteLength - at).slice();
  }
}
