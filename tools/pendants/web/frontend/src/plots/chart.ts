// One plot over time on a canvas: axes, lines, limits, and a cursor above it.
//
// Is told what to draw, and draws it at once; all is in points of the page, times in seconds.
import { linePath, type Area, type Line, type Range } from "./lines.ts";
import { valueAt } from "./series.ts";
import { evenSteps } from "./steps.ts";

export interface Inks {
  ink: string;
  grid: string;
  limit: string;
  cursor: string;
}

export interface Limit {
  value: number;
  text: string;
}

export interface Drawing {
  times: Range;
  heights: Range;
  lines: readonly Line[];
  /** from below and from above */
  limits: readonly Limit[];
  inks: Inks;
  /** what a value is multiplied by before it is written */
  factor: number;
  /** a number as it is written at an axis */
  written(value: number): string;
}

export const FONT = "12px system-ui, sans-serif";
/** Room for what is written at the axes, and at the other two sides. */
const [LEFT, BELOW, ABOVE, RIGHT] = [52, 24, 6, 18];
const GAP = 5;
/** Room for a time and its unit. */
const TIME_WIDTH = 80;
const LIMIT_DASH = [6, 4];
/** Between two limits, so that both names are within. */
const ROOMY = 40;

export class Chart {
  /** What is pointed at, over the lines. */
  readonly over = document.createElement("div");
  readonly #box: HTMLElement;
  readonly #canvas = document.createElement("canvas");
  readonly #cursor = document.createElement("div");
  #drawing: Drawing | null = null;
  #area: Area = { left: LEFT, top: ABOVE, width: 0, height: 0 };

