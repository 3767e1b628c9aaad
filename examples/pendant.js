// A pendant in JavaScript: joint 1 is jogged for half a second, by hold-to-run.
//   node pendant.js [PORT [ADDRESS]]                    docs/pendant-apps.md has the steps.
"use strict";
const net = require("node:net"), { setTimeout: sleep } = require("node:timers/promises");

const HELLO = 65000, VERDICT = 65002, AUTHORITY = 65005, STOP = 65014, RESET = 65015;
const ENABLING = 65016, SET_MODE = 65017, STATE = 65020, JOG_ENDED = 65025, JOG_START = 65030;
const JOG_BEAT = 65031, JOG_RELEASE = 65032, TOPIC = 1, REQUEST = 2;
const SUCCESS = 1, HELD = 1, LET_GO = 0, REDUCED_SPEED = 1, JOINTS = 1, IDLE = 0;

const int = (...values) => Buffer.from(new Int32Array(values).buffer);
const real = (...values) => Buffer.from(new Float32Array(values).buffer);
const text = (value, size) => Buffer.concat([Buffer.from(value), Buffer.alloc(size)], size);

const server = net.connect(Number(process.argv[2] ?? 11010), process.argv[3] ?? "127.0.0.1");
server.setNoDelay(true).on("error", fail);
server.on("close", () => fail(new Error("the connection was lost")));

let unread = Buffer.alloc(0);
const waiting = new Map(); // message type -> who waits for its body
server.on("data", (chunk) => {
  unread = Buffer.concat([unread, chunk]);
  while (unread.length >= 4 && unread.length >= 4 + unread.readInt32LE(0)) {
    const frame = unread.subarray(0, 4 + unread.readInt32LE(0));
    unread = unread.subarray(frame.length);
    const type = frame.readInt32LE(4), reply = frame.readInt32LE(12), body = frame.subarray(16);
    if (type === VERDICT && reply !== SUCCESS) {
      const why = body.subarray(20, 180).toString().replace(/\0.*$/s, "");
      fail(new Error(`refused, code ${body.readInt32LE(4)}: ${why}`));
    }
    waiting.get(type)?.(body);
  }
});

function fail(error) {
  console.error(error.message);
  process.exit(1);
}

function put(type, kind, ...fields) {
  const body = Buffer.concat(fields);
  server.write(Buffer.concat([int(12 + body.length, type, kind, 0), body]));
}

const next = (type) => new Promise((resolve) => waiting.set(type, resolve));
const ask = (type, reply, ...fields) => (put(type, REQUEST, ...fields), next(reply));

async function main() {
  const hello = await ask(HELLO, HELLO, int(2), real(25), text("", 32), text("JavaScript", 32));
  await ask(AUTHORITY, VERDICT, int(1, 1));
  await ask(SET_MODE, VERDICT, int(2, REDUCED_SPEED));
  put(ENABLING, TOPIC, int(HELD));
  const press = [int(3, 1, (await next(STATE)).readInt32LE(0)), real(0.25), int(JOINTS)];
  // Of all joints only joint 1, at half the jog speed.
  const speeds = [int(hello.readInt32LE(16)), real(0.5, ...Array(9).fill(0))];
  await ask(JOG_START, VERDICT, ...press, text("", 32), ...speeds);
  for (let beat = 1; beat <= 10; beat++) {
    await sleep(50);
    put(ENABLING, TOPIC, int(HELD));
    put(JOG_BEAT, TOPIC, int(1, beat));
  }
  const account = await ask(JOG_RELEASE, JOG_ENDED, int(4, 1));
  const [at, time] = [account.readFloatLE(20).toFixed(4), 1e3 * account.readFloatLE(8)];
  console.log(`joint 1 stands at ${at}, ${time.toFixed(0)} ms after the release`);
  await ask(STOP, VERDICT, int(5), text("", 64)); // latches, whoever asks for it
  put(ENABLING, TOPIC, int(LET_GO)); // let go, then reset on purpose
  while ((await next(STATE)).readInt32LE(20) !== IDLE); // it is refused while the robot is stopping
  await ask(RESET, VERDICT, int(6));
  process.exit(0);
}

main().catch(fail);
