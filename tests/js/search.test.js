import assert from "node:assert/strict";
import { test } from "node:test";
import { bestMatches } from "../../flatland/web/page/js/search.js";

const NAMES = ["/robot_1/odom/twist/0", "/robot_1/odom/pose/0", "/robot_10/odom/pose/0", "/dropose/1"];

test("names contain all words, in any order and case", () => {
  assert.deepEqual(bestMatches(NAMES, "POSE robot_1 ", 9), [NAMES[1], NAMES[2]]);
  assert.deepEqual(bestMatches(NAMES, "pose tilt", 9), []);
});

test("words at the beginning of parts and short names come first", () => {
  assert.deepEqual(bestMatches(NAMES, "pose", 9), [NAMES[1], NAMES[2], NAMES[3]]);
});

test("the number of matches is limited, and all names match an empty query in their order", () => {
  assert.deepEqual(bestMatches(NAMES, " ", 2), NAMES.slice(0, 2));
});
