// Three plots over one time: positions, velocities and accelerations, planned solid, driven dotted,
// the limits of the chosen joint dashed and named. One cursor goes over all three.
//
// All is kept in SI units; only what is written at the axes is in degrees.
import { Chart, FONT, type Drawing, type Limit } from "./chart.ts";
import { limitsOf, type PlotJoint } from "./findings.ts";
import { extremes, seen, type Line, type Range } from "./lines.ts";
import { QUANTITIES, valueAt, type Quantity, type Samples } from "./series.ts";

/** What is written on plots, from the table of texts. */
export interface PlotWords {
  quantities: Readonly<Record<Quantity, string>>;
  /** a number as this language writes it, in at most so many digits behind the point */
  number(value: number, digits: number): string;
}

export interface PlotOptions {
  words: PlotWords;
  theme: "dark" | "light";
  /** three above one another, or side by side */
  layout: "stack" | "row";
  /** The cursor went to a time [s]; null: it left. */
  onCursor?(time: number | null): void;
}

export interface PlotContent {
  joints: readonly PlotJoint[];
  planned: Samples | null;
  driven: Samples | null;
  /** the joint that is shown against its limits; null for all alike */
  chosen: number | null;
  unit: "deg" | "rad";
}

const COLOURS = {
  dark: ["#ff7a66", "#e0b020", "#8fce3f", "#2fc4a8", "#5f9bff", "#b98aff", "#ff9fd0", "#a3b1bf"],
  light: ["#cf3a2b", "#a96800", "#4d8a12", "#0f8573", "#2463d6", "#7f3fbf", "#b8327f", "#566473"],
} as const;

const INKS = {
  dark: { ink: "#93a0ad", grid: "rgba(147, 160, 173, 0.2)", limit: "#ff8a8d", cursor: "#e9edf1" },
  light: { ink: "#566473", grid: "rgba(86, 100, 115, 0.2)", limit: "#b3151a", cursor: "#17202a" },
} as const;

const NEAREST_VIEW = 0.02; // s
const DEGREES = 180 / Math.PI;
const DOTS = [2, 4];
const PER = { positions: "", velocities: "/s", accelerations: "/s²" } as const;
/** Height of the line over a saved picture. */
const CAPTION = 28;
/** A joint that is not the chosen one. */
const FAINT = "55";

/** Return the colour of a joint's lines. */
export function jointColour(joint: number, theme: "dark" | "light"): string {
  const colours = COLOURS[theme];
  return colours[joint % colours.length] ?? colours[0];
}

export class Plots {
  readonly #host: HTMLElement;
  readonly #options: PlotOptions;
  readonly #charts: Chart[];
  readonly #titles: HTMLElement[];
  #content: PlotContent | null = null;
  #range: Range | null = null;
  #cursor: number | null = null;
  #frame = 0;

