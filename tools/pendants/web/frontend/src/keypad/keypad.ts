// The keypad on screen: the firmware's state machine with the same bytes, as the emulator in Python.
//
// Pure: keys are pressed and let go, bytes of the bridge come in, and its milliseconds pass up to a
// time that it is told [ms]; it scans its matrix each of them, ghosts and debounce included.
import { FrameReader, bytesOf } from "./line-codec.ts";
import type { LineFrame } from "./line-codec.ts";
import {
  ACKNOWLEDGED,
  AckResult,
  COLUMNS,
  FrameKind,
  KeyFlag,
  KeypadFeature,
  NO_KEY,
  PROTOCOL,
  ROWS,
  STOP,
} from "./serial-frames.ts";
import type { FromKeypad, KeypadWelcome, ToKeypad } from "./serial-frames.ts";

/** The version that it says it has, and shows. */
const FIRMWARE = [1, 0] as const;
const BAUD = 115_200;
/** Equal scans after which a key counts as up, STOP as down, the button as down and as up [ms]. */
const UP_SCANS = 10;
const STOP_SCANS = 2;
const BUTTON_DOWN = 5;
const BUTTON_UP = 2;
const FIRST_HELLO = 15;
const HELLO_PERIOD = 1_000;
/** Without a frame for so long there is no bridge [ms]. */
const SILENCE = 1_000;
/** All keys were up for so long before that is told [ms]. */
const LET_GO = 20;
/** One that stood still for longer does not scan for all of it [ms]. */
const MOST_MISSED = 2_000;
const KEYS = 16;
const ALL_ROWS = (1 << ROWS) - 1;

interface KeyEvent {
  key: number;
  isDown: boolean;
  flags: number;
  mask: number;
  time: number;
}

/** The mask of the cells that read closed: ghosts among them, where three are pressed. */
export function closedCells(pressed: ReadonlySet<number>): number {
  let groups: { rows: Set<number>; columns: Set<number> }[] = [];
  for (const key of pressed) {
    const joined = { rows: new Set([Math.floor(key / 4)]), columns: new Set([key % 4]) };
    groups = groups.filter(({ rows, columns }) => {
      if (!overlaps(rows, joined.rows) && !overlaps(columns, joined.columns)) return true;
      for (const row of rows) joined.rows.add(row);
      for (const column of columns) joined.columns.add(column);
      return false;
    });
    groups.push(joined);
  }
  let mask = 0;
  for (const { rows, columns } of groups) {
    for (const row of rows) for (const column of columns) mask |= 1 << (4 * row + column);
  }
  return mask;
}

function overlaps(one: ReadonlySet<number>, other: ReadonlySet<number>): boolean {
  return [...one].some((each) => other.has(each));
}

function countOf(mask: number): number {
  let count = 0;
  for (let rest = mask; rest !== 0; rest &= rest - 1) count += 1;
  return count;
}

export class ScreenKeypad {
  /** The keys that a finger is on. */
  readonly pressed = new Set<number>();
  /** The enabling button is held. */
  button = false;
  /** What the display shows. */
  lcd: string[] = [];

  #started = 0;
  #time = 0;
  #out: number[] = [];
  #sequence = 0;
  #reader = new FrameReader(true);
  // Keys.
  #down = 0;
  #closedBefore = 0;
  #unequal = new Array<number>(KEYS).fill(0);
  #buttonUnequal = 0;
  #flags = 0;
  #debounce = 5;
  #openFor = 0;
  #events: KeyEvent[] = [];
  // The conversation.
  #resetCause = 1;
  #beatPeriod = 50;
  #rowsShown = 0;
  #hasBridge = false;
  #owesHello = false;
  #owesLetGo = false;
  #acks: { sequence: number; result: number }[] = [];
  #heardAt = 0;
  #beatAt = 0;
  #helloAt = 0;
  #flagsTold = 0;
  #badTold = 0;

  /** Switch it on, or start it anew; fingers stay where they are. */
  start(now: number, resetCause = 1): void {
    this.#started = now;
    this.#time = 0;
    this.#out = [];
    this.#sequence = 0;
    this.#reader = new FrameReader(true);
    this.#down = this.#closedBefore = this.#flags = 0;
    this.#unequal.fill(0);
    this.#buttonUnequal = 0;
    this.#debounce = 5;
    this.#openFor = 0;
    this.#events = [];
    this.#beatPeriod = 50;
    this.#acks = [];
    this.#heardAt = this.#beatAt = this.#flagsTold = this.#badTold = 0;
    this.#resetCause = resetCause;
    this.#owesLetGo = true;
    this.#loseBridge();
  }

