import assert from "node:assert/strict";
import { test } from "node:test";
import { MeasureTool } from "../../../flatland/web/page/js/tools/measure_tool.js";

function open() {
  return new MeasureTool({ invalidate() {} });
}

test("two clicks measure a distance, which follows the pointer in between", () => {
  const tool = open();
  assert.equal(tool.hint, "Select the first point");
  tool.down({ x: -3, y: -3 });
  tool.up({ x: -3, y: -3 }, false);
  tool.hover({ x: 0, y: -3 });
  assert.ok(tool.hint.startsWith("3.000 m"));
  tool.down({ x: 0, y: 1 });
  tool.up({ x: 0, y: 1 }, false);
  tool.hover({ x: 9, y: 9 });
  assert.equal(tool.hint, "5.000 m  (Δx 3.000 m, Δy 4.000 m, 53.1°)");
});

test("a drag measures a distance", () => {
  const tool = open();
  tool.down({ x: 0, y: 0 });
  tool.drag({ x: 1, y: 0 });
  tool.up({ x: 0, y: -2 }, true);
  tool.hover({ x: 5, y: 5 });
  assert.equal(tool.hint, "2.000 m  (Δx 0.000 m, Δy −2.000 m, −90.0°)");
});

test("Escape removes all lines, then there is nothing to cancel", () => {
  const tool = open();
  for (let i = 0; i < 2; i++) {
    tool.down({ x: i, y: 0 });
    tool.up({ x: i, y: 1 }, true);
  }
  assert.equal(tool.lines.length, 2);
  assert.deepEqual([tool.cancel(), tool.cancel()], [true, false]);
  assert.equal(tool.lines.length, 0);
});

test("lines are drawn with their lengths", () => {
  const tool = open();
  tool.down({ x: 0, y: 0 });
  tool.up({ x: 3, y: 4 }, true);
  const [edges, labels] = [[], []];
  const batch = { add: (...values) => edges.push(values.slice(0, 4)) };
  const overlay = { add: (...values) => labels.push(values) };
  tool.draw(batch, overlay, { camera: { zoom: 10 } }, { warning: [1, 0, 0, 1] });
  assert.deepEqual(edges[0], [0, 0, 3, 4]);
  assert.deepEqual(labels, [["5.000 m", 1.5, 2, -14]]);
});
