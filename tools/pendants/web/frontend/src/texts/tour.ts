// The words of the tour, in English.
import type { LeftOut, StepKind } from "../tour/tour.ts";

export const tourEn = {
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

export type TourTexts = typeof tourEn;
