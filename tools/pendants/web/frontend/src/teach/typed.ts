// Speed, zone and time of a move as a person types them, with a comma or a point.
import { readNumber } from "../texts/texts.ts";
import { speedText, zoneText } from "./program.ts";
import type { Move } from "./program.ts";

export function readSpeed(move: Move): string {
  return speedText(move);
}

export function readZone(move: Move): string {
  return zoneText(move) === "" ? "0" : zoneText(move);
}

/** Return a move with a typed speed: `50 %`, `250 mm/s`; null for what is none. */
export function typedSpeed(move: Move, typed: string): Move | null {
  const found = /^(.*?)\s*(%|mm\/s|m\/s)?$/.exec(typed.trim());
  const value = readNumber(found?.[1] ?? "");
  const unit = found?.[2] ?? (move.speed?.kind === "tool" ? "mm/s" : "%");
  if (value === null || value <= 0) return null;
  if (unit === "%") {
    return value > 100 ? null : { ...move, speed: { kind: "fraction", value: value / 100 } };
  }
  if (move.way === "PTP" || move.way === "SPLINE") return null;
  return { ...move, speed: { kind: "tool", value: unit === "m/s" ? value : value / 1000 } };
}

/** Return a move with a typed zone, or how long it stands (`0.5 s`); null for what is none. */
export function typedZone(move: Move, typed: string): Move | null {
  const found = /^(.*?)\s*(mm|°|deg|s)?$/.exec(typed.trim());
  const value = readNumber(found?.[1] ?? "");
  const isAngle = move.way === "PTP";
  const unit = found?.[2] ?? (isAngle ? "°" : "mm");
  if (value === null || value < 0) return null;
  if (unit === "s") return { ...move, dwell: value, zone: 0 };
  if (value === 0) return { ...move, zone: 0, dwell: 0 };
  if (isAngle !== (unit !== "mm")) return null;
  return { ...move, zone: isAngle ? (value * Math.PI) / 180 : value / 1000, dwell: 0 };
}
