// One conversation with a cell: hello, declaration, login, what is asked at the beginning, beats
// of the authority, and a new link where one was lost.
//
// Restores the cell, never control or motion. Name and password stay in memory while the tab lives,
// and nowhere else.
import { describedRobot } from "../kinematics/chain.ts";
import {
  Activity,
  AuthorityAction,
  LoginKind,
  Notices,
  PROTOCOL_VERSION,
  StopKind,
  VerdictCode,
} from "../protocol.ts";
import type { HelloReply, Message, Operations, State, Verdict } from "../protocol.ts";
import { NO_CELL, isInControl } from "../pendant/cell.ts";
import type { Cell, CellModel } from "../pendant/cell.ts";
import { LinkLost, Refused } from "./errors.ts";
import type { Refusal } from "./errors.ts";
import { Link } from "./link.ts";
import type { FrameTap, RequestDraft, Socket } from "./link.ts";

const STATE_RATE = 30;
const AUTHORITY_BEAT = 1000;
const PING = 1500;
const LOBBY_EVERY = 3000;
const FIRST_BACK_OFF = 1000;
const LONGEST_BACK_OFF = 8000;
const WHY_AFTER = 150;
const HOLDS_AFTER = 400;
const ENABLING_DEADLINE = 0.25;

export interface Credentials {
  kind: "password" | "pairing";
  name: string;
  secret: string;
}

/** Where a page goes: a server of the gateway, and a cell of it. */
export interface Place {
  server: string;
  cell: string;
}

export interface SessionEvents {
  /** A message that is no answer. */
  told(message: Message): void;
  /** The link ended: whatever was held is over. */
  lost(): void;
  /** A request of the session itself was refused, such as a login. */
  refused(refusal: Refusal): void;
}

export interface Around {
  open(server: string): Socket;
  now(): number;
  language(): string;
}

export class Session {
  readonly cell: CellModel;
  tap: FrameTap | null = null;
  readonly #stateListeners = new Set<(state: State) => void>();
  #around: Around;
  #events: SessionEvents;
  #link: Link | null = null;
  #place: Place | null = null;
  #credentials: Credentials | null = null;
  #client = "browser";
  #tries = 0;
  #timers = new Set<ReturnType<typeof setTimeout>>();
  #whyDue = false;
  #holdsDue = false;
  #listeners = new Set<(message: Message) => void>();
  #pingAt = 0;
  #helloed: ((reply: HelloReply | Refusal) => void) | null = null;

  constructor(cell: CellModel, around: Around, events: SessionEvents) {
    this.cell = cell;
    this.#around = around;
    this.#events = events;
  }

  get place(): Place | null {
    return this.#place;
  }

  /** Give the name that others see, and what shows who it is; null to look on. */
  identify(client: string, credentials: Credentials | null): void {
    this.#client = client === "" ? "browser" : client;
    this.#credentials = credentials;
  }

  /** Ask a server for its cells; with one only, go straight in. */
  visit(server: string): void {
    this.#place = { server, cell: "" };
    this.#tries = 0;
    this.#connect(false);
  }

  /** Go into a cell, as an observer. */
  enter(place: Place): void {
    this.#place = place;
    this.#tries = 0;
    this.#connect(true);
  }

