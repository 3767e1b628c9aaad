// The top row: where one is, chips, the main button, STOP.
import { isInControl, isReal, OVERDUE } from "../pendant/cell.ts";
import type { Cell } from "../pendant/cell.ts";
import { isPaused, pageState } from "../pendant/states.ts";
import {
  Activity,
  MotionControlAction,
  OperatingMode,
  ProgramState,
  StopKind,
} from "../protocol.ts";
import { fixed, modeWord } from "../texts/texts.ts";
import type { Texts } from "../texts/texts.ts";
import type { App, Part } from "../ui/app.ts";
import { attribute, h, keyCap, mark, say, show } from "../ui/elements.ts";

type Tone = "good" | "busy" | "remark" | "bad" | "plain";

interface Chip extends Part {
  element: HTMLButtonElement;
}

function chip(name: string, press: () => void, tell: (cell: Cell) => [string, Tone]): Chip {
  const value = h("strong", {});
  const element = h("button", { type: "button", class: "chip", onclick: press }, h("span", {}, name), value);
  return {
    element,
    update(cell) {
      const [text, tone] = tell(cell);
      say(value, text);
      attribute(element, "data-tone", tone);
    },
  };
}

export function topRow(app: App): Part {
  const { texts } = app;
  const place = h("span", { class: "place" });
  const kind = h("span", { class: "kind" });
  const openChecklist = (): void => app.choice.set({ isChecklistOpen: true });
  const chips: Record<string, Chip> = {
    link: chip(texts.link, () => app.choice.set({ isConnectOpen: true }), (cell) => linkWord(app, cell)),
    control: chip(texts.control, openChecklist, (cell) => controlWord(texts, cell)),
    robot: chip(texts.robot, openChecklist, (cell) => robotWord(texts, cell)),
    mode: chip(texts.mode, () => nextMode(app), (cell) => [modeWord(texts, cell.state?.operating_mode), isAutomatic(cell) ? "plain" : "remark"]),
    enabling: chip(texts.enabling, openChecklist, () => enablingWord(app)),
    frame: chip(texts.frame, () => nextFrame(app), () => [frameWord(app), "plain"]),
    speed: chip(texts.speed, () => changeSpeed(app, 1, SPEEDS[0]), (cell) => [`${Math.round((cell.state?.override ?? 0) * 100)} %`, "plain"]),
    delay: chip(texts.delay, () => app.choice.set({ isMenuOpen: true }), (cell) => delayWord(cell)),
  };
  const main = mainButton(app);
  const stop = stopButton(app);
  const element = h(
    "header",
    { class: "top" },
    h("button", { type: "button", class: "brand", onclick: () => app.choice.set({ isMenuOpen: true }), title: texts.settings },
      h("span", { class: "name" }, "openpendant", kind), place),
    h("div", { class: "chips" }, ...Object.values(chips).map((each) => each.element)),
    main.element,
    stop.element,
  );
  return {
    element,
    update(cell) {
      const isIn = cell.hello !== null || cell.snapshot !== null;
      say(place, isIn ? `${cell.hello?.cell ?? cell.snapshot?.cell ?? ""} · ${cell.hello?.robot ?? cell.snapshot?.robot ?? ""}` : cell.server);
      const isKnown = cell.controller !== null;
      say(kind, isKnown ? (isReal(cell) ? texts.realRobot : texts.simulation) : "");
      mark(kind, "real", isReal(cell));
      for (const each of Object.values(chips)) each.update(cell);
      show(chips["enabling"]?.element ?? place, app.holding.enabling.state !== "released");
      for (const name of ["control", "robot", "mode", "frame", "speed", "delay"]) {
        show(chips[name]?.element ?? place, isIn);
      }
      main.update(cell);
      stop.update(cell);
    },
  };
}

function linkWord(app: App, cell: Cell): [string, Tone] {
  const { texts } = app;
  const silence = app.now() - cell.heardAt;
  if (cell.stage === "up" && silence > OVERDUE) {
    return [texts.linkSilent(fixed(silence / 1000, 1)), "remark"];
  }
  if (cell.stage === "up" || cell.stage === "lobby") return [texts.linkUp, "good"];
  return cell.stage === "opening" ? [texts.linkOpening, "remark"] : [texts.linkNone, "bad"];
}

