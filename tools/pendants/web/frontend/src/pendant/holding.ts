// Turns presses and enabling into messages, and beats them from the page's main thread.
//
// Every press and beat has the sign of the enabling device in front of it in the same WebSocket
// message, so that a page that falls silent does so with both at once.
import { EnablingPosition, JogSpace, MotionControlAction } from "../protocol.ts";
import type { Message, Verdict } from "../protocol.ts";
import { LinkLost, Refused } from "../wire/errors.ts";
import type { Refusal } from "../wire/errors.ts";
import type { RequestDraft } from "../wire/link.ts";
import type { Session } from "../wire/session.ts";
import { isInControl, OVERDUE } from "./cell.ts";
import { isManual } from "./checklist.ts";
import { Enabling } from "./enabling.ts";
import type { Sign } from "./enabling.ts";
import { BEAT, DEADLINE, Holds, isSameAim } from "./hold.ts";
import type { Aim, JogKey, Order } from "./hold.ts";

const SLOTS = 10;

export interface HoldingEvents {
  /** Something is held or let go: what shows it looks again. */
  changed(): void;
  refused(refusal: Refusal): void;
  /** A press came to rest after it was let go. */
  stood(): void;
}

/** A motion that goes on as long as its button is held. */
interface HeldMotion {
  source: string;
  isBegun: boolean;
  isLetGo: boolean;
}

export class Holding {
  readonly enabling = new Enabling();
  /** Part of the jog speed, above 0 up to 1. */
  speed = 0.25;
  #session: Session;
  #events: HoldingEvents;
  #now: () => number;
  #holds = new Holds();
  #motion: HeldMotion | null = null;
  #timer: ReturnType<typeof setInterval> | null = null;

  constructor(session: Session, now: () => number, events: HoldingEvents) {
    this.#session = session;
    this.#now = now;
    this.#events = events;
  }

  get held(): JogKey[] {
    return this.#holds.held;
  }

  get aim(): Aim {
    return this.#holds.aim;
  }

  /** Whether sticks move the robot, or would. */
  get isSteered(): boolean {
    return this.#holds.isSteered;
  }

  /** Whether a button is held that moves the robot. */
  get isMoving(): boolean {
    return this.#holds.isHolding || this.#motion !== null;
  }

  /** Told with each picture: one that stays the same must not ask for the next. */
  setAim(aim: Aim): void {
    if (isSameAim(aim, this.aim)) return;
    this.#carryOut(this.#holds.setAim(aim));
  }

