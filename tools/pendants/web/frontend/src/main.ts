// Puts the page together: one session, one model of the cell, what is held, and the parts that
// show it. Nothing here moves anything by itself.
import "./style.css";
import { cellModel, isInControl, OVERDUE, showsTheSame } from "./pendant/cell.ts";
import type { Cell } from "./pendant/cell.ts";
import { EventLog } from "./pendant/event-log.ts";
import { Holding } from "./pendant/holding.ts";
import { motionRecord } from "./plots/motion_record.ts";
import { PacketRing } from "./packets/ring.ts";
import { Observable } from "./pendant/observable.ts";
import { pageState } from "./pendant/states.ts";
import { Activity, StopKind, VerdictCode } from "./protocol.ts";
import type { Message } from "./protocol.ts";
import { fetchWords, refusalSentence, textsOf } from "./texts/texts.ts";
import type { Language } from "./texts/texts.ts";
import type { App, Choice, Settings } from "./ui/app.ts";
import { listenToGamepads } from "./ui/gamepads.ts";
import { listen } from "./ui/keyboard.ts";
import { layout } from "./ui/layout.ts";
import type { Layout } from "./ui/layout.ts";
import { TASKS } from "./ui/tasks.ts";
import { probedGraphics } from "./view/probe.ts";
import { makeStickView } from "./view/stick.ts";
import type { MakeView, ViewEvents } from "./view/view.ts";
import { LinkLost, Refused } from "./wire/errors.ts";
import type { Refusal } from "./wire/errors.ts";
import { openSocket, served } from "./wire/gateway.ts";
import type { Served } from "./wire/gateway.ts";
import { Session } from "./wire/session.ts";

const SETTINGS = "openpendant.settings";
const STOOD = "openpendant.stood";
/** What counts down or ages is shown anew so often [ms]. */
const TICK = 250;
/** A picture holds up the next by no more [ms]. */
const LONGEST_REST = 100;
/** What a hand does that a panel may show: it need not wait for the next state that is another. */
const HANDLED = ["click", "input", "change", "pointerdown", "pointerup", "keydown", "keyup"] as const;

/** Refusals for something that is missing: the checklist says what. */
const MISSING: number[] = [
  VerdictCode.NOT_IN_CONTROL,
  VerdictCode.MODE_FORBIDS,
  VerdictCode.NOT_ENABLED,
  VerdictCode.STOP_LATCHED,
  VerdictCode.NOT_PREPARED,
];

const { graphics, context } = probedGraphics();
/** Asked for at once, beside all else; where it does not come, the robot stays one of sticks. */
const solids = graphics === "none" ? null : madeSolids();

async function madeSolids(): Promise<MakeView | null> {
  try {
    const { makeScene3d } = await import("./view/scene3d.ts");
    return makeScene3d(graphics === "software" ? "low" : "full", context);
  } catch {
    return null;
  }
}

function kept(): Settings {
  const usual: Settings = {
    theme: matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark",
    language: navigator.language.startsWith("de") ? "de" : "en",
    areRadians: false,
    areLettersOn: true,
  };
  const stored = remembered(SETTINGS);
  return stored === null ? usual : { ...usual, ...(JSON.parse(stored) as Partial<Settings>) };
}

/** A browser may refuse to remember anything: then a setting lasts as long as the tab. */
function remembered(name: string): string | null {
  try {
    return localStorage.getItem(name);
  } catch {
    return null;
  }
}

function remember(name: string, value: string): void {
  try {
    localStorage.setItem(name, value);
  } catch {
    // It lasts as long as the tab.
  }
}

class Page implements App {
  readonly cell = cellModel();
  readonly settings = new Observable<Settings>(kept());
  readonly choice = new Observable<Choice>({
    task: "jog",
    axes: "joint",
    userFrame: "",
    step: 0,
    isChecklistOpen: true,
    isConnectOpen: false,
    isMenuOpen: false,
    note: { text: "", kind: "remark" },
    isStopReleased: false,
  });
  readonly log = new EventLog(() => Date.now());
  readonly packets = new PacketRing();
  readonly session: Session;
  readonly holding: Holding;
  #root: HTMLElement;
  #layout: Layout | null = null;
  #viewListener: Partial<ViewEvents> | null = null;
  #stopListener: (() => void) | null = null;
  #served: Served = { servers: [""], hasKeypad: false };
  /** That in which the page stands. */
  #language = "";
  #isDue = false;
  #restsUntil = 0;
  /** Has what is stale by then drawn so. */
  #overdue: ReturnType<typeof setTimeout> | undefined;
  /** STOP was pressed without a link: it is sent as soon as there is one. */
  #isStopDue = false;
  #before: Cell = this.cell.value;

