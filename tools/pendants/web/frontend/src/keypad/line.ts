// The line of the keypad in the page: a WebSocket of the gateway, and the timer its time passes by.
//
// The beats come from the page's own thread, so a page that hangs is a keypad that is gone.
import { ScreenKeypad } from "./keypad.ts";

/** Between two looks at keys and line [ms]. */
const PERIOD = 4;
/** Before the line is tried again [ms]. */
const AGAIN = 1_000;
/** Close code of the gateway: another page has the keypad. */
const TAKEN = 4010;
/** Reset cause of a board whose port was opened. */
const OPENED = 2;
/** A struck key is down for so long, and until it was scanned [ms]. */
const STRUCK = 150;

export type LineStage = "pulled" | "opening" | "open" | "taken" | "lost";

export interface LineSocket {
  binaryType: BinaryType;
  onopen: (() => void) | null;
  onmessage: ((event: { data: ArrayBuffer }) => void) | null;
  onclose: ((event: { code: number }) => void) | null;
  send(data: Uint8Array): void;
  close(): void;
}

export interface LineAround {
  open(): LineSocket;
  /** Monotonic time [ms]. */
  now(): number;
  /** Something is to be shown anew. */
  changed(): void;
}

/** A keypad with its line, which is pulled at first. */
export class KeypadLine {
  readonly keypad = new ScreenKeypad();
  stage: LineStage = "pulled";
  readonly #around: LineAround;
  #socket: LineSocket | null = null;
  #timer: ReturnType<typeof setInterval> | null = null;
  #next = 0;
  #shown = "";
  /** What holds each key: it is down as long as something does. */
  readonly #sources = new Map<number, Set<string>>();
  readonly #struckUntil = new Map<number, number>();

  constructor(around: LineAround) {
    this.#around = around;
    this.keypad.start(around.now());
  }

  /** Plug the cable in, and keep it plugged in. */
  plug(): void {
    if (this.#timer !== null) return;
    this.keypad.start(this.#around.now());
    this.#timer = setInterval(() => this.#look(), PERIOD);
    this.#open();
  }

  /** Pull the cable: the bridge is at its end at once, and what was held is let go. */
  pull(): void {
    if (this.#timer !== null) clearInterval(this.#timer);
    this.#timer = null;
    this.#struckUntil.clear();
    this.letGo();
    const socket = this.#socket;
    this.#socket = null;
    socket?.close();
    this.#tell("pulled");
  }

  down(key: number, source: string): void {
    const sources = this.#sources.get(key) ?? new Set();
    this.#sources.set(key, sources.add(source));
    this.#press(key);
  }

  up(key: number, source: string): void {
    this.#sources.get(key)?.delete(source);
    this.#press(key);
  }

  /** Press a key shortly, as by a click: even where the page hangs meanwhile it is scanned. */
  strike(key: number): void {
    this.#struckUntil.set(key, this.#around.now() + STRUCK);
    this.#press(key);
  }

  hold(isHeld: boolean): void {
    this.keypad.button = isHeld;
    this.#around.changed();
  }

  /** Take all fingers off; what was struck is still scanned. */
  letGo(): void {
    this.#sources.clear();
    for (const key of this.keypad.pressed) this.#press(key);
    this.hold(false);
  }

  #press(key: number): void {
    const isHeld = (this.#sources.get(key)?.size ?? 0) > 0;
    if (isHeld || this.#struckUntil.has(key)) this.keypad.pressed.add(key);
    else this.keypad.pressed.delete(key);
    this.#around.changed();
  }

  #open(): void {
    const socket = (this.#socket = this.#around.open());
    socket.binaryType = "arraybuffer";
    this.#tell("opening");
    socket.onopen = () => {
      if (socket !== this.#socket) return;
      this.keypad.start(this.#around.now(), OPENED);
      this.#tell("open");
    };
    socket.onmessage = ({ data }) => {
      if (socket === this.#socket) this.keypad.receive(new Uint8Array(data));
    };
    socket.onclose = ({ code }) => {
      if (socket !== this.#socket) return;
      this.#socket = null;
      this.#next = this.#around.now() + AGAIN;
      this.#tell(code === TAKEN ? "taken" : "lost");
    };
  }

  #look(): void {
    const now = this.#around.now();
    if (this.#socket === null && now >= this.#next) this.#open();
    this.keypad.tick(now);
    for (const [key, until] of this.#struckUntil) {
      if (now < until) continue;
      this.#struckUntil.delete(key);
      this.#press(key);
    }
    const said = this.keypad.output();
    if (said.length > 0 && this.stage === "open") this.#socket?.send(said);
    const shown = this.keypad.lcd.join();
    if (shown === this.#shown) return;
    this.#shown = shown;
    this.#around.changed();
  }

  #tell(stage: LineStage): void {
    this.stage = stage;
    this.#around.changed();
  }
}
