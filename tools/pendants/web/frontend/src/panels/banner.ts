// The banner: one sentence of what happened, who did it, and what to do; only when it is not
// simply ready.
import { isInControl } from "../pendant/cell.ts";
import type { Cell } from "../pendant/cell.ts";
import { isPaused, outside, pageState } from "../pendant/states.ts";
import type { PageState } from "../pendant/states.ts";
import { LinkState, OperatingMode, StopKind } from "../protocol.ts";
import type { App, Part } from "../ui/app.ts";
import { attribute, h, say, show } from "../ui/elements.ts";
import { setMode } from "./top-row.ts";

export function banner(app: App): Part {
  const { texts } = app;
  const text = h("span", {});
  const recovery = h("button", { type: "button", onclick: () => setMode(app, OperatingMode.RECOVERY) }, texts.setRecovery);
  const state = h("div", { class: "banner", role: "status" }, text, recovery);
  const note = h("span", {});
  const close = h("button", { type: "button", class: "quiet", "aria-label": texts.close, onclick: () => app.choice.set({ note: { text: "", kind: "remark" } }) }, "×");
  const remark = h("div", { class: "banner note", role: "alert" }, note, close);
  return {
    element: h("div", { class: "banners" }, state, remark),
    update(cell) {
      const sentence = bannerText(app, cell);
      say(text, sentence);
      show(state, sentence !== "");
      attribute(state, "data-state", pageState(cell));
      const isOutside = outside(cell).length > 0 && isInControl(cell);
      show(recovery, isOutside && cell.state?.operating_mode !== OperatingMode.RECOVERY);
      say(note, app.choice.value.note.text);
      show(remark, app.choice.value.note.text !== "");
      attribute(remark, "data-state", app.choice.value.note.kind);
    },
  };
}

function bannerText(app: App, cell: Cell): string {
  const { texts } = app;
  const told: Record<PageState, () => string> = {
    disconnected: () => linkText(app, cell),
    observer: () =>
      cell.state?.holder === 0
        ? texts.observingFree
        : texts.observing(cell.holderName || texts.notKnown),
    control: () => (cell.wantedBy === "" ? "" : texts.wanted(cell.wantedBy)),
    running: () => {
      if (isPaused(cell)) return texts.paused;
      const line = cell.state?.program_line ?? 0;
      return line > 0 ? texts.runningProgram(line) : texts.running;
    },
    stopped: () => stopText(app, cell),
    fault: () => faultText(app, cell),
  };
  return told[pageState(cell)]();
}

function linkText(app: App, cell: Cell): string {
  const { texts } = app;
  if (cell.stage === "lost" && cell.retryAt !== null) {
    const left = Math.max(0, Math.ceil((cell.retryAt - app.now()) / 1000));
    return [texts.retrying(left), cell.linkText, texts.stopByHardware].filter((each) => each !== "").join(" ");
  }
  return cell.stage === "ended" ? texts.connectionFailed : texts.connecting;
}

function stopText(app: App, cell: Cell): string {
  const { texts } = app;
  if (cell.state?.stop === StopKind.NONE) return texts.stoppedController;
  const { stopped } = cell;
  if (cell.state?.stop === StopKind.PROTECTIVE) return texts.stoppedServer(stopped?.reason ?? "");
  const when = stopped?.since ?? null;
  const language = app.settings.value.language;
  const time = when === null ? "" : texts.at(new Date(when).toLocaleTimeString(language));
  return texts.stoppedBy(stopped?.client || texts.notKnown, time);
}

function faultText(app: App, cell: Cell): string {
  const { texts } = app;
  const { state } = cell;
  if (state === null || state.link === LinkState.DOWN) return texts.faultController;
  if (state.link === LinkState.STALE) return texts.faultStale;
  const joint = outside(cell)[0];
  if (joint !== undefined) return texts.faultOutside(app.jointNames()[joint] ?? String(joint));
  return texts.faultError(state.error_code);
}
