// Plan: a goal, the way there, its preview with a slider, and Execute.
import "../plan.css";
import { isInControl, isReal, measuredJoints } from "../pendant/cell.ts";
import type { Cell } from "../pendant/cell.ts";
import { isManual } from "../pendant/checklist.ts";
import { goalOf, firstGoal, readSeed } from "../planning/goals.ts";
import type { Way } from "../planning/goals.ts";
import { planModel } from "../planning/model.ts";
import type { PlanModel } from "../planning/model.ts";
import { clock, left, rowsOf } from "../planning/preview.ts";
import type { Preview, Row } from "../planning/preview.ts";
import { Twice } from "../planning/twice.ts";
import { NoticeKind, PlanStage } from "../protocol.ts";
import type { NamedPosition } from "../protocol.ts";
import type { PlanTexts } from "../texts/plan.ts";
import { fixed, refusalSentence } from "../texts/texts.ts";
import type { App, Part, TaskPart } from "../ui/app.ts";
import { attribute, h, mark, off, isOff, say, show } from "../ui/elements.ts";
import { icon } from "../ui/icons.ts";
import { enablingPad } from "./enabling-pad.ts";
import { whyNoMotion } from "./jog.ts";
import { PathStops } from "./path-stops.ts";
import { planDock } from "./plan-dock.ts";
import { reachQuestion } from "./reach.ts";

const WAYS: readonly Way[] = ["ptp", "lin", "path", "free"];
const HANDLES = "";

export function planTask(app: App): TaskPart {
  return new PlanTask(app);
}

class PlanTask implements TaskPart {
  readonly element: HTMLElement;
  readonly dock: HTMLElement;
  readonly #app: App;
  readonly #words: PlanTexts;
  readonly #model: PlanModel;
  readonly #dock: Part;
  readonly #reach: ReturnType<typeof reachQuestion>;
  readonly #verdict: Part;
  readonly #pad: Part;
  readonly #ways: HTMLButtonElement[];
  readonly #goal: HTMLSelectElement;
  readonly #goalLabel: HTMLElement;
  readonly #stops: PathStops;
  readonly #planner: HTMLSelectElement;
  readonly #seed: HTMLInputElement;
  readonly #seedProblem = h("span", { class: "problem", role: "alert" });
  readonly #search: HTMLElement;
  readonly #speed: HTMLInputElement;
  readonly #speedTold = h("output", { class: "number" });
  readonly #plan: HTMLButtonElement;
  readonly #execute: HTMLButtonElement;
  readonly #executeWord: HTMLElement;
  readonly #twice = new Twice();
  #way: Way = "ptp";
  #positions: readonly NamedPosition[] = [];
  #askedFor = "";
  #isShown = false;
  #isNoted = false;

