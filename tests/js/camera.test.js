import assert from "node:assert/strict";
import { test } from "node:test";
import { Camera } from "../../flatland/web/page/js/camera.js";

function camera(fields = {}) {
  return Object.assign(new Camera(), { x: 3, y: -2, zoom: 50, angle: 0.7, width: 640, height: 480 }, fields);
}

function assertClose(found, expected) {
  assert.equal(found.length, expected.length);
  for (const [i, value] of found.entries()) assert.ok(Math.abs(value - expected[i]) < 1e-9, `${found}`);
}

test("the view is around the camera, and a positive angle turns the world counter-clockwise", () => {
  assertClose(camera().toScreen(3, -2), [320, 240]);
  assertClose(camera({ angle: 0 }).toScreen(4, -1), [370, 190]);
  assertClose(camera({ angle: Math.PI / 2 }).toScreen(4, -2), [320, 190]);
  assertClose(camera().toWorld(...camera().toScreen(1.25, 8)), [1.25, 8]);
});

test("pan moves the world by a distance on the screen", () => {
  const moved = camera();
  const before = moved.toScreen(1, 1);
  moved.pan(30, -12);
  assertClose(moved.toScreen(1, 1), [before[0] + 30, before[1] - 12]);
});

test("zoomAt keeps the point under the pointer", () => {
  const zoomed = camera();
  const point = zoomed.toWorld(100, 50);
  zoomed.zoomAt(1.7, 100, 50, 0.4);
  assertClose(zoomed.toScreen(...point), [100, 50]);
  assertClose([zoomed.zoom, zoomed.angle], [85, 1.1]);
});

test("the scale is limited", () => {
  const zoomed = camera();
  zoomed.zoomAt(1e9, 0, 0);
  assert.equal(zoomed.zoom, 20_000);
  zoomed.zoomAt(1e-9, 0, 0);
  assert.equal(zoomed.zoom, 0.05);
});

test("fit shows an area, also in a turned view", () => {
  for (const angle of [0, 0.4, 2]) {
    const fitted = camera({ angle });
    fitted.fit([-1, -2, 9, 4]);
    assertClose([fitted.x, fitted.y], [4, 1]);
    const corners = [-1, 9].flatMap((x) => [-2, 4].map((y) => fitted.toScreen(x, y)));
    for (const [px, py] of corners) {
      assert.ok(px >= 0 && px <= 640 && py >= 0 && py <= 480, `${angle}: ${px}, ${py}`);
    }
  }
});

test("fit limits the scale for small areas", () => {
  const fitted = camera();
  fitted.fit([1, 1, 1, 1]);
  assert.equal(fitted.zoom, 400);
});

test("a copy has another size", () => {
  const copied = camera().copy(10, 20);
  assert.deepEqual({ ...copied }, { ...camera(), width: 10, height: 20 });
});
