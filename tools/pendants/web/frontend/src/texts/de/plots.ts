import type { PlotTexts } from "../plots.ts";

export const plotsDe: PlotTexts = {
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