  constructor(app: App) {
    this.#app = app;
    const words = (this.#words = app.texts.planWords);
    this.#model = planModel(app);
    this.#dock = planDock(app, words, this.#model);
    this.dock = this.#dock.element;
    this.#reach = reachQuestion(app, words, () => this.#asked());
    this.#verdict = verdict(app, words, this.#model);
    this.#pad = enablingPad(app);
    this.#ways = WAYS.map((way) => h("button", { type: "button", "data-way": way, onclick: () => this.#chooseWay(way) }, words[way]));
    this.#goal = h("select", { "aria-label": words.goal });
    this.#goal.addEventListener("change", () => this.#goalChosen());
    this.#goalLabel = h("label", {}, h("span", {}, words.goal), this.#goal);
    this.#stops = new PathStops(app, words);
    this.#planner = h("select", { "aria-label": words.planner });
    this.#seed = h("input", { type: "text", inputmode: "numeric", value: "0", "aria-label": `${words.seed}: ${words.seedHint}`, title: words.seedHint });
    this.#seed.addEventListener("input", () => say(this.#seedProblem, readSeed(this.#seed.value) === null ? words.seedWrong : ""));
    this.#search = h(
      "div",
      { class: "pair" },
      h("label", {}, h("span", {}, words.planner), this.#planner),
      h("label", {}, h("span", {}, words.seed), this.#seed, this.#seedProblem),
    );
    this.#speed = h("input", { type: "range", min: 1, max: 100, value: 50, "aria-label": words.speed });
    this.#plan = h("button", { type: "button", onclick: () => this.#make() }, words.plan);
    this.#executeWord = h("span", {}, words.execute);
    this.#execute = h("button", { type: "button", class: "execute", onclick: () => this.#executeIt() }, icon("play"), this.#executeWord);
    this.element = h(
      "section",
      { class: "plan", "aria-label": app.texts.plan },
      h("div", { class: "tabs", role: "group", "aria-label": words.ways }, ...this.#ways),
      h(
        "div",
        { class: "pair" },
        h("label", {}, h("span", {}, words.start), h("input", { type: "text", readonly: true, value: words.startsHere })),
        this.#goalLabel,
      ),
      this.#stops.element,
      this.#reach.element,
      this.#search,
      h("label", { class: "speed" }, h("span", {}, words.speed), this.#speed, this.#speedTold),
      this.#verdict.element,
      h("div", { class: "foot" }, h("p", { class: "muted" }, words.executeNot), this.#pad.element, h("div", { class: "acts" }, this.#plan, this.#execute)),
    );
    this.#chooseWay("ptp");
  }

  shown(isShown: boolean): void {
    this.#isShown = isShown;
    this.#app.overlay(null);
    this.#app.hearView(isShown ? { gizmoMoved: (pose, isDone) => this.#reach.moved(pose, isDone) } : null);
    if (isShown) {
      this.#askedFor = "";
      this.#app.choice.set({ isChecklistOpen: false });
    } else this.#tellNote();
  }

  update(cell: Cell): void {
    if (!this.#isShown) return;
    this.#learn(cell);
    this.#model.tick();
    this.#dock.update(cell);
    this.#verdict.update(cell);
    this.#reach.update(cell);
    this.#pad.update(cell);
    show(this.#pad.element, isManual(cell) && isInControl(cell));
    say(this.#speedTold, `${this.#speed.value} %`);
    this.#speed.style.setProperty("--filled", `${this.#speed.value}%`);
    this.#tellButtons(cell);
    this.#tellNote();
    this.#picture();
  }

  #chooseWay(way: Way): void {
    this.#way = way;
    for (const each of this.#ways) {
      const isChosen = each.dataset["way"] === way;
      mark(each, "chosen", isChosen);
      attribute(each, "aria-pressed", String(isChosen));
    }
    show(this.#search, way === "free");
    show(this.#goalLabel, way !== "path");
    show(this.#stops.element, way === "path");
    this.#goalChosen();
  }

  #goalChosen(): void {
    const isHandles = this.#goal.value === HANDLES && this.#way !== "path";
    this.#reach.use(isHandles, this.#way);
  }

  /** Look again at the positions when somebody changed them, and at the planners once. */
  #learn(cell: Cell): void {
    const wanted = `${cell.stage} ${cell.hello?.session ?? 0} ${cell.changes[NoticeKind.POSITIONS] ?? 0} ${cell.changes[NoticeKind.PROGRAM] ?? 0}`;
    if (cell.stage !== "up" || cell.snapshot === null || wanted === this.#askedFor) return;
    this.#askedFor = wanted;
    this.#app.attempt(async () => {
      const { session } = this.#app;
      const { positions } = await session.call<"positions.list">({ op: "positions.list" });
      this.#takePositions(positions);
      await this.#stops.learnPrograms();
      if (this.#planner.options.length > 0) return;
      const { planners } = await session.call<"robots.describe">({ op: "robots.describe" });
      this.#planner.replaceChildren(...(planners ?? []).map((each) => h("option", { value: each }, each)));
    });
  }

  #takePositions(positions: readonly NamedPosition[]): void {
    const before = this.#goal.value;
    const isFirst = this.#goal.options.length === 0;
    this.#positions = positions;
    this.#stops.takePositions(positions);
    const named = positions.map(({ name, legal, why }) =>
      h("option", { value: name, disabled: !legal, title: why === "" ? null : why }, legal ? name : this.#words.notLegal(name)),
    );
    this.#goal.replaceChildren(...named, h("option", { value: HANDLES }, this.#words.handles));
    const first = firstGoal(positions, measuredJoints(this.#app.cell.value))?.name ?? HANDLES;
    this.#goal.value = isFirst ? first : before;
    this.#goalChosen();
  }

  /** The speed that the slider asks for, as a fraction. */
  #asked(): number {
    return Number(this.#speed.value) / 100;
  }

  #make(): void {
    const { pose, branch, joints } = this.#reach.chosen();
    const position = this.#positions.find(({ name }) => name === this.#goal.value) ?? null;
    const seed = readSeed(this.#seed.value);
    const stops = this.#stops.joints;
    const goal = goalOf({ way: this.#way, position, pose, branch, joints, stops, planner: this.#planner.value, seed: seed ?? 0 });
    if (goal === null || (this.#way === "free" && seed === null) || isOff(this.#plan)) return;
    this.#twice.forget();
    void this.#model.make(goal, this.#asked());
  }

  #executeIt(): void {
    if (isOff(this.#execute)) {
      this.#app.session.refreshWhy();
      this.#app.choice.set({ isChecklistOpen: true });
      return;
    }
    if (this.#twice.press(this.#isDear(this.#app.cell.value), this.#app.now())) {
      this.#app.attempt(() => this.#model.execute());
    }
  }

  #isDear(cell: Cell): boolean {
    return isReal(cell) || (this.#model.value.isWatched && !isManual(cell));
  }

  #tellButtons(cell: Cell): void {
    const { stage } = this.#model.value.preview;
    const words = this.#words;
    const isReady = stage === "ready";
    const isBusy = stage === "planning" || stage === "running";
    say(this.#plan, isReady || stage === "stale" || stage === "done" ? words.again : words.plan);
    off(this.#plan, isBusy ? words.planning : "");
    // Who has no control is asked to take it first, by the one orange button.
    mark(this.#plan, "orange", !isReady && !isBusy && isInControl(cell));
    off(this.#execute, isReady ? whyNoMotion(this.#app, cell) : words.pickGoal);
    const asks = this.#twice.asks(this.#app.now());
    say(this.#executeWord, !asks ? words.execute : isReal(cell) ? words.executeReal : words.executeWatched);
    mark(this.#execute, "asks", asks);
  }

  /** The banner says that nothing moves, as long as a plan is only shown. */
  #tellNote(): void {
    const { choice } = this.#app;
    const { text } = choice.value.note;
    const isShown = this.#isShown && this.#model.value.preview.stage === "ready";
    if (isShown && !this.#isNoted) choice.set({ note: { text: this.#words.preview, kind: "remark" } });
    if (!isShown && this.#isNoted && text === this.#words.preview) choice.set({ note: { text: "", kind: "remark" } });
    this.#isNoted = isShown;
  }

  #picture(): void {
    const { preview, motion } = this.#model.value;
    const isSeen = motion !== null && ["ready", "running", "done"].includes(preview.stage);
    const joints = isSeen && preview.stage === "ready" ? this.#model.joints() : null;
    const handles = this.#reach.picture();
    this.#app.overlay({
      ghost: joints === null ? handles.ghost : { joints, verdict: "good" },
      ...(isSeen ? { path: motion.path } : {}),
      gizmo: isSeen ? null : handles.gizmo,
    });
  }
}

/** The verdict in one line, then what it is made of. */
function verdict(app: App, words: PlanTexts, model: PlanModel): Part {
  const sign = h("span", { class: "sign" });
  const title = h("strong", {});
  const sub = h("span", { class: "muted" });
  const clockTold = h("span", { class: "left" });
  const rows = h("ul", { class: "facts" });
  const hint = h("p", { class: "muted" }, words.pickGoal);
  const head = h("div", { class: "verdict", role: "status" }, sign, h("div", {}, title, sub), clockTold);
  let shown: Preview | null = null;
  const tell = (preview: Preview): void => {
    shown = preview;
    show(hint, preview.stage === "none");
    show(head, preview.stage !== "none");
    const [tone, text, more] = headOf(app, words, preview);
    attribute(head, "data-tone", tone);
    sign.replaceChildren(icon(tone === "good" || tone === "busy" ? "check" : "warning"));
    say(title, text);
    say(sub, more);
    const { plan, stage } = preview;
    const isSeen = plan !== null && ["ready", "running", "done"].includes(stage);
    rows.replaceChildren(...(isSeen ? rowsOf(plan).map((each) => factRow(app, words, model, each)) : []));
    show(rows, isSeen);
  };
  return {
    element: h("div", { class: "verdicts" }, hint, head, rows),
    update() {
      const { preview } = model.value;
      if (preview !== shown) tell(preview);
      const seconds = left(preview, app.now());
      say(clockTold, preview.stage === "ready" ? words.left(clock(seconds)) : "");
      show(clockTold, preview.stage === "ready");
    },
  };
}

type Tone = "good" | "busy" | "remark" | "bad";

function headOf(app: App, words: PlanTexts, preview: Preview): [Tone, string, string] {
  const { plan, cause, why } = preview;
  const subtitle = plan === null ? "" : words.subtitle(plan.plan);
  switch (preview.stage) {
    case "planning":
      return ["busy", words.planning, stageWord(words, preview)];
    case "refused":
      return ["bad", words.cannotRun(refusalText(app, preview)), ""];
    case "ready":
      return ["good", words.canRun, subtitle];
    case "running":
      return ["busy", words.runs, subtitle];
    case "done":
      return why === "" ? ["good", words.done, subtitle] : ["remark", words.ended, why];
    case "stale":
      return ["remark", words.stale, staleText(app, words, cause, why)];
    default:
      return ["busy", "", ""];
  }
}

function refusalText(app: App, { refusal }: Preview): string {
  return refusal === null ? "" : refusalSentence(refusal, app.settings.value.language, app.jointNames());
}

function stageWord(words: PlanTexts, { progress }: Preview): string {
  const word = { [PlanStage.SEARCHING]: words.searching, [PlanStage.SHORTENING]: words.shortening, [PlanStage.CHECKING]: words.checking }[progress.stage];
  return word === undefined ? "" : `${word}, ${Math.round(progress.fraction * 100)} %`;
}

function staleText(app: App, words: PlanTexts, cause: Preview["cause"], why: string): string {
  const told = cause === null ? "" : words.causes[cause];
  // The server's own words are English, and say which joint or which revision.
  const isOwn = app.settings.value.language === "en" && (cause === "other" || cause === "moved");
  return isOwn && why !== "" ? `${told} (${why})` : told;
}

function factRow(app: App, words: PlanTexts, model: PlanModel, row: Row): HTMLElement {
  const told = factText(app, words, row);
  const value =
    row.at > 0
      ? h("button", { type: "button", class: "quiet", onclick: () => model.seek(row.at) }, told)
      : h("span", {}, told);
  return h("li", { "data-tone": row.tone }, icon(row.tone === "good" ? "check" : "warning"), h("span", {}, words.rows[row.kind]), value);
}

function factText(app: App, words: PlanTexts, row: Row): string {
  switch (row.kind) {
    case "touch":
      if (!Number.isFinite(row.value)) return words.nothingNear;
      return words.nearestAt(`${fixed(row.value * 1000, 1)} mm`, row.object, fixed(row.at, 2));
    case "points":
      return words.samples(row.value);
    case "velocity":
    case "acceleration":
      return words.share(fixed(row.value * 100, 1), displayName(app, row.joint));
    case "limits":
      return words.marginLeft(`${fixed((row.value * 180) / Math.PI, 0)}°`);
    case "duration":
      return words.seconds(fixed(row.value, 2));
  }
}

/** Return what people call a joint that the server tells by its file's name. */
export function displayName(app: App, name: string): string {
  const joint = app.cell.value.snapshot?.joints.find((each) => each.name === name);
  return joint?.display_name ?? name;
}
