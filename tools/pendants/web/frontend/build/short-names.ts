// Gives the names of our own properties one or two letters, as the bundler does to variables.
//
// A name is shortened everywhere at once, so it means the same thing everywhere. It has to be in
// camel case and ours alone: no word of the browser, of uPlot or three.js, nothing of the wire, and
// in no string of the sources, by which it could be looked up.
import { readdirSync, readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join, sep } from "node:path";
import type { Plugin } from "vite";

const CAMEL = /(?<![\w$#"'`])#?[a-z]+[A-Z][A-Za-z0-9]*(?![\w$])/g;
const WORDS = /[A-Za-z_$][\w$]*/g;
/** Kept by a browser from one version of the page to the next. */
const STORED = ["areRadians", "areLettersOn"];

/** Strings, and types that are strings, which look the same. */
const STRINGS = /"(?:[^"\\\n]|\\.)*"|'(?:[^'\\\n]|\\.)*'/g;
const TEMPLATES = /`(?:[^`\\]|\\.)*`/g;
const IN_TEMPLATE = /\$\{[^{}`]*\}/g;
const COMMENTS = /^\s*(?:\/\/|\/\*\*|\*).*$/gm;

function textsIn(folder: string, ending: string): string[] {
  return readdirSync(folder, { recursive: true, encoding: "utf8" })
    .filter((each) => each.endsWith(ending))
    .map((each) => readFileSync(join(folder, each), "utf8"));
}

/** Words of other people's programs and of the wire. */
function others(): Set<string> {
  const packages = createRequire(import.meta.url);
  const types = join("node_modules", "@typescript");
  const texts = [
    ...textsIn(types, ".d.ts"),
    ...textsIn(join("node_modules", "three", "examples", "jsm"), ".js"),
    ...textsIn(join("node_modules", "three", "build"), "module.js"),
    ...textsIn(join("node_modules", "three", "build"), "core.js"),
    readFileSync(packages.resolve("uplot/dist/uPlot.esm.js"), "utf8"),
    readFileSync(join("src", "operations.ts"), "utf8"),
  ];
  return new Set([...STORED, ...texts.flatMap((text) => text.match(WORDS) ?? [])]);
}

function wordsOfStrings(source: string): string[] {
  const text = source.replace(COMMENTS, "");
  const templates = text.replace(IN_TEMPLATE, " ").match(TEMPLATES) ?? [];
  return [...(text.match(STRINGS) ?? []), ...templates].flatMap((each) => each.match(WORDS) ?? []);
}

/** Return the short name of each that may be shortened, the shortest for what is used most. */
export function shortened(sources: readonly string[], taken: ReadonlySet<string>): Map<string, string> {
  const inStrings = new Set(sources.flatMap(wordsOfStrings));
  const uses = new Map<string, number>();
  for (const text of sources) {
    for (const each of text.match(CAMEL) ?? []) {
      const name = each.replace("#", "");
      if (!taken.has(name) && !inStrings.has(name)) uses.set(name, (uses.get(name) ?? 0) + 1);
    }
  }
  const known = new Set([...taken, ...sources.flatMap((text) => text.match(WORDS) ?? [])]);
  const letters = "abcdefghijklmnopqrstuvwxyz";
  const free = [...letters, "$", "_"]
    .flatMap((one) => [...letters, ...letters.toUpperCase()].map((other) => one + other))
    .concat([...letters].flatMap((one) => [...letters].flatMap((two) => [...letters].map((three) => `${one}${two}$${three}`))))
    .filter((each) => !known.has(each));
  const names = [...uses].sort((one, other) => other[1] - one[1]).map(([name]) => name);
  return new Map(names.map((name, index) => [name, free[index] ?? name]));
}

export function shortNames(): Plugin {
  const inSources = `${sep}src${sep}`;
  const short = shortened(textsIn("src", ".ts"), others());
  return {
    name: "short-names",
    enforce: "pre",
    transform(code, id) {
      if (id.includes("node_modules") || !id.includes(inSources) || !id.endsWith(".ts")) return null;
      const told = code.replace(CAMEL, (name) => {
        const bare = name.replace("#", "");
        return (name.startsWith("#") ? "#" : "") + (short.get(bare) ?? bare);
      });
      return { code: told, map: null };
    },
  };
}
