import assert from "node:assert/strict";
import { test } from "node:test";
import { LabelPlaces, LINE_HEIGHT } from "../../../flatland/web/page/js/renderer/label_places.js";

test("labels at the same point are below each other, until all lines are taken", () => {
  const places = new LabelPlaces();
  const found = [1, 2, 3, 4].map(() => places.take(100, 50, 40, 3));
  assert.deepEqual(found, [0, LINE_HEIGHT, 2 * LINE_HEIGHT, null]);
});

test("labels beside each other are on the same line", () => {
  const places = new LabelPlaces();
  assert.deepEqual([places.take(100, 50, 40, 1), places.take(140, 50, 40, 1)], [0, 0]);
  assert.equal(places.take(120, 50, 4, 1), null);
});

test("labels of neighbouring bands do not overlap", () => {
  for (const [py, expected] of [
    [50 + LINE_HEIGHT - 1, null],
    [50 - LINE_HEIGHT + 1, null],
    [50 + LINE_HEIGHT, 0],
    [50 - LINE_HEIGHT, 0],
  ]) {
    const places = new LabelPlaces();
    places.take(0, 50, 40, 1);
    assert.equal(places.take(0, py, 40, 1), expected, `${py}`);
  }
});
