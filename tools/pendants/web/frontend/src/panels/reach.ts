// A place for the tool by handles or by numbers, and whether the robot reaches it.
import { ofRpy, pose as poseOf, rollPitchYaw, vector3 } from "../kinematics/pose.ts";
import type { Pose } from "../kinematics/pose.ts";
import { toolPose } from "../pendant/cell.ts";
import type { Cell } from "../pendant/cell.ts";
import type { Way } from "../planning/goals.ts";
import { Newest } from "../planning/newest.ts";
import { Motion, VerdictCode } from "../protocol.ts";
import type { InverseSolution, KinematicsIkReply } from "../protocol.ts";
import type { PlanTexts } from "../texts/plan.ts";
import { fixed, readNumber, refusalSentence } from "../texts/texts.ts";
import type { App, Part } from "../ui/app.ts";
import { attribute, h, mark, off, say, show } from "../ui/elements.ts";
import { holdButton } from "../ui/hold-button.ts";
import type { Ghost, Gizmo } from "../view/view.ts";
import { LinkLost, Refused } from "../wire/errors.ts";
import type { RequestDraft } from "../wire/link.ts";
import { whyNoMotion } from "./jog.ts";

/** Between two questions [ms]: the server answers ten a second. */
const EVERY = 120;
const SLOTS = 10;
const AXES = ["X", "Y", "Z", "R", "P", "Y"];
const DEGREES = 180 / Math.PI;

interface Question {
  pose: Pose;
  areAll: boolean;
}

export interface Chosen {
  pose: Pose | null;
  branch: number | null;
  joints: readonly number[] | null;
}

export interface ReachQuestion extends Part {
  /** Whether the handles are the goal, and which way leads there. */
  use(isUsed: boolean, way: Way): void;
  moved(pose: Pose, isDone: boolean): void;
  chosen(): Chosen;
  picture(): { ghost: Ghost | null; gizmo: Gizmo | null };
}

export function reachQuestion(app: App, words: PlanTexts, speed: () => number): ReachQuestion {
  return new Reach(app, words, speed);
}

class Reach implements ReachQuestion {
  readonly element: HTMLElement;
  readonly #app: App;
  readonly #words: PlanTexts;
  readonly #speed: () => number;
  readonly #boxes: HTMLInputElement[];
  readonly #drags: HTMLButtonElement[];
  readonly #told = h("p", { class: "told", role: "status" });
  readonly #branches = h("div", { class: "branches" });
  readonly #go: HTMLButtonElement;
  readonly #questions: Newest<Question, KinematicsIkReply>;
  #isUsed = false;
  #way: Way = "ptp";
  #dragging: "place" | "turn" = "place";
  #pose: Pose | null = null;
  #solutions: readonly InverseSolution[] = [];
  #solution: InverseSolution | null = null;
  /** Where it leads: the handles may be elsewhere since. */
  #solvedFor: Pose | null = null;
  #branch: number | null = null;
  #isBad = false;

