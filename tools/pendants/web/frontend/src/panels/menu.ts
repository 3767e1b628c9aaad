// Settings of this browser: theme, language, units, keys; and what STOP on a screen is not.
import type { App, Part } from "../ui/app.ts";
import { h, show } from "../ui/elements.ts";

export function menu(app: App): Part {
  const { texts, settings } = app;
  const pick = (label: string, options: readonly [string, string, () => void, boolean][]): HTMLElement =>
    h(
      "div",
      { class: "setting" },
      h("span", {}, label),
      h(
        "div",
        { class: "tabs", role: "group", "aria-label": label },
        ...options.map(([word, , act, isChosen]) =>
          h("button", { type: "button", class: isChosen ? "chosen" : "", "aria-pressed": String(isChosen), onclick: act }, word),
        ),
      ),
    );
  const { theme, language, areRadians, areLettersOn } = settings.value;
  const letters = h("input", { type: "checkbox", checked: areLettersOn });
  letters.addEventListener("change", () => settings.set({ areLettersOn: letters.checked }));
  const element = h(
    "div",
    { class: "veil", role: "dialog", "aria-label": texts.settings },
    h(
      "div",
      { class: "card" },
      h("h2", {}, texts.settings),
      pick(texts.theme, [
        [texts.dark, "dark", () => settings.set({ theme: "dark" }), theme === "dark"],
        [texts.light, "light", () => settings.set({ theme: "light" }), theme === "light"],
      ]),
      pick(texts.languageWord, [
        ["English", "en", () => settings.set({ language: "en" }), language === "en"],
        ["Deutsch", "de", () => settings.set({ language: "de" }), language === "de"],
      ]),
      pick(texts.unitOfAngles, [
        [texts.degrees, "deg", () => settings.set({ areRadians: false }), !areRadians],
        [texts.radians, "rad", () => settings.set({ areRadians: true }), areRadians],
      ]),
      h("label", { class: "setting" }, h("span", {}, texts.letters), letters),
      h("p", {}, texts.about),
      h(
        "div",
        { class: "acts" },
        h("button", { type: "button", onclick: () => { app.choice.set({ isMenuOpen: false }); const server = app.session.place?.server ?? ""; app.session.leave(); app.session.visit(server); } }, texts.leaveCell),
        h("button", { type: "button", onclick: () => app.choice.set({ isMenuOpen: false }) }, texts.close),
      ),
    ),
  );
  return {
    element,
    update() {
      show(element, app.choice.value.isMenuOpen);
    },
  };
}