  constructor(host: HTMLElement, options: PlotOptions) {
    this.#host = host;
    this.#options = { ...options };
    host.style.display = "grid";
    host.style.gap = "4px";
    host.style.minHeight = "0";
    host.style[options.layout === "row" ? "gridTemplateColumns" : "gridTemplateRows"] =
      "repeat(3, minmax(0, 1fr))";
    this.#titles = QUANTITIES.map(() => document.createElement("h4"));
    this.#charts = this.#titles.map((title) => {
      const figure = document.createElement("div");
      Object.assign(figure.style, { display: "flex", flexDirection: "column", minHeight: "0" });
      const box = document.createElement("div");
      Object.assign(box.style, { flex: "1", minHeight: "0", overflow: "hidden" });
      Object.assign(title.style, { margin: "0 0 2px 52px", font: `600 ${FONT}` });
      figure.append(title, box);
      host.append(figure);
      const chart = new Chart(box);
      this.#listen(chart);
      return chart;
    });
  }

  show(content: PlotContent): void {
    this.#content = content;
    this.#writeTitles();
    this.#want();
  }

  /** Show a part of the time [s]; null for all. */
  setRange(range: Range | null): void {
    this.#range = range;
    this.#want();
  }

  /** Move by a share of what is seen, as a drag does. */
  pan(share: number): void {
    const [from, to] = this.#shown();
    const by = share * (to - from);
    this.setRange([from + by, to + by]);
  }

  /** Put the cursor at a time [s]; null takes it away. It is not told to `onCursor`. */
  setCursor(time: number | null): void {
    this.#cursor = time;
    for (const chart of this.#charts) chart.point(time);
  }

  setTheme(theme: "dark" | "light"): void {
    if (theme === this.#options.theme) return;
    this.#options.theme = theme;
    this.#want();
  }

  resize(): void {
    for (const chart of this.#charts) chart.resize();
    this.setCursor(this.#cursor);
  }

  /** Return what is drawn on a ground, below a line of what it is, to be saved. */
  picture(ground: string, caption: string): HTMLCanvasElement {
    const whole = document.createElement("canvas");
    const host = this.#host.getBoundingClientRect();
    const origin = new DOMRect(host.x, host.y - CAPTION, host.width, host.height + CAPTION);
    const ratio = globalThis.devicePixelRatio || 1;
    Object.assign(whole, { width: Math.round(origin.width * ratio), height: Math.round(origin.height * ratio) });
    const paper = whole.getContext("2d");
    if (paper === null) return whole;
    paper.scale(ratio, ratio);
    paper.fillStyle = ground;
    paper.fillRect(0, 0, origin.width, origin.height);
    Object.assign(paper, { font: `600 ${FONT}`, textBaseline: "top", fillStyle: INKS[this.#options.theme].cursor });
    paper.fillText(caption, 10, 8);
    for (const title of this.#titles) {
      const { left, top } = title.getBoundingClientRect();
      paper.fillText(title.textContent, left - origin.left, top - origin.top);
    }
    for (const chart of this.#charts) chart.copyTo(paper, origin);
    return whole;
  }

  dispose(): void {
    cancelAnimationFrame(this.#frame);
    this.#host.replaceChildren();
  }

  /** Draw with the next picture. */
  #want(): void {
    if (this.#frame === 0) this.#frame = requestAnimationFrame(() => this.#draw());
  }

  #draw(): void {
    this.#frame = 0;
    const content = this.#content;
    if (content === null) return;
    this.#charts.forEach((chart, index) => chart.draw(this.#drawing(content, QUANTITIES[index]!)));
    this.setCursor(this.#cursor);
  }

  #drawing(content: PlotContent, quantity: Quantity): Drawing {
    const lines = this.#lines(content, quantity);
    const limits = this.#limits(content, quantity);
    return {
      times: this.#shown(),
      heights: this.#heights(lines, limits),
      lines,
      limits,
      inks: INKS[this.#options.theme],
      factor: this.#factor(),
      written: (value) => this.#options.words.number(value, 3),
    };
  }

  #writeTitles(): void {
    const unit = this.#shownUnit();
    this.#titles.forEach((title, index) => {
      const quantity = QUANTITIES[index]!;
      title.textContent = `${this.#options.words.quantities[quantity]} ${unit}${PER[quantity]}`;
    });
  }

  /** The unit of the chosen joint, or of the first: one plot has one unit. */
  #shownUnit(): string {
    const content = this.#content;
    const joint = content?.joints[content.chosen ?? 0];
    if (joint?.unit === "m") return "mm";
    return content?.unit === "rad" ? "rad" : "°";
  }

  /** What a value is multiplied by before it is written. */
  #factor(): number {
    const unit = this.#shownUnit();
    return unit === "mm" ? 1000 : unit === "rad" ? 1 : DEGREES;
  }

  /** Return the lines of a plot: of each joint what is planned, and what was driven; the chosen one above all. */
  #lines({ joints, planned, driven, chosen }: PlotContent, quantity: Quantity): Line[] {
    const unit = joints[chosen ?? 0]?.unit;
    const order = [...joints.keys()].sort((one, other) => Number(one === chosen) - Number(other === chosen));
    return order.flatMap((index) => {
      const joint = joints[index]!;
      // One plot has one unit: lines of another are left out.
      if (joint.unit !== unit) return [];
      const isFaint = chosen !== null && chosen !== index;
      const colour = jointColour(index, this.#options.theme) + (isFaint ? FAINT : "");
      const line = (samples: Samples | null, width: number, dash: readonly number[]): Line[] => {
        const column = samples?.[quantity][index];
        return samples === null || column === undefined || column.length === 0
          ? []
          : [{ samples, column, colour, width, dash }];
      };
      // The others are shown as planned; as driven only where nothing is planned.
      const isDrivenToo = !isFaint || planned === null;
      return [...line(planned, chosen === index ? 2.2 : 1.4, []), ...(isDrivenToo ? line(driven, 1.8, DOTS) : [])];
    });
  }

  #limits({ joints, chosen }: PlotContent, quantity: Quantity): Limit[] {
    const joint = chosen === null ? undefined : joints[chosen];
    if (joint === undefined) return [];
    const unit = `${this.#shownUnit()}${PER[quantity]}`;
    return limitsOf(joint, quantity).map((value) => {
      const number = this.#options.words.number(value * this.#factor(), 1);
      return { value, text: `${joint.name} ${number}${unit.startsWith("°") ? "" : " "}${unit}` };
    });
  }

  #shown(): Range {
    if (this.#range !== null) return this.#range;
    const all = [this.#content?.planned, this.#content?.driven].map((samples) => samples?.times ?? []);
    const known = all.filter(({ length }) => length > 0);
    const [first, last] = [
      Math.min(...known.map((times) => times[0]!)),
      Math.max(...known.map((times) => times.at(-1)!)),
    ];
    if (known.length === 0) return [0, 1];
    return last > first ? [first, last] : [first, first + 1];
  }

  /** Return the range of values that is shown: that of the lines, and their limits. */
  #heights(lines: readonly Line[], limits: readonly Limit[]): Range {
    const bounds = lines.flatMap(({ samples, column }) => extremes(column, ...seen(samples.times, ...this.#shown())));
    const finite = bounds.filter(Number.isFinite);
    const values = finite.length > 0 ? finite : [-1, 1];
    values.push(...limits.map(({ value }) => value).filter(Number.isFinite));
    const [low, high] = [Math.min(...values), Math.max(...values)];
    const edge = Math.max(0.05 * (high - low), 1e-4);
    return [low - edge, high + edge];
  }

  /** The pointer leads the cursor, a drag pans, the wheel zooms about it, a double click shows all. */
  #listen(chart: Chart): void {
    const { over } = chart;
    const timeAt = ({ clientX }: MouseEvent): number => chart.timeAt(clientX - over.getBoundingClientRect().left);
    let from: { x: number; range: Range } | null = null;
    over.addEventListener("pointerdown", (event) => {
      over.setPointerCapture(event.pointerId);
      from = { x: event.clientX, range: this.#shown() };
    });
    over.addEventListener("pointermove", (event) => {
      this.#cursorWent(timeAt(event));
      if (from === null) return;
      const [low, high] = from.range;
      const by = ((from.x - event.clientX) / Math.max(1, over.clientWidth)) * (high - low);
      if (Math.abs(event.clientX - from.x) > 3) this.setRange([low + by, high + by]);
    });
    for (const kind of ["pointerup", "pointercancel"] as const) {
      over.addEventListener(kind, () => (from = null));
    }
    over.addEventListener("pointerleave", () => this.#cursorWent(null));
    over.addEventListener("dblclick", () => this.setRange(null));
    over.addEventListener("wheel", (event) => {
      event.preventDefault();
      const time = timeAt(event);
      const factor = Math.exp(Math.max(-100, Math.min(100, event.deltaY)) * 0.002);
      const [low, high] = this.#shown();
      if ((high - low) * factor < NEAREST_VIEW) return;
      this.setRange([time - (time - low) * factor, time + (high - time) * factor]);
    }, { passive: false });
  }

  #cursorWent(time: number | null): void {
    this.setCursor(time);
    this.#options.onCursor?.(time);
  }
}

/** What each joint has at a time, for the table beside the plots; null where nothing is known. */
export function valuesAt(samples: Samples, time: number): Record<Quantity, (number | null)[]> {
  const all = (quantity: Quantity): (number | null)[] =>
    samples[quantity].map((column) => valueAt(samples, column, time));
  return {
    positions: all("positions"),
    velocities: all("velocities"),
    accelerations: all("accelerations"),
  };
}
