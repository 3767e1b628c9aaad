// Colours of the views: those of the page's look, for both themes, and shading.

export type Theme = "dark" | "light";

export interface Palette {
  /** middle and edge of the ground behind all */
  ground: readonly [string, string];
  grid: string;
  ink: string;
  muted: string;
  /** behind names */
  chip: string;
  /** an old robot, whose values are not known now */
  stale: string;
  edge: string;
}

export const PALETTES: Readonly<Record<Theme, Palette>> = {
  dark: {
    ground: ["#323e49", "#171c21"],
    grid: "#3f4d5a",
    ink: "#e9edf1",
    muted: "#93a0ad",
    chip: "rgba(19, 23, 27, 0.82)",
    stale: "#6f7a85",
    edge: "rgba(10, 13, 16, 0.45)",
  },
  light: {
    ground: ["#fbfcfd", "#dbe2e9"],
    grid: "#bcc8d3",
    ink: "#17202a",
    muted: "#566473",
    chip: "rgba(255, 255, 255, 0.86)",
    stale: "#a3adb7",
    edge: "rgba(23, 32, 42, 0.4)",
  },
};

export const ORANGE = "#f28c28";
export const GREEN = "#2fb573";
export const BLUE = "#4c8dff";
export const RED = "#e5484d";
/** Of x, y and z, in every picture. */
export const AXES = ["#e5484d", "#3fbf5f", "#4c8dff"] as const;

const VERDICTS = { good: BLUE, reached: GREEN, bad: RED };

export function verdictColour(verdict: keyof typeof VERDICTS): string {
  return VERDICTS[verdict];
}

type Rgb = readonly [number, number, number];

/** Return red, green, blue of `#rrggbb`; a middle grey of anything else. */
export function rgb(colour: string): Rgb {
  const found = /^#([0-9a-f]{2})([0-9a-f]{2})([0-9a-f]{2})$/i.exec(colour);
  if (found === null) return [144, 152, 160];
  const [, red = "", green = "", blue = ""] = found;
  return [Number.parseInt(red, 16), Number.parseInt(green, 16), Number.parseInt(blue, 16)];
}

/** Return the colour in a light of this strength; 1 leaves it as it is. */
export function shaded(colour: string, light: number, alpha = 1): string {
  const [red, green, blue] = rgb(colour).map((each) =>
    Math.round(Math.min(255, Math.max(0, each * light))),
  );
  return alpha >= 1 ? `rgb(${red} ${green} ${blue})` : `rgb(${red} ${green} ${blue} / ${alpha})`;
}
