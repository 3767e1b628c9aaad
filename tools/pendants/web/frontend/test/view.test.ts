import assert from "node:assert/strict";
import { test } from "node:test";

import {
  eyeOf,
  lookingFrom,
  orbited,
  Projection,
  shifted,
  zoomed,
} from "../src/view/camera.ts";
import { Pace } from "../src/view/pace.ts";
import { probedGraphics } from "../src/view/probe.ts";

const ORBIT = { target: [0, 0, 0.5], azimuth: 0, elevation: 0, distance: 4 } as const;

test("the target is in the middle of the picture", () => {
  const { x, y, depth } = new Projection(ORBIT, 800, 600).at([0, 0, 0.5]);
  assert.deepEqual([x, y, depth], [400, 300, 4]);
});

test("seen along x, y is to the right and z is up", () => {
  const seen = new Projection(ORBIT, 800, 600);
  assert.ok(seen.at([0, 1, 0.5]).x > 400);
  assert.ok(seen.at([0, 0, 1.5]).y < 300);
  assert.ok(seen.at([1, 0, 0.5]).depth < 4);
});

test("a line that ends behind the camera is cut, one that is behind is none", () => {
  const seen = new Projection(ORBIT, 800, 600);
  const cut = seen.line([0, 0, 0.5], [10, 0.2, 0.5]);
  assert.ok(cut !== null && Math.abs(cut[1].depth - seen.near) < 1e-9);
  assert.equal(seen.line([9, 0, 0], [10, 0, 0]), null);
});

test("a drag to the right shows more of the left, and no drag turns the world over", () => {
  assert.ok(eyeOf(orbited(ORBIT, 50, 0, 600))[1] < 0);
  const steep = orbited(orbited(ORBIT, 0, 5000, 600), 0, 5000, 600);
  assert.ok(steep.elevation < Math.PI / 2);
});

test("a shift by points moves the target by as many", () => {
  const moved = shifted(ORBIT, 30, -20, 600);
  const { x, y } = new Projection(moved, 800, 600).at(ORBIT.target);
  assert.ok(Math.abs(x - 430) < 1e-6 && Math.abs(y - 280) < 1e-6);
});

test("zoom ends before the robot is lost", () => {
  let [near, far] = [lookingFrom("iso", 1), lookingFrom("iso", 1)];
  for (let round = 0; round < 100; round++) [near, far] = [zoomed(near, 0.8, 1), zoomed(far, 1.25, 1)];
  assert.ok(near.distance >= 0.05 && far.distance <= 20);
});

test("no picture is begun before the last one is done", () => {
  const pace = new Pace();
  assert.ok(pace.mayDraw(0));
  pace.began(0);
  assert.ok(!pace.mayDraw(1000));
  pace.ended(20);
  assert.ok(pace.mayDraw(20));
});

test("after a slow picture it rests as long as that took", () => {
  const pace = new Pace();
  pace.began(0);
  pace.ended(150);
  assert.ok(!pace.mayDraw(299));
  assert.ok(pace.mayDraw(300));
});

test("only several slow pictures are too slow, and a cheaper kind starts anew", () => {
  const pace = new Pace();
  for (const took of [150, 150, 20, 150]) {
    pace.began(0);
    pace.ended(took);
  }
  assert.ok(!pace.isTooSlow);
  for (let round = 0; round < 3; round++) {
    pace.began(0);
    pace.ended(150);
  }
  assert.ok(pace.isTooSlow);
  pace.restarted();
  assert.ok(!pace.isTooSlow && pace.mayDraw(0));
});

/** A canvas whose WebGL says these names. */
function canvas(plain: string, unmasked?: string): Parameters<typeof probedGraphics>[0] & { lost: number } {
  const made = {
    lost: 0,
    getContext: () =>
      ({
        RENDERER: 1,
        getParameter: (name: number) => (name === 1 ? plain : unmasked),
        getExtension: (name: string) => {
          if (name === "WEBGL_lose_context") return { loseContext: () => made.lost++ };
          return unmasked === undefined ? null : { UNMASKED_RENDERER_WEBGL: 2 };
        },
      }) as unknown as WebGL2RenderingContext,
  };
  return made;
}

test("a browser without WebGL is told, whether it says null or throws", () => {
  assert.deepEqual(probedGraphics({ getContext: () => null }), { graphics: "none", context: null });
  const throws = { getContext: (): never => { throw new Error("no"); } };
  assert.deepEqual(probedGraphics(throws), { graphics: "none", context: null });
});

test("software is told by the name of the renderer", () => {
  assert.equal(probedGraphics(canvas("WebKit WebGL", "ANGLE (Google, Vulkan (SwiftShader))")).graphics, "software");
  assert.equal(probedGraphics(canvas("llvmpipe")).graphics, "software");
  assert.equal(probedGraphics(canvas("WebKit WebGL", "ANGLE (Intel, Mesa UHD)")).graphics, "hardware");
});

test("a context of software is kept, one of hardware given back", () => {
  const software = canvas("llvmpipe");
  assert.notEqual(probedGraphics(software).context, null);
  assert.equal(software.lost, 0);
  const hardware = canvas("Mesa Intel(R) UHD");
  assert.equal(probedGraphics(hardware).context, null);
  assert.equal(hardware.lost, 1);
});
