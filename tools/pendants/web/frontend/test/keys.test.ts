import assert from "node:assert/strict";
import { test } from "node:test";
import { keyAct, letsGo, takesLetters } from "../src/pendant/keys.ts";
import type { KeyPress } from "../src/pendant/keys.ts";

const AWAY = { isTyping: false, isButton: false };
const TYPING = { isTyping: true, isButton: false };
const BUTTON = { isTyping: false, isButton: true };

function key(code: string, more: Partial<KeyPress> = {}): KeyPress {
  return { code, key: "", shiftKey: false, ctrlKey: false, altKey: false, metaKey: false, ...more };
}

test("Space stops, on a button too and with letters switched off", () => {
  assert.deepEqual(keyAct(key("Space"), BUTTON, false), { act: "stop" });
});

test("Space stops while other keys are down", () => {
  assert.deepEqual(keyAct(key("Space", { ctrlKey: true }), AWAY, true), { act: "stop" });
});

test("Space in a text field is a space", () => {
  assert.equal(keyAct(key("Space"), TYPING, true), null);
});

test("F8 stops in a text field too", () => {
  assert.deepEqual(keyAct(key("F8"), TYPING, true), { act: "stop" });
});

test("a digit jogs its axis by its place on the keyboard", () => {
  const french = key("Digit1", { key: "&" });
  assert.deepEqual(keyAct(french, AWAY, true), { act: "jog", key: { axis: 0, direction: 1 } });
});

test("Shift turns the direction", () => {
  const pressed = key("Digit6", { shiftKey: true });
  assert.deepEqual(keyAct(pressed, AWAY, true), { act: "jog", key: { axis: 5, direction: -1 } });
});

test("letters and digits can be switched off", () => {
  for (const code of ["Digit1", "KeyV", "KeyC", "KeyM", "KeyF"]) {
    assert.equal(keyAct(key(code), AWAY, false), null);
  }
});

test("a letter with Ctrl is the browser's", () => {
  assert.equal(keyAct(key("KeyC", { ctrlKey: true }), AWAY, true), null);
});

test("Enter on a button is the button's, elsewhere it presses the orange one", () => {
  assert.equal(keyAct(key("Enter"), BUTTON, true), null);
  assert.deepEqual(keyAct(key("Enter"), AWAY, true), { act: "orange" });
});

test("the question mark goes by its character", () => {
  const german = key("Minus", { key: "?", shiftKey: true });
  assert.deepEqual(keyAct(german, AWAY, true), { act: "help" });
});

test("Ctrl, Alt and Meta going down let go", () => {
  for (const name of ["Control", "Alt", "Meta"]) {
    assert.equal(letsGo(key("", { key: name })), true);
  }
  assert.equal(letsGo(key("ShiftLeft", { key: "Shift" })), false);
});

test("sliders, check boxes and lists take no letters", () => {
  assert.equal(takesLetters("INPUT", "range", false), false);
  assert.equal(takesLetters("INPUT", "checkbox", false), false);
  assert.equal(takesLetters("SELECT", "", false), false);
  assert.equal(takesLetters("INPUT", "text", false), true);
  assert.equal(takesLetters("TEXTAREA", "", false), true);
});
