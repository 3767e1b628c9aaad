// Scene: what stands around, moved and measured by handles or numbers, and what the tool holds.
import "../scene.css";
import { ofRpy, pose as poseOf, rollPitchYaw, vector3 } from "../kinematics/pose.ts";
import type { Pose, Vector3 } from "../kinematics/pose.ts";
import { isInControl, measuredJoints, toolPose } from "../pendant/cell.ts";
import type { Cell } from "../pendant/cell.ts";
import { cellFrames } from "../scene/frames.ts";
import { sceneModel } from "../scene/model.ts";
import type { SceneModel } from "../scene/model.ts";
import { distanceTo, drawn, freeName, graspOf, inBase, isSame, isWall, KINDS, MEASURES, newEntry, ownPose, resized, snapped } from "../scene/objects.ts";
import type { Entry, Grasp, Kind } from "../scene/objects.ts";
import type { SceneTexts } from "../texts/scene.ts";
import { fixed, readNumber } from "../texts/texts.ts";
import type { App, TaskPart } from "../ui/app.ts";
import { attribute, h, mark, off, isOff, say, sayOrHide, show } from "../ui/elements.ts";
import { icon } from "../ui/icons.ts";
import type { Gizmo } from "../view/view.ts";

const AXES = ["X", "Y", "Z", "R", "P", "Y"];
const DEGREES = 180 / Math.PI;
const SNAP = 0.01;
/** Between two questions for the nearest bodies while the robot moves [ms]. */
const NEAREST_EVERY = 1000;
const MOST_NAMES = 5;

export function sceneTask(app: App): TaskPart {
  return new SceneTask(app);
}

class SceneTask implements TaskPart {
  readonly element: HTMLElement;
  readonly #app: App;
  readonly #words: SceneTexts;
  readonly #model: SceneModel;
  readonly #count = h("span", { class: "muted" });
  readonly #undo: HTMLButtonElement;
  readonly #list = h("div", { class: "objects" });
  readonly #none: HTMLElement;
  readonly #handles: HTMLButtonElement[];
  readonly #snap: HTMLButtonElement;
  readonly #editor: ObjectEditor;
  #listed: { key: string } = { key: "" };
  #selected = "";
  #draft: Entry | null = null;
  #drags: Gizmo["drags"] = "place";
  /** As it was when its size was seized. */
  #seized: Entry | null = null;
  #snapBy = 0;
  #isShown = false;
  #nearestAt = 0;
  #pictured: { key: unknown[]; objects: ReturnType<SceneModel["objects"]> } = { key: [], objects: [] };

