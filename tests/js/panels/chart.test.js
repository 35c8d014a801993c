import assert from "node:assert/strict";
import { test } from "node:test";
import { valueRange } from "../../../flatland/web/page/js/panels/chart.js";

test("the axis of values has a margin", () => {
  assert.deepEqual(valueRange(0, 10), [-0.8, 10.8]);
});

test("a constant is in the middle, without its rounding errors", () => {
  assert.deepEqual(
    valueRange(5, 5 + 1e-9).map((value) => value.toFixed(6)),
    ["4.500000", "5.500000"],
  );
  assert.deepEqual(valueRange(0, 0), [-1, 1]);
});

test("without values, the axis has limits", () => {
  assert.deepEqual(valueRange(null, null), [0, 1]);
});
