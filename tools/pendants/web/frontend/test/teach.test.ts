import assert from "node:assert/strict";
import { test } from "node:test";
import type { Operations } from "../src/operations.ts";
import { drop, insert, partsOf, placeOf, recordHere, remove, shift } from "../src/teach/edits.ts";
import { beyond, findingAt, findingsOf, inScreenUnits, touchesItself, waysOut } from "../src/teach/findings.ts";
import { freshStatement } from "../src/teach/fresh.ts";
import { blockOf, indexOf, nameProblem, programOf, rowsOf, usesOf } from "../src/teach/program.ts";
import type { Program, ProgramDocument, Statement } from "../src/teach/program.ts";
import { Teaching } from "../src/teach/teaching.ts";
import type { Wire } from "../src/teach/teaching.ts";
import { stepRequest, transport } from "../src/teach/transport.ts";
import type { Situation } from "../src/teach/transport.ts";
import { typedSpeed, typedZone } from "../src/teach/typed.ts";
import { Refused } from "../src/wire/errors.ts";

const MOVE: Statement = { statement: "move", way: "PTP", point: "P1" };
const LINE: Statement = { statement: "move", way: "LIN", point: "P2", zone: 0.02, speed: { kind: "tool", value: 0.25 } };
const LOOP: Statement[] = [{ statement: "loop", passes: 3 }, LINE, { statement: "wait", duration: 1 }, { statement: "end" }];
const POINTS = [{ name: "P1", joints: [0, 1] }, { name: "P2", joints: [0.5, 1] }];

function document(statements: Statement[]): ProgramDocument {
  return { name: "pick", points: POINTS, statements };
}

function program(statements: Statement[], revision = 1): Program {
  const text = `openpendant-program/1\nprogram "pick" robot ur5\n\n${statements.map((each) => each.statement).join("\n")}\n`;
  return programOf({ name: "pick", revision, saved_by: "me", breakpoints: [0] }, document(statements), text);
}

const whole = program([MOVE, ...LOOP, MOVE]);

test("a statement is found by its line in the text, and a line above all statements is none", () => {
  assert.equal(whole.firstLine, 4);
  assert.equal(indexOf(whole, 5), 1);
  assert.equal(indexOf(whole, 3), -1);
});

test("rows tell way, point, speed, zone and depth", () => {
  const rows = rowsOf(whole);
  assert.deepEqual(rows.map((each) => each.depth), [0, 0, 1, 1, 0, 0]);
  const { words, strong, point, speed, zone } = rows[2]!;
  assert.deepEqual([words, strong, point, speed, zone], ["move", "LIN", "P2", "250 mm/s", "20 mm"]);
});

test("a block goes whole, from its first line and from its last", () => {
  assert.deepEqual(blockOf(whole.statements, 1), { first: 1, count: 4 });
  assert.deepEqual(blockOf(whole.statements, 4), { first: 1, count: 4 });
  assert.deepEqual(blockOf(whole.statements, 2), { first: 2, count: 1 });
});

test("a change names the revision that it was made from", () => {
  const change = recordHere(program([MOVE], 7), "LIN", null);
  assert.equal(change.request.expected_revision, 7);
  assert.deepEqual("point" in change.request ? change.request.point : "", "P3");
});

test("deleting a block deletes all of it, and the line before it is chosen then", () => {
  const change = remove(whole, 4);
  assert.deepEqual("edit" in change!.request && change!.request.edit, { edit: "delete", first: 1, count: 4 });
  assert.equal(change!.chosen, 0);
});

test("the first line moves no higher and the last no lower", () => {
  assert.equal(shift(whole, 0, -1), null);
  assert.equal(shift(whole, 5, 1), null);
});

test("a block that is dropped behind a line below stands there, its own length counted", () => {
  const change = drop(whole, 1, 6);
  assert.deepEqual("edit" in change!.request && change!.request.edit, { edit: "reorder", first: 1, count: 4, to: 2 });
  assert.equal(drop(whole, 1, 3), null);
});

