// A gamepad of the browser: read once each animation frame, and let go of where that ends.
import { isInControl } from "../pendant/cell.ts";
import { GamepadHand, LONGEST_GAP } from "../pendant/gamepad.ts";
import type { PadState } from "../pendant/gamepad.ts";
import { steer } from "../panels/jog.ts";
import { changeSpeed, nextFrame, takeControl } from "../panels/top-row.ts";
import type { App } from "./app.ts";

const SOURCE = "gamepad";

/** Listen to gamepads, as long as the page stands. */
export function listenToGamepads(app: App): void {
  const { holding } = app;
  const hand = new GamepadHand({
    stop: () => app.stop(),
    // Asked for control it holds nothing yet, and so is let go below.
    hold: () => (isInControl(app.cell.value) ? holding.enable(SOURCE) : takeControl(app)),
    letGo: () => {
      holding.disable(SOURCE, false);
      holding.steer(null);
    },
    aim: (values) => (values === null ? holding.steer(null) : steer(app, values)),
    nextFrame: () => nextFrame(app),
    changeSpeed: (by) => changeSpeed(app, by),
  });
  let isPolled = false;
  const poll = (): void => {
    const pad = standardPad();
    hand.poll(pad, app.now());
    // Something else let go, as a page that loses the focus, or nothing was begun.
    const isOver = (hand.isHeld && !holding.enabling.isOn) || (hand.isAiming && !holding.isSteered);
    if (isOver) hand.letGo();
    isPolled = pad !== null;
    if (isPolled) requestAnimationFrame(poll);
  };
  // Between frames: a page whose frames end keeps its timers.
  setInterval(() => hand.watch(app.now()), LONGEST_GAP / 2);
  window.addEventListener("gamepadconnected", () => isPolled || poll());
  window.addEventListener("gamepaddisconnected", () => hand.poll(standardPad(), app.now()));
}

/** The first gamepad whose numbers are known; null for none. */
function standardPad(): PadState | null {
  const pad = navigator.getGamepads().find((each) => each?.mapping === "standard");
  if (pad == null) return null;
  return { axes: pad.axes, buttons: pad.buttons.map((each) => each.pressed), timestamp: pad.timestamp };
}
