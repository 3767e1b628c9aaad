// Decodes frames by the generated TypeScript and encodes them again; also what is to be refused.
//
// Arguments: folder of the sources. Input: {"frames": [{table, real, hex}], "refused": [{message,
// real}]} as JSON. Output: per frame its fields and the hex of the same encoded again in its byte
// order; per refused message the error.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

const source = (name) => import(pathToFileURL(join(process.argv[2], name)).href);
const { decodeBy, encodeBy } = await source("codec.ts");
const tables = {
  pendant: (await source("protocol.ts")).LAYOUTS,
  controller: (await source("simple-message.ts")).LAYOUTS,
};
const asked = JSON.parse(readFileSync(0, "utf8"));

const told = (value) => {
  if (value instanceof Uint8Array) return Buffer.from(value).toString("hex");
  if (Array.isArray(value)) return value.map(told);
  if (typeof value === "object") {
    return Object.fromEntries(Object.entries(value).map(([key, each]) => [key, told(each)]));
  }
  if (Object.is(value, -0)) return "-0";
  if (typeof value !== "number" || Number.isFinite(value)) return value;
  return Number.isNaN(value) ? "nan" : value > 0 ? "inf" : "-inf";
};

const frames = asked.frames.map(({ table, real, hex }) => {
  const bytes = Buffer.from(hex, "hex");
  // Somewhere in a larger buffer, as a socket hands it out.
  const within = new Uint8Array(bytes.length + 3);
  within.set(bytes, 3);
  const view = new DataView(within.buffer, 3, bytes.length);
  const message = decodeBy(tables[table], view, real);
  const isLittle = view.getInt32(0, true) === bytes.length - 4;
  const again = Buffer.from(encodeBy(tables[table], message, isLittle, real)).toString("hex");
  const { type, comm_type, reply_code, ...fields } = message;
  return { type, comm_type, reply_code, fields: told(fields), hex: again };
});

const refused = asked.refused.map(({ message, frame, real }) => {
  try {
    if (frame !== undefined) {
      const bytes = new Uint8Array(Buffer.from(frame, "hex"));
      decodeBy(tables.pendant, new DataView(bytes.buffer), real);
    } else {
      encodeBy(tables.pendant, message, true, real);
    }
    return "taken";
  } catch (error) {
    return `${error.name}: ${error.message}`;
  }
});
process.stdout.write(JSON.stringify({ frames, refused }));
