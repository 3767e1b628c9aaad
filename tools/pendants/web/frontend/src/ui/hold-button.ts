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
    down(`pointer ${event.pointerId}`);
  });
  for (const name of ["pointerup", "pointercancel", "pointerleave"] as const) {
    button.addEventListener(name, (event) => up(`pointer ${event.pointerId}`));
  }
  button.addEventListener("keydown", (event) => {
    if (event.key !== "Enter") return;
    event.preventDefault();
    if (!event.repeat) down("Enter");
  });
  button.addEventListener("keyup", (event) => {
    if (event.key === "Enter") up("Enter");
  });
  button.addEventListener("blur", () => up("Enter"));
  button.addEventListener("click", (event) => {
    if (event.detail === 0) held.explain();
  });
}
