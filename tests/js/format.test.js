import assert from "node:assert/strict";
import { test } from "node:test";
import { brief, describeValue, fixed, significant } from "../../flatland/web/page/js/format.js";

test("numbers have fixed decimals, a minus sign and no negative zero", () => {
  assert.equal(fixed(1.005, 1), "1.0");
  assert.equal(fixed(-1.25), "−1.25");
  assert.equal(fixed(-0.001), "0.00");
  assert.deepEqual(
    [null, undefined, NaN].map((value) => fixed(value)),
    ["–", "–", "–"],
  );
  assert.deepEqual(
    [Infinity, -Infinity].map((value) => fixed(value)),
    ["∞", "−∞"],
  );
});

test("numbers have significant digits", () => {
  assert.deepEqual(
    [1234.56, -0.00012345, 2].map((value) => significant(value, 3)),
    ["1230", "−0.000123", "2"],
  );
  assert.equal(significant(-Infinity), "−∞");
});

test("an object has a line for each field, and stamps in seconds", () => {
  assert.equal(
    describeValue({ stamp: 1_500_000_000, x: 0.123456, name: "a" }),
    "stamp: 1.5 s\nx: 0.1235\nname: a",
  );
  assert.equal(describeValue(null), "–");
  assert.equal(describeValue([1, 2]), "[1, 2]");
});

test("lists are short", () => {
  assert.equal(brief([1, 2.5, -3]), "[1, 2.5, −3]");
  const many = Array.from({ length: 20 }, (_, i) => i);
  assert.equal(brief(many), "20 values: 0, 1, 2, …");
  assert.equal(brief([...many.slice(0, 16), "… 311 items"]), "311 values: 0, 1, 2, …");
  assert.equal(
    brief([
      [1, 2],
      [3, 4],
      [5, 6],
    ]),
    "3 × 2 values",
  );
});

test("objects and texts are limited", () => {
  assert.equal(brief({ a: 1, b: { c: true } }), "a: 1  b: c: true");
  assert.equal(brief("x".repeat(200)).length, 160);
  assert.ok(brief("x".repeat(200)).endsWith("…"));
});
