// Frames on the keypad's line: COBS between zero bytes, kind, sequence, length, payload and CRC.
//
// What was received throws nothing: rubbish is a count, and the reader is back in step at the next
// zero byte.
import { LINE_LAYOUTS, LONGEST_PIECE } from "./serial-frames.ts";
import type { FromKeypad, LineField, ToKeypad } from "./serial-frames.ts";

export type LineFrame = FromKeypad | ToKeypad;

const HEAD = 4;
const TAIL = 2;
/** Bytes other than zero that one count of COBS covers. */
const BLOCK = 254;

/** CRC-16/CCITT, not reflected, from FFFFh. */
export function checksum(data: Uint8Array): number {
  let crc = 0xffff;
  for (const byte of data) {
    crc ^= byte << 8;
    for (let bit = 0; bit < 8; bit += 1) crc = (crc & 0x8000 ? (crc << 1) ^ 0x1021 : crc << 1) & 0xffff;
  }
  return crc;
}

/** Data by COBS, so that it has no zero byte. */
export function stuffed(data: Uint8Array): Uint8Array {
  const out: number[] = [];
  let at = out.push(0) - 1;
  data.forEach((byte, index) => {
    if (byte !== 0) out.push(byte);
    const count = out.length - at;
    // A full block at the very end needs no empty one behind it.
    const isFull = count > BLOCK && index < data.length - 1;
    if (byte === 0 || isFull) {
      out[at] = count;
      at = out.push(0) - 1;
    }
  });
  out[at] = out.length - at;
  return Uint8Array.from(out);
}

/** The data of a piece without zero bytes by COBS; null where it is none. */
export function unstuffed(piece: Uint8Array): Uint8Array | null {
  const out: number[] = [];
  for (let at = 0; at < piece.length; ) {
    const count = piece[at] ?? 0;
    if (count === 0 || at + count > piece.length) return null;
    out.push(...piece.subarray(at + 1, at + count));
    at += count;
    if (count <= BLOCK && at < piece.length) out.push(0);
  }
  return Uint8Array.from(out);
}

/** A frame as it goes on the line, with its zero bytes. */
export function bytesOf(frame: LineFrame, sequence: number): Uint8Array {
  const payload = payloadOf(frame);
  const data = [frame.kind, sequence % 256, ...littleEndian(payload.length, 2), ...payload];
  const whole = Uint8Array.from([...data, ...littleEndian(checksum(Uint8Array.from(data)), 2)]);
  return Uint8Array.from([0, ...stuffed(whole), 0]);
}

function fieldsOf(kind: number): { isToKeypad: boolean; fields: LineField[] } | null {
  const layout = LINE_LAYOUTS[kind];
  if (layout === undefined) return null;
  const [isToKeypad, ...fields] = layout;
  return { isToKeypad, fields };
}

function payloadOf(frame: LineFrame): number[] {
  const values = frame as unknown as Readonly<Record<string, number | string>>;
  return (fieldsOf(frame.kind)?.fields ?? []).flatMap(([name, size]) => {
    const value = values[name] ?? 0;
    return typeof value === "string" ? [...value].map((each) => each.charCodeAt(0)) : littleEndian(value, size);
  });
}

function littleEndian(value: number, size: number): number[] {
  return Array.from({ length: size }, (_, at) => (value >> (8 * at)) & 0xff);
}

/** The frame of a piece between zero bytes, with its sequence; null where it is none. */
export function frameOf(piece: Uint8Array, isToKeypad: boolean): { sequence: number; frame: LineFrame } | null {
  const data = unstuffed(piece);
  if (data === null || data.length < HEAD + TAIL) return null;
  const view = new DataView(data.buffer);
  const end = data.length - TAIL;
  if (checksum(data.subarray(0, end)) !== view.getUint16(end, true)) return null;
  const kind = view.getUint8(0);
  const layout = fieldsOf(kind);
  const length = view.getUint16(2, true);
  const size = layout?.fields.reduce((sum, field) => sum + field[1], 0);
  if (layout?.isToKeypad !== isToKeypad || length !== size || length !== end - HEAD) return null;
  const frame: Record<string, number | string> = { kind };
  let at = HEAD;
  for (const [name, bytes, isText] of layout.fields) {
    if (isText === true) frame[name] = String.fromCharCode(...data.subarray(at, at + bytes));
    else if (name !== "") frame[name] = bytes === 2 ? view.getUint16(at, true) : view.getUint8(at);
    at += bytes;
  }
  return { sequence: view.getUint8(1), frame: frame as unknown as LineFrame };
}

/** Reads one direction of a line, in whatever portions its bytes come. */
export class FrameReader {
  /** Pieces that are no frame. */
  bad = 0;
  readonly #isToKeypad: boolean;
  #piece: number[] = [];
  #isTooLong = false;
  #last: number | null = null;

  constructor(isToKeypad: boolean) {
    this.#isToKeypad = isToKeypad;
  }

  /** Take bytes and return the frames that they complete, each with its sequence. */
  receive(data: Uint8Array): { sequence: number; frame: LineFrame }[] {
    const found: { sequence: number; frame: LineFrame }[] = [];
    for (const byte of data) {
      if (byte !== 0) {
        if (this.#piece.length < LONGEST_PIECE) this.#piece.push(byte);
        else this.#isTooLong = true;
        continue;
      }
      const ended = this.#endPiece();
      if (ended !== null) found.push(ended);
    }
    return found;
  }

  #endPiece(): { sequence: number; frame: LineFrame } | null {
    const piece = Uint8Array.from(this.#piece);
    const wasTooLong = this.#isTooLong;
    this.#piece = [];
    this.#isTooLong = false;
    if (piece.length === 0) return null;
    const read = wasTooLong ? null : frameOf(piece, this.#isToKeypad);
    if (read === null) {
      this.bad += 1;
      return null;
    }
    if (read.sequence === this.#last) return null;
    this.#last = read.sequence;
    return read;
  }
}
