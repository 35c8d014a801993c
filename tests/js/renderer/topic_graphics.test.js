import assert from "node:assert/strict";
import { test } from "node:test";
import { packLines, packTriangles } from "../../../flatland/web/page/js/renderer/topic_graphics.js";

const OWN = 0xff00ff00;
const RED = 0x800000ff;

test("lines without a colour have that of the topic, and widths in metres are negative", () => {
  const lines = new Float32Array([1, 2, 3, 4, 0, 5, 6, 7, 8, 0.5]);
  const words = packLines({ lines, lineColors: new Uint32Array([0, RED]) }, OWN);
  assert.equal(words.length, 2 * 4 * 7);
  const floats = new Float32Array(words.buffer);
  assert.deepEqual([...floats.subarray(0, 4)], [1, 2, 3, 4]);
  assert.deepEqual([words[4], floats[5]], [OWN, 2]);
  assert.deepEqual([words[28 + 4], floats[28 + 5]], [RED, -0.5]);
});

test("each corner of a triangle has its colour", () => {
  const triangles = new Float32Array([1, 2, 3, 4, 5, 6]);
  const words = packTriangles({ triangles, triangleColors: new Uint32Array([RED]) }, OWN);
  const floats = new Float32Array(words.buffer);
  assert.deepEqual([floats[0], floats[1], floats[3], floats[4], floats[6], floats[7]], [1, 2, 3, 4, 5, 6]);
  assert.deepEqual([words[2], words[5], words[8]], [RED, RED, RED]);
});