  constructor(app: App) {
    this.#app = app;
    const words = (this.#words = app.texts.sceneWords);
    this.#model = sceneModel(app);
    this.#undo = h("button", { type: "button", title: words.undoHint, onclick: () => this.#act(() => this.#model.undo()) }, icon("undo"), words.undo);
    this.#none = h("p", { class: "muted" }, words.none);
    const handles = { place: words.move, turn: words.turn, size: words.resize };
    this.#handles = (["place", "turn", "size"] as const).map((each) =>
      h("button", { type: "button", "data-drags": each, onclick: () => this.#drag(each) }, handles[each]),
    );
    this.#snap = h("button", { type: "button", "aria-pressed": "false", onclick: () => this.#toggleSnap() }, words.snap);
    this.#editor = new ObjectEditor(app, words, this.#model, {
      edited: (draft) => this.#edit(draft),
      save: () => this.#save(),
      putBack: () => this.#select(this.#selected),
      copy: () => this.#copy(),
      remove: () => this.#remove(),
      act: (act) => this.#act(act),
    });
    this.element = h(
      "section",
      { class: "scene", "aria-label": app.texts.scene },
      h("header", {}, h("h2", {}, words.objects), this.#count, this.#undo),
      this.#none,
      this.#list,
      h("div", { class: "kinds" }, ...KINDS.map((kind) => this.#addButton(kind))),
      h("div", { class: "tabs", role: "group", "aria-label": words.handles }, ...this.#handles, this.#snap),
      this.#editor.element,
    );
    this.#drag("place");
  }

  shown(isShown: boolean): void {
    this.#isShown = isShown;
    this.#app.overlay(null);
    if (!isShown) {
      this.#app.hearView(null);
      return;
    }
    this.#app.choice.set({ isChecklistOpen: false });
    this.#app.hearView({
      picked: (name) => name !== null && this.#select(name),
      objectMoved: (name, pose) => this.#dragged(name, pose),
      objectScaled: (name, by, isDone) => this.#scaled(name, by, isDone),
    });
  }

  update(cell: Cell): void {
    if (!this.#isShown) return;
    const { scene, past } = this.#model.value;
    const saved = this.#saved();
    if (saved === null && this.#selected !== "" && this.#draft === null) this.#selected = "";
    if (saved === null && this.#selected === "") this.#select(scene.entries[0]?.name ?? "");
    say(this.#count, this.#words.ofCell(scene.entries.length));
    off(this.#undo, past.length === 0 ? this.#words.undoHint : "");
    show(this.#none, scene.entries.length === 0);
    this.#tellList();
    this.#learnNearest(cell);
    this.#editor.update(cell, saved, this.#draft);
    this.#picture(cell);
  }

  /** The chosen object as the server has it; null for none. */
  #saved(): Entry | null {
    return this.#model.value.scene.entries.find(({ name }) => name === this.#selected) ?? null;
  }

  #select(name: string): void {
    this.#selected = name;
    this.#draft = null;
    this.#editor.choose(this.#saved());
  }

  #edit(draft: Entry): void {
    const saved = this.#saved();
    this.#draft = saved !== null && isSame(saved, draft) ? null : draft;
  }

  /** It was dragged in the picture, whose places are in base. */
  #dragged(name: string, at: Pose): void {
    if (name !== this.#selected) this.#select(name);
    const entry = this.#draft ?? this.#saved();
    if (entry === null || entry.link !== null) return;
    const place = this.#drags === "place" ? snapped(at, this.#snapBy) : at;
    const draft = { ...entry, pose: ownPose(entry, place, this.#model.chain(this.#app.cell.value.robot)) };
    this.#edit(draft);
    this.#editor.fill(draft);
  }

  #scaled(name: string, by: Vector3, isDone: boolean): void {
    if (name !== this.#selected) this.#select(name);
    this.#seized ??= this.#draft ?? this.#saved();
    const entry = this.#seized;
    if (isDone) this.#seized = null;
    if (entry === null || entry.link !== null || entry.kind === "mesh") return;
    const draft = resized(entry, by, this.#snapBy);
    this.#edit(draft);
    this.#editor.fill(draft);
  }

  #drag(drags: Gizmo["drags"]): void {
    this.#drags = drags;
    for (const each of this.#handles) {
      const isChosen = each.dataset["drags"] === drags;
      mark(each, "chosen", isChosen);
      attribute(each, "aria-pressed", String(isChosen));
    }
  }

  #toggleSnap(): void {
    this.#snapBy = this.#snapBy > 0 ? 0 : SNAP;
    mark(this.#snap, "chosen", this.#snapBy > 0);
    attribute(this.#snap, "aria-pressed", String(this.#snapBy > 0));
  }

  #addButton(kind: Exclude<Kind, "mesh">): HTMLElement {
    const word = this.#words.kinds[kind] ?? kind;
    return h("button", { type: "button", "aria-label": this.#words.add(word), onclick: () => this.#add(kind) }, `+ ${word}`);
  }

  /** A new object stands in front of the robot, beside its tool. */
  #add(kind: Exclude<Kind, "mesh">): void {
    const at = toolPose(this.#app.cell.value)?.position ?? [0.5, 0, 0.2];
    const place = vector3([at[0] * 1.2 + 0.2, at[1] * 0.8 + 0.2, 0.1].map((each) => Math.round(each * 100) / 100));
    const entry = newEntry(kind, place, this.#model.value.scene.entries);
    this.#act(async () => {
      await this.#model.add(entry);
      this.#select(entry.name);
    });
  }

  #copy(): void {
    const entry = this.#draft ?? this.#saved();
    if (entry === null) return;
    const { entries } = this.#model.value.scene;
    const [x, y, z] = entry.pose.position;
    const copy: Entry = { ...entry, name: freeName(entry.kind, entries), link: null, pose: { ...entry.pose, position: [x + 0.1, y, z] } };
    this.#act(async () => {
      await this.#model.add(copy);
      this.#select(copy.name);
    });
  }

  #remove(): void {
    const name = this.#selected;
    this.#act(async () => {
      await this.#model.remove(name);
      this.#select("");
    });
  }

  #save(): void {
    const [saved, draft] = [this.#saved(), this.#draft];
    if (saved === null || draft === null) return;
    this.#act(async () => {
      await this.#model.save(saved, draft);
      this.#select(draft.name);
      await this.#tellPrograms();
    });
  }

