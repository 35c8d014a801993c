import assert from "node:assert/strict";
import { test } from "node:test";
import { valueRange } from "../../../flatland/web/page/js/panels/chart.js";

test("the axis of values has a margin, also around a constant with rounding errors", () => {
  const rounded = (...limits) => valueRange(...limits).map((value) => value.toFixed(6));
  assert.deepEqual(rounded(0, 10), ["-0.800000", "10.800000"]);
  assert.deepEqual(rounded(5, 5 + 1e-9), ["4.500000", "5.500000"]);
  assert.deepEqual(valueRange(0, 0), [-1, 1]);
  assert.deepEqual(valueRange(null, null), [0, 1], "without values");
});
