// The 2-D view: the same robot on a plain canvas, for where there is no WebGL, or none that keeps
// up. Draws only when something changed.
import { Chain, type RobotDescription } from "../kinematics/chain.ts";
import {
  difference,
  pose,
  scaled,
  transformed,
  vector3,
  zTowards,
  type Pose,
  type Vector3,
} from "../kinematics/pose.ts";
import {
  eyeOf,
  lookingFrom,
  orbited,
  Projection,
  shifted,
  zoomed,
  type Orbit,
} from "./camera.ts";
import { AXES, GREEN, ORANGE, PALETTES, shaded, verdictColour, type Palette } from "./colours.ts";
import { grabbed, gizmoLines, type Grab } from "./flat_gizmo.ts";
import { pathDots } from "./path_dots.ts";
import { isWithin, seenSolid, solidPose, type Flat, type Seen, type Solid } from "./solids.ts";
import { isSame, linkJoint, linksInPlace } from "./changes.ts";
import { EMPTY, type Content, type SceneObject, type Side, type View, type ViewEvents } from "./view.ts";

const CLICK = 4; // points that a press may move and still picks
const TRACE_WIDTH = 2;
const PATH_WIDTH = 2.5;
const DOT = 3;

/** A solid at its place, and how it is painted. */
interface Painted {
  solid: Solid;
  at: Pose;
  colour: string;
  outline: string | null;
  alpha: number;
  isDashed: boolean;
  name: string | null;
  /** of the robot that it hangs on */
  links: readonly string[];
}

interface Pointer {
  x: number;
  y: number;
  /** where it went down */
  from: Flat;
  isPanning: boolean;
}

export function makeStickView(host: HTMLElement, events: ViewEvents): View {
  return new StickView(host, events);
}

class StickView implements View {
  readonly #host: HTMLElement;
  readonly #events: ViewEvents;
  readonly #canvas = document.createElement("canvas");
  readonly #layer = document.createElement("canvas");
  readonly #ground = document.createElement("canvas");
  #groundSeen: readonly unknown[] = [];
  readonly #pointers = new Map<number, Pointer>();
  readonly #listening = new AbortController();
  #content: Content = EMPTY;
  #chain: Chain | null = null;
  #orbit: Orbit = lookingFrom("iso", 1);
  #frame = 0;
  #size = { width: 1, height: 1, ratio: 1 };
  #grab: Grab | null = null;
  #shown: { seen: Seen; name: string }[] = [];

  constructor(host: HTMLElement, events: ViewEvents) {
    this.#host = host;
    this.#events = events;
    Object.assign(this.#canvas.style, {
      display: "block", width: "100%", height: "100%", touchAction: "none",
    });
    host.append(this.#canvas);
    this.#listen();
    this.#fit();
    this.#wantFrame();
  }

