// Makes and changes elements of the page.

export type Child = Node | string | null | false | undefined;

type Props = Readonly<Record<string, string | number | boolean | null | undefined | EventListener>>;

function applied(element: Element, props: Props): void {
  for (const [name, value] of Object.entries(props)) {
    if (typeof value === "function") element.addEventListener(name.slice(2), value);
    else attribute(element, name, value ?? null);
  }
}

/** Make an element; names that begin with `on` are events, the others attributes. */
export function h<Tag extends keyof HTMLElementTagNameMap>(
  tag: Tag,
  props: Props = {},
  ...children: Child[]
): HTMLElementTagNameMap[Tag] {
  const element = document.createElement(tag);
  applied(element, props);
  element.append(...children.filter(isShown));
  return element;
}

function isShown(child: Child): child is Node | string {
  return child !== null && child !== undefined && child !== false;
}

/** Set an attribute; false and null take it away. */
export function attribute(
  element: Element,
  name: string,
  value: string | number | boolean | null,
): void {
  if (value === null || value === false) {
    element.removeAttribute(name);
    return;
  }
  const text = value === true ? "" : String(value);
  if (element.getAttribute(name) !== text) element.setAttribute(name, text);
}

/** Set the text of an element, if it is another one. */
export function say(element: Element, text: string): void {
  if (element.textContent === text) return;
  const [only, other] = element.childNodes;
  // A text that changes costs less than one that comes in place of another, 30 times a second.
  if (only instanceof Text && other === undefined && text !== "") only.data = text;
  else element.textContent = text;
}

/** Show an element with a text; with none, not at all. */
export function sayOrHide(element: HTMLElement, text: string): void {
  say(element, text);
  show(element, text !== "");
}

export function show(element: HTMLElement, isShown: boolean): void {
  if (element.hidden === isShown) element.hidden = !isShown;
}

/** Mark what is chosen, held or wanted next. */
export function mark(element: Element, name: string, isMarked: boolean): void {
  element.classList.toggle(name, isMarked);
}

/** Mark a button of a group as the one that is chosen, or as one that is not. */
export function choose(button: HTMLElement, isChosen: boolean): void {
  mark(button, "chosen", isChosen);
  attribute(button, "aria-pressed", String(isChosen));
}

/** A key of the keyboard, as it stands beside what it does; a screen reader hears it elsewhere. */
export function keyCap(text: string): HTMLElement {
  return h("kbd", { "aria-hidden": "true" }, text);
}

/** Switch a button off with the reason that it is off for; empty for on. */
export function off(button: HTMLButtonElement, why: string): void {
  attribute(button, "aria-disabled", why !== "" ? "true" : null);
  attribute(button, "title", why !== "" ? why : null);
}

export function isOff(button: HTMLElement): boolean {
  return button.getAttribute("aria-disabled") === "true";
}

/** Hand a file to the browser, which keeps it where it keeps what people download. */
export function download(name: string, content: Blob): void {
  const address = URL.createObjectURL(content);
  h("a", { href: address, download: name }).click();
  URL.revokeObjectURL(address);
}
