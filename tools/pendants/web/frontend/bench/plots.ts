// Three plots of as many samples as the address says, for the benchmark that pans them.
import { Plots } from "../src/plots/plots.ts";
import type { PlotJoint } from "../src/plots/findings.ts";
import type { Samples } from "../src/plots/series.ts";

const asked = new URLSearchParams(location.search);
const [samples, joints] = [Number(asked.get("samples")), Number(asked.get("joints"))];
const number = (value: number, digits: number): string => value.toFixed(digits);

function motion(off: number): Samples {
  const column = (joint: number, factor: number): Float32Array =>
    Float32Array.from({ length: samples }, (_, at) => factor * Math.sin(0.013 * at + joint + off) + off);
  const columns = (factor: number): Float32Array[] => Array.from({ length: joints }, (_, joint) => column(joint, factor));
  const times = Float64Array.from({ length: samples }, (_, at) => 0.01 * at);
  return { times, positions: columns(1), velocities: columns(2), accelerations: columns(3), gaps: [] };
}

const limits = { lower: -3, upper: 3, velocity: 4, acceleration: 8 };
const all = Array.from({ length: joints }, (_, joint): PlotJoint => ({ name: `joint ${joint}`, unit: "rad", ...limits }));
const words = { quantities: { positions: "q", velocities: "v", accelerations: "a" }, number };
const plots = new Plots(document.getElementById("plots")!, { words, theme: "dark", layout: "row" });
plots.show({ joints: all, planned: motion(0), driven: motion(0.01), chosen: joints === 1 ? 0 : null, unit: "rad" });
plots.setRange([0, 0.005 * samples]);

/** Pan for so long [ms]; return how long a picture took on average [ms]. */
async function pan(length: number): Promise<number> {
  const picture = (): Promise<number> => new Promise(requestAnimationFrame);
  const began = await picture();
  let [now, count] = [began, 0];
  while (now - began < length) {
    plots.pan(count % 200 < 100 ? 0.01 : -0.01);
    now = await picture();
    count += 1;
  }
  return (now - began) / count;
}

Object.assign(globalThis, { pan, plots });