function controlWord(texts: Texts, cell: Cell): [string, Tone] {
  if (cell.stage !== "up") return ["–", "plain"];
  if (isInControl(cell)) return [texts.controlYou, "good"];
  if ((cell.state?.holder ?? 0) === 0) return [texts.controlNobody, "remark"];
  return [cell.holderName || texts.notKnown, "busy"];
}

function robotWord(texts: Texts, cell: Cell): [string, Tone] {
  const state = pageState(cell);
  if (state === "disconnected") return [texts.robotUnknown, "plain"];
  if (state === "stopped") return [texts.robotStopped, "bad"];
  if (state === "fault") return [texts.robotFault, "remark"];
  switch (cell.state?.activity) {
    case Activity.JOGGING:
      return [texts.robotJogging, "busy"];
    case Activity.MOVING:
      return [texts.robotMoving, "busy"];
    case Activity.PLANNING:
      return [texts.robotPlanning, "busy"];
    case Activity.PAUSED:
    case Activity.PAUSING:
      return [texts.robotPaused, "busy"];
    case Activity.STOPPING:
      return [texts.robotStopping, "busy"];
    default:
      return [texts.robotReady, "good"];
  }
}

function isAutomatic(cell: Cell): boolean {
  return cell.state?.operating_mode === OperatingMode.AUTOMATIC;
}

/** Set the mode that one wants next: from T1 to Automatic, from all others to T1. */
export function nextMode(app: App): void {
  const { MANUAL_REDUCED, AUTOMATIC } = OperatingMode;
  const isT1 = app.cell.value.state?.operating_mode === MANUAL_REDUCED;
  setMode(app, isT1 ? AUTOMATIC : MANUAL_REDUCED);
}

export function setMode(app: App, mode: number): void {
  app.holding.letGo();
  app.attempt(() => app.session.askNow({ type: "set_mode", mode }));
}

function enablingWord(app: App): [string, Tone] {
  const { enabling } = app.holding;
  const { texts } = app;
  if (enabling.state === "kept") {
    const left = Math.ceil((enabling.left(app.now()) ?? 0) / 1000);
    return [texts.enablingKept(left), "remark"];
  }
  if (enabling.state === "held") return [texts.enablingHeld, "good"];
  return [enabling.state === "pressed" ? texts.enablingPressed : texts.enablingReleased, "plain"];
}

function frameWord(app: App): string {
  const { axes, userFrame } = app.choice.value;
  const { joint, base, tool, user } = app.texts;
  return axes === "user" && userFrame !== "" ? userFrame : { joint, base, tool, user }[axes];
}

export function nextFrame(app: App): void {
  const order = ["joint", "base", "tool", "user"] as const;
  const at = order.indexOf(app.choice.value.axes);
  app.holding.letGo();
  app.choice.set({ axes: order[(at + 1) % order.length] ?? "joint" });
}

const SPEEDS = [0.1, 0.25, 0.5, 1];

/** Set the override a step up or down; at the ends it stays, or begins anew where it is to. */
export function changeSpeed(app: App, by: 1 | -1, anew?: number): void {
  const now = app.cell.value.state?.override ?? 1;
  const further = SPEEDS.filter((each) => (each - now) * by > 1e-6);
  const override = further.at(by > 0 ? 0 : -1) ?? anew;
  if (override === undefined) return;
  app.attempt(() => app.session.askNow({ type: "set_speed", override, tool_speed: 0 }));
}

function delayWord(cell: Cell): [string, Tone] {
  if (cell.delay === null) return ["–", "plain"];
  return [`${Math.round(cell.delay)} ms`, cell.delay > 100 ? "remark" : "plain"];
}

interface MainAct {
  text: string;
  look: "orange" | "plain" | "blue";
  key: string;
  act(): void;
}

