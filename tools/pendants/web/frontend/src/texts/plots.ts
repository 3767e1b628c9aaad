// The words of the plots, in each language.
import type { Language } from "./texts.ts";

const en = {
  positions: "Position",
  velocities: "Velocity",
  accelerations: "Acceleration",
  planned: "planned",
  driven: "driven",
  limit: "limit",
  oneJoint: "One joint",
  allJoints: "All joints",
  joint: "Joint",
  atTime: (seconds: string) => `At ${seconds} s`,
  pointAtPlots: "Point at a plot to read it.",
  howClose: "How close to the limits",
  worstAt: (joint: string, seconds: string) => `${joint}, ${seconds} s`,
  against: "Planned against driven",
  largestDifference: "largest difference",
  where: "where",
  controllerDelay: "delay of the controller",
  noPlan: "No plan is known for this motion: it is shown as it was driven.",
  planOf: (plan: number, seconds: string) => `plan ${plan}, ${seconds} s`,
  howMade: (milliseconds: string) =>
    `A driven sample every ${milliseconds} ms. Acceleration of the driven motion is a difference of two speeds.`,
  saveCsv: "Save as CSV",
  fit: "Show all",
  hold: "Hold the picture",
  goOn: "Go on",
};

export type PlotTexts = typeof en;

const de: PlotTexts = {
  positions: "Stellung",
  velocities: "Geschwindigkeit",
  accelerations: "Beschleunigung",
  planned: "geplant",
  driven: "gefahren",
  limit: "Grenze",
  oneJoint: "Eine Achse",
  allJoints: "Alle Achsen",
  joint: "Achse",
  atTime: (seconds) => `Bei ${seconds} s`,
  pointAtPlots: "Auf eine Kurve zeigen, um sie abzulesen.",
  howClose: "Abstand zu den Grenzen",
  worstAt: (joint, seconds) => `${joint}, ${seconds} s`,
  against: "Geplant gegen gefahren",
  largestDifference: "größte Abweichung",
  where: "wo",
  controllerDelay: "Verzug der Steuerung",
  noPlan: "Zu dieser Bewegung ist kein Plan bekannt: gezeigt wird sie, wie sie gefahren wurde.",
  planOf: (plan, seconds) => `Plan ${plan}, ${seconds} s`,
  howMade: (milliseconds) =>
    `Alle ${milliseconds} ms ein gefahrener Wert. Die gefahrene Beschleunigung ist die Differenz zweier Geschwindigkeiten.`,
  saveCsv: "Als CSV speichern",
  fit: "Alles zeigen",
  hold: "Bild anhalten",
  goOn: "Weiter",
};

export const plotTexts: Readonly<Record<Language, PlotTexts>> = { en, de };
