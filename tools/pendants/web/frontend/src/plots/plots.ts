// Three plots over one time: positions, velocities and accelerations, planned solid, driven dotted,
// the limits of the chosen joint dashed and named. One cursor goes over all three.
//
// All is kept in SI units; only what is written at the axes is in degrees.
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";

import { limitsOf, type PlotJoint } from "./findings.ts";
import { extremes, linePath, seen } from "./lines.ts";
import {
  joinedTimes,
  QUANTITIES,
  spread,
  valueAt,
  type Gap,
  type Quantity,
  type Samples,
} from "./series.ts";
import { evenSteps } from "./steps.ts";

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

const FONT = "12px system-ui, sans-serif";
const NEAREST_VIEW = 0.02; // s
const DEGREES = 180 / Math.PI;
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
  readonly #boxes: HTMLElement[];
  readonly #titles: HTMLElement[];
  #plots: uPlot[] = [];
  #content: PlotContent | null = null;
  #gaps: { planned: Gap[]; driven: Gap[] } = { planned: [], driven: [] };
  #range: readonly [number, number] | null = null;
  #times: Float64Array = new Float64Array();
  #cursor: number | null = null;
  #isTelling = false;

  constructor(host: HTMLElement, options: PlotOptions) {
    this.#host = host;
    this.#options = { ...options };
    host.style.display = "grid";
    host.style.gap = "4px";
    host.style.minHeight = "0";
    host.style[options.layout === "row" ? "gridTemplateColumns" : "gridTemplateRows"] =
      "repeat(3, minmax(0, 1fr))";
    this.#titles = QUANTITIES.map(() => document.createElement("h4"));
    this.#boxes = QUANTITIES.map((_, index) => {
      const figure = document.createElement("div");
      Object.assign(figure.style, { display: "flex", flexDirection: "column", minHeight: "0" });
      const box = document.createElement("div");
      Object.assign(box.style, { flex: "1", minHeight: "0", overflow: "hidden" });
      const title = this.#titles[index]!;
      Object.assign(title.style, { margin: "0 0 2px 52px", font: `600 ${FONT}` });
      figure.append(title, box);
      host.append(figure);
      return box;
    });
  }

  /** Show this; only what changed in kind makes the plots anew. */
  show(content: PlotContent): void {
    const before = this.#content;
    this.#content = content;
    const isAlike =
      before !== null &&
      before.joints === content.joints &&
      before.chosen === content.chosen &&
      before.unit === content.unit &&
      (before.planned === null) === (content.planned === null) &&
      (before.driven === null) === (content.driven === null);
    const data = this.#data(content);
    if (isAlike && this.#plots.length > 0) {
      this.#plots.forEach((plot, index) => plot.setData(data[index]!, false));
      this.#rescale();
    } else {
      this.#make(data);
    }
  }

  /** Show a part of the time [s]; null for all. */
  setRange(range: readonly [number, number] | null): void {
    this.#range = range;
    this.#rescale();
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
    this.#isTelling = true;
    for (const plot of this.#plots) placeCursor(plot, time);
    this.#isTelling = false;
  }

  setTheme(theme: "dark" | "light"): void {
    if (theme === this.#options.theme) return;
    this.#options.theme = theme;
    if (this.#content !== null) this.#make(this.#data(this.#content));
  }

  resize(): void {
    this.#plots.forEach((plot, index) => plot.setSize(sizeOf(this.#boxes[index]!)));
  }

  dispose(): void {
    for (const plot of this.#plots) plot.destroy();
    this.#plots = [];
    this.#host.replaceChildren();
  }

  /** Return the columns of each plot: the times, then of each joint the planned and the driven. */
  #data({ joints, planned, driven }: PlotContent): uPlot.AlignedData[] {
    const none = new Float64Array();
    const [one, other] = [planned?.times ?? none, driven?.times ?? none];
    this.#times = sameTimes(one, other) ? one : joinedTimes(one, other);
    this.#gaps = {
      planned: planned === null ? [] : unknown(planned),
      driven: driven === null ? [] : unknown(driven),
    };
    return QUANTITIES.map((quantity) => [
      this.#times,
      ...joints.flatMap((_, joint) =>
        [planned, driven].flatMap((samples) => {
          const column = samples?.[quantity][joint];
          if (samples === null || column === undefined || column.length === 0) return [];
          return [spread(this.#times, samples.times, column)];
        }),
      ),
    ]);
  }

  #make(data: uPlot.AlignedData[]): void {
    for (const plot of this.#plots) plot.destroy();
    this.#writeTitles();
    this.#plots = QUANTITIES.map((quantity, index) => {
      const box = this.#boxes[index]!;
      const plot = new uPlot(this.#uplotOptions(quantity, box), data[index]!, box);
      this.#listen(plot);
      return plot;
    });
    this.#rescale();
  }

  #writeTitles(): void {
    const unit = this.#shownUnit();
    this.#titles.forEach((title, index) => {
      const quantity = QUANTITIES[index]!;
      const per = { positions: "", velocities: "/s", accelerations: "/s²" }[quantity];
      title.textContent = `${this.#options.words.quantities[quantity]} ${unit}${per}`;
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

  #uplotOptions(quantity: Quantity, box: HTMLElement): uPlot.Options {
    const inks = INKS[this.#options.theme];
    const axis: uPlot.Axis = {
      stroke: inks.ink,
      font: FONT,
      grid: { stroke: inks.grid, width: 1 },
      ticks: { show: false },
    };
    return {
      ...sizeOf(box),
      legend: { show: false },
      padding: [6, 18, 0, 0],
      cursor: {
        y: false,
        drag: { x: false, y: false },
        points: { size: 8 },
        dataIdx: (_plot, _line, index) => index,
      },
      scales: {
        x: { time: false, range: () => [...this.#shown()] },
        y: { range: (plot) => this.#heights(quantity, plot) },
      },
      axes: [
        {
          ...axis,
          size: 24,
          values: (_, splits) => splits.map((each) => `${this.#written(each)} s`),
        },
        {
          ...axis,
          size: 52,
          splits: (_plot, _axis, least, most) => evenSteps(least, most, this.#factor()),
          values: (_, splits) => splits.map((each) => this.#written(each * this.#factor())),
        },
      ],
      series: [{}, ...this.#series()],
      hooks: {
        draw: [(plot) => this.#drawLimits(plot, quantity)],
        setCursor: [(plot) => this.#cursorWent(plot)],
      },
    };
  }

  #series(): uPlot.Series[] {
    const content = this.#content;
    if (content === null) return [];
    return content.joints.flatMap((joint, index) => {
      const isFaint = content.chosen !== null && content.chosen !== index;
      // One plot has one unit: lines of another are left out.
      const show = joint.unit === (content.joints[content.chosen ?? 0]?.unit ?? joint.unit);
      const colour = jointColour(index, this.#options.theme);
      const plain: uPlot.Series = {
        show,
        auto: false,
        label: joint.name,
        stroke: isFaint ? colour + FAINT : colour,
        width: content.chosen === index ? 2.2 : 1.4,
        points: { show: false },
      };
      const planned: uPlot.Series = { ...plain, paths: this.#pathsOf("planned", []) };
      const driven: uPlot.Series = { ...plain, paths: this.#pathsOf("driven", [2, 4]), width: 1.8 };
      // The others are shown as planned; as driven only where nothing is planned.
      if (isFaint && content.planned !== null) driven.show = false;
      return [
        ...(content.planned === null ? [] : [planned]),
        ...(content.driven === null ? [] : [driven]),
      ];
    });
  }

  #pathsOf(kind: "planned" | "driven", dash: number[]): uPlot.Series.PathBuilder {
    return (plot, line) => linePath(plot, line, this.#gaps[kind], dash);
  }

  #written(value: number): string {
    return this.#options.words.number(value, 3);
  }

  #shown(): readonly [number, number] {
    if (this.#range !== null) return this.#range;
    const [first, last] = [this.#times[0] ?? 0, this.#times.at(-1) ?? 1];
    return last > first ? [first, last] : [first, first + 1];
  }

  /** Return the range of values that is shown: that of the lines, and the limits near them. */
  #heights(quantity: Quantity, plot: uPlot): [number, number] {
    const content = this.#content;
    const joint = content === null || content.chosen === null ? null : content.joints[content.chosen];
    const [first, last] = seen(this.#times, ...this.#shown());
    let [low, high] = [Infinity, -Infinity];
    plot.series.forEach(({ show }, line) => {
      if (line === 0 || show !== true) return;
      const [least, most] = extremes(plot.data[line] as unknown as Float32Array, first, last);
      [low, high] = [Math.min(low, least), Math.max(high, most)];
    });
    if (low > high) [low, high] = [-1, 1];
    if (joint !== null && joint !== undefined) {
      for (const limit of limitsOf(joint, quantity)) {
        if (!Number.isFinite(limit)) continue;
        [low, high] = [Math.min(low, limit), Math.max(high, limit)];
      }
    }
    const edge = Math.max(0.05 * (high - low), 1e-4);
    return [low - edge, high + edge];
  }

  #drawLimits(plot: uPlot, quantity: Quantity): void {
    const content = this.#content;
    const joint = content === null || content.chosen === null ? undefined : content.joints[content.chosen];
    if (joint === undefined) return;
    const { ctx, bbox } = plot;
    const ratio = globalThis.devicePixelRatio || 1;
    const { limit: colour } = INKS[this.#options.theme];
    const per = { positions: "", velocities: "/s", accelerations: "/s²" }[quantity];
    ctx.save();
    Object.assign(ctx, { strokeStyle: colour, fillStyle: colour, lineWidth: 1.2 * ratio });
    Object.assign(ctx, { textAlign: "right", font: `${12 * ratio}px system-ui, sans-serif` });
    const limits = limitsOf(joint, quantity);
    const [lowest, highest] = limits.map((each) => plot.valToPos(each, "y", true));
    // Within the range where there is room for both names, else outside of it.
    const isRoomy = Math.abs((lowest ?? 0) - (highest ?? 0)) > 40 * ratio;
    for (const [index, limit] of limits.entries()) {
      if (!Number.isFinite(limit)) continue;
      const y = plot.valToPos(limit, "y", true);
      ctx.setLineDash([6 * ratio, 4 * ratio]);
      ctx.beginPath();
      ctx.moveTo(bbox.left, y);
      ctx.lineTo(bbox.left + bbox.width, y);
      ctx.stroke();
      const isBelow = (index === 1) === isRoomy;
      ctx.textBaseline = isBelow ? "top" : "bottom";
      const unit = `${this.#shownUnit()}${per}`;
      const value = this.#options.words.number(limit * this.#factor(), 1);
      const text = `${joint.name} ${value}${unit.startsWith("°") ? "" : " "}${unit}`;
      ctx.fillText(text, bbox.left + bbox.width - 4 * ratio, y + (isBelow ? 4 : -4) * ratio);
    }
    ctx.restore();
  }

  #rescale(): void {
    const [min, max] = this.#shown();
    for (const plot of this.#plots) plot.setScale("x", { min, max });
    // uPlot takes the scale with the next microtask; only then is the time at its place.
    queueMicrotask(() => this.setCursor(this.#cursor));
  }

  #cursorWent(plot: uPlot): void {
    // uPlot tells of its own first drawing, too; only a pointer leads the cursor.
    if (this.#isTelling || (plot.cursor.event ?? null) === null) return;
    const { left } = plot.cursor;
    const time = left === undefined || left < 0 ? null : plot.posToVal(left, "x");
    this.#cursor = time;
    this.#isTelling = true;
    for (const other of this.#plots) if (other !== plot) placeCursor(other, time);
    this.#isTelling = false;
    this.#options.onCursor?.(time);
  }

  /** A drag pans, the wheel zooms about the pointer, a double click shows all. */
  #listen(plot: uPlot): void {
    const { over } = plot;
    over.style.touchAction = "none";
    for (const line of over.querySelectorAll<HTMLElement>(".u-cursor-x")) {
      line.style.borderRight = `1.5px solid ${INKS[this.#options.theme].cursor}`;
    }
    let from: { x: number; range: readonly [number, number] } | null = null;
    over.addEventListener("pointerdown", (event) => {
      over.setPointerCapture(event.pointerId);
      from = { x: event.clientX, range: this.#shown() };
    });
    over.addEventListener("pointermove", (event) => {
      if (from === null) return;
      const [low, high] = from.range;
      const by = ((from.x - event.clientX) / Math.max(1, over.clientWidth)) * (high - low);
      if (Math.abs(event.clientX - from.x) > 3) this.setRange([low + by, high + by]);
    });
    for (const kind of ["pointerup", "pointercancel"] as const) {
      over.addEventListener(kind, () => (from = null));
    }
    over.addEventListener("dblclick", () => this.setRange(null));
    over.addEventListener("wheel", (event) => {
      event.preventDefault();
      const time = plot.posToVal(event.clientX - over.getBoundingClientRect().left, "x");
      const factor = Math.exp(Math.max(-100, Math.min(100, event.deltaY)) * 0.002);
      const [low, high] = this.#shown();
      if ((high - low) * factor < NEAREST_VIEW) return;
      this.setRange([time - (time - low) * factor, time + (high - time) * factor]);
    }, { passive: false });
  }
}

function sizeOf(box: HTMLElement): { width: number; height: number } {
  return { width: Math.max(80, box.clientWidth), height: Math.max(60, box.clientHeight) };
}

function placeCursor(plot: uPlot, time: number | null): void {
  const left = time === null ? -10 : plot.valToPos(time, "x");
  plot.setCursor({ left, top: 1 }, false);
}

function sameTimes(one: Float64Array, other: Float64Array): boolean {
  return one.length === other.length && one.every((time, index) => time === other[index]);
}

/** Return the times of which a motion knows nothing: its gaps, and all before and behind. */
function unknown({ times, gaps }: Samples): Gap[] {
  const [first, last] = [times[0] ?? 0, times.at(-1) ?? 0];
  return [[Number.NEGATIVE_INFINITY, first], ...gaps, [last, Number.POSITIVE_INFINITY]];
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