  constructor(root: HTMLElement) {
    this.#root = root;
    const around = { open: openSocket, now: () => this.now(), language: () => this.settings.value.language };
    this.session = new Session(this.cell, around, {
      told: (message) => this.#told(message),
      lost: () => this.holding.lost(),
      refused: (refusal) => this.refused(refusal),
    });
    this.session.tap = (way, frame) => this.packets.add(way, frame, Date.now());
    this.holding = new Holding(this.session, () => this.now(), {
      changed: () => this.#draw(),
      refused: (refusal) => this.refused(refusal),
      stood: () => this.#stood(),
    });
  }

  get texts() {
    return textsOf(this.settings.value.language);
  }

  now(): number {
    return performance.now();
  }

  jointNames(): string[] {
    return (this.cell.value.snapshot?.joints ?? []).map((each) => each.display_name ?? each.name);
  }

  async begin(): Promise<void> {
    const words = fetchWords(this.settings.value.language);
    this.#served = await served();
    await words;
    this.cell.watch((cell) => this.#changed(cell));
    this.choice.watch(() => this.#draw());
    this.settings.watch((settings) => {
      remember(SETTINGS, JSON.stringify(settings));
      if (settings.language !== this.#language) void this.#speak(settings.language);
      document.documentElement.dataset["theme"] = settings.theme;
      this.#draw();
    });
    motionRecord(this);
    // The cell is asked while the page is built: what is seen first is true already.
    this.session.visit(this.#served.servers[0] ?? "");
    this.#show();
    listen(this);
    listenToGamepads(this);
    // A browser may keep a page that was left, as it is, with its socket open: no beat comes from it.
    window.addEventListener("pagehide", ({ persisted }) => persisted && this.session.interrupt());
    for (const kind of HANDLED) {
      window.addEventListener(kind, () => this.#draw(), { capture: true, passive: true });
    }
    setInterval(() => this.#draw(), TICK);
  }

  refused(refusal: Refusal): void {
    const text = refusalSentence(refusal, this.settings.value.language, this.jointNames());
    this.log.add("refusal", text);
    const isMissing = MISSING.includes(refusal.code);
    this.choice.set({
      note: { text, kind: "refusal" },
      ...(isMissing ? { isChecklistOpen: true } : {}),
      ...(refusal.code === VerdictCode.LOGIN_NEEDED ? { isConnectOpen: true } : {}),
    });
    if (isMissing) this.session.refreshWhy();
  }

  attempt(act: () => Promise<unknown>): void {
    const tried = async (): Promise<void> => {
      try {
        await act();
        if (this.choice.value.note.kind === "refusal") this.#note("", "remark");
      } catch (error) {
        if (error instanceof Refused) this.refused(error.refusal);
        else if (!(error instanceof LinkLost)) throw error;
      }
    };
    void tried();
  }

  stop(): void {
    this.#stopListener?.();
    this.holding.forget();
    this.choice.set({ isStopReleased: false });
    this.#isStopDue = this.cell.value.stage !== "up";
    if (!this.#isStopDue) this.attempt(() => this.session.stop(this.texts.stopReason));
  }

  hearStop(listener: (() => void) | null): void {
    this.#stopListener = listener;
  }

  overlay(part: Parameters<App["overlay"]>[0]): void {
    // Told with each picture: one that stays the same must not ask for the next.
    if (this.#layout?.view.overlay(part) === true) this.#draw();
  }

  hearView(listener: Partial<ViewEvents> | null): void {
    this.#viewListener = listener;
  }

  /** Build the page anew in another language, unless yet another was chosen meanwhile. */
  async #speak(language: Language): Promise<void> {
    this.#language = language;
    await fetchWords(language);
    if (this.#language === language) this.#show();
  }

  /** Build the page anew: the first time, and in another language. What is held loses its button. */
  #show(): void {
    const { theme, language } = this.settings.value;
    this.#language = language;
    this.holding.forget();
    document.documentElement.dataset["theme"] = theme;
    document.documentElement.lang = language;
    this.#layout?.close();
    this.#layout = layout(this, this.#served);
    this.#root.replaceChildren(this.#layout.element);
    this.#layout.view.use((host) => makeStickView(host, this.#viewEvents()));
    void this.#better(this.#layout);
    this.#draw();
  }

  /** Draw in three dimensions where the browser can, once there is a robot; sticks stand there until then. */
  async #better(shown: Layout): Promise<void> {
    const [make] = await Promise.all([solids, this.#robotKnown()]);
    if (make === null || shown !== this.#layout) return;
    const sticks = (): void => {
      shown.view.use((host) => makeStickView(host, this.#viewEvents()));
      this.#draw();
    };
    shown.view.use((host) => make(host, { ...this.#viewEvents(), tooSlow: sticks }));
    this.#draw();
  }

  #robotKnown(): Promise<void> {
    return new Promise((known) => {
      if (this.cell.value.robot !== null) known();
      const end = this.cell.watch(({ robot }) => {
        if (robot === null) return;
        end();
        known();
      });
    });
  }

  #viewEvents(): ViewEvents {
    return {
      gizmoMoved: (pose, isDone) => this.#heard((view) => view.gizmoMoved?.(pose, isDone)),
      objectMoved: (name, pose, isDone) => this.#heard((view) => view.objectMoved?.(name, pose, isDone)),
      objectScaled: (name, by, isDone) => this.#heard((view) => view.objectScaled?.(name, by, isDone)),
      picked: (name) => this.#heard((view) => view.picked?.(name)),
    };
  }

  #heard(tell: (view: Partial<ViewEvents>) => void): void {
    if (this.#viewListener === null) return;
    tell(this.#viewListener);
    this.#draw();
  }

  /** Whatever takes the control, the mode or the peace away lets go of all that is held. */
  #changed(cell: Cell): void {
    const before = this.#before;
    this.#before = cell;
    this.log.hearLink(before, cell, this.texts);
    this.holding.enabling.mayBeKept = cell.controller?.emulated === true;
    if (this.#isStopDue && cell.stage === "up") this.stop();
    const hadControl = isInControl(before);
    const isOther =
      (hadControl && !isInControl(cell)) ||
      before.state?.operating_mode !== cell.state?.operating_mode ||
      (before.state?.stop === StopKind.NONE && cell.state?.stop !== StopKind.NONE);
    if (isOther && before.state !== null) {
      this.holding.letGo();
      this.holding.letEnablingGo();
    }
    if (before.state?.stop !== StopKind.NONE && cell.state?.stop === StopKind.NONE) {
      this.choice.set({ isStopReleased: false });
    }
    // Nothing stands in front of a robot that begins to move.
    if (this.holding.isMoving && cell.state?.activity === Activity.JOGGING) {
      if (this.choice.value.isChecklistOpen) this.choice.set({ isChecklistOpen: false });
    }
    if (before.stage !== "up" && cell.stage === "up" && pageState(cell) === "observer") {
      this.session.refreshWhy();
    }
    if (cell.stateAt !== before.stateAt) {
      clearTimeout(this.#overdue);
      this.#overdue = setTimeout(() => this.#draw(), OVERDUE + 1);
    }
    const entry = TASKS.find(({ task }) => task === this.choice.value.task);
    if (entry?.isLive === true || !showsTheSame(before, cell)) this.#draw();
  }

  #told(message: Message): void {
    this.log.hear(message, this.cell.value, this.texts);
    if (message.type === "jog_ended") this.holding.ended(message.press);
  }

  #stood(): void {
    if (remembered(STOOD) !== null) return;
    remember(STOOD, "1");
    this.#note(this.texts.stood, "remark");
  }

  #note(text: string, kind: "remark" | "refusal"): void {
    this.choice.set({ note: { text, kind } });
  }

  /** Draw with the next picture. As long as there are beats, each rests twice as long as it took. */
  #draw(): void {
    if (this.#isDue) return;
    this.#isDue = true;
    const { isMoving, enabling } = this.holding;
    const rest = this.#restsUntil - this.now();
    if (rest > 0 && (isMoving || enabling.isOn)) setTimeout(() => this.#drawNext(), rest);
    else this.#drawNext();
  }

  #drawNext(): void {
    requestAnimationFrame(() => {
      this.#isDue = false;
      const began = this.now();
      // The task that follows begins when the picture is laid out and painted.
      setTimeout(() => {
        const ended = this.now();
        this.#restsUntil = ended + Math.min(2 * (ended - began), LONGEST_REST);
      });
      const ended = this.holding.enabling.endedBy;
      if (ended !== "") {
        this.holding.enabling.endedBy = "";
        const { enablingUnanswered, enablingSilent } = this.texts;
        const sentence = ended === "unanswered" ? enablingUnanswered : enablingSilent;
        this.log.add("remark", sentence);
        this.#note(sentence, "remark");
      }
      this.#layout?.update(this.cell.value);
    });
  }
}

const root = document.getElementById("page");
if (root !== null) void new Page(root).begin();
