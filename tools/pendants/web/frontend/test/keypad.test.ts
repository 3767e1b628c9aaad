// The keypad in the page: the bytes of the golden frames, those of the emulator in Python in the same
// hands, and a line that is pulled.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import type { TestContext } from "node:test";
import { KeypadLine } from "../src/keypad/line.ts";
import type { LineSocket } from "../src/keypad/line.ts";
import { bytesOf, FrameReader, stuffed, unstuffed } from "../src/keypad/line-codec.ts";
import type { LineFrame } from "../src/keypad/line-codec.ts";
import { closedCells, ScreenKeypad } from "../src/keypad/keypad.ts";
import { FrameKind, KeyFlag, STOP } from "../src/keypad/serial-frames.ts";

interface Golden {
  name: string;
  way: string;
  hex: string;
  kind: number;
  sequence: number;
  fields: Record<string, number | string> | null;
}

interface Step {
  key?: number;
  let_go_of_all?: true;
  button?: boolean;
  reset?: true;
  bytes?: string;
  now: number;
  said: string;
  lcd: string[];
}

/** Of the emulator in Python; without the file there is nothing to compare with. */
const path = process.env["KEYPAD_CASES"] ?? "";
const cases = JSON.parse(readFileSync(path, "utf8")) as { golden: Golden[]; started: number; runs: Step[][] };

const bytes = (hex: string): Uint8Array => Uint8Array.from(Buffer.from(hex.replaceAll(" ", ""), "hex"));
const hex = (data: Uint8Array): string => Buffer.from(data).toString("hex");

for (const { name, way, hex: line, kind, sequence, fields } of cases.golden) {
  const isToKeypad = way === "to the keypad";
  if (fields === null) {
    test(`golden frame ${name} is refused`, () => {
      const reader = new FrameReader(isToKeypad);
      assert.deepEqual(reader.receive(bytes(line)), []);
      assert.equal(reader.bad, 1);
    });
    continue;
  }
  const frame = { kind, ...fields } as unknown as LineFrame;
  test(`golden frame ${name} is written and read to the byte`, () => {
    assert.equal(hex(bytesOf(frame, sequence)), hex(bytes(line)));
    assert.deepEqual(new FrameReader(isToKeypad).receive(bytes(line)), [{ sequence, frame }]);
  });
  test(`golden frame ${name} that goes the wrong way is rubbish`, () => {
    const reader = new FrameReader(!isToKeypad);
    assert.deepEqual(reader.receive(bytes(line)), []);
    assert.equal(reader.bad, 1);
  });
}

test("a frame is read behind one that was cut, and a repeated one once", () => {
  const [g1, , g3] = cases.golden.map((each) => bytes(each.hex));
  assert.ok(g1 !== undefined && g3 !== undefined);
  const reader = new FrameReader(false);
  assert.equal(reader.receive(Uint8Array.from([...g3.subarray(0, 12), ...g1, ...g1])).length, 1);
  assert.equal(reader.bad, 1);
});

test("a piece that is longer than any frame is dropped up to the next zero byte", () => {
  const g1 = bytes(cases.golden[0]?.hex ?? "");
  const reader = new FrameReader(false);
  assert.equal(reader.receive(Uint8Array.from([...new Array<number>(5_000).fill(7), ...g1])).length, 1);
  assert.equal(reader.bad, 1);
});

test("COBS is undone whatever the data, with blocks of every length", () => {
  for (const size of [0, 1, 253, 254, 255, 508, 600]) {
    for (const every of [1, 7, 254, 1_000]) {
      const data = Uint8Array.from({ length: size }, (_, at) => (at % every === every - 1 ? 0 : (at % 255) + 1));
      const piece = stuffed(data);
      assert.ok(!piece.includes(0));
      assert.deepEqual(unstuffed(piece), data);
    }
  }
});

