// The words of the page in the language of whoever reads it, and numbers as people write them.
import { OperatingMode, VerdictCode } from "../protocol.ts";
import type { CodeText } from "../protocol.ts";
import { remedies } from "../remedies.ts";
import type { Refusal } from "../wire/errors.ts";
import { en } from "./en.ts";
import type { Texts } from "./en.ts";

export type { Texts };

export type Language = "en" | "de";

const fetched = new Map<Language, Texts>([["en", en]]);

/**
 * Fetch the words of a language; English comes with the program. Where they do not come, they are
 * asked for again the next time.
 */
export async function fetchWords(language: Language): Promise<void> {
  if (fetched.has(language)) return;
  try {
    fetched.set(language, (await import("./de/de.ts")).de);
  } catch {
    // The page is in English until they come.
  }
}

/** Return the words of a language, or the English ones until they have been fetched. */
export function textsOf(language: Language): Texts {
  return fetched.get(language) ?? en;
}

/**
 * Return cause and remedy of a code. English has the server's own sentence, with its numbers; so has
 * a code that only a newer server knows, and no remedy.
 */
export function causeAndRemedy(code: number, text: string, language: Language): CodeText {
  const known: Readonly<Partial<Record<number, CodeText>>> = textsOf(language).codes;
  return known[code] ?? [ended(text), remedies[code] ?? ""];
}

const names = new Map<number, string>(
  Object.entries(VerdictCode).map(([name, code]) => [code, name]),
);

export function codeName(code: number): string {
  return names.get(code) ?? String(code);
}

export function modeWord(texts: Texts, mode: number | undefined): string {
  switch (mode) {
    case OperatingMode.MANUAL_REDUCED:
      return texts.modeT1;
    case OperatingMode.MANUAL_HIGH:
      return texts.modeT2;
    case OperatingMode.AUTOMATIC:
      return texts.modeAutomatic;
    case OperatingMode.RECOVERY:
      return texts.modeRecovery;
    default:
      return texts.notKnown;
  }
}

/** How a value of a joint or of space is told: degrees and mm, or SI. */
export interface Units {
  areRadians: boolean;
}

/** Return a refusal as a sentence: what happened, with joint and numbers, and what to do. */
export function refusalSentence(
  refusal: Refusal,
  language: Language,
  jointNames: readonly string[],
): string {
  const { code, text, value, limit } = refusal;
  const [cause, remedy] = causeAndRemedy(code, text, language);
  if (cause === ended(text)) return `${codeName(code)}: ${cause} ${remedy}`.trim();
  const joint = jointNames[refusal.joint];
  const numbers =
    value === 0 && limit === 0
      ? ""
      : ` ${textsOf(language).numbers(plain(value, language), plain(limit, language))}`;
  return `${codeName(code)}: ${joint === undefined ? "" : `${joint}: `}${cause}${numbers} ${remedy}`;
}

function ended(sentence: string): string {
  return sentence === "" || /[.!?]$/.test(sentence) ? sentence : `${sentence}.`;
}

function plain(value: number, language: Language): string {
  return value.toLocaleString(language, { maximumFractionDigits: 3 });
}

/** Return a number with so many decimals, and no minus in front of a zero. */
export function fixed(value: number, decimals: number): string {
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? text.replace("-", "") : text;
}

/** Read a number as a person types it: with a comma or a point, and any of the signs for minus. */
export function readNumber(typed: string): number | null {
  const text = typed.trim().replace(",", ".").replace(/[−–]/g, "-").replace(/\s/g, "");
  if (!/^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(text)) return null;
  const value = Number(text);
  return Number.isFinite(value) ? value : null;
}
