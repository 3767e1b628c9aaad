// A frame as text: the line and the rows that `openpendant packets decode` prints of it.
import { CommType } from "../codec.ts";
import type { RealSize } from "../codec.ts";
import { anatomyOf, commName, replyName } from "./fields.ts";
import type { FrameAnatomy, FrameField, Value } from "./fields.ts";

const MOST_FIELDS = 8;
const LONGEST_TEXT = 60;
const LONGEST_LINE = 4_000;
/** More marks than that on one letter run into the lines above. */
const LONGEST_STACK = 4;

/** Fields that matter in one line, where not all do; of other messages the first eight. */
const LINE_FIELDS: Readonly<Record<string, readonly string[]>> = {
  verdict: ["request_id", "code", "joint", "value", "limit", "text"],
  outcome: ["request_id", "outcome", "code", "motion_time", "text"],
  state: ["sequence", "activity", "request_id", "holder", "stop", "link", "positions"],
};

/** Return all that is printed of a frame with `--format tree`. */
export function frameText(frame: Uint8Array, real: RealSize = 4): string {
  const anatomy = anatomyOf(frame, real);
  return [frameLine(anatomy), ...frameRows(anatomy)].join("\n");
}

/** Return name, communication type and the fields that matter. */
export function frameLine(anatomy: FrameAnatomy): string {
  const [, type, comm, code] = anatomy.header.map((each) => Number(each.value));
  const name = anatomy.name === "unknown" ? `type ${type}` : anatomy.name;
  const kind = comm === CommType.REPLY ? `${commName(comm)} ${replyName(code ?? 0)}` : commName(comm ?? 0);
  const fields = thatMatter(anatomy).map((each) => ` ${short(each)}`);
  return `${name} ${kind}${fields.join("")}`;
}

function thatMatter({ name, fields }: FrameAnatomy): FrameField[] {
  const chosen = LINE_FIELDS[name];
  const known = chosen === undefined ? [] : fields.filter((each) => chosen.includes(each.path));
  return known.length > 0 ? known : fields.slice(0, MOST_FIELDS);
}

function short({ path, value, kind, label }: FrameField): string {
  return `${path}=${valueText(value, kind, true)}${label === "" ? "" : `:${label}`}`;
}

/** Return header and fields, one a row with offset, unit and name of the value. */
export function frameRows({ header, fields }: FrameAnatomy): string[] {
  return [...header, ...fields].map(({ path, offset, value, kind, unit, label }) => {
    const more = [unit === "" ? "" : `[${unit}]`, label].filter((each) => each !== "").join("  ");
    const row = `${String(offset).padStart(6)}  ${path.padEnd(16)} ${valueText(value, kind, false)}`;
    return more === "" ? row : `${row}  ${more}`;
  });
}

/** Return a value as it is printed, shortened or in full. */
export function valueText(value: Value, kind: FrameField["kind"], isShort: boolean): string {
  if (typeof value === "string") {
    const text = oneLine(value);
    const signs = [...text];
    return isShort && signs.length > LONGEST_TEXT ? `"${signs.slice(0, LONGEST_TEXT).join("")}..."` : `"${text}"`;
  }
  if (value instanceof Uint8Array) {
    const most = isShort ? LONGEST_TEXT / 2 : value.length;
    const digits = hexOf(value.subarray(0, most));
    return value.length > most ? `${digits}...` : digits;
  }
  if (typeof value === "number") return kind === "int" ? String(value) : general(value, isShort ? 6 : 9);
  if (!isShort) return value.map((each) => general(each, 9)).join(" ");
  let meant = value.length;
  while (meant > 0 && value[meant - 1] === 0) meant -= 1;
  return `[${value.slice(0, meant).map((each) => general(each, 5)).join(" ")}]`;
}

export function hexOf(bytes: Uint8Array): string {
  return Array.from(bytes, (each) => each.toString(16).padStart(2, "0")).join("");
}

/** Return a real with so many significant digits, as C and Python write it with `g`. */
export function general(value: number, digits: number): string {
  if (Number.isNaN(value)) return "nan";
  if (!Number.isFinite(value)) return value > 0 ? "inf" : "-inf";
  if (value === 0) return Object.is(value, -0) ? "-0" : "0";
  const [figures, exponent] = rounded(Math.abs(value), digits);
  const sign = value < 0 ? "-" : "";
  if (exponent < -4 || exponent >= digits) {
    const size = String(Math.abs(exponent)).padStart(2, "0");
    const mantissa = withoutZeros(`${figures.slice(0, 1)}.${figures.slice(1)}`);
    return `${sign}${mantissa}e${exponent < 0 ? "-" : "+"}${size}`;
  }
  if (exponent < 0) return `${sign}${withoutZeros(`0.${"0".repeat(-exponent - 1)}${figures}`)}`;
  return sign + withoutZeros(`${figures.slice(0, exponent + 1)}.${figures.slice(exponent + 1)}`);
}

/** Return the significant figures of a positive number, and its power of ten. */
function rounded(value: number, digits: number): [string, number] {
  const [mantissa = "", power = "0"] = value.toExponential(digits + 30).split("e");
  const figures = mantissa.replace(".", "");
  // Half-way a browser takes the larger one, C and Python the even one.
  const isTie = /^50*$/.test(figures.slice(digits));
  const isEven = Number(figures.charAt(digits - 1)) % 2 === 0;
  if (isTie && isEven) return [figures.slice(0, digits), Number(power)];
  const [told = "", rest = "0"] = value.toExponential(digits - 1).split("e");
  return [told.replace(".", ""), Number(rest)];
}

function withoutZeros(text: string): string {
  return text.replace(/\.?0*$/, "");
}

/** What is not shown as it is: controls, line ends, signs that turn the writing or are not seen. */
const HIDDEN =
  /[\p{C}\p{Zl}\p{Zp}\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180f\u2800\u3164\ufe00-\ufe0d\uffa0\u{e0100}-\u{e01ef}]|(?! )\p{Zs}/u;

/** Return a text as one line that can be shown anywhere. */
function oneLine(text: string): string {
  const signs = [...text];
  let stacked = 0;
  const kept = signs.slice(0, LONGEST_LINE).map((sign) => {
    stacked = /[\p{Mn}\p{Me}]/u.test(sign) ? stacked + 1 : 0;
    return HIDDEN.test(sign) || stacked > LONGEST_STACK ? escaped(sign) : sign;
  });
  const over = signs.length - LONGEST_LINE;
  return kept.join("") + (over > 0 ? `… (${over} signs more)` : "");
}

function escaped(sign: string): string {
  const named: Readonly<Record<string, string>> = { "\n": "\\n", "\r": "\\r", "\t": "\\t" };
  const code = sign.codePointAt(0) ?? 0;
  const known = named[sign];
  if (known !== undefined) return known;
  if (code < 0x100) return `\\x${code.toString(16).padStart(2, "0")}`;
  if (code < 0x10000) return `\\u${code.toString(16).padStart(4, "0")}`;
  return `\\U${code.toString(16).padStart(8, "0")}`;
}