test("statements are inserted before the chosen one", () => {
  const change = insert(whole, [MOVE], 2);
  assert.equal(change.chosen, 2);
});

const REPLY: Operations["programs.dry_run"][1] = {
  program: "pick",
  revision: 1,
  duration: 4.2,
  endless: false,
  complete: true,
  refused: 1,
  moves: [
    { program: "pick", line: 4, point: "P1", zone_used: false, reachable: true },
    { program: "pick", line: 6, point: "P2", zone_used: false, reachable: true },
    { program: "pick", line: 9, point: "P1", zone_used: false, reachable: false, code: 48, text: "pick, line 9, point P1: no way there" },
    { program: "place", line: 3, point: "Q", zone_used: false, reachable: false, code: 48, text: "place, line 3, point Q: no" },
  ],
  scene: [],
  statements: [],
  unchecked: [],
  points: [],
  not_walked: [],
  path: [[0, 1, 2, 3]],
  plan: null,
};

test("a dry run marks lines reachable, with a remark, and not reachable", () => {
  const found = findingsOf(REPLY);
  assert.deepEqual([0, 2, 5].map((each) => findingAt(found, whole, each).mark), ["good", "remark", "bad"]);
  assert.equal(findingAt(found, whole, 5).text, "no way there");
  assert.deepEqual(found.elsewhere.map((each) => each.program), ["place"]);
});

test("findings of another revision mark nothing", () => {
  assert.equal(findingAt(findingsOf({ ...REPLY, revision: 2 }), whole, 0).mark, "unchecked");
});

test("a point that the robot cannot stand at makes its move unreachable", () => {
  const points = [{ point: "P1", reachable: false, code: 45, text: "beyond" }];
  assert.equal(findingAt(findingsOf({ ...REPLY, points }), whole, 0).code, 45);
});

test("the joint that is farthest outside comes first, with the limit that it breaks", () => {
  const limits = [{ lower: -1, upper: 1 }, { lower: -2, upper: 2 }];
  assert.deepEqual(beyond([1.1, -2.5], limits)[0], { joint: 1, value: -2.5, limit: -2 });
});

test("what is refused has two ways out, and a straight line has PTP among them", () => {
  assert.deepEqual(waysOut(48, "LIN"), ["ptp", "touchUp"]);
  assert.deepEqual(waysOut(91, "PTP"), ["around", "moveObject"]);
  assert.deepEqual(waysOut(91, "LIN", true), ["ptp", "around"]);
});

test("a robot touches itself where both bodies are its own", () => {
  assert.equal(touchesItself("link2 and link4 touch at 3%", ["link2", "link4"]), true);
  assert.equal(touchesItself("link2 and pillar touch at 3%", ["link2", "link4"]), false);
});

test("sentences have degrees and millimetres", () => {
  assert.equal(inScreenUnits("1.5707963 rad, -6.28 to 6.28 rad, 0.25 m"), "90.0°, -359.8 to 359.8°, 250.0 mm");
});

test("a speed is typed with its unit or in that of the line", () => {
  const line = LINE as Extract<Statement, { statement: "move" }>;
  assert.deepEqual(typedSpeed(line, "12,5")?.speed, { kind: "tool", value: 0.0125 });
  assert.deepEqual(typedSpeed(line, "40 %")?.speed, { kind: "fraction", value: 0.4 });
  assert.equal(typedSpeed(MOVE as typeof line, "250 mm/s"), null);
  assert.equal(typedSpeed(line, "140 %"), null);
});

test("a zone is degrees for PTP and mm for LIN, and seconds are a dwell", () => {
  const line = LINE as Extract<Statement, { statement: "move" }>;
  assert.equal(typedZone(line, "10 mm")?.zone, 0.01);
  assert.equal(typedZone(MOVE as typeof line, "10 mm"), null);
  assert.deepEqual([typedZone(line, "0,5 s")?.dwell, typedZone(line, "0,5 s")?.zone], [0.5, 0]);
});

