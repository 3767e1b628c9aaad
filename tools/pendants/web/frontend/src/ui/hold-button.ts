// A button that acts for as long as it is held, by pointer, finger or Enter.

import { h, isOff } from "./elements.ts";
import type { Child } from "./elements.ts";

export interface Held {
  down(source: string): void;
  up(source: string): void;
  /** A click without pointer or key, as of a screen reader: it moves nothing. */
  explain(): void;
}

/** Make such a button; one with words needs no label. Leaving it and every doubt let go. */
export function holdButton(
  className: string,
  label: string | null,
  held: Held,
  ...children: Child[]
): HTMLButtonElement {
  const button = h(
    "button",
    { type: "button", class: `hold ${className}`, "aria-label": label },
    ...children,
  );
  bindHold(button, held);
  return button;
}

export function bindHold(button: HTMLElement, held: Held): void {
  const sources = new Set<string>();
  const down = (source: string): void => {
    if (isOff(button) || sources.has(source)) return;
    sources.add(source);
    held.down(source);
  };
  const up = (source: string): void => {
    if (sources.delete(source)) held.up(source);
  };
  button.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    // A finger is captured by what it touches first, and would never leave it.
    if (button.hasPointerCapture(event.pointerId)) button.releasePointerCapture(event.pointerId);
    (event.target as Element).releasePointerCapture?.(event.pointerId);
    event.preventDefault();
    button.focus({ preventScroll: true });
    const source = `pointer ${event.pointerId}`;
    down(source);
    whenOver(["pointerup", "pointercancel"], (over) => over.pointerId === event.pointerId, () => up(source));
  });
  button.addEventListener("pointerleave", (event) => up(`pointer ${event.pointerId}`));
  button.addEventListener("keydown", (event) => {
    if (event.key !== "Enter") return;
    event.preventDefault();
    if (event.repeat) return;
    down("Enter");
    whenOver(["keyup"], (over) => over.key === "Enter", () => up("Enter"));
  });
  button.addEventListener("blur", () => up("Enter"));
  button.addEventListener("click", (event) => {
    if (event.detail === 0) held.explain();
  });
}

/** Act once at the first such event anywhere: a button that is gone by then is told of none. */
function whenOver<Name extends "pointerup" | "pointercancel" | "keyup">(
  names: readonly Name[],
  isIt: (event: WindowEventMap[Name]) => boolean,
  act: () => void,
): void {
  const end = new AbortController();
  for (const name of names) {
    window.addEventListener(
      name,
      (event) => {
        if (!isIt(event)) return;
        end.abort();
        act();
      },
      { capture: true, signal: end.signal },
    );
  }
}