/** Return what the main button does in each state; null where it is not wanted. */
export function mainAct(app: App, cell: Cell): MainAct | null {
  const { texts, session } = app;
  switch (pageState(cell)) {
    case "disconnected":
      return { text: texts.connect, look: "orange", key: "", act: () => app.choice.set({ isConnectOpen: true }) };
    case "observer":
      return {
        text: cell.state?.holder === 0 ? texts.takeControl : texts.askForControl,
        look: "orange",
        key: "C",
        act: () => takeControl(app),
      };
    case "running": {
      const isGoing = !isPaused(cell);
      const action = isGoing ? MotionControlAction.PAUSE : MotionControlAction.RESUME;
      return {
        text: isGoing ? texts.pause : texts.resume,
        look: "plain",
        key: "",
        act: () => app.attempt(() => resume(app, action, isGoing)),
      };
    }
    case "stopped":
      if (!isInControl(cell)) {
        return { text: texts.takeControl, look: "plain", key: "C", act: () => takeControl(app) };
      }
      return cell.state?.stop === StopKind.NONE
        ? null
        : { text: texts.reset, look: "blue", key: "", act: () => resetStop(app) };
    case "fault":
      return { text: texts.acknowledge, look: "plain", key: "", act: () => session.refreshWhy() };
    case "control":
      return {
        text: texts.giveUpControl,
        look: "plain",
        key: "",
        act: () => {
          app.holding.forget();
          app.attempt(() => session.giveUpControl());
        },
      };
  }
}

async function resume(app: App, action: number, isGoing: boolean): Promise<void> {
  const { state } = app.cell.value;
  const isProgram = state !== null && state.program_state !== ProgramState.NONE;
  if (!isGoing && isProgram) {
    await app.session.askNow({ type: "motion_control", action: MotionControlAction.RESUME });
  } else await app.session.askNow({ type: "motion_control", action });
}

/** Take control, or ask whoever holds it. */
export function takeControl(app: App): void {
  app.attempt(async () => {
    await app.session.takeControl();
  });
}

/** The second of the two steps that end a stop; nothing may be held meanwhile. */
export function resetStop(app: App): void {
  if (!app.choice.value.isStopReleased || app.holding.isMoving) return;
  app.attempt(() => app.session.askNow({ type: "reset_stop" }));
}

function mainButton(app: App): Part {
  const text = h("span", {});
  const key = keyCap("");
  const element = h("button", { type: "button", class: "main-act", onclick: () => mainAct(app, app.cell.value)?.act() }, text, key);
  return {
    element,
    update(cell) {
      const act = mainAct(app, cell);
      show(element, act !== null);
      if (act === null) return;
      say(text, act.text);
      say(key, act.key);
      show(key, act.key !== "");
      const isReset = act.look === "blue";
      const { isChecklistOpen, isConnectOpen, isMenuOpen } = app.choice.value;
      const isAskedElsewhere = isConnectOpen || isMenuOpen || (isChecklistOpen && cell.hello !== null) || cell.stage === "lobby";
      mark(element, "orange", act.look === "orange" && !isAskedElsewhere);
      mark(element, "wanted", act.look === "orange");
      mark(element, "blue", isReset);
      attribute(element, "aria-disabled", isReset && !app.choice.value.isStopReleased ? "true" : null);
    },
  };
}

/** STOP: a training mushroom where the robot is known to be emulated, else a grey button. */
function stopButton(app: App): Part {
  const { texts } = app;
  const under = h("small", {});
  const element = h(
    "button",
    { type: "button", class: "stop", title: texts.stopLabel, "aria-keyshortcuts": "Space F8" },
    h("span", { class: "cap" }, texts.stop),
    under,
  );
  element.addEventListener("pointerdown", (event) => {
    if (event.button === 0) app.stop();
  });
  element.addEventListener("click", (event) => {
    // The pointer has stopped already as it went down.
    if (event.detail === 0) app.stop();
  });
  return {
    element,
    update(cell) {
      const isPressed = (cell.state?.stop ?? 0) !== StopKind.NONE;
      const isTraining = cell.controller?.emulated === true;
      const isLinked = cell.stage === "up";
      mark(element, "training", isTraining);
      mark(element, "pressed", isPressed);
      attribute(element, "aria-pressed", String(isPressed));
      const idle = isTraining ? texts.stopTraining : "";
      say(under, !isLinked ? texts.stopNoLink : isPressed ? texts.stopPressed : idle);
    },
  };
}
