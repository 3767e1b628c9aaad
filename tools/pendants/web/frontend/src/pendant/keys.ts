// Keys of the keyboard by their physical place, and what they do where nobody types.
import type { JogKey } from "./hold.ts";

export type KeyAct =
  | { act: "stop" }
  | { act: "enabling" }
  | { act: "jog"; key: JogKey }
  | { act: "frame" }
  | { act: "control" }
  | { act: "mode" }
  | { act: "orange" }
  | { act: "close" }
  | { act: "help" };

/** What is needed of a keyboard event. */
export interface KeyPress {
  code: string;
  key: string;
  shiftKey: boolean;
  ctrlKey: boolean;
  altKey: boolean;
  metaKey: boolean;
}

/** Where the focus is. */
export interface Focus {
  /** It takes letters: text, number, editable. */
  isTyping: boolean;
  /** It does something by itself with Enter. */
  isButton: boolean;
}

/** Return what a key that went down does; null for nothing of ours. */
export function keyAct(press: KeyPress, focus: Focus, areLettersOn: boolean): KeyAct | null {
  if (press.code === "F8") return { act: "stop" };
  if (press.code === "Escape") return { act: "close" };
  if (focus.isTyping) return null;
  // Space stops with whatever else is down: a frightened hand looks for no Shift.
  if (press.code === "Space") return { act: "stop" };
  if (press.ctrlKey || press.altKey || press.metaKey) return null;
  if (press.code === "Enter" || press.code === "NumpadEnter") {
    return focus.isButton ? null : { act: "orange" };
  }
  if (!areLettersOn) return null;
  if (press.key === "?") return { act: "help" };
  const digit = /^(?:Digit|Numpad)([1-9])$/.exec(press.code)?.[1];
  if (digit !== undefined) {
    return { act: "jog", key: { axis: Number(digit) - 1, direction: press.shiftKey ? -1 : 1 } };
  }
  switch (press.code) {
    case "KeyV":
      return { act: "enabling" };
    case "KeyF":
      return { act: "frame" };
    case "KeyC":
      return { act: "control" };
    case "KeyM":
      return { act: "mode" };
    default:
      return null;
  }
}

/** Whether a key that went down lets go of keys that are held; a Mac tells no key-up under Meta. */
export function letsGo(press: KeyPress): boolean {
  return ["Control", "Alt", "Meta", "AltGraph"].includes(press.key);
}

/** Whether an element takes letters, so that letters are not ours there. */
export function takesLetters(tag: string, type: string, isEditable: boolean): boolean {
  if (isEditable || tag === "TEXTAREA") return true;
  const notTyped = ["range", "checkbox", "radio", "button", "submit", "reset", "file", "color"];
  return tag === "INPUT" && !notTyped.includes(type);
}