  constructor(box: HTMLElement) {
    this.#box = box;
    box.style.position = "relative";
    this.over.className = "plot-over";
    Object.assign(this.over.style, { position: "absolute", overflow: "hidden", touchAction: "none" });
    this.#cursor.className = "plot-cursor";
    Object.assign(this.#cursor.style, { position: "absolute", height: "100%", borderLeft: "1.5px solid" });
    this.#cursor.hidden = true;
    this.over.append(this.#cursor);
    box.append(this.#canvas, this.over);
    this.resize();
  }

  /** Fit a box of another size. */
  resize(): void {
    const [whole, high] = [Math.max(80, this.#box.clientWidth), Math.max(60, this.#box.clientHeight)];
    const ratio = globalThis.devicePixelRatio || 1;
    Object.assign(this.#canvas, { width: Math.round(whole * ratio), height: Math.round(high * ratio) });
    Object.assign(this.#canvas.style, { display: "block", width: `${whole}px`, height: `${high}px` });
    this.#area = { left: LEFT, top: ABOVE, width: whole - LEFT - RIGHT, height: high - ABOVE - BELOW };
    const { left, top, width, height } = this.#area;
    Object.assign(this.over.style, { left: `${left}px`, top: `${top}px`, width: `${width}px`, height: `${height}px` });
    if (this.#drawing !== null) this.draw(this.#drawing);
  }

  draw(drawing: Drawing): void {
    this.#drawing = drawing;
    const paper = this.#canvas.getContext("2d");
    if (paper === null) return;
    const ratio = globalThis.devicePixelRatio || 1;
    paper.setTransform(ratio, 0, 0, ratio, 0, 0);
    paper.clearRect(0, 0, this.#canvas.width, this.#canvas.height);
    paper.font = FONT;
    this.#drawAxes(paper, drawing);
    this.#drawLines(paper, drawing);
    this.#drawLimits(paper, drawing);
  }

  /** Copy what is drawn to a paper whose left upper corner is there. */
  copyTo(paper: CanvasRenderingContext2D, origin: DOMRect): void {
    const { left, top, width, height } = this.#canvas.getBoundingClientRect();
    paper.drawImage(this.#canvas, left - origin.left, top - origin.top, width, height);
  }

  /** Put the cursor at a time, with a dot on each line; null takes it away. */
  point(time: number | null): void {
    const { left, width } = this.#area;
    const at = time === null || this.#drawing === null ? -1 : this.#across(time) - left;
    this.#cursor.hidden = !(at >= 0 && at <= width);
    if (time === null || this.#drawing === null || this.#cursor.hidden) return;
    this.#cursor.style.transform = `translateX(${at}px)`;
    this.#cursor.style.color = this.#drawing.inks.cursor;
    this.#cursor.replaceChildren(...this.#drawing.lines.flatMap((line) => this.#dot(line, time)));
  }

  /** Return the time at so many points from the left of what is pointed at. */
  timeAt(x: number): number {
    const [from, to] = this.#drawing?.times ?? [0, 1];
    return from + (x / this.#area.width) * (to - from);
  }

  #dot({ samples, column, colour }: Line, time: number): HTMLElement[] {
    const value = valueAt(samples, column, time);
    if (value === null) return [];
    const dot = document.createElement("i");
    const place = { position: "absolute", left: "-5px", top: `${this.#down(value) - this.#area.top - 4}px` };
    Object.assign(dot.style, { ...place, width: "8px", height: "8px", borderRadius: "50%", background: colour });
    return [dot];
  }

  #across(time: number): number {
    const [from, to] = this.#drawing?.times ?? [0, 1];
    return this.#area.left + ((time - from) / (to - from)) * this.#area.width;
  }

  #down(value: number): number {
    const [low, high] = this.#drawing?.heights ?? [0, 1];
    return this.#area.top + ((high - value) / (high - low)) * this.#area.height;
  }

  #drawAxes(paper: CanvasRenderingContext2D, { times, heights, inks, factor, written }: Drawing): void {
    const { left, top, width, height } = this.#area;
    Object.assign(paper, { strokeStyle: inks.grid, fillStyle: inks.ink, lineWidth: 1 });
    paper.beginPath();
    Object.assign(paper, { textAlign: "center", textBaseline: "top" });
    for (const time of evenSteps(...times, 1, Math.max(2, Math.floor(width / TIME_WIDTH)))) {
      const x = Math.round(this.#across(time)) + 0.5;
      paper.moveTo(x, top);
      paper.lineTo(x, top + height);
      paper.fillText(`${written(time)} s`, x, top + height + GAP);
    }
    Object.assign(paper, { textAlign: "right", textBaseline: "middle" });
    for (const value of evenSteps(...heights, factor)) {
      const y = Math.round(this.#down(value)) + 0.5;
      paper.moveTo(left, y);
      paper.lineTo(left + width, y);
      paper.fillText(written(value * factor), left - GAP, y);
    }
    paper.stroke();
  }

  #drawLines(paper: CanvasRenderingContext2D, { lines, times, heights }: Drawing): void {
    const { left, top, width, height } = this.#area;
    for (const line of lines) {
      const { path, dash, known } = linePath(line, this.#area, times, heights);
      paper.save();
      paper.beginPath();
      paper.rect(left, top, width, height);
      paper.clip();
      if (known !== null) paper.clip(known);
      Object.assign(paper, { strokeStyle: line.colour, lineWidth: line.width, lineJoin: "round" });
      paper.setLineDash(dash);
      paper.stroke(path);
      paper.restore();
    }
  }

  #drawLimits(paper: CanvasRenderingContext2D, { limits, inks }: Drawing): void {
    const { left, width } = this.#area;
    const [lowest = 0, highest = 0] = limits.map(({ value }) => this.#down(value));
    // Within the range where there is room for both names, else outside of it.
    const isRoomy = Math.abs(lowest - highest) > ROOMY;
    Object.assign(paper, { strokeStyle: inks.limit, fillStyle: inks.limit, lineWidth: 1.2, textAlign: "right" });
    paper.setLineDash(LIMIT_DASH);
    for (const [index, { value, text }] of limits.entries()) {
      if (!Number.isFinite(value)) continue;
      const y = this.#down(value);
      paper.beginPath();
      paper.moveTo(left, y);
      paper.lineTo(left + width, y);
      paper.stroke();
      const isBelow = (index === 1) === isRoomy;
      paper.textBaseline = isBelow ? "top" : "bottom";
      paper.fillText(text, left + width - 4, y + (isBelow ? 4 : -4));
    }
    paper.setLineDash([]);
  }
}
