import assert from "node:assert/strict";
import { test } from "node:test";
import { aimOfSticks, GamepadHand } from "../src/pendant/gamepad.ts";

type PadAct =
  | { act: "stop" | "hold" | "letGo" | "centre" | "frame" }
  | { act: "aim"; values: number[] }
  | { act: "speed"; by: 1 | -1 };

const LEFT_X = 0;
const LEFT_Y = 1;
const RIGHT_X = 2;
const RIGHT_Y = 3;
const [FRAME, STOP, SLOWER, FASTER, ENABLING, SHIFT] = [0, 1, 2, 3, 4, 5] as const;

/** A gamepad and a hand on it, a frame each 16 ms. */
class Pad {
  #acts: PadAct[] = [];
  readonly hand = new GamepadHand({
    stop: () => this.#acts.push({ act: "stop" }),
    hold: () => this.#acts.push({ act: "hold" }),
    letGo: () => this.#acts.push({ act: "letGo" }),
    aim: (values) => this.#acts.push(values === null ? { act: "centre" } : { act: "aim", values }),
    nextFrame: () => this.#acts.push({ act: "frame" }),
    changeSpeed: (by) => this.#acts.push({ act: "speed", by }),
  });
  axes = [0, 0, 0, 0];
  buttons = new Array<boolean>(17).fill(false);
  now = 1_000;
  #news = 1;

