// A motion's samples as a table of comma-separated values (RFC 4180), in SI units.
import type { PlotJoint } from "./findings.ts";
import { joinedTimes, QUANTITIES, valueAt, type Quantity, type Samples } from "./series.ts";

const SYMBOLS: Readonly<Record<Quantity, string>> = {
  positions: "q",
  velocities: "v",
  accelerations: "a",
};
const PER: Readonly<Record<Quantity, string>> = {
  positions: "",
  velocities: "/s",
  accelerations: "/s2",
};

/** Return the table; a field is empty where nothing is known. */
export function csvTable(
  joints: readonly PlotJoint[],
  planned: Samples | null,
  driven: Samples | null,
): string {
  const kinds = [
    ...(planned === null ? [] : [{ word: "planned", samples: planned }]),
    ...(driven === null ? [] : [{ word: "driven", samples: driven }]),
  ];
  const none = new Float64Array();
  const times = joinedTimes(planned?.times ?? none, driven?.times ?? none);
  const columns = kinds.flatMap(({ word, samples }) =>
    QUANTITIES.flatMap((quantity) =>
      joints.map((joint, index) => ({
        head: `${joint.name} ${SYMBOLS[quantity]} ${word} [${joint.unit}${PER[quantity]}]`,
        samples,
        values: samples[quantity][index] ?? new Float32Array(samples.times.length),
      })),
    ),
  );
  const lines = [csvRow(["t [s]", ...columns.map(({ head }) => head)])];
  for (const time of times) {
    const row = columns.map(({ samples, values }) => {
      const value = valueAt(samples, values, time);
      return value === null ? "" : String(Number(value.toPrecision(7)));
    });
    lines.push([String(Number(time.toFixed(6))), ...row].join(","));
  }
  return `${lines.join("\r\n")}\r\n`;
}

/** Return one line of such a table, without its end. */
export function csvRow(fields: readonly string[]): string {
  return fields.map(field).join(",");
}

function field(text: string): string {
  // A name that a spreadsheet would take for a formula is shown as the text that it is.
  const safe = /^[=+\-@\t\r]/.test(text) ? `'${text}` : text;
  return /[",\r\n]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
}
