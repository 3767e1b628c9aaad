// The dock's questions: whether somebody is still there, and the two steps that end a stop.
import { isInControl } from "../pendant/cell.ts";
import type { Cell } from "../pendant/cell.ts";
import { pageState } from "../pendant/states.ts";
import { StopKind, TriState } from "../protocol.ts";
import { fixed } from "../texts/texts.ts";
import type { App, Part } from "../ui/app.ts";
import { attribute, h, keyCap, mark, say, show } from "../ui/elements.ts";
import { resetStop } from "./top-row.ts";

export function enablingQuestion(app: App): Part {
  const { texts, holding } = app;
  const count = h("strong", {});
  const title = h("h2", {});
  const element = h(
    "section",
    { class: "question" },
    h("div", { class: "clock" }, count, h("span", {}, texts.seconds)),
    h("div", {}, title, h("p", {}, texts.enablingAsksHow)),
    h("button", { type: "button", class: "orange", onclick: () => holding.touched() }, texts.stillHere, keyCap("V")),
  );
  return {
    element,
    update() {
      const isAsked = holding.enabling.asks(app.now());
      show(element, isAsked);
      if (!isAsked) return;
      const left = Math.ceil((holding.enabling.left(app.now()) ?? 0) / 1000);
      say(count, String(left));
      say(title, texts.enablingAsks(left));
      element.style.setProperty("--left", String(left / 5));
    },
  };
}

export function stopDock(app: App): Part {
  const { texts } = app;
  const own = column(texts.pendantsStop);
  const controllers = column(texts.controllersEmergency);
  const release = h("button", { type: "button", onclick: () => app.choice.set({ isStopReleased: true }) }, texts.stepRelease);
  const reset = h("button", { type: "button", class: "blue", onclick: () => resetStop(app) }, texts.resetMovesNothing);
  const steps = h("div", { class: "steps-of-stop" }, h("span", { class: "number" }, "1"), release, h("span", { class: "number" }, "2"), reset);
  const element = h("section", { class: "stop-dock" }, own.element, controllers.element, steps);
  return {
    element,
    update(cell) {
      const isShown = pageState(cell) === "stopped";
      show(element, isShown);
      if (!isShown) return;
      const isPressed = (cell.state?.stop ?? 0) !== StopKind.NONE;
      own.tell(isPressed ? texts.pressed : texts.clear, isPressed ? "bad" : "good", stopper(app, cell));
      const emergency = cell.state?.e_stopped;
      const word = emergency === TriState.TRUE ? texts.pressed : emergency === TriState.FALSE ? texts.clear : texts.unknown;
      const tone = emergency === TriState.TRUE ? "bad" : emergency === TriState.FALSE ? "good" : "plain";
      controllers.tell(word, tone, texts.readAgo(`${fixed((cell.state?.age ?? 0) * 1000, 0)} ms`));
      show(steps, isPressed && isInControl(cell));
      const { isStopReleased } = app.choice.value;
      attribute(release, "aria-disabled", isStopReleased ? "true" : null);
      mark(release, "orange", !isStopReleased);
      attribute(reset, "aria-disabled", isStopReleased ? null : "true");
    },
  };
}

function stopper(app: App, cell: Cell): string {
  const { stopped } = cell;
  if (stopped === null) return "";
  const time = stopped.since === null ? "" : new Date(stopped.since).toLocaleTimeString(app.settings.value.language);
  return [stopped.client, stopped.reason, time].filter((each) => each !== "").join(" · ");
}

function column(name: string) {
  const dot = h("i", {});
  const word = h("strong", {});
  const more = h("p", {});
  return {
    element: h("div", { class: "column" }, h("span", {}, name), h("div", { class: "told" }, dot, word), more),
    tell(text: string, tone: string, rest: string): void {
      say(word, text);
      say(more, rest);
      attribute(dot, "data-tone", tone);
    },
  };
}