  /** Say which programs were checked with another scene. */
  async #tellPrograms(): Promise<void> {
    const { programs } = await this.#app.session.call<"programs.list">({ op: "programs.list" });
    const names = programs.map(({ name }) => `“${name}”`);
    const told = names.length > MOST_NAMES ? [...names.slice(0, MOST_NAMES), "…"] : names;
    if (names.length > 0) this.#app.choice.set({ note: { text: this.#words.programsStale(told.join(", ")), kind: "remark" } });
  }

  #act(act: () => Promise<unknown>): void {
    this.#app.attempt(act);
  }

  #learnNearest(cell: Cell): void {
    const moves = (cell.state?.velocities ?? []).some((each) => Math.abs(each) > 1e-3);
    if (!moves || this.#app.now() < this.#nearestAt) return;
    this.#nearestAt = this.#app.now() + NEAREST_EVERY;
    this.#act(() => this.#model.learnNearest());
  }

  #tellList(): void {
    const { scene } = this.#model.value;
    const key = `${scene.revision} ${this.#selected} ${scene.entries.map((each) => `${each.name}${each.link ?? ""}`).join()}`;
    if (this.#listed.key === key) return;
    this.#listed.key = key;
    this.#list.replaceChildren(...scene.entries.map((each) => this.#listRow(each)));
  }

  #listRow(entry: Entry): HTMLElement {
    const words = this.#words;
    const dot = h("i", { class: "dot", "aria-hidden": "true" });
    dot.style.background = entry.colour;
    const where = entry.link !== null ? words.heldBy(entry.link) : isWall(entry) ? words.seeThrough : words.stands;
    const isChosen = entry.name === this.#selected;
    return h(
      "button",
      { type: "button", class: `object${isChosen ? " selected" : ""}`, "aria-pressed": String(isChosen), onclick: () => this.#select(entry.name) },
      dot,
      h("strong", {}, entry.name),
      h("span", { class: "muted" }, words.kinds[entry.kind] ?? entry.kind),
      h("span", { class: entry.link !== null ? "where held" : "where" }, where),
    );
  }

  #picture(cell: Cell): void {
    const saved = this.#saved();
    const entry = this.#draft ?? saved;
    const all = this.#model.objects(cell);
    const chain = this.#model.chain(cell.robot);
    const key = [all, this.#draft, this.#selected];
    if (key.some((each, index) => each !== this.#pictured.key[index])) {
      const others = all.filter(({ name }) => name !== this.#selected);
      const joints = measuredJoints(cell);
      const chosen = entry === null ? [] : [drawn(entry, inBase(entry, chain, joints), { chosen: true })];
      const shadow = saved === null || this.#draft === null ? [] : [drawn(saved, inBase(saved, chain, joints), { shadow: true })];
      this.#pictured = { key, objects: [...others, ...shadow, ...chosen] };
    }
    const isFree = entry !== null && entry.link === null;
    this.#app.overlay({
      objects: this.#pictured.objects,
      gizmo: isFree ? { object: entry.name, pose: inBase(entry, chain, null), drags: this.#drags, snap: this.#snapBy } : null,
    });
  }
}

interface EditorEvents {
  edited(draft: Entry): void;
  save(): void;
  putBack(): void;
  copy(): void;
  remove(): void;
  act(act: () => Promise<unknown>): void;
}

/** The numbers of one object, and what can be done with it. */
class ObjectEditor {
  readonly element: HTMLElement;
  readonly #app: App;
  readonly #words: SceneTexts;
  readonly #model: SceneModel;
  readonly #events: EditorEvents;
  readonly #name = h("input", { type: "text", maxlength: 64 });
  readonly #boxes: HTMLInputElement[];
  readonly #sizes = h("div", { class: "three" });
  readonly #problem = h("p", { class: "problem", role: "alert" });
  readonly #near = h("p", { class: "muted" });
  readonly #touch = h("div", { class: "touch" });
  readonly #touchTold = h("summary", {});
  readonly #hold: HTMLButtonElement;
  readonly #holdTold = h("p", { class: "muted" });
  readonly #save: HTMLButtonElement;
  readonly #back: HTMLButtonElement;
  readonly #remove: HTMLButtonElement;
  readonly #unsaved: HTMLElement;
  #sizeBoxes: HTMLInputElement[] = [];
  #entry: Entry | null = null;
  #isSure = false;
  #touchKey = "";
  #grippedBy: { name: string; distance: number } | null = null;

