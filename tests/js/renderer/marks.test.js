import assert from "node:assert/strict";
import { test } from "node:test";
import { Camera } from "../../../flatland/web/page/js/camera.js";
import {
  addGrid,
  addSmallRobots,
  gridStep,
  resolveFrames,
} from "../../../flatland/web/page/js/renderer/marks.js";
import { createPalette } from "../../../flatland/web/page/js/renderer/palette.js";
import { showRoom } from "../fake_server.js";

test("the lines of the grid have round distances of at least 28 pixels", () => {
  assert.deepEqual([28, 27, 20, 10, 1000, 0.01].map(gridStep), [1, 2, 2, 5, 0.05, 5000]);
});

test("the grid covers the view", () => {
  const camera = Object.assign(new Camera(), { x: 3, zoom: 30, width: 300, height: 300 });
  const lines = [];
  addGrid({ add: (...values) => lines.push(values) }, { camera }, createPalette(true));
  const vertical = lines.filter(([x1, , x2]) => x1 === x2).map(([x]) => x);
  assert.ok(Math.min(...vertical) <= -2 && Math.max(...vertical) >= 8);
  assert.deepEqual(vertical, vertical.map(Math.round));
});

test("robots of less than 10 pixels are drawn as discs of 10 pixels", () => {
  const { world } = showRoom();
  const discs = (zoom) => {
    const added = [];
    const camera = Object.assign(new Camera(), { zoom });
    addSmallRobots({ add: (...values) => added.push(values) }, { camera }, world, createPalette(false));
    return added.map(([x, y, , , , width]) => [x, y, width]);
  };
  assert.deepEqual(discs(12), [[-2, 1, 10]], "a robot of 0.8 m, not the crate");
  assert.deepEqual(discs(13), []);
});

test("frames are resolved from their parents", () => {
  const frames = resolveFrames([
    { parent: "base", child: "laser", pose: [1, 0, 0] },
    { parent: "map", child: "base", pose: [2, 3, Math.PI / 2] },
  ]);
  assert.deepEqual(frames.get("map"), [0, 0, 0]);
  const pose = frames.get("laser").map((value) => value.toFixed(6));
  assert.deepEqual(pose, ["2.000000", "4.000000", "1.570796"]);
});

test("a loop of parents ends", () => {
  const link = (parent, child) => ({ parent, child, pose: [1, 0, 0] });
  const frames = resolveFrames([link("a", "b"), link("b", "a")]);
  assert.deepEqual([...frames.keys()].sort(), ["a", "b"]);
});
