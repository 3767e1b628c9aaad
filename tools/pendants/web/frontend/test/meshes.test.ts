import assert from "node:assert/strict";
import { createHash } from "node:crypto";
import { test } from "node:test";

import type { RobotDescription } from "../src/kinematics/chain.ts";
import type { RobotMesh } from "../src/operations.ts";
import { downloadedMeshes, MOST_BYTES, type Ask } from "../src/view/meshes.ts";
import { RobotMeshes } from "../src/view/robot_meshes.ts";
import { sha256 } from "../src/view/sha256.ts";

const CHUNK = 32_768;
const told = (bytes: Uint8Array): string => createHash("sha256").update(bytes).digest("hex");
const some = (length: number): Uint8Array => Uint8Array.from({ length }, (_, i) => (i * 7919) % 251);

test("hashes are those of SHA-256, whatever the length", () => {
  for (const length of [0, 1, 55, 56, 63, 64, 65, 119, 120, 1000, 100_003]) {
    assert.equal(sha256(some(length)), told(some(length)), `${length} bytes`);
  }
});

test("a hash is that of the part of a buffer", () => {
  assert.equal(sha256(some(300).subarray(7, 200)), told(some(300).subarray(7, 200)));
});

function entry(bytes: Uint8Array, changes: Partial<RobotMesh> = {}): RobotMesh {
  return {
    hash: told(bytes), bytes: bytes.length, form: "stl", unit_scale: [1, 1, 1], colour: "#ffffff",
    links: [{ link: "arm", xyz: [0, 0, 1], quat: [0, 0, 0, 1] }], ...changes,
  };
}

/** A server with these meshes, and the requests that it saw. */
function server(meshes: RobotMesh[], files: Map<string, Uint8Array>): { ask: Ask; seen: unknown[]; most: number } {
  let open = 0;
  const state = { seen: [] as unknown[], most: 0, ask: null as unknown as Ask };
  const answer = async (request: { op: string; hash?: string; offset?: number }): Promise<unknown> => {
    state.seen.push(request);
    if (request.op === "shapes.meshes") return { meshes };
    state.most = Math.max(state.most, ++open);
    await Promise.resolve();
    open--;
    const bytes = files.get(request.hash ?? "");
    if (bytes === undefined) throw new Error("no mesh with this hash");
    const offset = request.offset ?? 0;
    const part = bytes.subarray(offset, offset + CHUNK);
    return {
      bytes_total: bytes.length, offset, more: offset + part.length < bytes.length,
      data: Buffer.from(part).toString("base64"),
    };
  };
  state.ask = answer as unknown as Ask;
  return state;
}

const atOnce = (): Promise<void> => Promise.resolve();

test("a mesh comes in chunks, one at a time, with time between them", async () => {
  const bytes = some(2 * CHUNK + 5);
  const state = server([entry(bytes)], new Map([[told(bytes), bytes]]));
  const waits: number[] = [];
  const { meshes, problems } = await downloadedMeshes(state.ask, () => {}, (duration) => {
    waits.push(duration);
    return Promise.resolve();
  });
  assert.deepEqual(problems, []);
  assert.deepEqual(meshes.map((mesh) => mesh.bytes), [bytes]);
  assert.equal(state.most, 1);
  assert.equal(waits.length, 2);
  assert.ok(waits.every((each) => each >= 50), "the server gives 20 chunks a second");
});

test("bytes of another hash are not shown", async () => {
  const [bytes, other] = [some(100), some(100).reverse()];
  const state = server([entry(bytes)], new Map([[told(bytes), other]]));
  const { meshes, problems } = await downloadedMeshes(state.ask, () => {}, atOnce);
  assert.deepEqual(meshes, []);
  assert.deepEqual(problems.map((each) => each.problem), ["hash"]);
});

test("one file in two scales is fetched once", async () => {
  const bytes = some(100);
  const meshes = [entry(bytes), entry(bytes, { unit_scale: [1, -1, 1] })];
  const state = server(meshes, new Map([[told(bytes), bytes]]));
  assert.equal((await downloadedMeshes(state.ask, () => {}, atOnce)).meshes.length, 2);
  assert.equal(state.seen.length, 2);
});

test("a mesh that is refused leaves the others to come", async () => {
  const [missing, bytes] = [some(10), some(20)];
  const state = server([entry(missing), entry(bytes)], new Map([[told(bytes), bytes]]));
  const { meshes, problems } = await downloadedMeshes(state.ask, () => {}, atOnce);
  assert.deepEqual(meshes.map((each) => each.hash), [told(bytes)]);
  assert.deepEqual(problems.map((each) => each.problem), ["refused"]);
});

test("no byte is asked for of meshes that are too large", async () => {
  const mesh = entry(some(10), { bytes: MOST_BYTES + 1 });
  const state = server([mesh], new Map());
  const { problems } = await downloadedMeshes(state.ask, () => {}, atOnce);
  assert.deepEqual(problems.map((each) => each.problem), ["size"]);
  assert.equal(state.seen.length, 1);
});

test("a server that sends more than it said is not believed", async () => {
  const bytes = some(100);
  const state = server([entry(bytes, { bytes: 90 })], new Map([[told(bytes), bytes]]));
  const { meshes, problems } = await downloadedMeshes(state.ask, () => {}, atOnce);
  assert.deepEqual(meshes, []);
  assert.deepEqual(problems.map((each) => each.problem), ["size"]);
});

test("meshes of a robot that is no longer shown are asked for no more", async () => {
  const bytes = some(5 * CHUNK);
  const state = server([entry(bytes)], new Map([[told(bytes), bytes]]));
  const stop = new AbortController();
  const { meshes } = await downloadedMeshes(state.ask, () => {}, () => {
    stop.abort();
    return Promise.resolve();
  }, stop.signal);
  assert.deepEqual(meshes, []);
  assert.equal(state.seen.length, 2);
});

/** A robot of which one link has a mesh. */
const robot = (hash: string, mesh: string | null): RobotDescription => ({
  robot: "arm", hash, shapes: [], struts: [], joints: [], home: [], links: [{ link: "arm", joint: null, mesh }],
});
const soon = (): Promise<void> => new Promise((done) => setTimeout(done, 5));

test("meshes of a robot are fetched once, and none where it has none", async () => {
  const bytes = some(100);
  const state = server([entry(bytes)], new Map([[told(bytes), bytes]]));
  const meshes = new RobotMeshes(state.ask, () => assert.fail("refused"));
  meshes.of(robot("plain", null));
  assert.equal(state.seen.length, 0);
  for (let picture = 0; picture < 3; picture++) meshes.of(robot("arm", told(bytes)));
  await soon();
  assert.deepEqual(meshes.of(robot("arm", told(bytes))).map((each) => each.hash), [told(bytes)]);
  meshes.linked();
  meshes.of(robot("arm", told(bytes)));
  assert.equal(state.seen.length, 2, "all had come: another link asks for nothing");
});

test("a list that is refused is told once, and asked for again only after another link", async () => {
  let asked = 0;
  let failed = 0;
  const refuses = (() => Promise.reject(new Error(`refused ${++asked}`))) as unknown as Ask;
  const meshes = new RobotMeshes(refuses, () => failed++);
  for (let picture = 0; picture < 3; picture++) {
    assert.deepEqual(meshes.of(robot("arm", "aa")), []);
    await soon();
  }
  assert.deepEqual([asked, failed], [1, 1]);
  meshes.linked();
  meshes.of(robot("arm", "aa"));
  await soon();
  assert.equal(asked, 2);
});
