// What the inspector of packets says of frames, what it keeps, and what it keeps to itself.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { frameText, general } from "../src/packets/lines.ts";
import { maskSecret } from "../src/packets/masking.ts";
import { PacketRing } from "../src/packets/ring.ts";
import { anatomyOf } from "../src/packets/fields.ts";
import { encode } from "../src/protocol.ts";

interface Case {
  hex: string;
  real: 4 | 8;
  text: string;
}

const path = process.env["PACKET_CASES"];
const cases = path === undefined ? [] : (JSON.parse(readFileSync(path, "utf8")) as Case[]);

test("every frame is told as packets decode prints it", { skip: cases.length === 0 }, () => {
  for (const { hex, real, text } of cases) {
    assert.equal(frameText(new Uint8Array(Buffer.from(hex, "hex")), real), text);
  }
});

test("the fields of a frame cover all its bytes, one behind the other", { skip: cases.length === 0 }, () => {
  for (const { hex, real } of cases) {
    const frame = new Uint8Array(Buffer.from(hex, "hex"));
    const { header, fields, message } = anatomyOf(frame, real);
    let at = 0;
    for (const each of [...header, ...fields]) {
      assert.equal(each.offset, at, each.path);
      at += each.size;
    }
    if (message?.type !== "ping") assert.equal(at, frame.length);
  }
});

test("a real half-way between two figures becomes the even one", () => {
  assert.equal(general(2 ** -14, 9), "6.10351562e-05");
  assert.equal(general(0.5, 9), "0.5");
  assert.equal(general(999999.5, 6), "1e+06");
  assert.equal(general(-1234.5, 9), "-1234.5");
});

const frame = (message: Parameters<typeof encode>[0]): Uint8Array => new Uint8Array(encode(message));
const login = (secret: string): Uint8Array =>
  frame({ type: "login", request_id: 1, kind: 1, name: "anna", secret });

test("a password is kept in no form, and not even its length", () => {
  const [one, other] = [maskSecret(login("swordfish and more")), maskSecret(login("x"))];
  assert.ok(!Buffer.from(one).includes("swordfish"));
  assert.deepEqual(one, other);
  assert.match(frameText(one), /secret {11}"\*{8}"/);
});

test("a login of another size is masked as a whole", () => {
  const cut = login("swordfish").slice(0, 80);
  new DataView(cut.buffer).setInt32(0, 76, true);
  assert.ok(!Buffer.from(maskSecret(cut)).includes("sword"));
});

test("a frame without a secret is kept as it came", () => {
  const beat = frame({ type: "jog_beat", press: 1, beat: 2 });
  assert.equal(maskSecret(beat), beat);
});

test("a pairing code is masked in the reply, and the request is left", () => {
  const asked = frame({ type: "pairing", request_id: 1, action: 1 });
  assert.equal(maskSecret(asked), asked);
  const reply = frame({ type: "pairing_reply", request_id: 1, lifetime: 60, code: "471122" });
  assert.ok(!Buffer.from(maskSecret(reply)).includes("4711"));
});

test("a ring keeps the newest frames, by number", () => {
  const ring = new PacketRing(3);
  for (let each = 1; each <= 5; each += 1) ring.add("out", new Uint8Array([each]), each);
  assert.deepEqual([ring.count, ring.length, ring.oldest], [5, 3, 3]);
  assert.deepEqual([2, 3, 5, 6].map((each) => ring.at(each)?.frame[0]), [undefined, 3, 5, undefined]);
});

test("large frames push old ones out before there are too many bytes", () => {
  const ring = new PacketRing(100, 1000);
  for (let each = 1; each <= 9; each += 1) ring.add("in", new Uint8Array(300), each);
  assert.deepEqual([ring.length, ring.oldest], [3, 7]);
  ring.add("in", new Uint8Array(5000), 10);
  assert.deepEqual([ring.length, ring.oldest], [1, 10]);
});