  /** Show so much time in frames; with no news unless it trembles. */
  show(time = 16, trembles = true): PadAct[] {
    for (let passed = 0; passed < time; passed += 16) {
      this.now += 16;
      if (trembles) this.#news += 1;
      this.hand.poll({ axes: this.axes, buttons: this.buttons, timestamp: this.#news }, this.now);
    }
    return this.done();
  }

  /** What it did since this was asked last. */
  done(): PadAct[] {
    return this.#acts.splice(0);
  }

  stick(number: number, value: number): PadAct[] {
    this.axes[number] = value;
    return this.show();
  }

  button(number: number, isDown: boolean): PadAct[] {
    this.buttons[number] = isDown;
    return this.show();
  }
}

function ready(): Pad {
  const pad = new Pad();
  pad.show();
  return pad;
}

function pressed(): Pad {
  const pad = ready();
  assert.deepEqual(pad.button(ENABLING, true), [{ act: "hold" }]);
  assert.deepEqual(pad.stick(LEFT_Y, -1), [{ act: "aim", values: [1, 0, 0, 0, 0, 0] }]);
  return pad;
}

test("each stick moves the axis that it moves for openpendant gamepad", () => {
  const along = (number: number, isShifted: boolean): number[] => {
    const axes = [0, 0, 0, 0];
    axes[number] = -1;
    return aimOfSticks(axes, isShifted);
  };
  assert.deepEqual(along(LEFT_Y, false), [1, 0, 0, 0, 0, 0]);
  assert.deepEqual(along(LEFT_X, false), [0, 1, 0, 0, 0, 0]);
  assert.deepEqual(along(RIGHT_Y, false), [0, 0, 1, 0, 0, 0]);
  assert.deepEqual(along(RIGHT_X, false), [0, 0, 0, 0, 0, 1]);
  assert.deepEqual(along(LEFT_X, true), [0, 0, 0, -1, 0, 0]);
  assert.deepEqual(along(LEFT_Y, true), [0, 0, 0, 0, 1, 0]);
  assert.deepEqual(along(RIGHT_Y, true), [0, 0, 1, 0, 0, 0]);
});

test("a stick counts from the end of its dead zone on and is linear", () => {
  assert.deepEqual(aimOfSticks([0, 0.15, 0, 0], false), [0, 0, 0, 0, 0, 0]);
  assert.ok(Math.abs((aimOfSticks([0, -0.575, 0, 0], false)[0] ?? 0) - 0.5) < 1e-9);
});

test("a stick without the enabling button moves nothing", () => {
  assert.deepEqual(ready().stick(LEFT_Y, -1), []);
});

test("the enabling button let go lets go, and moves again without a centred stick", () => {
  const pad = pressed();
  assert.deepEqual(pad.button(ENABLING, false), [{ act: "letGo" }]);
  assert.deepEqual(pad.show(500), []);
  assert.equal(pad.button(ENABLING, true).length, 2);
});

test("a centred stick ends the press and keeps the enabling device", () => {
  const pad = pressed();
  assert.deepEqual(pad.stick(LEFT_Y, 0), [{ act: "centre" }]);
  assert.equal(pad.stick(LEFT_Y, -1)[0]?.act, "aim");
});

test("a press is aimed at most 25 times a second, and at last where the stick is", () => {
  const pad = pressed();
  let aims: PadAct[] = [];
  for (let step = 0; step < 60; step += 1) aims = [...aims, ...pad.stick(LEFT_Y, -1 + 0.012 * step)];
  aims = [...aims, ...pad.show(60)];
  assert.ok(aims.length >= 10 && aims.length <= 25, `${aims.length}`);
  const last = aims.at(-1);
  const end = (1 - 0.012 * 59 - 0.15) / 0.85;
  assert.ok(last?.act === "aim" && Math.abs((last.values[0] ?? 0) - end) <= 0.02);
});

test("an axis that comes to rest is aimed anew however small it was", () => {
  const pad = pressed();
  pad.show(60);
  pad.stick(LEFT_X, -0.16);
  pad.show(60);
  assert.deepEqual(pad.stick(LEFT_X, 0), [{ act: "aim", values: [1, 0, 0, 0, 0, 0] }]);
});

test("the shift button turns where the stick moved", () => {
  const pad = pressed();
  pad.show(60);
  assert.deepEqual(pad.button(SHIFT, true), [{ act: "aim", values: [0, 0, 0, 0, 1, 0] }]);
});

for (const what of ["stick", "button"] as const) {
  test(`a ${what} that is off when the gamepad is first seen counts once it was let go`, () => {
    const pad = new Pad();
    if (what === "stick") pad.axes[LEFT_Y] = -1;
    else pad.buttons[ENABLING] = true;
    assert.deepEqual(pad.show(100), []);
    pad.buttons[ENABLING] = true;
    assert.deepEqual(pad.stick(LEFT_Y, -1), []);
    assert.deepEqual(pad.show(100), []);
    pad.button(ENABLING, false);
    pad.stick(LEFT_Y, 0);
    assert.deepEqual(pad.button(ENABLING, true), [{ act: "hold" }]);
  });
}

test("a gamepad that is gone lets go, and its next frame begins anew", () => {
  const pad = pressed();
  pad.hand.poll(null, pad.now);
  assert.deepEqual(pad.done(), [{ act: "letGo" }]);
  assert.deepEqual(pad.show(200), []);
});

test("no frame for 100 ms lets go, and the frames after it move nothing", () => {
  const pad = pressed();
  pad.hand.watch(pad.now + 100);
  assert.deepEqual(pad.done(), []);
  pad.hand.watch(pad.now + 101);
  assert.deepEqual(pad.done(), [{ act: "letGo" }]);
  assert.deepEqual(pad.show(200), []);
});

test("a gap between two frames lets go likewise", () => {
  const pad = pressed();
  pad.now += 200;
  assert.deepEqual(pad.show(), [{ act: "letGo" }]);
});

test("a gamepad without news for two seconds lets go", () => {
  const pad = pressed();
  assert.deepEqual(pad.show(1_980, false), []);
  assert.deepEqual(pad.show(32, false), [{ act: "letGo" }]);
  assert.deepEqual(pad.show(200), []);
});

test("what else let go has to be pressed anew", () => {
  const pad = pressed();
  pad.hand.letGo();
  assert.deepEqual(pad.done(), [{ act: "letGo" }]);
  assert.deepEqual(pad.stick(LEFT_Y, -0.5), []);
  pad.button(ENABLING, false);
  assert.deepEqual(pad.button(ENABLING, true), [], "the stick was not centred yet");
});

test("the stop button stops, held or not, and when it is down at the first frame", () => {
  assert.deepEqual(pressed().button(STOP, true), [{ act: "stop" }, { act: "letGo" }]);
  assert.deepEqual(ready().button(STOP, true), [{ act: "stop" }]);
  const pad = new Pad();
  pad.buttons[STOP] = true;
  assert.deepEqual(pad.show(100), [{ act: "stop" }]);
});

test("frame and speed have buttons; the frame stays while something is held", () => {
  assert.deepEqual(ready().button(FRAME, true), [{ act: "frame" }]);
  assert.deepEqual(pressed().button(FRAME, true), []);
  assert.deepEqual(pressed().button(SLOWER, true), [{ act: "speed", by: -1 }]);
  assert.deepEqual(ready().button(FASTER, true), [{ act: "speed", by: 1 }]);
});
