// What every panel gets: the cell, the session, what is held, words and settings.
import type { Cell, CellModel } from "../pendant/cell.ts";
import type { EventLog } from "../pendant/event-log.ts";
import type { Holding } from "../pendant/holding.ts";
import type { Observable } from "../pendant/observable.ts";
import type { Language, Texts } from "../texts/texts.ts";
import type { PacketRing } from "../packets/ring.ts";
import type { Content, ViewEvents } from "../view/view.ts";
import type { Refusal } from "../wire/errors.ts";
import type { Session } from "../wire/session.ts";

export type Task = "jog" | "teach" | "plan" | "scene" | "frames" | "plots" | "packets" | "log" | "keypad" | "tour";

export type AxesFrame = "joint" | "base" | "tool" | "user";

export interface Settings {
  theme: "dark" | "light";
  language: Language;
  areRadians: boolean;
  areLettersOn: boolean;
}

/** What a person chose on this page; kept over a new link, but not over a new visit. */
export interface Choice {
  task: Task;
  axes: AxesFrame;
  userFrame: string;
  /** Step in mm and degrees; 0 for hold to move. */
  step: number;
  isChecklistOpen: boolean;
  isConnectOpen: boolean;
  isMenuOpen: boolean;
  /** One sentence of the page: a refusal, or what just happened; empty for nothing. */
  note: { text: string; kind: "remark" | "refusal" };
  /** The first of the two steps that end a stop. */
  isStopReleased: boolean;
}

export interface App {
  readonly session: Session;
  readonly cell: CellModel;
  readonly holding: Holding;
  readonly settings: Observable<Settings>;
  readonly choice: Observable<Choice>;
  readonly texts: Texts;
  /** What happened while this page looked on. */
  readonly log: EventLog;
  /** The newest frames of this tab. */
  readonly packets: PacketRing;
  now(): number;
  /** Names of the joints as people call them. */
  jointNames(): string[];
  refused(refusal: Refusal): void;
  /** Do something whose refusal is told in the banner. */
  attempt(act: () => Promise<unknown>): void;
  stop(): void;
  /** Hear STOP as it is pressed on this page; null for nobody. */
  hearStop(listener: (() => void) | null): void;
  /** Add to what the view shows, over the measured robot; null takes it away. */
  overlay(part: Partial<Content> | null): void;
  /** Hear what is dragged and pressed in the picture; null for nobody. */
  hearView(listener: Partial<ViewEvents> | null): void;
}

/** A part of the page that shows the cell. */
export interface Part {
  readonly element: HTMLElement;
  update(cell: Cell): void;
}

/** A task of the rail: its panel, and its dock where it has one. */
export interface TaskPart extends Part {
  readonly dock?: HTMLElement;
  /** Stands in place of the picture of the cell. */
  readonly stage?: HTMLElement;
  /** It is shown or left. */
  shown?(isShown: boolean): void;
}

export type MakeTask = (app: App) => TaskPart;

/** Return what gives each page the one thing of a kind that it has, made when it is first asked for. */
export function onePerPage<Made>(make: (app: App) => Made): (app: App) => Made {
  const made = new WeakMap<App, Made>();
  return (app) => {
    const known = made.get(app);
    if (known !== undefined) return known;
    const first = make(app);
    made.set(app, first);
    return first;
  };
}
