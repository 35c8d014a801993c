import assert from "node:assert/strict";
import { test } from "node:test";
import { PlotCanvas, ticks } from "../../../flatland/web/page/js/panels/plot_canvas.js";
import { FakeElement, openPage } from "../fake_page.js";

function draw(times, values, now, span) {
  openPage();
  const canvas = new FakeElement("canvas");
  new PlotCanvas(canvas).draw(times, values, now, span, false, 0);
  return canvas.context;
}

/** Returns the last points, which are those of the curve. */
function curve(context, count) {
  return context.points.slice(-count);
}

test("ticks are round numbers", () => {
  assert.deepEqual(ticks(0, 10), [0, 5, 10]);
  assert.deepEqual(ticks(-1.5, 0.2), [-1, 0]);
  for (const [low, high] of [
    [0, 1],
    [-3, 88],
    [0.001, 0.0017],
    [1e6, 1e6 + 5],
  ]) {
    const found = ticks(low, high);
    assert.ok(found.length >= 1 && found.length <= 5, `${low}, ${high}: ${found}`);
    assert.ok(found.every((value) => value >= low && value <= high));
  }
});

test("the curve ends at the right, and its highest point is highest", () => {
  const points = curve(draw([0, 5, 10], [0, 2, 1], 10, 10), 3);
  assert.deepEqual(
    points.map(([x]) => x),
    [54, 123, 192],
  );
  assert.ok(points[1][1] < points[2][1] && points[2][1] < points[0][1]);
});

test("only samples of the window are drawn, and the one before", () => {
  const [before, first] = curve(draw([0, 1, 2, 3, 4], [9, 9, 1, 2, 3], 4, 1.5), 3);
  assert.ok(before[0] < 54 && first[0] > 54);
  assert.ok(before[1] < 100, "values before the window do not scale the axis");
});

test("a constant series and one without finite values have an axis", () => {
  assert.ok(draw([1, 2], [5, 5], 2, 10).texts.includes("5"));
  assert.ok(draw([1], [NaN], 1, 10).texts.length > 0);
  assert.ok(draw([], [], 0, 10).texts.length > 0);
});
