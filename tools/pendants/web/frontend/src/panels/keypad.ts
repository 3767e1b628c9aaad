// The keypad pendant in the page: its 16 keys, its display, its enabling button.
//
// It is a device of its own, with a bridge of its own that serves it: what is pressed here moves the
// robot of that bridge, with the bridge's rights.
import "../keypad.css";
import { KeypadLine } from "../keypad/line.ts";
import type { LineStage } from "../keypad/line.ts";
import { COLUMNS, KEY_CAPS, MODE, STOP } from "../keypad/serial-frames.ts";
import type { App, TaskPart } from "../ui/app.ts";
import { attribute, h, mark, say } from "../ui/elements.ts";
import { holdButton } from "../ui/hold-button.ts";
import { openKeypadSocket } from "../wire/gateway.ts";

/** STOP of the page presses the keypad's for so long [ms]. */
const STRUCK = 150;

/** The bridge waits for a debounced press and a page of the display: for a click without a press [ms]. */
const CLICKED = 60;

export function keypadTask(app: App): TaskPart {
  return new KeypadTask(app);
}

class KeypadTask implements TaskPart {
  readonly element: HTMLElement;
  readonly #app: App;
  readonly #line: KeypadLine;
  readonly #rows = KEY_CAPS.slice(0, 4).map(() => h("div", {}));
  readonly #state = h("p", { class: "muted", role: "status" });
  readonly #keys: HTMLButtonElement[];
  readonly #button: HTMLButtonElement;
  readonly #sources = new Map<number, Set<string>>();
  #isShown = false;

  constructor(app: App) {
    const words = app.texts.keypadWords;
    this.#app = app;
    this.#line = new KeypadLine({ open: openKeypadSocket, now: () => app.now(), changed: () => this.#draw() });
    this.#keys = KEY_CAPS.map((_, key) => this.#key(key));
    this.#button = holdButton(
      "keypad-enabling",
      null,
      {
        down: () => this.#hold(true),
        up: () => this.#hold(false),
        explain: () => this.#remark(words.holdHow),
      },
      words.button,
    );
    this.element = h(
      "section",
      { class: "keypad", "aria-label": words.title },
      h("h2", {}, words.title),
      h("div", { class: "glass", role: "log", "aria-label": words.display }, ...this.#rows),
      h("div", { class: "keys" }, ...this.#keys),
      this.#button,
      this.#state,
      h("p", { class: "muted" }, words.what),
    );
    this.#letGoWhere();
  }

  shown(isShown: boolean): void {
    this.#isShown = isShown;
    this.#app.hearStop(isShown ? () => this.#strikeStop() : null);
    this.#plug();
  }

  update(): void {
    this.#draw();
  }

  #key(key: number): HTMLButtonElement {
    const [label, does, menu] = KEY_CAPS[key] ?? ["", "", ""];
    const held = {
      down: (source: string) => this.#touch(key, source, true),
      up: (source: string) => this.#touch(key, source, false),
      explain: () => this.#click(key),
    };
    const told = `${does} ${menu}`.replace(/ +/g, " ").trim();
    const className = key === STOP ? "stop-key" : key === MODE ? "mode-key" : "";
    const [joint, tool] = does.split("  ");
    return holdButton(
      className,
      this.#app.texts.keypadWords.key(label, told),
      held,
      h("span", { class: "joint" }, joint),
      // What a screen reader reads has a space between two rows.
      " ",
      tool !== undefined && h("span", {}, tool),
      " ",
      menu !== "" && h("span", { class: "menu" }, menu),
    );
  }

  /** A finger more or less on a key; it is down as long as one is. */
  #touch(key: number, source: string, isDown: boolean): void {
    const sources = this.#sources.get(key) ?? new Set();
    this.#sources.set(key, sources);
    if (isDown) sources.add(source);
    else sources.delete(source);
    if (sources.size > 0) this.#line.keypad.pressed.add(key);
    else this.#line.keypad.pressed.delete(key);
    this.#draw();
  }

  /** A click without pointer or key, as of a screen reader: STOP is pressed, all else is held. */
  #click(key: number): void {
    if (key === STOP) this.#strikeStop();
    else if (key === MODE) this.#strike(key, CLICKED);
    else this.#remark(this.#app.texts.keypadWords.holdHow);
  }

  #strikeStop(): void {
    this.#strike(STOP, STRUCK);
  }

  #strike(key: number, time: number): void {
    this.#touch(key, "struck", true);
    setTimeout(() => this.#touch(key, "struck", false), time);
  }

  #hold(isHeld: boolean): void {
    this.#line.keypad.button = isHeld;
    this.#draw();
  }

  /** Whatever lets go of a button of the page lets go of all keys here. */
  #letGoWhere(): void {
    const letGo = (): void => {
      for (const sources of this.#sources.values()) sources.clear();
      this.#line.letGo();
      this.#draw();
    };
    for (const name of ["blur", "pagehide", "contextmenu"]) window.addEventListener(name, letGo);
    window.addEventListener("keydown", (event) => event.key === "Escape" && letGo(), { capture: true });
    document.addEventListener("visibilitychange", () => this.#plug());
    // In another language the page is built anew, with another keypad.
    const { language } = this.#app.settings.value;
    this.#app.settings.watch((settings) => {
      if (settings.language !== language) this.shown(false);
    });
  }

  /** The cable is in while somebody looks. */
  #plug(): void {
    if (this.#isShown && !document.hidden) this.#line.plug();
    else this.#line.pull();
  }

  #remark(text: string): void {
    this.#app.choice.set({ note: { text, kind: "remark" } });
  }

  #draw(): void {
    const { keypad, stage } = this.#line;
    this.#rows.forEach((row, at) => say(row, (keypad.lcd[at] ?? "").padEnd(COLUMNS)));
    this.#keys.forEach((button, key) => mark(button, "held", keypad.pressed.has(key)));
    mark(this.#button, "held", keypad.button);
    attribute(this.#button, "aria-pressed", String(keypad.button));
    say(this.#state, this.#stageWord(stage));
  }

  #stageWord(stage: LineStage): string {
    const { open, opening, taken, lost } = this.#app.texts.keypadWords;
    return { open, opening, taken, lost, pulled: lost }[stage];
  }
}