  /** What it sends now. */
  output(): Uint8Array {
    const out = Uint8Array.from(this.#out);
    this.#out = [];
    return out;
  }

  /** Take bytes of the bridge, as of the last `tick`. */
  receive(data: Uint8Array): void {
    for (const { sequence, frame } of this.#reader.receive(data)) this.#obey(sequence, frame as ToKeypad);
  }

  /** Let its milliseconds pass up to now. */
  tick(now: number): void {
    const until = Math.floor(now - this.#started);
    this.#time = Math.max(this.#time, until - MOST_MISSED);
    while (this.#time < until) {
      this.#time += 1;
      this.#scan();
      this.#pass();
    }
  }

  #scan(): void {
    this.#readButton();
    const closed = closedCells(this.pressed);
    if ((closed | this.#down | this.#closedBefore) !== 0) {
      const changed = this.#debounced(closed);
      this.#judgeNumber(closed, changed);
      this.#noteAll(changed);
      this.#openFor = 0;
    } else {
      this.#openFor += 1;
    }
    this.#closedBefore = closed;
  }

  #debounced(closed: number): number {
    let changed = 0;
    for (let key = 0; key < KEYS; key += 1) {
      const bit = 1 << key;
      if (((closed ^ this.#down) & bit) === 0) {
        this.#unequal[key] = 0;
        continue;
      }
      const scans = (this.#unequal[key] ?? 0) + 1;
      const down = key === STOP ? STOP_SCANS : this.#debounce;
      const isOver = scans >= ((closed & bit) !== 0 ? down : UP_SCANS);
      this.#unequal[key] = isOver ? 0 : scans;
      if (isOver) changed |= bit;
    }
    return changed;
  }

  /** Count cells before they are debounced, so that the first of three keys counts never. */
  #judgeNumber(closed: number, changed: number): void {
    if (countOf((closed & this.#closedBefore) | this.#down) > 2) this.#flags |= KeyFlag.TOO_MANY_KEYS;
    if (closed === 0 && (this.#down & ~changed) === 0) this.#flags &= ~KeyFlag.TOO_MANY_KEYS;
  }

  /** Note the changes of one scan: STOP first, then what was let go, then what was pressed. */
  #noteAll(changed: number): void {
    const stop = 1 << STOP;
    const ups = changed & this.#down & ~stop;
    const downs = changed & ~this.#down & ~stop;
    for (const order of [changed & stop, ups, downs]) {
      for (let key = 0; key < KEYS; key += 1) {
        if (((order >> key) & 1) === 0) continue;
        this.#down ^= 1 << key;
        const isDown = ((this.#down >> key) & 1) === 1;
        this.#events.push({ key, isDown, flags: this.#flags, mask: this.#down, time: this.#time });
      }
    }
  }

  #readButton(): void {
    const isHeld = (this.#flags & KeyFlag.ENABLING_HELD) !== 0;
    if (this.button === isHeld) {
      this.#buttonUnequal = 0;
      return;
    }
    this.#buttonUnequal += 1;
    if (this.#buttonUnequal < (isHeld ? BUTTON_UP : BUTTON_DOWN)) return;
    this.#buttonUnequal = 0;
    this.#flags ^= KeyFlag.ENABLING_HELD;
  }

  #obey(sequence: number, frame: ToKeypad): void {
    this.#hasBridge = true;
    this.#heardAt = this.#time;
    let result: number = AckResult.DONE;
    switch (frame.kind) {
      case FrameKind.WELCOME:
        result = this.#takeWelcome(frame);
        break;
      case FrameKind.LCD_ROW:
        if (frame.row < ROWS) {
          this.lcd[frame.row] = shown(frame.text);
          this.#rowsShown |= 1 << frame.row;
        } else {
          result = AckResult.WRONG_PLACE;
        }
        break;
      case FrameKind.LCD_PAGE:
        this.lcd = Array.from({ length: ROWS }, (_, row) => shown(frame.text.slice(row * COLUMNS, (row + 1) * COLUMNS)));
        this.#rowsShown = ALL_ROWS;
        break;
      case FrameKind.ASK_HELLO:
        this.#owesHello = true;
        break;
      case FrameKind.HOST_BEAT:
        break;
    }
    if (ACKNOWLEDGED.includes(frame.kind)) this.#acks.push({ sequence, result });
  }

  #takeWelcome({ protocol, beat, debounce }: KeypadWelcome): number {
    if (protocol !== PROTOCOL) return AckResult.WRONG_VERSION;
    if (beat < 20 || beat > 250 || debounce < 5 || debounce > 20) return AckResult.WRONG_PLACE;
    this.#beatPeriod = beat;
    this.#debounce = debounce;
    this.#openFor = 0;
    this.#owesLetGo = true;
    return AckResult.DONE;
  }

  #loseBridge(): void {
    this.#hasBridge = false;
    this.#rowsShown = 0;
    this.#owesHello = true;
    this.#helloAt = this.#time;
    const version = `keypad ${FIRMWARE.join(".")}${String(BAUD).padStart(9)}`;
    this.lcd = ["NO BRIDGE", "USE THE ROBOT'S OWN", "STOP BUTTON", version].map((row) => row.padEnd(COLUMNS));
  }

  #pass(): void {
    if (this.#hasBridge && this.#time - this.#heardAt >= SILENCE) this.#loseBridge();
    if (!this.#hasBridge && this.#time - this.#helloAt >= HELLO_PERIOD) {
      this.#helloAt = this.#time;
      this.#owesHello = true;
    }
    if (this.#events.length === 0) return this.#sendOneOfTheRest();
    for (const { key, isDown, flags, mask, time } of this.#events) {
      const kind = isDown ? FrameKind.KEY_DOWN : FrameKind.KEY_UP;
      this.#send({ kind, key, flags: this.#flagsOf(flags), mask, time: time % 65_536 });
    }
    this.#events = [];
  }

  /** Send a beat, or one of the frames that can wait for one. */
  #sendOneOfTheRest(): void {
    const since = this.#time - this.#beatAt;
    const state = { key: NO_KEY, flags: this.#flagsOf(this.#flags), mask: this.#down, time: this.#time % 65_536 };
    if (since >= this.#beatPeriod || this.#flags !== this.#flagsTold) {
      const isSteady = since >= this.#beatPeriod && since < 2 * this.#beatPeriod;
      this.#beatAt = isSteady ? this.#beatAt + this.#beatPeriod : this.#time;
      this.#flagsTold = this.#flags;
      this.#send({ kind: FrameKind.BEAT, ...state });
      this.#badTold = this.#reader.bad;
    } else if (this.#owesLetGo && this.#openFor >= LET_GO) {
      this.#owesLetGo = false;
      this.#send({ kind: FrameKind.KEY_UP, ...state });
    } else if (this.#owesHello && this.#time >= FIRST_HELLO) {
      this.#owesHello = false;
      this.#send(this.#hello());
    } else {
      const ack = this.#acks.shift();
      if (ack !== undefined) this.#send({ kind: FrameKind.ACK, ...ack });
    }
  }

  #hello(): FromKeypad {
    return {
      kind: FrameKind.HELLO,
      protocol: PROTOCOL,
      major: FIRMWARE[0],
      minor: FIRMWARE[1],
      reset_cause: this.#resetCause,
      columns: COLUMNS,
      rows: ROWS,
      features: KeypadFeature.ENABLING_BUTTON,
      mask: this.#down,
      time: this.#time % 65_536,
    };
  }

  #flagsOf(flags: number): number {
    const rubbish = this.#reader.bad > this.#badTold ? KeyFlag.RUBBISH_RECEIVED : 0;
    return flags | rubbish | (this.#rowsShown === ALL_ROWS ? 0 : KeyFlag.PAGE_INCOMPLETE);
  }

  #send(frame: LineFrame): void {
    this.#out.push(...bytesOf(frame, this.#sequence));
    this.#sequence = (this.#sequence + 1) % 256;
  }
}

/** What the glass shows of bytes. */
function shown(text: string): string {
  return text.replace(/[^ -~]/g, "?");
}