cases.runs.forEach((steps, run) => {
  test(`in the same hands it says and shows what the emulator in Python does, run ${run}`, () => {
    const keypad = new ScreenKeypad();
    let now = cases.started;
    keypad.start(now);
    steps.forEach((step, at) => {
      const { key } = step;
      if (key !== undefined && !keypad.pressed.delete(key)) keypad.pressed.add(key);
      if (step.let_go_of_all) keypad.pressed.clear();
      if (step.button !== undefined) keypad.button = step.button;
      if (step.reset) keypad.start(now, 2);
      if (step.bytes !== undefined) keypad.receive(bytes(step.bytes));
      now = step.now;
      keypad.tick(now);
      assert.equal(hex(keypad.output()), step.said, `step ${at}`);
      assert.deepEqual(keypad.lcd, step.lcd, `step ${at}`);
    });
  });
});

test("three keys in a rectangle close the fourth, and two close no other", () => {
  assert.equal(closedCells(new Set([0, 1, 4])), 0b110011);
  assert.equal(closedCells(new Set([0, 5])), 0b100001);
});

// The line.

class Socket implements LineSocket {
  binaryType: BinaryType = "blob";
  onopen: (() => void) | null = null;
  onmessage: ((event: { data: ArrayBuffer }) => void) | null = null;
  onclose: ((event: { code: number }) => void) | null = null;
  readonly sent: number[] = [];
  isClosed = false;

  send(data: Uint8Array): void {
    assert.ok(!this.isClosed);
    this.sent.push(...data);
  }

  close(): void {
    this.isClosed = true;
  }

  kinds(): number[] {
    return new FrameReader(false).receive(Uint8Array.from(this.sent)).map(({ frame }) => frame.kind);
  }
}

function plugged(context: TestContext) {
  context.mock.timers.enable({ apis: ["setInterval"] });
  let now = 1_000;
  const sockets: Socket[] = [];
  const line = new KeypadLine({
    open: () => sockets[sockets.push(new Socket()) - 1] as Socket,
    now: () => now,
    changed: () => undefined,
  });
  const pass = (time: number): void => {
    for (let passed = 0; passed < time; passed += 1) {
      now += 1;
      context.mock.timers.tick(1);
    }
  };
  /** Time passes in which no timer runs. */
  const hang = (time: number): void => {
    now += time;
  };
  line.plug();
  return { line, sockets, pass, hang, newest: () => sockets.at(-1) as Socket };
}

test("nothing is sent before the line is open, and a hello as soon as it is", (context) => {
  const { pass, newest } = plugged(context);
  pass(200);
  assert.deepEqual(newest().sent, []);
  newest().onopen?.();
  pass(45);
  assert.deepEqual(newest().kinds(), [FrameKind.HELLO, FrameKind.KEY_UP]);
});

test("a pressed key and a STOP leave as frames, beats in between", (context) => {
  const { line, pass, newest } = plugged(context);
  newest().onopen?.();
  pass(45);
  line.down(0, "finger");
  pass(60);
  line.down(STOP, "finger");
  pass(8);
  assert.deepEqual(newest().kinds().slice(2), [FrameKind.KEY_DOWN, FrameKind.BEAT, FrameKind.BEAT, FrameKind.KEY_DOWN]);
});

test("a pulled cable lets go of all keys, closes the socket and says nothing more", (context) => {
  const { line, pass, newest } = plugged(context);
  newest().onopen?.();
  line.down(0, "finger");
  line.hold(true);
  pass(45);
  const { length } = newest().sent;
  line.pull();
  pass(500);
  assert.ok(newest().isClosed);
  assert.equal(newest().sent.length, length);
  assert.equal(line.keypad.pressed.size, 0);
  assert.equal(line.keypad.button, false);
});

