// The pad of the enabling device (training): hold it, tap it to keep it, its lower edge is panic.
import { isInControl } from "../pendant/cell.ts";
import { OperatingMode } from "../protocol.ts";
import type { App, Part } from "../ui/app.ts";
import { attribute, h, keyCap, mark, off, say, show } from "../ui/elements.ts";
import { bindHold, holdButton } from "../ui/hold-button.ts";
import { icon } from "../ui/icons.ts";

export function enablingPad(app: App): Part {
  const { texts, holding } = app;
  const title = h("strong", {});
  const hint = h("span", { class: "hint" });
  const pad = h(
    "button",
    { type: "button", class: "hold pad" },
    icon("hand"),
    h("span", { class: "words" }, title, hint),
    keyCap("V"),
  );
  bindHold(pad, {
    down: (source) => holding.enable(`pad ${source}`),
    up: (source) => holding.disable(`pad ${source}`, source !== "Enter"),
    explain: () => app.choice.set({ note: { text: texts.holdHow, kind: "remark" } }),
  });
  const letGo = h("button", { type: "button", onclick: () => holding.letEnablingGo() }, texts.letGo);
  const keep = h("button", { type: "button", onclick: () => holding.keepEnabling() }, texts.kept);
  const through = holdButton(
    "through",
    null,
    {
      down: (source) => holding.pressThrough(`through ${source}`),
      up: (source) => holding.disable(`through ${source}`, false),
      explain: () => holding.pressThrough("reader"),
    },
    texts.pressedThrough,
  );
  const positions = h("div", { class: "tabs positions", role: "group", "aria-label": texts.enablingTraining }, letGo, keep, through);
  const element = h("div", { class: "enabling" }, pad, positions);
  return {
    element,
    update(cell) {
      const { state } = holding.enabling;
      say(title, wordOf(app, state));
      attribute(pad, "aria-description", texts.lineEnablingHow);
      const isAsked = cell.state?.operating_mode !== OperatingMode.AUTOMATIC;
      const idle = holding.enabling.mayBeKept ? texts.tapToKeep : "";
      const ready = isAsked ? idle : texts.enablingNotAsked;
      say(hint, state === "held" ? texts.keepThumb : ready);
      mark(element, "on", holding.enabling.isOn);
      for (const [button, name] of [
        [letGo, "released"],
        [keep, "kept"],
        [through, "pressed"],
      ] as const) {
        mark(button, "chosen", state === name);
        attribute(button, "aria-pressed", String(state === name));
      }
      show(keep, holding.enabling.mayBeKept);
      off(pad, isInControl(cell) ? "" : texts.noJog);
    },
  };
}

function wordOf(app: App, state: string): string {
  const { texts } = app;
  if (state === "held") return texts.lineEnablingDone;
  if (state === "kept") {
    const left = Math.ceil((app.holding.enabling.left(app.now()) ?? 0) / 1000);
    return `${texts.enablingTraining}: ${texts.enablingKept(left)}`;
  }
  return texts.enablingTraining;
}
