// Takes passwords, codes and secrets out of frames before they are kept.
import { WORDS } from "../field-words.ts";
import { LAYOUTS } from "../protocol.ts";
import { fieldsOf, HEADER } from "./fields.ts";

const MASK = "********";

interface Secret {
  at: number;
  size: number;
  /** of the whole frame */
  of: number;
}

/** Where secrets are, by message type: at most one in a message, before any real. */
const secrets = new Map<number, Secret[]>();
for (const [name, [number, , declared]] of Object.entries(LAYOUTS)) {
  const words = WORDS[name]?.fields ?? {};
  const fields = fieldsOf(declared);
  const of = HEADER + fields.reduce((sum, each) => sum + each.width(4), 0);
  let at = HEADER;
  for (const each of fields) {
    const size = each.width(4);
    if (words[each.name]?.isSecret === true) {
      secrets.set(number, [...(secrets.get(number) ?? []), { at, size, of }]);
    }
    at += size;
  }
}

/** Sizes of the other messages of a type that has a secret: they have none. */
const harmless = new Map<number, number[]>();
for (const [name, [number, , declared]] of Object.entries(LAYOUTS)) {
  if (!secrets.has(number)) continue;
  const words = WORDS[name]?.fields ?? {};
  const fields = fieldsOf(declared);
  if (fields.some((each) => words[each.name]?.isSecret === true)) continue;
  const size = HEADER + fields.reduce((sum, each) => sum + each.width(4), 0);
  harmless.set(number, [...(harmless.get(number) ?? []), size]);
}

/** Return a frame without its secret: itself where it has none, else a copy. */
export function maskSecret(frame: Uint8Array): Uint8Array {
  if (frame.length < HEADER) return frame;
  const view = new DataView(frame.buffer, frame.byteOffset, frame.byteLength);
  const isLittle = view.getInt32(0, true) === frame.length - 4;
  const type = view.getInt32(4, isLittle);
  const found = secrets.get(type);
  if (found === undefined || frame.length === HEADER) return frame;
  if (harmless.get(type)?.includes(frame.length) === true) return frame;
  const masked = frame.slice();
  const secret = found.find((each) => each.of === frame.length);
  // A frame of another size than declared may hold the secret anywhere.
  const { at, size } = secret ?? { at: HEADER, size: frame.length - HEADER };
  const span = masked.subarray(at, at + size);
  if (secret === undefined) {
    for (let each = 0; each < span.length; each += 1) if (span[each] !== 0) span[each] = 0x2a;
  } else if (span[0] !== 0) {
    // Not even its length is told.
    span.fill(0);
    span.set(new TextEncoder().encode(MASK.slice(0, size)));
  }
  return masked;
}
