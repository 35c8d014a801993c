import assert from "node:assert/strict";
import { test } from "node:test";
import { forCorners } from "../../../flatland/web/page/js/renderer/quads.js";

test("each record is repeated for the corners of its quad, bit by bit", () => {
  const records = new Float32Array(6).subarray(2);
  new Uint32Array(records.buffer).set([0, 0, 1, 0xffc00001, 3, 4]);
  assert.deepEqual(
    [...forCorners(records, 2)],
    [1, 0xffc00001, 1, 0xffc00001, 1, 0xffc00001, 1, 0xffc00001, 3, 4, 3, 4, 3, 4, 3, 4],
  );
});
