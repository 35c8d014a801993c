import assert from "node:assert/strict";
import { test } from "node:test";
import {
  composePoses,
  inversePoint,
  inversePose,
  isInside,
  segmentDistance,
  transformPoint,
  wrapAngle,
} from "../../flatland/web/page/js/geometry.js";
import { SQUARE } from "./fake_server.js";

const POSE = [1, 2, Math.PI / 2];

function assertClose(found, expected) {
  for (const [i, value] of expected.entries()) assert.ok(Math.abs(value - found[i]) < 1e-9, `${found}`);
}

test("angles are wrapped to (-pi, pi]", () => {
  const { PI } = Math;
  const wrapped = [3 * PI, -3 * PI, -PI, 7, -7, 0].map(wrapAngle);
  assertClose(wrapped, [PI, PI, PI, 7 - 2 * PI, 2 * PI - 7, 0]);
});

test("points are transformed from a frame to its parent and back", () => {
  assertClose(transformPoint(POSE, 3, 1), [0, 5]);
  assertClose(inversePoint(POSE, 0, 5), [3, 1]);
});

test("poses are composed and inverted", () => {
  assertClose(composePoses(POSE, [3, 1, Math.PI]), [0, 5, -Math.PI / 2]);
  assertClose(composePoses(POSE, inversePose(POSE)), [0, 0, 0]);
});

test("the distance from a segment is that of its closest point", () => {
  assert.equal(segmentDistance(1, 3, [0, 0], [2, 0]), 3);
  assert.equal(segmentDistance(5, 4, [0, 0], [2, 0]), 5);
  assert.equal(segmentDistance(-3, -4, [0, 0], [2, 0]), 5);
  assert.equal(segmentDistance(3, 4, [0, 0], [0, 0]), 5, "a segment without length");
});

test("points are inside or outside of a polygon", () => {
  const notched = [...SQUARE, [0, 0]];
  assert.ok(isInside(0.2, 0.2, SQUARE));
  assert.ok(!isInside(0.6, 0.2, SQUARE));
  assert.ok(isInside(0.3, 0, notched));
  assert.ok(!isInside(-0.3, 0, notched));
});
