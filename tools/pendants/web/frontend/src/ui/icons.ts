// Icons, as lines in a square of 24.

const PATHS = {
  jog: "M12 3v18M3 12h18M12 3l-3 3M12 3l3 3M12 21l-3-3M12 21l3-3M3 12l3-3M3 12l3 3M21 12l-3-3M21 12l-3 3",
  teach: "M9 6h12M9 12h12M9 18h12M4 6h.01M4 12h.01M4 18h.01",
  plan: "M6 19a2 2 0 1 0 0-4 2 2 0 0 0 0 4zM18 9a2 2 0 1 0 0-4 2 2 0 0 0 0 4zM8 17h8a3.5 3.5 0 0 0 0-7H8a3.5 3.5 0 0 1 0-7h8",
  scene: "M12 3l8 4.5v9L12 21l-8-4.5v-9zM12 12l8-4.5M12 12v9M12 12L4 7.5",
  frames: "M6 4v14h14M6 18l9-9M15 9h-4M15 9v4",
  plots: "M4 4v16h16M7 15l4-6 4 4 5-7",
  packets: "M4 8h14l-3-3M20 16H6l3 3",
  keypad: "M5 3h14v18H5zM8 6h8v3H8zM9 13h.01M12 13h.01M15 13h.01M9 17h.01M12 17h.01M15 17h.01",
  log: "M6 3h12v18H6zM9 8h6M9 12h6M9 16h4",
  hand: "M8 12V6a1.5 1.5 0 0 1 3 0v5M11 11V4.5a1.5 1.5 0 0 1 3 0V11M14 11V6a1.5 1.5 0 0 1 3 0v8a7 7 0 0 1-7 7c-3 0-4-1.500-6-5l-1-2a1.500 1.500 0 0 1 2.600-1.400L8 15",
  check: "M5 12l5 5L19 7",
  warning: "M12 4l9 16H3zM12 10v4M12 17h.01",
  link: "M9 15l6-6M10 6l2-2a4 4 0 0 1 6 6l-2 2M14 18l-2 2a4 4 0 0 1-6-6l2-2",
  minus: "M6 12h12",
  plus: "M6 12h12M12 6v12",
  undo: "M9 7L4 12l5 5M4 12h10a6 6 0 0 1 0 12",
  home: "M4 11l8-7 8 7M6 10v10h12V10",
  eye: "M2 12s4-7 10-7 10 7 10 7-4 7-10 7S2 12 2 12zM12 15a3 3 0 1 0 0-6 3 3 0 0 0 0 6z",
  box: "M12 3l8 4.5v9L12 21l-8-4.5v-9z",
  stop: "M7 7h10v10H7z",
  cross: "M6 6l12 12M18 6L6 18",
  play: "M8 5l11 7-11 7z",
  pause: "M8 5v14M16 5v14",
  step: "M5 5l9 7-9 7zM19 5v14",
  back: "M19 5l-9 7 9 7zM5 5v14",
  redo: "M15 7l5 5-5 5M20 12H10a6 6 0 0 0 0 12",
  up: "M6 15l6-6 6 6",
  down: "M6 9l6 6 6-6",
  robot: "M5 21h10M10 21v-5l-4-6 8-5 5 3M6 10h.01M14 5h.01",
} as const;

export type IconName = keyof typeof PATHS;

/** Return an icon that a screen reader leaves out. */
export function icon(name: IconName): SVGSVGElement {
  const space = "http://www.w3.org/2000/svg";
  const svg = document.createElementNS(space, "svg");
  svg.setAttribute("viewBox", "0 0 24 24");
  svg.setAttribute("class", "icon");
  svg.setAttribute("aria-hidden", "true");
  const path = document.createElementNS(space, "path");
  path.setAttribute("d", PATHS[name]);
  svg.append(path);
  return svg;
}