  show(content: Content): void {
    if (isSame(this.#content, content)) return;
    if (content.robot !== this.#content.robot) this.#takeRobot(content.robot);
    this.#content = content;
    this.#draw();
  }

  look(side: Side): void {
    this.#orbit = lookingFrom(side, this.#chain?.size ?? 1);
    this.#wantFrame();
  }

  resize(): void {
    this.#fit();
    // A canvas of another size is empty: drawn at once, so that it never flashes.
    this.#draw();
  }

  dispose(): void {
    cancelAnimationFrame(this.#frame);
    this.#listening.abort();
    this.#canvas.remove();
  }

  #fit(): void {
    const { width, height } = this.#host.getBoundingClientRect();
    const ratio = Math.min(3, globalThis.devicePixelRatio || 1);
    this.#size = { width: Math.max(1, width), height: Math.max(1, height), ratio };
    for (const canvas of [this.#canvas, this.#layer, this.#ground]) {
      canvas.width = Math.max(1, Math.round(this.#size.width * ratio));
      canvas.height = Math.max(1, Math.round(this.#size.height * ratio));
    }
  }

  #takeRobot(robot: RobotDescription | null): void {
    const isOther = robot?.hash !== this.#content.robot?.hash;
    this.#chain = robot === null ? null : new Chain(robot);
    if (isOther) this.#orbit = lookingFrom("iso", this.#chain?.size ?? 1);
  }

  #wantFrame(): void {
    if (this.#frame === 0) this.#frame = requestAnimationFrame(() => this.#draw());
  }

  #draw(): void {
    cancelAnimationFrame(this.#frame);
    this.#frame = 0;
    const { width, height, ratio } = this.#size;
    const paper = this.#canvas.getContext("2d", { alpha: false });
    if (paper === null) return;
    const palette = PALETTES[this.#content.theme];
    const by = new Projection(this.#orbit, width, height);
    this.#layGround(by, palette);
    paper.setTransform(1, 0, 0, 1, 0, 0);
    paper.drawImage(this.#ground, 0, 0);
    paper.setTransform(ratio, 0, 0, ratio, 0, 0);
    const painted = [...this.#robotSolids(palette), ...this.#content.objects.map(objectSolid)];
    this.#shown = drawSolids(paper, painted, eyeOf(this.#orbit), by, palette);
    this.#drawGhost(paper, by, palette);
    drawWay(paper, by, this.#content.trace, ORANGE, TRACE_WIDTH, 0.75);
    drawWay(paper, by, this.#content.path, ORANGE, PATH_WIDTH, 1);
    drawDots(paper, by, this.#content.path, palette.ink);
    this.#drawFrames(paper, by, palette);
    this.#drawGizmo(paper, by);
  }

  /** Draw the ground if it is seen otherwise than before: its gradient costs as much as the rest. */
  #layGround(by: Projection, palette: Palette): void {
    const { width, height, ratio } = this.#size;
    const seen = [this.#size, this.#orbit, this.#chain, palette];
    const paper = this.#ground.getContext("2d");
    if (paper === null || seen.every((each, index) => each === this.#groundSeen[index])) return;
    this.#groundSeen = seen;
    paper.setTransform(ratio, 0, 0, ratio, 0, 0);
    const far = Math.hypot(width, height) * 0.6;
    const ground = paper.createRadialGradient(
      width / 2, height * 0.4, 0, width / 2, height * 0.4, far,
    );
    ground.addColorStop(0, palette.ground[0]);
    ground.addColorStop(1, palette.ground[1]);
    paper.fillStyle = ground;
    paper.fillRect(0, 0, width, height);
    const size = this.#chain?.size ?? 1;
    const step = gridStep(size);
    const reach = step * Math.ceil((2.2 * size) / step);
    const z = this.#chain?.root.position[2] ?? 0;
    paper.lineWidth = 1;
    paper.strokeStyle = palette.grid;
    paper.beginPath();
    for (let at = -reach; at <= reach + step / 2; at += step) {
      addLine(paper, by, [at, -reach, z], [at, reach, z]);
      addLine(paper, by, [-reach, at, z], [reach, at, z]);
    }
    paper.stroke();
  }

  #robotSolids(palette: Palette): Painted[] {
    const { joints, driven, stale } = this.#content;
    if (this.#chain === null) return [];
    const moves = new Set(driven);
    const isOld = stale || joints === null;
    return robotSolids(this.#chain, joints, (shape) => {
      if (isOld) return palette.stale;
      return shape.part === "joint" && moves.has(shape.joint) ? ORANGE : shape.colour;
    });
  }

  #drawGhost(paper: CanvasRenderingContext2D, by: Projection, palette: Palette): void {
    const { ghost } = this.#content;
    const layer = this.#layer.getContext("2d");
    if (ghost === null || this.#chain === null || layer === null) return;
    const { width, height, ratio } = this.#size;
    layer.setTransform(ratio, 0, 0, ratio, 0, 0);
    layer.clearRect(0, 0, width, height);
    const colour = verdictColour(ghost.verdict);
    const here = this.#chain.linkPoses(this.#content.joints);
    const still = linksInPlace(here, this.#chain.linkPoses(ghost.joints));
    const solids = robotSolids(this.#chain, ghost.joints, () => colour);
    const moved = solids.filter(({ links }) => links.some((link) => !still.has(link)));
    drawSolids(layer, moved, eyeOf(this.#orbit), by, palette);
    paper.save();
    paper.globalAlpha = 0.45;
    paper.setTransform(1, 0, 0, 1, 0, 0);
    paper.drawImage(this.#layer, 0, 0);
    paper.restore();
  }

  #drawFrames(paper: CanvasRenderingContext2D, by: Projection, palette: Palette): void {
    if (this.#content.frames.length === 0) return; // A font has the page's styles worked out.
    const length = 0.12 * (this.#chain?.size ?? 1);
    paper.font = "12px system-ui, sans-serif";
    paper.textBaseline = "middle";
    for (const mark of this.#content.frames) {
      AXES.forEach((colour, index) => {
        const tip = vector3([0, 0, 0].map((_, each) => (each === index ? length : 0)));
        paper.strokeStyle = colour;
        paper.lineWidth = 2.5;
        paper.beginPath();
        addLine(paper, by, mark.position, transformed(mark, tip));
        paper.stroke();
      });
      const at = by.at(mark.position);
      if (mark.name === "" || at.depth < by.near) continue;
      const width = paper.measureText(mark.name).width;
      paper.fillStyle = palette.chip;
      paper.fillRect(at.x + 6, at.y + 4, width + 8, 18);
      paper.fillStyle = palette.ink;
      paper.fillText(mark.name, at.x + 10, at.y + 13);
    }
  }

  #drawGizmo(paper: CanvasRenderingContext2D, by: Projection): void {
    const { gizmo } = this.#content;
    if (gizmo === null || gizmo === undefined) return;
    paper.lineWidth = 4;
    paper.lineCap = "round";
    for (const { axis, points } of gizmoLines(gizmo, this.#orbit, by)) {
      paper.strokeStyle = this.#grab?.axis === axis ? ORANGE : AXES[axis];
      paper.beginPath();
      points.forEach(({ x, y }, index) => (index === 0 ? paper.moveTo(x, y) : paper.lineTo(x, y)));
      paper.stroke();
      const tip = points.at(-1);
      if (gizmo.drags === "turn" || tip === undefined) continue;
      paper.fillStyle = paper.strokeStyle;
      paper.beginPath();
      if (gizmo.drags === "size") paper.rect(tip.x - 6, tip.y - 6, 12, 12);
      else paper.arc(tip.x, tip.y, 7, 0, 2 * Math.PI);
      paper.fill();
    }
    paper.lineCap = "butt";
  }

  #listen(): void {
    const { signal } = this.#listening;
    const on = <Kind extends keyof HTMLElementEventMap>(
      kind: Kind,
      act: (event: HTMLElementEventMap[Kind]) => void,
    ): void => this.#canvas.addEventListener(kind, act, { signal, passive: false });
    on("pointerdown", (event) => this.#pressed(event));
    on("pointermove", (event) => this.#dragged(event));
    on("pointerup", (event) => this.#let(event, true));
    on("pointercancel", (event) => this.#let(event, false));
    on("contextmenu", (event) => event.preventDefault());
    this.#ground.addEventListener("contextrestored", () => {
      this.#groundSeen = [];
      this.#wantFrame();
    }, { signal });
    on("wheel", (event) => {
      event.preventDefault();
      this.#zoom(Math.exp(Math.max(-100, Math.min(100, event.deltaY)) * 0.002));
    });
  }

  #place(event: PointerEvent): Flat {
    const { left, top } = this.#canvas.getBoundingClientRect();
    return { x: event.clientX - left, y: event.clientY - top };
  }

  #pressed(event: PointerEvent): void {
    this.#canvas.setPointerCapture(event.pointerId);
    const from = this.#place(event);
    const isPanning = event.button !== 0 || event.shiftKey;
    this.#pointers.set(event.pointerId, { ...from, from, isPanning });
    const { gizmo } = this.#content;
    if (gizmo !== null && gizmo !== undefined && this.#pointers.size === 1 && !isPanning) {
      const { width, height } = this.#size;
      this.#grab = grabbed(gizmo, this.#orbit, new Projection(this.#orbit, width, height), from);
      if (this.#grab !== null) this.#wantFrame();
    }
  }

  #dragged(event: PointerEvent): void {
    const pointer = this.#pointers.get(event.pointerId);
    if (pointer === undefined) return;
    const { x, y } = this.#place(event);
    if (this.#grab !== null) {
      this.#tell(this.#grab, { x, y }, false);
    } else if (this.#pointers.size === 1) {
      const move = pointer.isPanning ? shifted : orbited;
      this.#orbit = move(this.#orbit, x - pointer.x, y - pointer.y, this.#size.height);
      this.#wantFrame();
    } else {
      this.#pinch(pointer, { x, y });
    }
    Object.assign(pointer, { x, y });
  }

  #pinch(pointer: Pointer, to: Flat): void {
    const other = [...this.#pointers.values()].find((each) => each !== pointer);
    if (other === undefined) return;
    const before = Math.hypot(pointer.x - other.x, pointer.y - other.y);
    const after = Math.hypot(to.x - other.x, to.y - other.y);
    this.#zoom(before / Math.max(1, after));
    const half = [(to.x - pointer.x) / 2, (to.y - pointer.y) / 2] as const;
    this.#orbit = shifted(this.#orbit, half[0], half[1], this.#size.height);
  }

  #zoom(factor: number): void {
    this.#orbit = zoomed(this.#orbit, factor, this.#chain?.size ?? 1);
    this.#wantFrame();
  }

  #let(event: PointerEvent, isUp: boolean): void {
    const pointer = this.#pointers.get(event.pointerId);
    this.#pointers.delete(event.pointerId);
    if (pointer === undefined) return;
    const at = this.#place(event);
    if (this.#grab !== null) {
      const grab = this.#grab;
      this.#grab = null;
      // A drag that was taken away leaves the target where it was last told.
      this.#tell(grab, isUp ? at : pointer, true);
      this.#wantFrame();
    } else if (isUp && Math.hypot(at.x - pointer.from.x, at.y - pointer.from.y) <= CLICK) {
      const hit = this.#shown.filter(({ seen }) => isWithin(seen.outline, at)).at(-1);
      this.#events.picked(hit?.name ?? null);
    }
  }

  #tell(grab: Grab, at: Flat, isDone: boolean): void {
    const moved = grab.at(at);
    const name = grab.gizmo.object;
    if (name === null) this.#events.gizmoMoved(moved, isDone);
    else if (grab.gizmo.drags === "size") this.#events.objectScaled(name, grab.scale(at), isDone);
    else this.#events.objectMoved(name, moved, isDone);
  }
}

/** Return how far the lines of the floor are from one another [m]. */
function gridStep(size: number): number {
  return [0.05, 0.1, 0.25, 0.5, 1, 2.5].find((step) => size / step <= 6) ?? 5;
}

interface RobotShape {
  part: string;
  colour: string;
  /** number of the driven joint above it; -1 for none */
  joint: number;
}

function robotSolids(
  chain: Chain,
  joints: readonly number[] | null,
  colourOf: (shape: RobotShape) => string,
): Painted[] {
  const places = chain.linkPoses(joints);
  const plain = { outline: null, alpha: 1, isDashed: false, name: null };
  const bodies = chain.robot.shapes.map((shape): Painted => {
    const colour = colourOf({ ...shape, joint: linkJoint(chain, shape.link) });
    const at = solidPose(places.get(shape.link) ?? chain.root, shape);
    return { ...plain, solid: shape, at, colour, links: [shape.link] };
  });
  const struts = chain.robot.struts.map((strut): Painted => {
    const first = transformed(places.get(strut.first_link) ?? chain.root, vector3(strut.first));
    const second = transformed(places.get(strut.second_link) ?? chain.root, vector3(strut.second));
    const along = difference(second, first);
    const length = Math.max(1e-6, Math.hypot(...along));
    const middle = scaled([first[0] + second[0], first[1] + second[1], first[2] + second[2]], 0.5);
    const at = { position: middle, quaternion: zTowards(scaled(along, 1 / length)) };
    const size = [strut.diameter, strut.diameter, length];
    const joint = chain.driven.findIndex((each) => each.name === strut.name);
    const colour = colourOf({ part: "joint", colour: strut.colour, joint });
    const links = [strut.first_link, strut.second_link];
    return { ...plain, solid: { form: "cylinder", size }, at, colour, links };
  });
  return [...bodies, ...struts];
}

function objectSolid(object: SceneObject): Painted {
  const outline = object.chosen ? ORANGE : object.held ? GREEN : object.shape.colour;
  const alpha = object.shadow ? 0.12 : object.keepOut ? 0.16 : 0.72;
  return {
    solid: object.shape,
    at: pose(object.position, object.quaternion),
    colour: object.shape.colour,
    outline,
    alpha,
    isDashed: object.shadow === true,
    name: object.shadow ? null : object.name,
    links: [],
  };
}

/** Draw solids, the farthest first, and return how those with a name are seen, in that order. */
function drawSolids(
  paper: CanvasRenderingContext2D,
  painted: readonly Painted[],
  eye: Vector3,
  by: Projection,
  palette: Palette,
): { seen: Seen; name: string }[] {
  const all = painted
    .map((each) => ({ each, seen: seenSolid(each.solid, each.at, eye, by) }))
    .filter((item): item is { each: Painted; seen: Seen } => item.seen !== null)
    .sort((a, b) => b.seen.depth - a.seen.depth);
  for (const { each, seen } of all) drawSolid(paper, each, seen, palette);
  return all.flatMap(({ each, seen }) => (each.name === null ? [] : [{ seen, name: each.name }]));
}

function drawSolid(
  paper: CanvasRenderingContext2D,
  each: Painted,
  seen: Seen,
  palette: Palette,
): void {
  const outline = (): void => tracePath(paper, seen.outline);
  if (seen.across !== null) {
    const [from, to] = seen.across;
    const fill = paper.createLinearGradient(from.x, from.y, to.x, to.y);
    fill.addColorStop(0, shaded(each.colour, 0.95, each.alpha));
    fill.addColorStop(0.35, shaded(each.colour, 1.04, each.alpha));
    fill.addColorStop(1, shaded(each.colour, 0.55, each.alpha));
    paper.fillStyle = fill;
    outline();
    paper.fill();
  }
  for (const face of seen.faces) {
    paper.fillStyle = shaded(each.colour, face.light, each.alpha);
    tracePath(paper, face.points);
    paper.fill();
  }
  paper.lineWidth = each.outline === null ? 1 : 1.5;
  paper.strokeStyle = each.outline ?? palette.edge;
  paper.setLineDash(each.isDashed ? [5, 4] : []);
  outline();
  paper.stroke();
  if (each.outline !== null) {
    for (const face of seen.faces) {
      tracePath(paper, face.points);
      paper.stroke();
    }
  }
  paper.setLineDash([]);
}

function tracePath(paper: CanvasRenderingContext2D, points: readonly Flat[]): void {
  paper.beginPath();
  points.forEach(({ x, y }, index) => (index === 0 ? paper.moveTo(x, y) : paper.lineTo(x, y)));
  paper.closePath();
}

function addLine(
  paper: CanvasRenderingContext2D,
  by: Projection,
  from: Vector3,
  to: Vector3,
): void {
  const line = by.line(from, to);
  if (line === null) return;
  paper.moveTo(line[0].x, line[0].y);
  paper.lineTo(line[1].x, line[1].y);
}

/** Draw a way of points x, y, z; one that is not finite is a gap. */
function drawWay(
  paper: CanvasRenderingContext2D,
  by: Projection,
  points: Float32Array,
  colour: string,
  width: number,
  alpha: number,
): void {
  if (points.length < 6) return;
  paper.save();
  paper.strokeStyle = colour;
  paper.globalAlpha = alpha;
  paper.lineWidth = width;
  paper.lineJoin = "round";
  paper.beginPath();
  let isDown = false;
  for (let i = 0; i + 2 < points.length; i += 3) {
    const at = by.at([points[i]!, points[i + 1]!, points[i + 2]!]);
    if (!Number.isFinite(at.x + at.y) || at.depth < by.near) isDown = false;
    else if (isDown) paper.lineTo(at.x, at.y);
    else {
      paper.moveTo(at.x, at.y);
      isDown = true;
    }
  }
  paper.stroke();
  paper.restore();
}

function drawDots(paper: CanvasRenderingContext2D, by: Projection, path: Float32Array, colour: string): void {
  const dots = pathDots(path);
  paper.fillStyle = colour;
  paper.beginPath();
  for (let i = 0; i < dots.length; i += 3) {
    const { x, y, depth } = by.at([dots[i]!, dots[i + 1]!, dots[i + 2]!]);
    if (depth < by.near) continue;
    paper.moveTo(x + DOT, y);
    paper.arc(x, y, DOT, 0, 2 * Math.PI);
  }
  paper.fill();
}
