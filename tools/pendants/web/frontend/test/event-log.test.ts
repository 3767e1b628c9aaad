import assert from "node:assert/strict";
import { test } from "node:test";
import { NO_CELL } from "../src/pendant/cell.ts";
import type { Cell } from "../src/pendant/cell.ts";
import { EventLog } from "../src/pendant/event-log.ts";
import type { HelloReply, Message, State } from "../src/protocol.ts";
import { de } from "../src/texts/de/de.ts";
import { en } from "../src/texts/en.ts";

const CELL: Cell = { ...NO_CELL, stage: "up", hello: { session: 7, cell: "a", robot: "ur5" } as HelloReply };
const STANDS = {
  type: "state",
  time_s: 100,
  time_ns: 0,
  activity: 0,
  operating_mode: 3,
  enabling: 0,
  override: 1,
  program_state: 0,
  program_line: 0,
  link: 1,
  drives_powered: 1,
  e_stopped: 0,
  error_code: 0,
  in_error: 0,
};

/** A log that looks on at a robot that stands. */
function looking(): { log: EventLog; hear: (message: object) => string[]; state: (change: object) => string[] } {
  const log = new EventLog(() => 5000);
  const hear = (message: object): string[] => {
    const from = log.lines.length;
    log.hear(message as Message, CELL, en);
    return log.lines.slice(from).map(({ kind, text }) => `${kind}: ${text}`);
  };
  let last: object = STANDS;
  hear(last);
  return { log, hear, state: (change) => hear((last = { ...last, ...change } as unknown as State)) };
}

test("what the first state tells was so before the page came", () => {
  const { log, state } = looking();
  assert.deepEqual(log.lines, []);
  assert.deepEqual(state({ time_s: 101 }), []);
});

const CHANGES: [string, object, string[]][] = [
  ["mode", { operating_mode: 1 }, ["event: Mode: T1 reduced."]],
  ["speed", { override: 0.3 }, ["event: Speed: 30 %."]],
  ["controller", { link: 0 }, ["fault: The controller does not answer. Look whether it runs."]],
  ["feedback", { link: 2 }, ["fault: The controller sends no positions."]],
  ["what the controller knows of itself no more", { e_stopped: -1, in_error: -1, drives_powered: -1 }, []],
  ["emergency stop", { e_stopped: 1 }, ["stop: The controller reports its own emergency stop. Release it there."]],
  ["error", { in_error: 1, error_code: 42 }, ["fault: The controller reports error 42. Clear it there."]],
  ["drives", { drives_powered: 0 }, ["event: Drives off."]],
  ["enabling", { enabling: 2 }, ["stop: The enabling device was pressed through."]],
  ["enabling that is held", { enabling: 1 }, []],
  ["program, which reports by itself", { program_state: 1, program_line: 1 }, []],
];
for (const [name, change, told] of CHANGES) {
  test(`a change of state is told once: ${name}`, () => {
    const { state } = looking();
    assert.deepEqual(state(change), told);
    assert.deepEqual(state({}), []);
  });
}

test("a motion or a program that was under way before the page came did not begin then", () => {
  const log = new EventLog(() => 0);
  const hear = (message: object): void => log.hear(message as Message, CELL, en);
  hear({ ...STANDS, activity: 2, program_state: 1, program_line: 3 });
  hear({ type: "program_report", program: "pick", state: 1, line: 4, text: "" });
  hear({ ...STANDS, time_s: 900 });
  assert.deepEqual(log.lines, []);
});

test("a stop that the controller does not know for a while is clear once it says so", () => {
  const { state } = looking();
  state({ e_stopped: 1 });
  assert.deepEqual(state({ e_stopped: -1 }), []);
  assert.deepEqual(state({ e_stopped: 1 }), []);
  assert.deepEqual(state({ e_stopped: -1 }), []);
  assert.deepEqual(state({ e_stopped: 0 }), ["event: The controller reports that its emergency stop is clear."]);
});

test("a program is told where it began, stands and ended, and not line by line", () => {
  const { hear } = looking();
  const report = (state: number, line: number, text = ""): string[] => hear({ type: "program_report", program: "pick", state, line, text });
  assert.deepEqual(report(1, 0), ["motion: Program “pick” began."]);
  assert.deepEqual(report(1, 1), []);
  assert.deepEqual(report(1, 2), []);
  assert.deepEqual(report(2, 2), ["motion: Program “pick” pauses in line 2."]);
  assert.deepEqual(report(2, 2), []);
  assert.deepEqual(report(4, 3), ["motion: One step was run; program “pick” stands at line 3."]);
  assert.deepEqual(report(4, 4), ["motion: One step was run; program “pick” stands at line 4."]);
  assert.deepEqual(report(1, 4), ["motion: Program “pick” goes on in line 4."]);
  assert.deepEqual(report(3, 6), ["motion: Program “pick” stands at a breakpoint, line 6."]);
  assert.deepEqual(report(0, 0, "finished"), ["motion: Program “pick” ended."]);
  report(1, 0);
  assert.deepEqual(report(0, 0, "nothing is gripped"), ["motion: Program “pick” ended: nothing is gripped"]);
});

test("the motions of a program are not told one by one, nor is the ramp in which a stop ends them", () => {
  const { state } = looking();
  state({ program_state: 1, activity: 2 });
  assert.deepEqual(state({ program_state: 0, activity: 3 }), []);
  assert.deepEqual(state({ activity: 0 }), []);
});

