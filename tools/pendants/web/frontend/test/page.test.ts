import assert from "node:assert/strict";
import { test } from "node:test";
import { fraction, isAtEnd } from "../src/pendant/axes.ts";
import { NO_CELL, OVERDUE, showsTheSame } from "../src/pendant/cell.ts";
import type { Cell } from "../src/pendant/cell.ts";
import { checklist, nextLine } from "../src/pendant/checklist.ts";
import { pageState } from "../src/pendant/states.ts";
import type { HelloReply, State } from "../src/protocol.ts";
import { de } from "../src/texts/de/de.ts";
import { en } from "../src/texts/en.ts";
import { fetchWords, fixed, readNumber, refusalSentence } from "../src/texts/texts.ts";

const READY = {
  holder: 7,
  stop: 0,
  operating_mode: 1,
  enabling: 1,
  link: 1,
  e_stopped: 0,
  in_error: 0,
  error_code: 0,
  motion_possible: 1,
  activity: 0,
  program_state: 0,
  positions: [],
  drives_powered: 1,
} as unknown as State;

function cell(state: Partial<State> = {}): Cell {
  return {
    ...NO_CELL,
    stage: "up",
    hello: { session: 7 } as HelloReply,
    state: { ...READY, ...state },
  };
}

test("without a link the page is disconnected, whatever it was told before", () => {
  assert.equal(pageState({ ...cell(), stage: "lost" }), "disconnected");
});

test("each state has its sign", () => {
  assert.equal(pageState(cell()), "control");
  assert.equal(pageState(cell({ holder: 3 })), "observer");
  assert.equal(pageState(cell({ activity: 2 })), "running");
  assert.equal(pageState(cell({ stop: 1 })), "stopped");
  assert.equal(pageState(cell({ e_stopped: 1 })), "stopped");
  assert.equal(pageState(cell({ link: 0 })), "fault");
});

test("a jog of our own is no running motion", () => {
  assert.equal(pageState(cell({ activity: 4 })), "control");
});

test("a stop goes before a fault, and both before who holds control", () => {
  assert.equal(pageState(cell({ stop: 1, link: 0, holder: 3 })), "stopped");
  assert.equal(pageState(cell({ link: 0, holder: 3 })), "fault");
});

test("an error that keeps the controller from nothing is no fault", () => {
  assert.equal(pageState(cell({ in_error: 1, motion_possible: 1 })), "control");
  assert.equal(pageState(cell({ in_error: 1, motion_possible: 0 })), "fault");
});

test("the checklist names what is missing in the order in which one can act", () => {
  const told = cell({ holder: 0, operating_mode: 3, enabling: 0 });
  const missing = checklist(told).filter((each) => each.done !== true);
  assert.deepEqual(
    missing.map((each) => each.name),
    ["control", "mode", "enabling", "key"],
  );
  assert.equal(nextLine(missing)?.name, "control");
});

test("with all done only the jog key is left", () => {
  assert.equal(nextLine(checklist(cell()))?.name, "key");
});

test("enabling that somebody else holds is not ours", () => {
  const lines = checklist(cell({ holder: 3 }));
  assert.equal(lines.find((each) => each.name === "enabling")?.done, false);
});

test("numbers are read with a comma, a point and every sign for minus", () => {
  assert.equal(readNumber("12,5"), 12.5);
  assert.equal(readNumber(" −3.25 "), -3.25);
  assert.equal(readNumber("1,2,3"), null);
  assert.equal(readNumber(""), null);
  assert.equal(readNumber("5x"), null);
});

test("a zero has no minus", () => {
  assert.equal(fixed(-0.001, 2), "0.00");
});

test("a refusal in German has the joint and the numbers, and no English sentence", async () => {
  const refusal = { code: 45, joint: 1, value: 2.5, limit: 2, text: "Lower-Arm would leave" };
  await fetchWords("de");
  const told = refusalSentence(refusal, "de", ["Base", "Lower-Arm"]);
  assert.match(told, /^OUT_OF_RANGE: Lower-Arm: Ein Gelenk würde/);
  assert.match(told, /Wert 2,5, Grenze 2\./);
  assert.doesNotMatch(told, /would/);
});

test("both languages have the same words, and none is empty", () => {
  assert.deepEqual(Object.keys(de).sort(), Object.keys(en).sort());
  for (const [name, text] of Object.entries(de)) assert.notEqual(text, "", name);
});

test("a joint at the end of its range can only go back", () => {
  const row = { name: "", value: 2, speed: 0, isAngle: true, limits: [-2, 2] } as const;
  assert.equal(isAtEnd(row, 1), true);
  assert.equal(isAtEnd(row, -1), false);
  assert.equal(fraction(row), 1);
});

const STOOD = { ...cell({ sequence: 4, time_s: 1, age: 0.01, positions: [0.5, 1] }), stateAt: 100, heardAt: 100 };

function next(state: Partial<State>, around: Partial<Cell> = {}): Cell {
  const later = { sequence: 5, time_s: 2, age: 0.02, positions: [0.5, 1], ...state };
  return { ...STOOD, stateAt: 133, heardAt: 133, state: { ...STOOD.state, ...later } as State, ...around };
}

test("a state of a robot that stands shows nothing new", () => {
  assert.equal(showsTheSame(STOOD, next({})), true);
});

test("what moved, changed or came after a silence is shown", () => {
  assert.equal(showsTheSame(STOOD, next({ positions: [0.5, 1.001] })), false);
  assert.equal(showsTheSame(STOOD, next({ holder: 3 })), false);
  assert.equal(showsTheSame(STOOD, next({}, { answers: 1 })), false);
  assert.equal(showsTheSame(STOOD, next({}, { stateAt: 100 + OVERDUE })), false);
  assert.equal(showsTheSame(STOOD, next({}, { heardAt: 100 + OVERDUE })), false);
  assert.equal(showsTheSame({ ...STOOD, state: null }, next({})), false);
});