  constructor(app: App, words: SceneTexts, model: SceneModel, events: EditorEvents) {
    this.#app = app;
    this.#words = words;
    this.#model = model;
    this.#events = events;
    this.#boxes = AXES.map((name, index) => this.#box(`${name} [${index < 3 ? "mm" : "°"}]`));
    attribute(this.#name, "aria-label", words.name);
    this.#name.addEventListener("change", () => this.#typed());
    this.#hold = h("button", { type: "button", onclick: () => this.#holdOrLeave() }, words.attachTouching);
    this.#save = h("button", { type: "button", onclick: () => events.save() }, words.save);
    this.#back = h("button", { type: "button", onclick: () => events.putBack() }, words.putBack);
    this.#remove = h("button", { type: "button", class: "remove", onclick: () => this.#removeIt() }, words.remove);
    this.#unsaved = h("p", { class: "muted" }, words.unsaved);
    const labelled = (box: HTMLInputElement, index: number): HTMLElement => h("label", {}, h("span", {}, `${AXES[index] ?? ""} ${index < 3 ? "mm" : "°"}`), box);
    this.element = h(
      "div",
      { class: "object-editor" },
      h("header", {}, this.#name, h("span", { class: "muted" }, words.inBase), h("button", { type: "button", onclick: () => events.copy() }, words.copy), this.#remove),
      h("div", { class: "three" }, ...this.#boxes.map(labelled)),
      this.#sizes,
      this.#problem,
      this.#near,
      h("details", {}, this.#touchTold, this.#touch),
      h("div", { class: "grasp" }, this.#hold, this.#holdTold),
      h("div", { class: "foot" }, this.#unsaved, h("div", { class: "acts" }, this.#back, this.#save)),
    );
    show(this.element, false);
  }

  choose(entry: Entry | null): void {
    this.#entry = entry;
    this.#isSure = false;
    this.#touchKey = "";
    show(this.element, entry !== null);
    say(this.#remove, this.#words.remove);
    if (entry === null) return;
    this.fill(entry);
  }

  fill(entry: Entry): void {
    this.#entry = entry;
    this.#name.value = entry.name;
    const { position, quaternion } = entry.pose;
    const values = [...position.map((each) => each * 1000), ...rollPitchYaw(quaternion).map((each) => each * DEGREES)];
    this.#boxes.forEach((box, index) => {
      box.value = fixed(values[index] ?? 0, 1);
      box.disabled = entry.link !== null;
    });
    this.#sizeBoxes = MEASURES[entry.kind].map((each) => this.#box(`${this.#words.measures[each] ?? each} [mm]`));
    this.#sizeBoxes.forEach((box, index) => {
      box.value = fixed((entry.sizes[index] ?? 0) * 1000, 1);
      box.disabled = entry.link !== null;
    });
    this.#sizes.replaceChildren(
      ...this.#sizeBoxes.map((box, index) => h("label", {}, h("span", {}, `${this.#words.measures[MEASURES[entry.kind][index] ?? ""] ?? ""} mm`), box)),
    );
    this.#name.disabled = entry.link !== null || entry.kind === "mesh";
    say(this.#problem, entry.kind === "mesh" ? this.#words.meshFixed : "");
  }

  update(cell: Cell, saved: Entry | null, draft: Entry | null): void {
    if (this.#entry === null || saved === null) {
      show(this.element, false);
      return;
    }
    show(this.element, true);
    // An undo or somebody else made it another one.
    if (draft === null && !isSame(this.#entry, saved)) this.fill(saved);
    show(this.#unsaved, draft !== null);
    off(this.#save, draft === null ? this.#words.unsaved : "");
    off(this.#back, draft === null ? this.#words.unsaved : "");
    mark(this.#save, "orange", draft !== null && isInControl(cell));
    this.#tellNearest(saved);
    this.#tellTouch(cell, saved);
    this.#tellGrasp(cell, saved, draft);
  }

  #box(label: string): HTMLInputElement {
    const box = h("input", { type: "text", inputmode: "text", "aria-label": label });
    box.addEventListener("change", () => this.#typed());
    return box;
  }

  #typed(): void {
    const entry = this.#entry;
    if (entry === null) return;
    const places = this.#boxes.map((box) => readNumber(box.value));
    const sizes = this.#sizeBoxes.map((box) => readNumber(box.value));
    const areBad = [...places.map((each) => each === null), ...sizes.map((each) => each === null || each < 0)];
    [...this.#boxes, ...this.#sizeBoxes].forEach((box, index) => attribute(box, "aria-invalid", areBad[index] === true ? "true" : null));
    const isBad = areBad.includes(true) || this.#name.value.trim() === "";
    say(this.#problem, isBad ? this.#words.wrong : "");
    if (isBad) return;
    const [x = 0, y = 0, z = 0, ...turns] = places.map((each) => each ?? 0);
    const pose = poseOf(vector3([x, y, z].map((each) => each / 1000)), ofRpy(turns.map((each) => each / DEGREES)));
    const draft: Entry = { ...entry, name: this.#name.value.trim(), pose, sizes: sizes.map((each) => (each ?? 0) / 1000) };
    this.#entry = draft;
    this.#events.edited(draft);
  }

  /** The first press asks, the second removes. */
  #removeIt(): void {
    if (this.#isSure) this.#events.remove();
    this.#isSure = !this.#isSure;
    say(this.#remove, this.#isSure ? this.#words.removeSure : this.#words.remove);
  }

  #tellNearest({ name }: Entry): void {
    const { nearest } = this.#model.value;
    const { distance = null, first = "", second = "" } = nearest ?? {};
    const told = distance === null ? "" : `${fixed(distance * 1000, 0)} mm`;
    const other = first === name ? second : second === name ? first : "";
    sayOrHide(this.#near, told === "" ? "" : other === "" ? this.#words.nearestPair(first, second, told) : this.#words.nearestTo(other, told));
  }

  #tellTouch(cell: Cell, { name }: Entry): void {
    const { scene } = this.#model.value;
    const partners = new Set(scene.allowed.filter((pair) => pair.includes(name)).map(([one, other]) => (one === name ? other : one)));
    const bodies = [...scene.entries.map((each) => each.name).filter((each) => each !== name), ...(cell.robot?.links ?? []).map(({ link }) => link)];
    const key = [name, ...bodies, "/", ...partners].join("\n");
    if (key === this.#touchKey) return;
    this.#touchKey = key;
    say(this.#touchTold, `${this.#words.mayTouch}: ${partners.size === 0 ? this.#words.nothing : [...partners].join(", ")}`);
    this.#touch.replaceChildren(
      ...bodies.map((body) => {
        const box = h("input", { type: "checkbox", checked: partners.has(body) });
        box.addEventListener("change", () => this.#events.act(() => this.#model.allow(name, body, box.checked)));
        return h("label", { class: "check" }, box, body);
      }),
    );
  }

  #tellGrasp(cell: Cell, saved: Entry, draft: Entry | null): void {
    const words = this.#words;
    if (saved.link !== null) {
      say(this.#hold, words.detach);
      off(this.#hold, "");
      const known = this.#grippedBy?.name === saved.name ? this.#grippedBy : null;
      say(this.#holdTold, known === null ? words.carried : words.gripped(millimetres(known.distance)));
      return;
    }
    const grasp = this.#grasp(cell);
    const distance = grasp === null ? null : distanceTo(saved, inBase(saved, this.#model.chain(cell.robot), null), grasp.point);
    if (grasp === null || distance === null) {
      say(this.#hold, words.attachTouching);
      say(this.#holdTold, "");
      off(this.#hold, draft === null ? "" : words.unsaved);
      return;
    }
    const far = words.tooFar(millimetres(distance), millimetres(grasp.reach));
    const isFar = distance > grasp.reach;
    say(this.#hold, isFar ? words.attach(millimetres(distance)) : words.attachTouching);
    say(this.#holdTold, isFar ? far : "");
    off(this.#hold, isFar ? far : draft === null ? "" : words.unsaved);
  }

  #grasp(cell: Cell): Grasp | null {
    const at = toolPose(cell);
    return at === null ? null : graspOf(cellFrames(this.#app).content(cell), cell.snapshot?.tool ?? null, at);
  }

  #holdOrLeave(): void {
    const entry = this.#entry;
    if (entry === null || isOff(this.#hold)) return;
    const { name } = entry;
    this.#events.act(async () => {
      if (this.#model.value.scene.entries.some((each) => each.name === name && each.link !== null)) await this.#model.detach(name);
      else this.#grippedBy = { name, distance: await this.#model.attach(name) };
      const now = this.#model.value.scene.entries.find((each) => each.name === name);
      if (now !== undefined) this.fill(now);
    });
  }
}

function millimetres(metres: number): string {
  return `${fixed(metres * 1000, 1)} mm`;
}