test("a motion with a pause is one line, at its end", () => {
  const { state } = looking();
  state({ activity: 2, time_s: 100 });
  for (const activity of [6, 3, 5, 2]) assert.deepEqual(state({ activity, time_s: 101 }), []);
  assert.deepEqual(state({ activity: 0, time_s: 103 }), ["motion: Moved for 3.0 s."]);
});

test("a jog is one line, with its ramp, once the robot stands", () => {
  const { state } = looking();
  assert.deepEqual(state({ activity: 4, time_s: 103 }), []);
  assert.deepEqual(state({ activity: 3, time_s: 104 }), []);
  assert.deepEqual(state({ activity: 0, time_s: 104, time_ns: 5e8 }), ["motion: Jogged for 1.5 s."]);
  state({ activity: 2, time_s: 110, time_ns: 0 });
  assert.deepEqual(state({ activity: 0, time_s: 112 }), ["motion: Moved for 2.0 s."]);
});

const CONTROL: [object, string][] = [
  [{ holder: 7, reason: 1, client: "me" }, "event: You hold control."],
  [{ holder: 3, reason: 1, client: "Anna" }, "event: Anna holds control."],
  [{ holder: 3, reason: 5, client: "Anna" }, "event: Anna holds control: taken over."],
  [{ holder: 0, reason: 3, client: "" }, "event: Nobody holds control: pendant fell silent."],
];
for (const [message, told] of CONTROL) {
  test(`control is told with who and why: ${told}`, () => {
    assert.deepEqual(looking().hear({ type: "authority_changed", ...message }), [told]);
  });
}

test("control that is lost is told with whose it was", () => {
  const { hear, log } = looking();
  log.hearLink(CELL, { ...CELL, holderName: "Anna" }, en);
  const lost = { type: "authority_changed", holder: 0, reason: 4, client: "" };
  assert.deepEqual(hear(lost), ["event: Nobody holds control: Anna, link ended."]);
});

test("a stop is told with who and why, and so is its end", () => {
  const { hear } = looking();
  assert.deepEqual(hear({ type: "stop_changed", stop: 1, client: "Anna", reason: "look out" }), ["stop: Stopped by Anna: look out."]);
  assert.deepEqual(hear({ type: "stop_changed", stop: 2, client: "", reason: "late" }), ["stop: Stopped by the server: late"]);
  assert.deepEqual(hear({ type: "stop_changed", stop: 0, client: "Anna", reason: "" }), ["event: Stop reset by Anna."]);
});

test("a press that was let go is not told beside its jog, one that fell silent is", () => {
  const { hear } = looking();
  const ended = { type: "jog_ended", stop_time: 0.123, tool_distance: 0.0042 };
  assert.deepEqual(hear({ ...ended, reason: 1 }), []);
  assert.deepEqual(hear({ ...ended, reason: 2 }), ["remark: The jog ended because its page fell silent: the robot stood 0.12 s and 4.2 mm later."]);
});

test("a changed document is told with its name and whose change it was", () => {
  const changed = { type: "document_changed", kind: 1, what: 3, name: "pick", from_name: "take", client: "Anna" };
  assert.deepEqual(looking().hear(changed), ["event: Program “pick”: renamed (formerly “take”) · Anna"]);
});

test("what changes many times a second is not told, and the scene has no name", () => {
  const { hear } = looking();
  const changed = { type: "document_changed", what: 2, name: "cell", from_name: "", client: "" };
  assert.deepEqual(hear({ ...changed, kind: 7 }), []);
  assert.deepEqual(hear({ ...changed, kind: 0 }), []);
  assert.deepEqual(hear({ ...changed, kind: 5 }), ["event: Scene: changed"]);
});

test("the link is told as it comes and goes, and what changed without it is no event", () => {
  const { log, state } = looking();
  const lost: Cell = { ...CELL, stage: "lost", linkText: "No bytes came." };
  log.hearLink(NO_CELL, CELL, en);
  log.hearLink(CELL, CELL, en);
  log.hearLink(CELL, lost, en);
  log.hearLink(lost, { ...lost, stage: "opening" }, en);
  assert.deepEqual(log.lines.map(({ text }) => text), ["Connected to cell “a”, ur5.", "The link to the server was lost. No bytes came."]);
  assert.deepEqual(state({ operating_mode: 1 }), []);
});

test("who leaves a cell lost no link", () => {
  const log = new EventLog(() => 0);
  log.hearLink(CELL, NO_CELL, en);
  assert.deepEqual(log.lines.map(({ kind, text }) => `${kind}: ${text}`), ["event: You left the cell."]);
});

test("it keeps the last 500 lines", () => {
  assert.equal(new EventLog(() => 0).most, 500);
});

test("it keeps the newest lines, and their numbers", () => {
  const log = new EventLog(() => 0, 3);
  for (const text of ["a", "b", "c", "d"]) log.add("remark", text);
  assert.deepEqual(log.lines.map(({ number, text }) => `${number} ${text}`), ["2 b", "3 c", "4 d"]);
});

test("a line is in the language of the page", () => {
  const log = new EventLog(() => 0);
  log.hear({ ...STANDS } as unknown as Message, CELL, de);
  log.hear({ ...STANDS, operating_mode: 1 } as unknown as Message, CELL, de);
  assert.equal(log.lines[0]?.text, "Betriebsart: T1 reduziert.");
});
