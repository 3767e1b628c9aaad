// The keypad pendant in the page: its 16 keys, its display, its enabling button.
//
// It is a device of its own, with a bridge of its own that serves it: what is pressed here moves the
// robot of that bridge, with the bridge's rights.
import "../keypad.css";
import { KeypadLine } from "../keypad/line.ts";
import type { LineStage } from "../keypad/line.ts";
import { COLUMNS, KEY_CAPS, MODE, STOP } from "../keypad/serial-frames.ts";
import { letsGo } from "../pendant/keys.ts";
import type { App, TaskPart } from "../ui/app.ts";
import { attribute, h, mark, say } from "../ui/elements.ts";
import { holdButton } from "../ui/hold-button.ts";
import { openKeypadSocket } from "../wire/gateway.ts";

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
  readonly #end = new AbortController();
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
        down: () => this.#line.hold(true),
        up: () => this.#line.hold(false),
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
    this.#app.hearStop(isShown ? () => this.#line.strike(STOP) : null);
    this.#plug();
  }

  update(): void {
    this.#draw();
  }

  #key(key: number): HTMLButtonElement {
    const [label, does, menu] = KEY_CAPS[key] ?? ["", "", ""];
    const held = {
      down: (source: string) => {
        // However short it is, and whatever the page does meanwhile.
        if (key === STOP) this.#line.strike(STOP);
        this.#line.down(key, source);
      },
      up: (source: string) => this.#line.up(key, source),
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

  /** A click without pointer or key, as of a screen reader: STOP is pressed, all else is held. */
  #click(key: number): void {
    if (key === STOP || key === MODE) this.#line.strike(key);
    else this.#remark(this.#app.texts.keypadWords.holdHow);
  }

  /** Whatever lets go of a button of the page lets go of all keys here. */
  #letGoWhere(): void {
    const { signal } = this.#end;
    const letGo = (): void => this.#line.letGo();
    for (const name of ["blur", "pagehide", "contextmenu"]) window.addEventListener(name, letGo, { signal });
    const keyed = (event: KeyboardEvent): void => {
      if (event.key === "Escape" || letsGo(event)) letGo();
    };
    window.addEventListener("keydown", keyed, { capture: true, signal });
    document.addEventListener("visibilitychange", () => this.#plug(), { signal });
    // In another language the page is built anew, with another keypad.
    const { language } = this.#app.settings.value;
    const endWatch = this.#app.settings.watch((settings) => {
      if (settings.language === language) return;
      endWatch();
      this.#end.abort();
      this.shown(false);
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
    const { open, opening, taken, lost, pulled } = this.#app.texts.keypadWords;
    return { open, opening, taken, lost, pulled }[stage];
  }
}