test("a line that ended is tried again after a second, and a key that was down meanwhile is no press", (context) => {
  const { line, sockets, pass, newest } = plugged(context);
  newest().onopen?.();
  line.down(0, "finger");
  pass(45);
  newest().onclose?.({ code: 4010 });
  assert.equal(line.stage, "taken");
  pass(990);
  assert.equal(sockets.length, 1);
  pass(20);
  assert.equal(sockets.length, 2);
  newest().onopen?.();
  pass(45);
  const frames = new FrameReader(false).receive(Uint8Array.from(newest().sent)).map(({ frame }) => frame);
  assert.deepEqual(frames.map(({ kind }) => kind), [FrameKind.KEY_DOWN, FrameKind.HELLO]);
  assert.ok(frames.every((frame) => "mask" in frame && frame.mask === 1));
});

test("what comes from the bridge on a line that was given up is not heard", (context) => {
  const { line, sockets, pass, newest } = plugged(context);
  const first = newest();
  first.onopen?.();
  line.pull();
  line.plug();
  pass(10);
  assert.equal(sockets.length, 2);
  const page = bytesOf({ kind: FrameKind.LCD_PAGE, text: "X".repeat(80) }, 1);
  first.onmessage?.({ data: page.buffer as ArrayBuffer });
  assert.ok(line.keypad.lcd[0]?.startsWith("NO BRIDGE"));
});

test("the enabling button is a flag of the next beat", (context) => {
  const { line, pass, newest } = plugged(context);
  newest().onopen?.();
  pass(45);
  line.hold(true);
  pass(8);
  const frames = new FrameReader(false).receive(Uint8Array.from(newest().sent));
  const beat = frames.at(-1)?.frame;
  assert.ok(beat?.kind === FrameKind.BEAT && (beat.flags & KeyFlag.ENABLING_HELD) !== 0);
});

test("a close of a line that was given up takes nothing from the one that is open", (context) => {
  const { line, sockets, pass, newest } = plugged(context);
  const first = newest();
  first.onopen?.();
  line.pull();
  line.plug();
  newest().onopen?.();
  first.onclose?.({ code: 1000 });
  pass(1_100);
  assert.equal(line.stage, "open");
  assert.equal(sockets.length, 2);
});

test("a keypad that was pulled starts anew where it is plugged in", (context) => {
  const { line, pass, newest } = plugged(context);
  newest().onopen?.();
  const page = bytesOf({ kind: FrameKind.LCD_PAGE, text: "X".repeat(80) }, 1);
  newest().onmessage?.({ data: page.buffer as ArrayBuffer });
  assert.ok(line.keypad.lcd[0]?.startsWith("X"));
  line.pull();
  pass(10);
  line.plug();
  assert.ok(line.keypad.lcd[0]?.startsWith("NO BRIDGE"));
});

test("a struck key is scanned, however long the page hangs and whatever lets go meanwhile", (context) => {
  const { line, hang, pass, newest } = plugged(context);
  newest().onopen?.();
  pass(45);
  line.down(STOP, "finger");
  line.strike(STOP);
  line.up(STOP, "finger");
  line.letGo();
  hang(700);
  pass(20);
  const downs = new FrameReader(false)
    .receive(Uint8Array.from(newest().sent))
    .filter(({ frame }) => frame.kind === FrameKind.KEY_DOWN)
    .map(({ frame }) => "key" in frame && frame.key);
  assert.deepEqual(downs, [STOP]);
  assert.equal(line.keypad.pressed.size, 0);
});

test("a key is down as long as something holds it", (context) => {
  const { line } = plugged(context);
  line.down(0, "finger");
  line.down(0, "Enter");
  line.up(0, "finger");
  assert.ok(line.keypad.pressed.has(0));
  line.up(0, "Enter");
  assert.equal(line.keypad.pressed.size, 0);
});

test("what held a key before the cable was pulled holds it no more", (context) => {
  const { line } = plugged(context);
  line.down(0, "finger");
  line.pull();
  line.plug();
  line.down(0, "Enter");
  line.up(0, "Enter");
  assert.equal(line.keypad.pressed.size, 0);
});
