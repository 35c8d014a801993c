import assert from "node:assert/strict";
import { test } from "node:test";
import { TRAIL_CAPACITY, Trails } from "../../flatland/web/page/js/trails.js";

/** Returns the coordinates of each segment as a text. */
function segments({ added, segments }) {
  return Array.from({ length: added }, (_, i) => segments.subarray(4 * i, 4 * i + 4).join(" "));
}

test("a trail connects the positions of a model", () => {
  const trails = new Trails();
  trails.setTime(3);
  for (const x of [0, 1, 1.0625, 2]) trails.extend(7, x, 0.5, 4);
  assert.deepEqual(segments(trails), ["0 0.5 1 0.5", "1 0.5 1.0625 0.5", "1.0625 0.5 2 0.5"]);
  assert.equal(trails.colors[0], 4);
});

test("short steps are collected, and long steps leave a gap", () => {
  const trails = new Trails();
  for (const x of [0, 0.03125, 0.0625, 5, 6]) trails.extend(7, x, 0, 0);
  assert.deepEqual(segments(trails), ["0 0 0.0625 0", "5 0 6 0"]);
});

test("times are relative to the first segment", () => {
  const trails = new Trails();
  trails.setTime(1e6);
  trails.extend(1, 0, 0, 0);
  trails.setTime(1e6);
  trails.extend(1, 1, 0, 0);
  trails.setTime(1e6 + 0.5);
  trails.extend(1, 2, 0, 0);
  assert.deepEqual([...trails.times.subarray(0, 2)], [0, 0.5]);
});

test("trails restart if time runs backwards", () => {
  const trails = new Trails();
  trails.setTime(9);
  trails.extend(1, 0, 0, 0);
  trails.extend(1, 1, 0, 0);
  const { generation } = trails;
  trails.setTime(0);
  assert.equal(trails.added, 0);
  assert.equal(trails.generation, generation + 1);
  trails.extend(1, 1.5, 0, 0);
  assert.equal(trails.added, 0, "the position before the reset is forgotten");
});

test("an interrupted trail starts anew", () => {
  const trails = new Trails();
  trails.extend(1, 0, 0, 0);
  trails.interrupt(1);
  trails.extend(1, 1, 0, 0);
  assert.equal(trails.added, 0);
});

test("the oldest segments are replaced", () => {
  const trails = new Trails();
  for (let i = 0; i <= TRAIL_CAPACITY + 1; i++) trails.extend(1, i, 0, 0);
  assert.equal(trails.added, TRAIL_CAPACITY + 1);
  assert.deepEqual([...trails.segments.subarray(0, 4)], [TRAIL_CAPACITY, 0, TRAIL_CAPACITY + 1, 0]);
});
