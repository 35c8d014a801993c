import assert from "node:assert/strict";
import { test } from "node:test";
import { decodeBinary } from "../../flatland/web/page/js/protocol.js";

/** Returns a message: header, then numbers of 32 bits. */
function message(kind, words, { version = 1, world = 3, time = 2.5 } = {}) {
  const view = new DataView(new ArrayBuffer(16 + 4 * words.length));
  view.setUint8(0, kind);
  view.setUint8(1, version);
  view.setUint16(2, world, true);
  view.setUint32(4, 9, true);
  view.setFloat64(8, time, true);
  for (const [i, word] of words.entries()) {
    if (typeof word === "number") view.setUint32(16 + 4 * i, word, true);
    else view.setFloat32(16 + 4 * i, word[0], true);
  }
  return view.buffer;
}

/** Marks a number as a float. */
const f = (...values) => values.map((value) => [value]);

/** Returns the id, the pose and the ranges of each scan. */
function scansOf(buffer) {
  return decodeBinary(buffer).scans.map(({ id, pose, ranges }) => [id, pose, [...ranges]]);
}

test("edges of a layer", () => {
  const { edges, ...rest } = decodeBinary(message(1, [2, 1, ...f(1, 2, 3, 4)]));
  assert.deepEqual(rest, { kind: "edges", world: 3, time: 2.5, layer: 2 });
  assert.deepEqual([...edges], [1, 2, 3, 4]);
});

test("poses with and without ids", () => {
  const named = decodeBinary(message(2, [2, 7, 8, ...f(1, 2, 3, 4, 5, 6)]));
  assert.equal(named.kind, "poses");
  assert.deepEqual([...named.ids], [7, 8]);
  assert.deepEqual([...named.poses], [1, 2, 3, 4, 5, 6]);
  const same = decodeBinary(message(4, [1, ...f(1, 2, 3)]));
  assert.equal(same.kind, "poses");
  assert.equal(same.ids, null);
  assert.deepEqual([...same.poses], [1, 2, 3]);
});

test("scans in groups of the same number of beams", () => {
  const first = [2, 1, 5, 6, ...f(1, 2, 3, 4, 5, 6), ...f(0.5, 0.25)];
  const second = [1, 2, 7, ...f(7, 8, 9), ...f(1.5, -Infinity)];
  assert.deepEqual(scansOf(message(3, [2, ...first, ...second])), [
    [5, [1, 2, 3], [0.5]],
    [6, [4, 5, 6], [0.25]],
    [7, [7, 8, 9], [1.5, -Infinity]],
  ]);
});

test("compact scans have codes of 16 bits, or ranges", () => {
  const pair = (low, high) => low + 65536 * high;
  const codes = [pair(0, 4), pair(65533, 65534), pair(65535, 0)];
  const first = [1, 5, 16, 8, ...f(1, 2, 3), ...f(0.5), ...codes];
  const second = [1, 2, 32, 9, ...f(7, 8, 9), ...f(1.5, -Infinity)];
  assert.deepEqual(scansOf(message(5, [2, ...first, ...second])), [
    [8, [1, 2, 3], [0, 2, 32766.5, -Infinity, NaN]],
    [9, [7, 8, 9], [1.5, -Infinity]],
  ]);
  assert.throws(() => decodeBinary(message(5, [1, 1, 1, 8, 8, ...f(1, 2, 3), 0])), /of 8 bits/);
});

test("the codes of several scans have their own resolutions", () => {
  const poses = f(0, 0, 0, 1, 1, 1);
  assert.deepEqual(scansOf(message(5, [1, 2, 1, 16, 5, 6, ...poses, ...f(0.5, 0.25), 4 + 65536 * 4])), [
    [5, [0, 0, 0], [2]],
    [6, [1, 1, 1], [1]],
  ]);
});

test("a message of an unknown kind is ignored", () => {
  assert.equal(decodeBinary(message(99, [0])), null);
});

test("another version and a short message are errors", () => {
  assert.throws(() => decodeBinary(message(1, [0, 0], { version: 2 })), /unsupported version 2/);
  const short = { 1: [0, 5], 2: [5], 3: [1, 5, 5], 4: [5], 5: [1, 5, 5, 16] };
  for (const [kind, words] of Object.entries(short)) {
    assert.throws(() => decodeBinary(message(Number(kind), words)), RangeError);
  }
});

test("marks of a topic with texts", () => {
  const text = new TextEncoder().encode('[[1,2,"ä"]]');
  const padded = new Uint8Array(16);
  padded.set(text);
  const tail = [...new Uint32Array(padded.buffer)];
  const head = [7, 1, 1, text.length, ...f(1, 2, 3, 4, 0.5), ...f(1, 2, 3, 4, 5, 6), 0x11223344, 0x55667788];
  const decoded = decodeBinary(message(6, [...head, ...tail]));
  const { lines, lineColors, triangles, triangleColors, ...rest } = decoded;
  assert.deepEqual(rest, { kind: "marks", world: 3, time: 2.5, topic: 7, texts: [[1, 2, "ä"]] });
  assert.deepEqual([...lines], [1, 2, 3, 4, 0.5]);
  assert.deepEqual([...triangles], [1, 2, 3, 4, 5, 6]);
  assert.deepEqual([[...lineColors], [...triangleColors]], [[0x11223344], [0x55667788]]);
});

test("a grid of a topic", () => {
  const { compressed, ...rest } = decodeBinary(message(7, [7, 20, 10, ...f(1, 2, 0.5), [0.25], 0x04030201]));
  const size = { width: 20, height: 10, pose: [1, 2, 0.5], resolution: 0.25 };
  assert.deepEqual(rest, { kind: "grid", world: 3, time: 2.5, topic: 7, ...size });
  assert.deepEqual([...compressed], [1, 2, 3, 4]);
});
