// The words of the plots, in English.

export const plotsEn = {
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
  notDriven: "Execute the plan to compare it with what the robot drives.",
  notAtPace: "The motion was driven slower than planned, or with a pause or a stop: its times are not those of the plan.",
  noMotion: "Nothing was driven yet: this is how the robot stands.",
  noPlan: "No plan is known for this motion: it is shown as it was driven.",
  planOf: (plan: number, seconds: string) => `plan ${plan}, ${seconds} s`,
  howMade: (milliseconds: string) =>
    `A driven sample every ${milliseconds} ms. Acceleration of the driven motion is a difference of two speeds.`,
  saveCsv: "Save as CSV",
  savePicture: "Save picture",
  fit: "Show all",
  hold: "Hold the picture",
  goOn: "Go on",
};

export type PlotTexts = typeof plotsEn;