  /** Try again now. */
  retry(): void {
    if (this.#place !== null) this.#connect(this.#place.cell !== "");
  }

  /** Close the link of a page that nobody sees any more; it is tried again once the page goes on. */
  interrupt(): void {
    this.#link?.close();
  }

  /** Leave the cell; nothing is tried again. */
  leave(): void {
    this.#stopTimers();
    const link = this.#link;
    this.#link = null;
    link?.close();
    this.#events.lost();
    this.cell.set({ ...NO_CELL });
  }

  send(...messages: Message[]): void {
    this.#link?.send(...messages);
  }

  newId(): number {
    return this.#link?.newId() ?? 0;
  }

  askNow(draft: RequestDraft, ...ahead: Message[]): Promise<Verdict> {
    return this.#needed().askNow(draft, ...ahead);
  }

  ask(draft: RequestDraft): Promise<Verdict> {
    return this.#needed().ask(draft);
  }

  move(draft: RequestDraft): Promise<{ id: number; ended: Promise<Message> }> {
    return this.#needed().move(draft);
  }

  call<Op extends keyof Operations>(request: Operations[Op][0]): Promise<Operations[Op][1]> {
    return this.#needed().call<Op>(request);
  }

  callMotion<Op extends keyof Operations>(
    request: Operations[Op][0],
  ): Promise<{ reply: Operations[Op][1]; ended: Promise<Message> }> {
    return this.#needed().callMotion<Op>(request);
  }

  /** Be told of messages that are no answers; returns how to end that. */
  listen(told: (message: Message) => void): () => void {
    this.#listeners.add(told);
    return () => this.#listeners.delete(told);
  }

  /** Stop the robot: at once, whatever is open. */
  stop(reason: string): Promise<Verdict> {
    return this.askNow({ type: "software_stop", reason });
  }

  async takeControl(): Promise<void> {
    await this.askNow({ type: "authority", action: AuthorityAction.REQUEST });
  }

  async giveUpControl(): Promise<void> {
    await this.askNow({ type: "authority", action: AuthorityAction.RELEASE });
  }

  /** Log in on the link that there is, and remember it for the next. */
  async login(credentials: Credentials): Promise<void> {
    await this.#needed().askNow(loginOf(credentials));
    this.#credentials = credentials;
    this.cell.set({ who: await this.call<"access.whoami">({ op: "access.whoami" }) });
    if (this.cell.value.snapshot === null) await this.#learn();
  }

  /** Ask again what keeps the robot from moving. */
  refreshWhy(): void {
    if (this.#whyDue) return;
    this.#whyDue = true;
    this.#after(WHY_AFTER, () => {
      this.#whyDue = false;
      void this.#quietly(async () => {
        this.cell.set({ why: await this.call<"why">({ op: "why", kind: "jog", whose: "mine" }) });
      });
    });
  }

  /** Ask what leads out of where the robot stands; while it moves nobody can say. */
  refreshHolds(): void {
    if (this.#holdsDue) return;
    this.#holdsDue = true;
    this.#after(HOLDS_AFTER, () => {
      this.#holdsDue = false;
      void this.#quietly(async () => {
        try {
          this.cell.set({ holds: (await this.call<"jog.retreat">({ op: "jog.retreat" })).holds });
        } catch (error) {
          const { MOVING, FEEDBACK_STALE } = VerdictCode;
          const isLater = error instanceof Refused && [MOVING, FEEDBACK_STALE].some((each) => each === error.refusal.code);
          if (!isLater) throw error;
        }
      });
    });
  }

  /** Look again at what the whole cell is: frames, signals, tool. */
  async refreshSnapshot(): Promise<void> {
    await this.#quietly(async () => {
      this.cell.set({ snapshot: await this.call<"snapshot">({ op: "snapshot" }) });
    });
  }

  #needed(): Link {
    if (this.#link === null) throw new LinkLost();
    return this.#link;
  }

  #connect(isIn: boolean): void {
    const place = this.#place;
    if (place === null) return;
    this.#stopTimers();
    const old = this.#link;
    this.#link = null;
    old?.close();
    this.cell.set({ stage: "opening", retryAt: null, server: place.server });
    const link: Link = new Link(this.#around.open(place.server), {
      opened: () => void this.#begin(link, isIn),
      told: (message) => this.#told(link, message),
      heard: (message) => this.#heard(message),
      closed: (why) => this.#closed(link, why),
    });
    link.tap = (way, frame) => this.tap?.(way, frame);
    this.#link = link;
  }

  #heard({ type }: Message): void {
    const { answers } = this.cell.value;
    this.cell.set({ heardAt: this.#around.now(), answers: answers + Number(type !== "state") });
  }

  async #begin(link: Link, isIn: boolean): Promise<void> {
    try {
      if (!isIn && !(await this.#chosen(link))) return;
      await this.#hello(link);
      if (link !== this.#link) return;
      this.#tries = 0;
      // From now on control may be taken, and is lost without its beats.
      this.#repeat(AUTHORITY_BEAT, () => {
        if (isInControl(this.cell.value)) link.send({ type: "authority_beat" });
      });
      this.#ping(link);
      await this.#learn();
    } catch (error) {
      if (link !== this.#link || error instanceof LinkLost) return;
      if (!(error instanceof Refused)) throw error;
      this.#sentAway(link, error.refusal);
    }
  }

  /** Whether there is one cell only, which needs no choice. */
  async #chosen(link: Link): Promise<boolean> {
    const { cells, server } = await link.lobby();
    if (link !== this.#link) return false;
    this.cell.set({ cells, server: server ?? this.cell.value.server });
    const only = cells[0];
    if (cells.length === 1 && only !== undefined && this.#place !== null) {
      this.#place = { ...this.#place, cell: only.cell };
      return true;
    }
    this.cell.set({ stage: "lobby" });
    this.#repeat(LOBBY_EVERY, () => void this.#quietly(() => this.#lookAgain(link)));
    return false;
  }

  /** Cells come to be free, in use or known to be emulated while a person chooses. */
  async #lookAgain(link: Link): Promise<void> {
    const { cells } = await link.lobby();
    if (link === this.#link && this.cell.value.stage === "lobby") this.cell.set({ cells });
  }

  async #hello(link: Link): Promise<void> {
    const answered = new Promise<HelloReply | Refusal>((resolve) => (this.#helloed = resolve));
    link.send({
      type: "hello",
      protocol_version: PROTOCOL_VERSION,
      state_rate: STATE_RATE,
      cell: this.#place?.cell ?? "",
      client: this.#client,
    });
    const reply = await answered;
    if (!("session" in reply)) throw new Refused(reply);
    if (link !== this.#link) return;
    this.cell.set({ hello: reply, stage: "up", linkText: "" });
    const declared = await link.ask({
      type: "declare",
      enabling_deadline: ENABLING_DEADLINE,
      notices: Notices.WANTED,
      language: this.#around.language(),
    });
    this.cell.set({ rampTime: declared.value });
    if (this.#credentials !== null) await this.#logInAgain(link, this.#credentials);
  }

  async #logInAgain(link: Link, credentials: Credentials): Promise<void> {
    try {
      await link.askNow(loginOf(credentials));
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      // It goes on as an observer; another try with the same words would only lock the account.
      this.#credentials = null;
      this.#events.refused(error.refusal);
    }
  }

  /** Ask at once for all that a page shows of a cell; who this is, is told to everybody. */
  async #learn(): Promise<void> {
    await Promise.all([
      this.#quietly(async () => {
        this.cell.set({ who: await this.call<"access.whoami">({ op: "access.whoami" }) });
      }),
      this.#quietly(() => this.#learnCell()),
    ]);
  }

  async #learnCell(): Promise<void> {
    const [controller, snapshot, shapes, description] = await Promise.all([
      this.call<"controller.describe">({ op: "controller.describe" }),
      this.call<"snapshot">({ op: "snapshot" }),
      this.call<"shapes.show">({ op: "shapes.show" }),
      this.call<"robots.describe">({ op: "robots.describe" }),
    ]);
    const { owner, stop } = snapshot;
    this.cell.set({
      controller,
      snapshot,
      holderName: owner?.client ?? "",
      stopped: stop === null ? null : { client: stop.client, reason: stop.reason, since: null },
      robot: describedRobot(shapes, description.facts),
    });
    this.refreshWhy();
  }

  /** What only informs may be refused or cut off: the page says so, and goes on. */
  async #quietly(asked: () => Promise<void>): Promise<void> {
    try {
      await asked();
    } catch (error) {
      if (error instanceof Refused) this.#events.refused(error.refusal);
      else if (!(error instanceof LinkLost)) throw error;
    }
  }

  #told(link: Link, message: Message): void {
    if (link !== this.#link) return;
    if (this.#helloed !== null && this.#isHelloAnswer(message)) return;
    switch (message.type) {
      case "ping":
        this.cell.set({ delay: this.#around.now() - this.#pingAt });
        break;
      case "state":
        this.#takeState(message);
        break;
      case "authority_changed":
        this.cell.set({ holderName: message.client, wantedBy: "" });
        break;
      case "authority_wanted":
        this.cell.set({ wantedBy: message.client });
        break;
      case "stop_changed":
        this.cell.set({
          stopped:
            message.stop === StopKind.NONE
              ? null
              : { client: message.client, reason: message.reason, since: Date.now() },
        });
        break;
      case "controller_changed":
        void this.#quietly(async () => {
          const controller = await this.call<"controller.describe">({ op: "controller.describe" });
          this.cell.set({ controller });
        });
        break;
      case "document_changed":
        this.#changed(message.kind);
        break;
      case "outcome":
        if (message.request_id === 0 && message.code !== 0) this.#events.refused(message);
        break;
    }
    this.#events.told(message);
    for (const each of this.#listeners) each(message);
  }

  #isHelloAnswer(message: Message): boolean {
    if (message.type !== "hello_reply" && message.type !== "verdict") return false;
    const helloed = this.#helloed;
    this.#helloed = null;
    helloed?.(message.type === "verdict" ? message : message);
    return true;
  }

  /** Be told of each state, none left out as the cell's model may; returns how to end that. */
  watchStates(told: (state: State) => void): () => void {
    this.#stateListeners.add(told);
    return () => this.#stateListeners.delete(told);
  }

  #takeState(state: State): void {
    for (const told of this.#stateListeners) told(state);
    const old = this.cell.value.state;
    const now = this.#around.now();
    this.cell.set({ state, stateAt: now });
    const watched: (keyof State)[] = [
      "holder",
      "stop",
      "operating_mode",
      "enabling",
      "link",
      "drives_powered",
      "e_stopped",
      "in_error",
      "program_state",
    ];
    if (old === null || watched.some((each) => old[each] !== state[each])) this.refreshWhy();
    const cameToRest = old?.activity !== state.activity && state.activity === Activity.IDLE;
    if (cameToRest) this.refreshHolds();
  }

  #changed(kind: number): void {
    const { changes } = this.cell.value;
    this.cell.set({ changes: { ...changes, [kind]: (changes[kind] ?? 0) + 1 } });
    void this.refreshSnapshot();
  }

  /** The server ended it, and says why: only a person can mend that. */
  #sentAway(link: Link, refusal: Refusal): void {
    const comesAgain = refusal.code === VerdictCode.NO_PLACE;
    link.close();
    if (!comesAgain) {
      this.#stopTimers();
      this.cell.set({ stage: "ended", retryAt: null });
    }
    this.#events.refused(refusal);
  }

  #closed(link: Link, why: string): void {
    if (link !== this.#link) return;
    this.#stopTimers();
    this.#link = null;
    this.#helloed = null;
    const wait = Math.min(LONGEST_BACK_OFF, FIRST_BACK_OFF * 2 ** this.#tries);
    this.#tries += 1;
    const isIn = (this.#place?.cell ?? "") !== "";
    this.cell.set({
      stage: "lost",
      linkText: why,
      retryAt: this.#around.now() + wait,
      hello: null,
      who: null,
      holderName: "",
      wantedBy: "",
      delay: null,
    });
    this.#events.lost();
    this.#after(wait, () => this.#connect(isIn));
  }

  /** Keeps the connection, and measures its delay. */
  #ping(link: Link): void {
    const ping = (): void => {
      this.#pingAt = this.#around.now();
      link.send({ type: "ping" });
    };
    ping();
    this.#repeat(PING, ping);
  }

  #after(wait: number, then: () => void): void {
    const timer = setTimeout(() => {
      this.#timers.delete(timer);
      then();
    }, wait);
    this.#timers.add(timer);
  }

  #repeat(every: number, act: () => void): void {
    this.#after(every, () => {
      act();
      this.#repeat(every, act);
    });
  }

  #stopTimers(): void {
    for (const each of this.#timers) clearTimeout(each);
    this.#timers.clear();
    this.#whyDue = false;
    this.#holdsDue = false;
  }
}

function loginOf({ kind, name, secret }: Credentials): RequestDraft {
  const number = kind === "password" ? LoginKind.PASSWORD : LoginKind.PAIRING;
  return { type: "login", kind: number, name, secret };
}

/** Whether the values of a cell are old: no frame came in time, or no link is up. */
export function isStale(cell: Cell, now: number, overdue: number): boolean {
  return cell.stage !== "up" || cell.state === null || now - cell.stateAt > overdue;
}
