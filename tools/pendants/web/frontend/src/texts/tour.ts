// The words of the tour, in each language.
import type { LeftOut, StepKind } from "../tour/tour.ts";
import type { Language } from "./texts.ts";

const en = {
  title: "Tour",
  what: "The robot shows what it can: every joint alone, a straight line of the tool and back, then a circle without a stop. It takes half a minute. Watch it beside this list.",
  begin: "Begin the tour",
  again: "Once more",
  end: "End the tour",
  leave: "Back to jogging",
  needsControl: "First take control. The tour moves the robot as you would, and asks for nothing else.",
  needsEnabling: "In T1 keep the enabling device held while it moves: hold V, or tap the pad to keep it. It ends when you let go.",
  needsPeace: "Something keeps the robot from moving. The list of steps says what.",
  sure: "Begin: the real robot moves",
  freely: "In Automatic nothing has to be held. STOP, or End the tour, stops it at any moment.",
  steps: {
    joint: (name: string) => `Joint ${name} alone`,
    back: () => "Back to where it began",
    line: () => "A straight line of the tool",
    lineBack: () => "The same line back",
    bend: () => "Bending the arm, to have room for a line",
    poses: (_name: string, count: number) => `A path of ${count} places of the tool, without a stop`,
    positions: (_name: string, count: number) => `A path of ${count} joint positions, without a stop`,
  } satisfies Record<StepKind, (name: string, count: number) => string>,
  now: "now",
  took: (seconds: string) => `${seconds} s`,
  leftOut: {
    joint: (name: string) => `Left out: joint ${name} alone. Neither way is free.`,
    line: () => "Left out: a straight line. None is in reach.",
    circle: () => "Left out: a circle. None is in reach.",
    path: () => "Left out: a path. No joint may move.",
  } satisfies Record<LeftOut["kind"], (name: string) => string>,
  done: (count: number) => `That was the tour, in ${count} motions. The robot is yours: jog, teach, plan.`,
  ended: "The tour was ended. The robot stands.",
  endedBy: (why: string) => `The tour ended: ${why}`,
};

export type TourTexts = typeof en;

const de: TourTexts = {
  title: "Rundgang",
  what: "Der Roboter zeigt, was er kann: jede Achse allein, eine gerade Linie des Werkzeugs und zurück, dann einen Kreis ohne Halt. Das dauert eine halbe Minute. Sehen Sie neben dieser Liste zu.",
  begin: "Rundgang beginnen",
  again: "Noch einmal",
  end: "Rundgang beenden",
  leave: "Zurück zum Handbetrieb",
  needsControl: "Übernehmen Sie zuerst die Steuerung. Der Rundgang bewegt den Roboter wie Sie, und verlangt nichts weiter.",
  needsEnabling: "In T1 bleibt die Zustimmung gehalten, solange er fährt: V halten, oder das Feld antippen. Loslassen beendet den Rundgang.",
  needsPeace: "Etwas hindert den Roboter an der Bewegung. Die Liste der Schritte sagt, was.",
  sure: "Beginnen: der echte Roboter fährt",
  freely: "In Automatik muss nichts gehalten werden. STOP, oder Rundgang beenden, hält ihn jederzeit an.",
  steps: {
    joint: (name) => `Achse ${name} allein`,
    back: () => "Zurück an den Anfang",
    line: () => "Eine gerade Linie des Werkzeugs",
    lineBack: () => "Dieselbe Linie zurück",
    bend: () => "Arm beugen, um Platz für eine Linie zu haben",
    poses: (_name, count) => `Eine Bahn durch ${count} Orte des Werkzeugs, ohne Halt`,
    positions: (_name, count) => `Eine Bahn durch ${count} Achsstellungen, ohne Halt`,
  },
  now: "jetzt",
  took: (seconds) => `${seconds} s`,
  leftOut: {
    joint: (name) => `Ausgelassen: Achse ${name} allein. Kein Weg ist frei.`,
    line: () => "Ausgelassen: eine gerade Linie. Keine ist erreichbar.",
    circle: () => "Ausgelassen: ein Kreis. Keiner ist erreichbar.",
    path: () => "Ausgelassen: eine Bahn. Keine Achse darf fahren.",
  },
  done: (count) => `Das war der Rundgang, in ${count} Bewegungen. Der Roboter gehört Ihnen.`,
  ended: "Der Rundgang wurde beendet. Der Roboter steht.",
  endedBy: (why) => `Der Rundgang endete: ${why}`,
};

export const tourTexts: Readonly<Record<Language, TourTexts>> = { en, de };
