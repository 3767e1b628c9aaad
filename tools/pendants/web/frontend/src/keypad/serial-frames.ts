// Generated from the declarations in simplemsg/ by `make reference`; do not edit.
//
// The frames on the line between a keypad and its bridge. Times are ms.

export const PROTOCOL = 1;
export const LONGEST_PIECE = 96;
export const NO_KEY = 255;
export const COLUMNS = 20;
export const ROWS = 4;

/** Kinds of frames. */
export const FrameKind = { HELLO: 1, KEY_DOWN: 2, KEY_UP: 3, BEAT: 4, ACK: 5, MESSAGE: 64, WELCOME: 129, LCD_ROW: 130, LCD_PAGE: 131, HOST_BEAT: 132, ASK_HELLO: 133 } as const;

/** Flags of a key frame. */
export const KeyFlag = { TOO_MANY_KEYS: 1, ENABLING_HELD: 2, RUBBISH_RECEIVED: 4, PAGE_INCOMPLETE: 8 } as const;

/** What a keypad is fitted with. */
export const KeypadFeature = { ENABLING_BUTTON: 1, CHARACTERS_JUMPER: 2 } as const;

/** What a keypad made of a frame. */
export const AckResult = { DONE: 0, WRONG_KIND: 1, WRONG_LENGTH: 2, WRONG_PLACE: 3, BUSY: 4, WRONG_VERSION: 5 } as const;

/** What a keypad says of itself after its start, and when it is asked. */
export interface KeypadHello {
  kind: typeof FrameKind.HELLO;
  protocol: number;
  major: number;
  minor: number;
  reset_cause: number;
  columns: number;
  rows: number;
  features: number;
  mask: number;
  time: number;
}

/** A key went down. */
export interface KeyDown {
  kind: typeof FrameKind.KEY_DOWN;
  key: number;
  flags: number;
  mask: number;
  time: number;
}

/** A key came up; with `NO_KEY` and no key down: all keys are up after a start or a welcome. */
export interface KeyUp {
  kind: typeof FrameKind.KEY_UP;
  key: number;
  flags: number;
  mask: number;
  time: number;
}

/** The keypad lives; sent all the time, with and without keys. */
export interface KeypadBeat {
  kind: typeof FrameKind.BEAT;
  key: number;
  flags: number;
  mask: number;
  time: number;
}

/** The keypad's answer to a welcome, a row or a page. */
export interface Ack {
  kind: typeof FrameKind.ACK;
  sequence: number;
  result: number;
}

/** The bridge's answer to a hello. */
export interface KeypadWelcome {
  kind: typeof FrameKind.WELCOME;
  protocol: number;
  beat: number;
  debounce: number;
  flags: number;
}

/** One row of the display: twenty characters of printable ASCII. */
export interface LcdRow {
  kind: typeof FrameKind.LCD_ROW;
  row: number;
  text: string;
}

/** All of the display, row by row. */
export interface LcdPage {
  kind: typeof FrameKind.LCD_PAGE;
  text: string;
}

/** The bridge lives; `flags` of `HostFlag`. */
export interface HostBeat {
  kind: typeof FrameKind.HOST_BEAT;
  flags: number;
}

/** The bridge wants a hello. */
export interface AskHello {
  kind: typeof FrameKind.ASK_HELLO;
}

export type FromKeypad = KeypadHello | KeyDown | KeyUp | KeypadBeat | Ack;

export type ToKeypad = KeypadWelcome | LcdRow | LcdPage | HostBeat | AskHello;

/** Kinds that a keypad answers. */
export const ACKNOWLEDGED = [129, 130, 131];

/** What is printed on each key: its label, what it does, and what in the menu. */
export const KEY_CAPS: readonly (readonly [string, string, string])[] = [
  ["1", "1+  X+", "REC"],
  ["2", "2+  Y+", "PLAY"],
  ["3", "3+  Z+", "UP"],
  ["A", "SPEED +", ""],
  ["4", "1-  X-", "TEACH"],
  ["5", "2-  Y-", "UNDO"],
  ["6", "3-  Z-", "DOWN"],
  ["B", "SPEED -", ""],
  ["7", "4+  A+", "HOME"],
  ["8", "5+  B+", "RUN"],
  ["9", "6+  C+", "PAGE"],
  ["C", "MODE", "long: menu"],
  ["*", "4-  A-", "CTRL"],
  ["0", "5-  B-", "PAUSE"],
  ["#", "6-  C-", "T1/T2"],
  ["D", "STOP", ""],
];

export const MODE = 11;
export const STOP = 15;

/** A field of a payload: bytes of a number, or of a text; one without a name is zero. */
export type LineField = readonly [name: string, size: number, isText?: true];

export type LineLayout = readonly [isToKeypad: boolean, ...LineField[]];

/** The payload of each kind, and whether it goes to the keypad. */
export const LINE_LAYOUTS: Readonly<Record<number, LineLayout>> = {
  1: [false, ["protocol", 1], ["major", 1], ["minor", 1], ["reset_cause", 1], ["columns", 1], ["rows", 1], ["features", 1], ["", 1], ["mask", 2], ["time", 2]],
  2: [false, ["key", 1], ["flags", 1], ["mask", 2], ["time", 2]],
  3: [false, ["key", 1], ["flags", 1], ["mask", 2], ["time", 2]],
  4: [false, ["key", 1], ["flags", 1], ["mask", 2], ["time", 2]],
  5: [false, ["sequence", 1], ["result", 1]],
  129: [true, ["protocol", 1], ["beat", 1], ["debounce", 1], ["flags", 1]],
  130: [true, ["row", 1], ["", 1], ["text", 20, true]],
  131: [true, ["text", 80, true]],
  132: [true, ["flags", 1], ["", 1]],
  133: [true],
};
