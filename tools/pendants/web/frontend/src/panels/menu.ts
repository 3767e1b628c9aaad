// Settings of this browser: theme, language, units, keys; and what STOP on a screen is not.
import type { App, Part, Settings } from "../ui/app.ts";
import { choose, h, show } from "../ui/elements.ts";

export function menu(app: App): Part {
  const { texts, settings } = app;
  const choices: [HTMLElement, Partial<Settings>][] = [];
  const pick = (label: string, options: readonly [string, Partial<Settings>][]): HTMLElement => {
    const buttons = options.map(([word, chosen]) => {
      const button = h("button", { type: "button", onclick: () => settings.set(chosen) }, word);
      choices.push([button, chosen]);
      return button;
    });
    const group = h("div", { class: "tabs", role: "group", "aria-label": label }, ...buttons);
    return h("div", { class: "setting" }, h("span", {}, label), group);
  };
  const letters = h("input", { type: "checkbox", checked: settings.value.areLettersOn });
  letters.addEventListener("change", () => settings.set({ areLettersOn: letters.checked }));
  const element = h(
    "div",
    { class: "veil", role: "dialog", "aria-label": texts.settings },
    h(
      "div",
      { class: "card" },
      h("h2", {}, texts.settings),
      pick(texts.theme, [
        [texts.dark, { theme: "dark" }],
        [texts.light, { theme: "light" }],
      ]),
      pick(texts.languageWord, [
        ["English", { language: "en" }],
        ["Deutsch", { language: "de" }],
      ]),
      pick(texts.unitOfAngles, [
        [texts.degrees, { areRadians: false }],
        [texts.radians, { areRadians: true }],
      ]),
      h("label", { class: "setting" }, h("span", {}, texts.letters), letters),
      h("p", {}, texts.about),
      // A browser gives gamepads to such a page alone.
      !isSecureContext && h("p", {}, texts.gamepadsByHttps),
      h(
        "div",
        { class: "acts" },
        h("button", { type: "button", onclick: () => { app.choice.set({ isMenuOpen: false }); const server = app.session.place?.server ?? ""; app.session.leave(); app.session.visit(server); } }, texts.leaveCell),
        h("button", { type: "button", class: "take-tour", onclick: () => app.choice.set({ isMenuOpen: false, task: "tour" }) }, texts.tour),
        h("button", { type: "button", onclick: () => app.choice.set({ isMenuOpen: false }) }, texts.close),
      ),
    ),
  );
  return {
    element,
    update() {
      show(element, app.choice.value.isMenuOpen);
      for (const [button, chosen] of choices) choose(button, isChosen(settings.value, chosen));
    },
  };
}

function isChosen(settings: Settings, chosen: Partial<Settings>): boolean {
  return Object.entries(chosen).every(([name, value]) => settings[name as keyof Settings] === value);
}
