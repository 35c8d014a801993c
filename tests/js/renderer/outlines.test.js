import assert from "node:assert/strict";
import { test } from "node:test";
import { addArrow, addModelAt } from "../../../flatland/web/page/js/renderer/outlines.js";
import { showRoom } from "../fake_server.js";

function record(draw) {
  const edges = [];
  draw({ add: (...values) => edges.push(values.slice(0, 4).map((value) => Number(value.toFixed(6)) + 0)) });
  return edges;
}

test("a model is outlined as if it had another pose", () => {
  const { world } = showRoom();
  const edges = record((batch) => addModelAt(batch, world, world.modelByName("crate"), [10, 20, 0], 0, 1));
  assert.deepEqual(edges, [
    [9.5, 20.5, 9.5, 19.5],
    [9.5, 19.5, 10.5, 19.5],
    [10.5, 19.5, 10.5, 20.5],
    [10.5, 20.5, 9.5, 20.5],
  ]);
});

test("an arrow is along the x axis of a pose", () => {
  const [shaft] = record((batch) => addArrow(batch, [1, 2, Math.PI / 2], 3, 0));
  assert.deepEqual(shaft, [1, 2, 1, 5]);
});