test("a loop comes with its end, and a wait without a number is none", () => {
  assert.deepEqual(freshStatement("loop", { passes: "" }), [{ statement: "loop", passes: null }, { statement: "end" }]);
  assert.equal(freshStatement("wait", { seconds: "soon" }), null);
});

test("a text is cut into parts that join to it again, and no character is cut", () => {
  const text = "ab\u{1f916}cd";
  assert.deepEqual(partsOf(text, 3), ["ab", "\u{1f916}c", "d"]);
  assert.deepEqual(partsOf(""), [""]);
});

test("a syntax error has its place", () => {
  assert.deepEqual(placeOf("pick:6:12: found 'spede'; accepted: speed"), { line: 6, column: 12, rest: "found 'spede'; accepted: speed" });
  assert.equal(placeOf("the robot is another"), null);
});

test("a name may be neither empty nor taken nor bear a slash", () => {
  assert.deepEqual(["", "a/b", "P1", "P9"].map((each) => nameProblem(each, ["P1"])), ["empty", "signs", "taken", ""]);
});

test("a point counts the moves that go to it", () => {
  assert.equal(usesOf(whole, "P1"), 2);
});

const READY: Situation = { isInControl: true, mayMove: true, state: { program_state: 0, activity: 0 }, hasProgram: true, isOpenOne: false };

test("nothing begins without control, without conditions or without a line", () => {
  assert.equal(transport({ ...READY, isInControl: false }).off.run, "conditions");
  assert.equal(transport({ ...READY, mayMove: false }).off.step, "conditions");
  assert.equal(transport({ ...READY, hasProgram: false }).off.run, "noProgram");
  assert.equal(transport(READY).off.run, "");
});

test("what runs can be paused and ended, and is neither begun nor stepped again", () => {
  const { off } = transport({ ...READY, isOpenOne: true, state: { program_state: 1, activity: 2 } });
  assert.deepEqual(off, { back: "underWay", run: "underWay", step: "underWay", pause: "", end: "" });
});

test("what is paused goes on, steps both ways, and ends", () => {
  const told = transport({ ...READY, isOpenOne: true, state: { program_state: 2, activity: 5 } });
  assert.deepEqual([told.isPaused, told.off.run, told.off.back, told.off.end, told.off.pause], [true, "", "", "", "standing"]);
});

test("what still brakes goes on only once it stands", () => {
  const told = transport({ ...READY, isOpenOne: true, state: { program_state: 2, activity: 6 } });
  assert.deepEqual([told.isPaused, told.off.run, told.off.pause], [false, "underWay", "standing"]);
});

test("another program that is paused is not stepped by this one's keys", () => {
  assert.equal(transport({ ...READY, state: { program_state: 2, activity: 5 } }).off.step, "otherRuns");
});

test("a step of a paused run names no line and no revision of its own", () => {
  const run = { program: "pick", revision: 4, line: 9, times: 2 };
  const request = stepRequest(run, -1, true);
  assert.deepEqual(request.type === "program_run" && [request.run, request.line, request.revision], [3, 0, 0]);
});

interface Asked {
  op: string;
  format?: string;
  offset?: number;
  expected_revision?: number;
  part?: number;
  parts?: number;
}

class Server implements Wire {
  asked: string[] = [];
  revision = 1;
  statements: Statement[] = [MOVE];
  refuses = 0;

  async call<Op extends keyof Operations>(request: Operations[Op][0]): Promise<Operations[Op][1]> {
    const asked = request as Asked;
    this.asked.push(asked.op);
    await Promise.resolve();
    return this.#answer(asked) as Operations[Op][1];
  }