  constructor(app: App, words: PlanTexts, speed: () => number) {
    this.#app = app;
    this.#speed = speed;
    this.#words = words;
    this.#boxes = AXES.map((name, index) => {
      const unit = index < 3 ? "mm" : "°";
      const box = h("input", { type: "text", inputmode: "text", "aria-label": `${name} [${unit}]` });
      box.addEventListener("change", () => this.#typed());
      return box;
    });
    this.#drags = (["place", "turn"] as const).map((each) =>
      h("button", { type: "button", "data-drags": each, onclick: () => this.#drag(each) }, words[each]),
    );
    this.#questions = new Newest(
      ({ pose, areAll }: Question) => this.#ask(pose, areAll),
      (question, reply) => this.#answered(question, reply),
      (question, error) => this.#refused(question, error),
      EVERY,
      { now: () => app.now(), after: (wait, then) => void setTimeout(then, wait) },
    );
    const { holding, texts, choice } = app;
    this.#go = holdButton("go", null, {
      down: (source) => {
        const draft = this.#draft();
        if (draft !== null) holding.holdMotion(source, draft);
      },
      up: (source) => holding.release(source),
      explain: () => choice.set({ note: { text: texts.holdHow, kind: "remark" } }),
    }, words.moveThere);
    const boxes = this.#boxes.map((box, index) => h("label", {}, h("span", {}, `${AXES[index] ?? ""} ${index < 3 ? "mm" : "°"}`), box));
    this.element = h(
      "div",
      { class: "reach" },
      h("div", { class: "tabs", role: "group", "aria-label": words.handlesDo }, ...this.#drags),
      h("div", { class: "six" }, ...boxes),
      this.#told,
      this.#go,
      this.#branches,
    );
    this.#drag("place");
  }

  use(isUsed: boolean, way: Way): void {
    this.#isUsed = isUsed;
    this.#way = way;
    show(this.#go, way !== "free");
    show(this.element, isUsed);
    if (isUsed && this.#pose === null) this.#begin();
    this.#tellBranches();
  }

  moved(pose: Pose, isDone: boolean): void {
    if (!this.#isUsed) return;
    this.#take(pose, isDone);
  }

  chosen(): Chosen {
    if (!this.#isUsed) return { pose: null, branch: null, joints: null };
    return { pose: this.#pose, branch: this.#branch, joints: this.#found()?.joints ?? null };
  }

  picture(): { ghost: Ghost | null; gizmo: Gizmo | null } {
    if (!this.#isUsed || this.#pose === null) return { ghost: null, gizmo: null };
    const ghost: Ghost | null =
      this.#solution === null ? null : { joints: this.#solution.joints, verdict: this.#isBad ? "bad" : "reached" };
    return { ghost, gizmo: { object: null, pose: this.#pose, drags: this.#dragging, snap: 0 } };
  }

  update(cell: Cell): void {
    if (!this.#isUsed) return;
    if (this.#pose === null) this.#begin();
    const isReached = this.#found() !== null && !this.#isBad;
    off(this.#go, isReached ? whyNoMotion(this.#app, cell) : this.#told.textContent || this.#words.unreached);
  }

  /** The answer for where the handles are now; null before it is here. */
  #found(): InverseSolution | null {
    return this.#solvedFor === this.#pose ? this.#solution : null;
  }

  /** The motion to the handles: PTP to the chosen posture, or LIN to their place. */
  #draft(): RequestDraft | null {
    const [pose, joints] = [this.#pose, this.#found()?.joints];
    if (pose === null || joints === undefined) return null;
    const speed = this.#speed();
    if (this.#way === "lin") {
      const [position, orientation] = [[...pose.position], [...pose.quaternion]];
      return { type: "pose_move", motion: Motion.LIN, speed, frame: "base", position, orientation };
    }
    const slots = [...joints, ...new Array<number>(SLOTS - joints.length).fill(0)];
    return { type: "joint_move", speed, joint_count: joints.length, joints: slots };
  }

  /** The handles begin where the tool is. */
  #begin(): void {
    const pose = toolPose(this.#app.cell.value);
    if (pose !== null) this.#take(pose, true);
  }

  #drag(dragging: "place" | "turn"): void {
    this.#dragging = dragging;
    for (const each of this.#drags) {
      const isChosen = each.dataset["drags"] === dragging;
      mark(each, "chosen", isChosen);
      attribute(each, "aria-pressed", String(isChosen));
    }
  }

  #take(pose: Pose, isDone: boolean): void {
    this.#pose = pose;
    this.#branch = null;
    const values = [...pose.position.map((each) => each * 1000), ...rollPitchYaw(pose.quaternion).map((each) => each * DEGREES)];
    this.#boxes.forEach((box, index) => {
      box.value = fixed(values[index] ?? 0, 1);
      attribute(box, "aria-invalid", null);
    });
    this.#questions.ask({ pose, areAll: isDone });
  }

  #typed(): void {
    const values = this.#boxes.map((box) => readNumber(box.value));
    this.#boxes.forEach((box, index) => attribute(box, "aria-invalid", values[index] === null ? "true" : null));
    if (values.some((each) => each === null)) return;
    const [x = 0, y = 0, z = 0, ...turns] = values.map((each) => each ?? 0);
    const position = vector3([x, y, z].map((each) => each / 1000));
    this.#take(poseOf(position, ofRpy(turns.map((each) => each / DEGREES))), true);
  }

  #ask(pose: Pose, areAll: boolean): Promise<KinematicsIkReply> {
    const [x, y, z] = pose.position;
    const [qx, qy, qz, qw] = pose.quaternion;
    return this.#app.session.call<"kinematics.ik">({
      op: "kinematics.ik",
      pose: { position: [x, y, z], orientation: [qx, qy, qz, qw] },
      frame: "base",
      branches: areAll ? "all" : "nearest",
      scene: true,
    });
  }

  #answered({ pose, areAll }: Question, { solutions }: KinematicsIkReply): void {
    this.#solution = solutions[0] ?? null;
    this.#solvedFor = pose;
    this.#solutions = areAll ? solutions : [];
    this.#tellSolution();
    this.#tellBranches();
  }

  #refused(question: Question, error: unknown): void {
    if (error instanceof LinkLost) return;
    if (!(error instanceof Refused)) throw error;
    const { refusal } = error;
    const passing: number[] = [VerdictCode.SUPERSEDED, VerdictCode.TOO_OFTEN];
    if (passing.includes(refusal.code)) {
      if (question.pose === this.#pose) this.#questions.ask(question);
      return;
    }
    this.#isBad = true;
    this.#solutions = [];
    say(this.#told, refusalSentence(refusal, this.#app.settings.value.language, this.#app.jointNames()));
    mark(this.#told, "bad", true);
    this.#tellBranches();
  }

  #tellSolution(): void {
    const words = this.#words;
    const solution = this.#solution;
    const touches = solution?.touches ?? null;
    this.#isBad = solution === null || touches !== null;
    mark(this.#told, "bad", this.#isBad);
    if (solution === null) {
      say(this.#told, words.unreached);
      return;
    }
    const { joint, margin } = solution.nearest_limit;
    const told = touches === null ? words.reached : words.touches(touches[0] ?? "", touches[1] ?? "");
    const name = this.#app.jointNames()[joint] ?? String(joint);
    say(this.#told, `${told} ${words.tightest(name, `${fixed(margin * DEGREES, 0)}°`)}`);
  }

  #tellBranches(): void {
    const words = this.#words;
    show(this.#branches, this.#isUsed && this.#way === "ptp" && this.#solutions.length > 1);
    this.#branches.replaceChildren(
      h("span", { class: "muted" }, words.branches),
      ...this.#solutions.map((each) => {
        const button = h("button", { type: "button", onclick: () => this.#choose(each) }, words.branch(each.branch, this.#posture(each)));
        const isChosen = each === this.#solution;
        mark(button, "picked", isChosen);
        mark(button, "bad", each.touches !== null);
        attribute(button, "aria-pressed", String(isChosen));
        return button;
      }),
    );
  }

  #posture({ configuration }: InverseSolution): string {
    if (configuration === null) return "";
    const { shoulder, elbow, wrist } = configuration;
    return [shoulder, elbow, wrist].map((each) => this.#words.posture[each] ?? each).join(", ");
  }

  #choose(solution: InverseSolution): void {
    this.#solution = solution;
    this.#branch = solution.branch;
    this.#tellSolution();
    this.#tellBranches();
  }
}