  /** A jog key went down. */
  press(source: string, key: JogKey): void {
    if (!this.#mayBegin()) return;
    this.#carryOut(this.#holds.down(source, key, this.speed, this.#now()));
  }

  /** A jog key came up, or the pointer left it. */
  release(source: string): void {
    this.#carryOut(this.#holds.up(source, this.speed, this.#now()));
    if (this.#motion?.source === source) this.#endMotion();
  }

  /** Sticks ask for parts of the speed along each axis; null where they are centred. */
  steer(values: readonly number[] | null): void {
    if (values !== null && !this.#mayBegin()) return;
    this.#carryOut(this.#holds.steer(values, this.speed, this.#now()));
  }

  /** A button went down that moves for as long as it is held. */
  holdMotion(source: string, draft: RequestDraft): void {
    if (this.isMoving || !this.#mayBegin()) return;
    const motion: HeldMotion = { source, isBegun: false, isLetGo: false };
    this.#motion = motion;
    this.#events.changed();
    void this.#run(motion, draft);
  }

  enable(source: string): void {
    this.#say(this.enabling.down(source, this.#now()));
  }

  disable(source: string, isPad: boolean): void {
    const signs = this.enabling.up(source, this.#now(), isPad);
    this.#letGoWith(signs);
  }

  keepEnabling(): void {
    this.#say(this.enabling.keep(this.#now()));
  }

  pressThrough(source: string): void {
    const signs = this.enabling.pressThrough(source, this.#now());
    this.#letGoWith(signs);
  }

  letEnablingGo(): void {
    this.#letGoWith(this.enabling.letGo());
  }

  /** Any key or touch. */
  touched(): void {
    this.enabling.touched(this.#now());
  }

  /** Let go of all that moves, keys and motions; the enabling device stays as it is. */
  letGo(): void {
    this.#carryOut(this.#holds.letGo());
    this.#endMotion();
  }

  /** Let go of everything: the page lost the focus, is hidden or ends. */
  forget(): void {
    const releases = this.#messages(this.#holds.forget());
    this.#session.send(...this.#signMessages(this.enabling.forget()), ...releases);
    this.#endMotion();
    this.#settle();
  }

  /** The link ended. */
  lost(): void {
    this.#holds.lost();
    this.#motion = null;
    this.enabling.forget();
    this.#settle();
  }

  /** The server ended a press. */
  ended(press: number): void {
    this.#carryOut(this.#holds.ended(press));
    if (!this.#holds.isHolding) this.#events.stood();
  }

  #mayBegin(): boolean {
    const cell = this.#session.cell.value;
    return isInControl(cell) && this.#now() - cell.stateAt <= OVERDUE;
  }

  async #run(motion: HeldMotion, draft: RequestDraft): Promise<void> {
    try {
      const { ended } = await this.#session.move(draft);
      motion.isBegun = true;
      if (motion.isLetGo) this.#endProgram();
      await ended;
    } catch (error) {
      if (error instanceof Refused && !motion.isLetGo) this.#events.refused(error.refusal);
      else if (!(error instanceof Refused || error instanceof LinkLost)) throw error;
    }
    if (this.#motion === motion) this.#motion = null;
    this.#events.changed();
  }

  #endMotion(): void {
    const motion = this.#motion;
    if (motion === null) return;
    this.#motion = null;
    motion.isLetGo = true;
    this.#endProgram();
    this.#events.changed();
  }

  #endProgram(): void {
    const action = MotionControlAction.PROGRAM_STOP;
    // Refused it has ended already, or has not begun and is ended as soon as it has.
    this.#session.askNow({ type: "motion_control", action }).catch(ignoreAnswer);
  }

  /** Send signs; with the device let go, what is held goes with it in one write: a release. */
  #letGoWith(signs: Sign[]): void {
    if (signs.length === 0) return;
    const messages = this.#signMessages(signs);
    if (!this.enabling.isOn) messages.push(...this.#messages(this.#holds.letGo()));
    this.#session.send(...messages);
    this.#settle();
  }

  #say(signs: Sign[]): void {
    this.#session.send(...this.#signMessages(signs));
    this.#settle();
  }

  #carryOut(orders: Order[]): void {
    const beats = this.#messages(orders.filter((each) => each.order !== "start"));
    if (beats.length > 0) this.#session.send(...beats);
    for (const each of orders) if (each.order === "start") void this.#start(each);
    this.#settle();
  }

  async #start(order: Order & { order: "start" }): Promise<void> {
    const { press, aim, values } = order;
    const draft: RequestDraft = {
      type: "jog_start",
      press,
      state_sequence: this.#session.cell.value.state?.sequence ?? 0,
      deadline: DEADLINE / 1000,
      space: aim.space === "joints" ? JogSpace.JOINTS : JogSpace.TOOL,
      frame: aim.frame,
      value_count: aim.count,
      values: [...values, ...new Array<number>(SLOTS - values.length).fill(0)],
    };
    const ahead = this.#signMessages(this.enabling.ahead(this.#now()));
    try {
      await this.#session.askNow(draft, ...ahead);
      this.#holds.accepted(press);
    } catch (error) {
      if (error instanceof Refused) {
        this.#carryOut(this.#holds.refused(press));
        this.#events.refused(error.refusal);
      } else if (!(error instanceof LinkLost)) throw error;
    }
  }

  #tick(): void {
    const now = this.#now();
    const wasOn = this.enabling.isOn;
    const signs = this.#signMessages(this.enabling.tick(now));
    const orders =
      wasOn && !this.enabling.isOn && isManual(this.#session.cell.value)
        ? this.#holds.letGo()
        : this.#holds.tick(now);
    this.#session.send(...signs, ...this.#messages(orders));
    // A beat alone changes nothing that the page shows.
    const isBeat = wasOn === this.enabling.isOn && orders.every(({ order }) => order === "beat");
    if (!isBeat || !this.#isHeld) this.#settle();
  }

  #messages(orders: Order[]): Message[] {
    return orders.flatMap((each): Message[] => {
      if (each.order === "beat") {
        return [{ type: "jog_beat", press: each.press, beat: each.beat }];
      }
      if (each.order === "start") return [];
      return [{ type: "jog_release", request_id: this.#session.newId(), press: each.press }];
    });
  }

  #signMessages(signs: Sign[]): Message[] {
    const cell = this.#session.cell.value;
    // Letting go and pressing through always count; the rest only where it means something.
    return signs
      .filter((each) => each !== EnablingPosition.HELD || isInControl(cell))
      .map((position) => ({ type: "enabling", position }));
  }

  get #isHeld(): boolean {
    return this.#holds.isHolding || this.enabling.isOn;
  }

  /** Beat while something is held, and only then. */
  #settle(): void {
    const isHeld = this.#isHeld;
    if (isHeld && this.#timer === null) this.#timer = setInterval(() => this.#tick(), BEAT);
    if (!isHeld && this.#timer !== null) {
      clearInterval(this.#timer);
      this.#timer = null;
    }
    this.#events.changed();
  }
}

/** The answer tells nothing that an outcome does not tell besides. */
function ignoreAnswer(error: unknown): Verdict | undefined {
  if (error instanceof Refused || error instanceof LinkLost) return undefined;
  throw error;
}
