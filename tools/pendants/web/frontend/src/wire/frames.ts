// Cuts what a WebSocket message holds into frames, and joins frames into one message.

const HEADER = 16;

/** Return the whole frames of a message; throws a RangeError where one is cut. */
export function framesOf(message: ArrayBuffer): Uint8Array[] {
  const view = new DataView(message);
  const frames: Uint8Array[] = [];
  let at = 0;
  while (at < message.byteLength) {
    const left = message.byteLength - at;
    const size = left < 4 ? 0 : 4 + view.getInt32(at, true);
    if (size < HEADER || size > left) throw new RangeError(`a frame is cut after ${left} bytes`);
    frames.push(new Uint8Array(message, at, size));
    at += size;
  }
  return frames;
}

/** Return frames one behind the other. */
export function joined(frames: readonly ArrayBuffer[]): ArrayBuffer {
  const first = frames[0];
  if (frames.length === 1 && first !== undefined) return first;
  const whole = new Uint8Array(frames.reduce((size, each) => size + each.byteLength, 0));
  let at = 0;
  for (const each of frames) {
    whole.set(new Uint8Array(each), at);
    at += each.byteLength;
  }
  return whole.buffer;
}
