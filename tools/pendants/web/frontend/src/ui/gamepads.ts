// A gamepad of the browser: read once each animation frame, and let go of where that ends.
import { isInControl } from "../pendant/cell.ts";
import { GamepadHand, LONGEST_GAP } from "../pendant/gamepad.ts";
import type { PadAct, PadState } from "../pendant/gamepad.ts";
import { steer } from "../panels/jog.ts";
import { changeSpeed, nextFrame, takeControl } from "../panels/top-row.ts";
import type { App } from "./app.ts";

const SOURCE = "gamepad";

/** Listen to gamepads from the first one on; returns how to end that. */
export function listenToGamepads(app: App): () => void {
  const end = new AbortController();
  const { signal } = end;
  const hand = new GamepadHand();
  const carry = (acts: PadAct[]): void => {
    for (const each of acts) carryOut(app, hand, each);
  };
  let frame: number | null = null;
  const poll = (): void => {
    const pad = standardPad();
    carry(hand.poll(pad, app.now()));
    // Something else ended the press, or it was not begun: it must be pressed anew.
    if (hand.isAiming && !app.holding.isSteered) carry(hand.letGo());
    frame = pad === null ? null : requestAnimationFrame(poll);
  };
  const begin = (): void => {
    if (frame === null) poll();
  };
  const letGo = (): void => carry(hand.letGo());
  // Between frames: a page whose frames end keeps its timers.
  const watch = setInterval(() => carry(hand.watch(app.now())), LONGEST_GAP / 2);
  window.addEventListener("gamepadconnected", begin, { signal });
  window.addEventListener("gamepaddisconnected", () => carry(hand.poll(standardPad(), app.now())), { signal });
  window.addEventListener("blur", letGo, { signal });
  window.addEventListener("pagehide", letGo, { signal });
  document.addEventListener("visibilitychange", () => document.hidden && letGo(), { signal });
  begin();
  return () => {
    end.abort();
    clearInterval(watch);
    if (frame !== null) cancelAnimationFrame(frame);
    letGo();
  };
}

/** The first gamepad whose numbers are known; null for none, and where the browser tells none. */
function standardPad(): PadState | null {
  const pads = typeof navigator.getGamepads === "function" ? navigator.getGamepads() : [];
  const pad = pads.find((each) => each?.connected === true && each.mapping === "standard");
  if (pad == null) return null;
  return { axes: pad.axes, buttons: pad.buttons.map((each) => each.pressed), timestamp: pad.timestamp };
}

function carryOut(app: App, hand: GamepadHand, act: PadAct): void {
  app.holding.touched();
  switch (act.act) {
    case "stop":
      app.stop();
      return;
    case "hold":
      if (isInControl(app.cell.value)) app.holding.enable(SOURCE);
      else {
        takeControl(app);
        hand.letGo();
      }
      return;
    case "letGo":
      app.holding.disable(SOURCE, false);
      app.holding.steer(null);
      return;
    case "aim":
      steer(app, act.values);
      return;
    case "centre":
      app.holding.steer(null);
      return;
    case "frame":
      nextFrame(app);
      return;
    case "speed":
      changeSpeed(app, act.by);
      return;
  }
}
