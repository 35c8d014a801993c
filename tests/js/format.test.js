import assert from "node:assert/strict";
import { test } from "node:test";
import { brief, describeValue, fixed, significant } from "../../flatland/web/page/js/format.js";

test("numbers have fixed decimals, a minus sign and no negative zero", () => {
  assert.equal(fixed(1.005, 1), "1.0");
  assert.equal(fixed(-1.25), "−1.25");
  assert.equal(fixed(-0.001), "0.00");
  const special = [null, undefined, NaN, Infinity, -Infinity].map((value) => fixed(value));
  assert.deepEqual(special, ["–", "–", "–", "∞", "−∞"]);
});

test("numbers have significant digits", () => {
  const texts = [1234.56, -0.00012345, 2].map((value) => significant(value, 3));
  assert.deepEqual(texts, ["1230", "−0.000123", "2"]);
  assert.equal(significant(-Infinity), "−∞");
});

/** Returns the lines of a value as text, and the paths of its numbers. */
function described(value) {
  const lines = describeValue(value);
  const paths = lines.flat().flatMap(({ path }) => (path === null ? [] : [path.join("/")]));
  return [lines.map((parts) => parts.map(({ text }) => text).join("|")), paths];
}

test("an object has a line for each field, and stamps in seconds", () => {
  const value = { stamp: 1_500_000_000, x: 0.123456, name: "a" };
  assert.deepEqual(described(value), [["stamp: 1.5 s", "x: |0.1235", "name: |a"], ["x"]]);
  assert.deepEqual(described(null), [["–"], []]);
});

test("the numbers of short lists and of parts of objects can be plotted", () => {
  assert.deepEqual(described([1, 2]), [["1|2"], ["0", "1"]]);
  assert.deepEqual(described(2.5), [["2.5"], [""]]);
  const twist = { twist: { linear: [1, 0], ok: true } };
  const paths = ["twist/linear/0", "twist/linear/1", "twist/ok"];
  assert.deepEqual(described(twist), [["twist: |linear: |1|0|ok: |true"], paths]);
  const ranges = { ranges: Array.from({ length: 9 }, () => 1) };
  assert.deepEqual(described(ranges), [["ranges: |9 values: 1, 1, 1, …"], []]);
});

test("lists are short", () => {
  assert.equal(brief([1, 2.5, -3]), "[1, 2.5, −3]");
  const many = Array.from({ length: 20 }, (_, i) => i);
  assert.equal(brief(many), "20 values: 0, 1, 2, …");
  assert.equal(brief([...many.slice(0, 16), "… 311 items"]), "311 values: 0, 1, 2, …");
  const row = [1, 2];
  assert.equal(brief([row, row, row]), "3 × 2 values");
});

test("objects and texts are limited", () => {
  assert.equal(brief({ a: 1, b: { c: true } }), "a: 1  b: c: true");
  assert.equal(brief("x".repeat(200)).length, 160);
  assert.ok(brief("x".repeat(200)).endsWith("…"));
});