  #answer(asked: Asked): unknown {
    switch (asked.op) {
      case "programs.load":
        return this.#part(asked.format === "json" ? JSON.stringify(document(this.statements)) : program(this.statements).text, asked.offset ?? 0);
      case "programs.list":
        return { programs: [{ name: "pick", revision: this.revision, deleted: false }], next: null };
      case "programs.dry_run":
        return { ...REPLY, revision: this.revision };
      case "programs.save":
        if (asked.part !== asked.parts) return { part: asked.part, parts: asked.parts };
        this.revision += 1;
        return { name: "pick", revision: this.revision };
      case "programs.breakpoints":
        return { name: "pick", statements: [0, 1] };
      default:
        if (this.refuses !== 0 || asked.expected_revision !== this.revision) throw refused(this.refuses || 100);
        this.revision += 1;
        this.statements = [...this.statements, MOVE];
        return { name: "pick", revision: this.revision };
    }
  }

  #part(body: string, offset: number): unknown {
    const next = offset + 20 < body.length ? offset + 20 : null;
    return { name: "pick", revision: this.revision, saved_by: "me", body: body.slice(offset, offset + 20), next };
  }
}

function refused(code: number): Refused {
  return new Refused({ code, joint: -1, value: 0, limit: 0, text: "no" });
}

async function opened(): Promise<{ server: Server; teaching: Teaching; told: string[] }> {
  const server = new Server();
  const told: string[] = [];
  const teaching = new Teaching(server, {
    changed: () => undefined,
    overtaken: ({ revision }) => told.push(`overtaken ${revision}`),
    gone: (name) => told.push(`gone ${name}`),
  });
  await teaching.open("pick");
  return { server, teaching, told };
}

const append = (from: Program) => recordHere(from, "PTP", null);

test("a program is loaded part by part", async () => {
  const { teaching } = await opened();
  assert.deepEqual(teaching.program?.statements, [MOVE]);
});

test("changes that are asked for together are made one after the other, each from the newest revision", async () => {
  const { server, teaching, told } = await opened();
  await Promise.all([teaching.change(append), teaching.change(append)]);
  assert.equal(server.revision, 3);
  assert.deepEqual(told, []);
});

test("a change that somebody overtook is told, not done, and the newest program is shown", async () => {
  const { server, teaching, told } = await opened();
  server.revision = 5;
  await teaching.change(append);
  assert.deepEqual(told, ["overtaken 5"]);
  assert.equal(teaching.program?.revision, 5);
});

test("another refusal goes to whoever asked, and the next change is made all the same", async () => {
  const { server, teaching } = await opened();
  server.refuses = 18;
  await assert.rejects(teaching.change(append), Refused);
  server.refuses = 0;
  await teaching.change(append);
  assert.equal(teaching.program?.revision, 2);
});

test("a notice loads the program again only where its revision is another", async () => {
  const { server, teaching } = await opened();
  server.asked = [];
  server.revision = 2;
  server.statements = [MOVE, MOVE];
  await teaching.refresh();
  assert.equal(teaching.program?.statements.length, 2);
});

test("an edit makes what a dry run found old", async () => {
  const { teaching } = await opened();
  await teaching.dryRun();
  assert.equal(findingAt(teaching.findings, teaching.program!, 0).mark, "good");
  await teaching.change(append);
  assert.equal(findingAt(teaching.findings, teaching.program!, 0).mark, "unchecked");
});

test("a dry run is not believed where the scene changed while it walked", async () => {
  const { teaching } = await opened();
  const walking = teaching.dryRun();
  teaching.makeOld();
  await walking;
  assert.equal(teaching.findings, null);
});

test("a long text goes in parts, all from one revision", async () => {
  const { server, teaching } = await opened();
  await teaching.save("x".repeat(15_001), 1);
  assert.equal(server.asked.filter((each) => each === "programs.save").length, 2);
  assert.equal(teaching.program?.revision, 2);
});
