import assert from "node:assert/strict";
import { test } from "node:test";
import { Camera } from "../../../flatland/web/page/js/camera.js";
import { sortIntoCells, visibleRanges } from "../../../flatland/web/page/js/renderer/edge_cells.js";

/** Returns short edges on a square grid of 100 m. */
function manyEdges(count) {
  const side = Math.ceil(Math.sqrt(count));
  const edges = new Float32Array(4 * count);
  for (let i = 0; i < count; i++) {
    const [x, y] = [(100 * (i % side)) / side, (100 * Math.floor(i / side)) / side];
    edges.set([x, y, x + 0.5, y], 4 * i);
  }
  return edges;
}

function rows(edges) {
  return Array.from({ length: edges.length / 4 }, (_, i) => edges.subarray(4 * i, 4 * i + 4).join()).sort();
}

test("few edges are one cell in their order", () => {
  const edges = new Float32Array([3, 4, -1, 2, 0, 0, 1, 1]);
  const sorted = sortIntoCells(edges);
  assert.equal(sorted.edges, edges);
  assert.deepEqual(sorted.cells, [{ start: 0, count: 2, bounds: [-1, 0, 3, 4] }]);
});

test("many edges are sorted into cells that contain all of them", () => {
  const edges = manyEdges(9000);
  const { edges: sorted, cells } = sortIntoCells(edges);
  assert.deepEqual(rows(sorted), rows(edges));
  assert.ok(cells.length > 20);
  let next = 0;
  for (const { start, count, bounds } of cells) {
    assert.equal(start, next);
    next += count;
    for (let i = 4 * start; i < 4 * next; i += 2) {
      assert.ok(sorted[i] >= bounds[0] && sorted[i] <= bounds[2]);
      assert.ok(sorted[i + 1] >= bounds[1] && sorted[i + 1] <= bounds[3]);
    }
  }
  assert.equal(next, 9000);
});

test("edges in one point or on one line are sorted", () => {
  for (const edges of [new Float32Array(4 * 3000), manyEdges(3000).map((value, i) => (i % 2 ? 0 : value))]) {
    const { cells } = sortIntoCells(edges);
    assert.equal(
      cells.reduce((sum, { count }) => sum + count, 0),
      3000,
    );
  }
});

test("a view contains the ranges of its cells, neighbours joined", () => {
  const { edges, cells } = sortIntoCells(manyEdges(9000));
  const camera = Object.assign(new Camera(), { x: 20, y: 80, zoom: 10, width: 100, height: 100 });
  const ranges = visibleRanges(cells, camera);
  const count = ranges.reduce((sum, range) => sum + range.count, 0);
  assert.ok(count < 3000, "most edges are outside");
  for (let i = 0; i < 9000; i++) {
    const isNear = Math.abs(edges[4 * i] - 20) < 5 && Math.abs(edges[4 * i + 1] - 80) < 5;
    const isDrawn = ranges.some(({ start, count: length }) => i >= start && i < start + length);
    assert.ok(isDrawn || !isNear);
  }
  camera.zoom = 0.1;
  assert.deepEqual(visibleRanges(cells, camera), [{ start: 0, count: 9000 }]);
});
