import assert from "node:assert/strict";
import { test } from "node:test";

import { shortened } from "../build/short-names.ts";

const none = new Set<string>();

test("a property in camel case gets a short name, and it is no word of the sources", () => {
  const short = shortened(["const aa = { isHeld: true }; use(aa.isHeld, this.#isHeld);"], none);
  assert.equal(short.get("isHeld")?.length, 2);
  assert.notEqual(short.get("isHeld"), "aa");
});

test("a name by which something is looked up keeps its length", () => {
  const short = shortened(['words["touchUp"]; way.touchUp; `data-${other.goTo} dropOn`; x.dropOn; x.goTo'], none);
  assert.equal(short.has("touchUp"), false);
  assert.equal(short.has("dropOn"), false);
  assert.equal(short.has("goTo"), true);
});

test("a word of the browser or of another program keeps its length", () => {
  assert.equal(shortened(["element.textContent"], new Set(["textContent"])).size, 0);
});

test("no two names get the same short one, however many there are", () => {
  const names = Array.from({ length: 3000 }, (_, index) => `isThing${index}`);
  const short = shortened([names.map((each) => `x.${each}`).join("; ")], none);
  assert.equal(new Set(short.values()).size, names.length);
});
