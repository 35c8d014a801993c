import assert from "node:assert/strict";
import { test } from "node:test";
import { shapeEdges, shapePoints, shapesExtent, shapesRadius } from "../../flatland/web/page/js/shapes.js";
import { SQUARE } from "./fake_server.js";

const START = [0, -6];
const END = [1, 0];
const SHAPES = [
  { kind: "polygon", points: SQUARE },
  { kind: "circle", center: [3, 4], radius: 2 },
  { kind: "edges", points: [START, END] },
];

test("the radius contains all shapes", () => {
  assert.equal(shapesRadius(SHAPES), 7);
  assert.equal(shapesRadius(SHAPES.slice(0, 1)), Math.SQRT1_2);
  assert.equal(shapesRadius(SHAPES.slice(2)), 6);
  assert.equal(shapesRadius([]), 0);
});

test("the extent is measured in a direction", () => {
  assert.equal(shapesExtent(SHAPES, 1, 0), 5);
  assert.equal(shapesExtent(SHAPES, 0, -1), 6);
  assert.equal(shapesExtent(SHAPES, -1, 0), 0.5);
});

test("a polygon is closed, a line is open", () => {
  assert.equal(shapeEdges(SHAPES[0]).length, 4);
  assert.deepEqual(shapeEdges(SHAPES[0])[0], [-0.5, 0.5, -0.5, -0.5]);
  assert.deepEqual(shapeEdges(SHAPES[2]), [[0, -6, 1, 0]]);
});

test("the outline of a circle is a polygon", () => {
  const points = shapePoints(SHAPES[1]);
  assert.equal(points.length, 40);
  for (const [x, y] of points) assert.ok(Math.abs(Math.hypot(x - 3, y - 4) - 2) < 1e-9);
  assert.equal(shapeEdges(SHAPES[1]).length, 40);
});
