// The keys of the page, in front of whatever has the focus.
import { keyAct, letsGo, takesLetters } from "../pendant/keys.ts";
import type { KeyAct } from "../pendant/keys.ts";
import { isInControl } from "../pendant/cell.ts";
import { pageState } from "../pendant/states.ts";
import { pressKey } from "../panels/jog.ts";
import { mainAct, nextFrame, nextMode, takeControl } from "../panels/top-row.ts";
import type { App } from "./app.ts";

/** Listen to keys, and to everything that lets go; returns how to end that. */
export function listen(app: App): () => void {
  const end = new AbortController();
  const { signal } = end;
  const down = (event: KeyboardEvent): void => {
    app.holding.touched();
    if (letsGo(event)) app.holding.letGo();
    const focus = focused();
    const act = keyAct(event, focus, app.settings.value.areLettersOn);
    // One press, one act: a held Enter would click again and again.
    if (event.repeat && (act !== null || event.key === "Enter")) {
      event.preventDefault();
      return;
    }
    if (event.key === "Enter" && act?.act === "orange" && openBox(event)) return;
    if (act === null || !carryOut(app, act, event)) return;
    event.preventDefault();
    event.stopPropagation();
  };
  const up = (event: KeyboardEvent): void => {
    if (event.key === "Shift") app.holding.letGo();
    if (event.code === "Space" && !focus().isTyping) event.preventDefault();
    if (event.code === "KeyV") app.holding.disable("key V", false);
    app.holding.release(`key ${event.code}`);
  };
  const forget = (): void => app.holding.forget();
  window.addEventListener("keydown", down, { capture: true, signal });
  window.addEventListener("keyup", up, { capture: true, signal });
  window.addEventListener("pointerdown", () => app.holding.touched(), { capture: true, signal });
  window.addEventListener("blur", forget, { signal });
  window.addEventListener("pagehide", forget, { signal });
  document.addEventListener("visibilitychange", () => document.hidden && forget(), { signal });
  document.addEventListener(
    "contextmenu",
    (event) => {
      forget();
      if (event.target instanceof Element && event.target.closest(".hold") !== null) {
        event.preventDefault();
      }
    },
    { signal },
  );
  return () => end.abort();
}

const focus = focused;

function focused(): { isTyping: boolean; isButton: boolean } {
  const at = document.activeElement;
  if (!(at instanceof HTMLElement)) return { isTyping: false, isButton: false };
  const type = at instanceof HTMLInputElement ? at.type : "";
  return {
    isTyping: takesLetters(at.tagName, type, at.isContentEditable),
    isButton: at instanceof HTMLButtonElement || at instanceof HTMLAnchorElement,
  };
}

/** Space stops, so Enter does what Space would do to a check box and a list. */
function openBox(event: KeyboardEvent): boolean {
  const at = event.target;
  if (at instanceof HTMLInputElement && at.type === "checkbox") at.click();
  else if (at instanceof HTMLSelectElement) at.showPicker();
  else return false;
  event.preventDefault();
  return true;
}

/** Do what a key says; returns whether it was ours. */
function carryOut(app: App, act: KeyAct, event: KeyboardEvent): boolean {
  const cell = app.cell.value;
  switch (act.act) {
    case "stop":
      app.stop();
      return true;
    case "close":
      return close(app);
    case "enabling":
      app.holding.enable("key V");
      return true;
    case "jog":
      pressKey(app, `key ${event.code}`, act.key);
      return true;
    case "frame":
      nextFrame(app);
      return true;
    case "control":
      if (!isInControl(cell)) takeControl(app);
      return true;
    case "mode":
      if (isInControl(cell)) nextMode(app);
      else app.choice.set({ isChecklistOpen: true });
      return true;
    case "orange":
      return pressOrange(app);
    case "help":
      app.session.refreshWhy();
      app.choice.set({ isChecklistOpen: true });
      return true;
  }
}

/** Esc lets go, and closes what is open. */
function close(app: App): boolean {
  app.holding.forget();
  const { isConnectOpen, isMenuOpen, isChecklistOpen } = app.choice.value;
  if (isConnectOpen) app.choice.set({ isConnectOpen: false });
  else if (isMenuOpen) app.choice.set({ isMenuOpen: false });
  else if (isChecklistOpen) app.choice.set({ isChecklistOpen: false });
  else return false;
  return true;
}

/** Press the one orange button, where that moves nothing: what is held never is. */
function pressOrange(app: App): boolean {
  const shown = [...document.querySelectorAll<HTMLButtonElement>("button.orange")];
  const button = shown.find((each) => each.offsetParent !== null && !each.classList.contains("hold"));
  const isHeldLine = button?.closest("[data-line=key], [data-line=enabling], [data-line=limits]") != null;
  if (button === undefined || isHeldLine) return false;
  if (button.classList.contains("main-act") && pageState(app.cell.value) === "running") return false;
  if (button.classList.contains("main-act")) mainAct(app, app.cell.value)?.act();
  else button.click();
  return true;
}
