import assert from "node:assert/strict";
import { test } from "node:test";
import { modelAt, modelRadius } from "../../flatland/web/page/js/hit.js";
import { WorldState } from "../../flatland/web/page/js/world_state.js";
import { describeModel, models, poses, SQUARE } from "./fake_server.js";

/** Returns a world with models, and the poses of their bodies by their ids. */
function world(list, places = {}) {
  const state = new WorldState(0, "room");
  state.applyModels(models(list));
  state.applyPoses(poses(places));
  return state;
}

function nameAt(state, x, y, tolerance = 0.1) {
  return modelAt(state, x, y, tolerance)?.name ?? null;
}

test("a circle is hit inside and within the tolerance", () => {
  const state = world([describeModel(1, "robot")], { 10: [2, 0, 1] });
  assert.equal(nameAt(state, 2, 0), "robot");
  assert.equal(nameAt(state, 2.45, 0), "robot");
  assert.equal(nameAt(state, 2.55, 0), null);
});

test("a polygon is hit in the frame of its body", () => {
  const shapes = [{ kind: "polygon", points: SQUARE }];
  const state = world([describeModel(1, "crate", { body: { shapes } })], { 10: [0, 0, Math.PI / 4] });
  assert.equal(nameAt(state, 0.65, 0, 0), "crate");
  assert.equal(nameAt(state, 0.5, 0.5, 0), null);
});

test("the area inside an open line is not hit", () => {
  const shapes = [{ kind: "edges", points: SQUARE }];
  const state = world([describeModel(1, "line", { body: { shapes } })], { 10: [0, 0, 0] });
  assert.equal(nameAt(state, 0, 0), null);
  assert.equal(nameAt(state, 0.5, 0), "line");
  assert.equal(nameAt(state, -0.5, 0), null, "the line is not closed");
});

test("the smallest model is hit, and a model without shapes only alone", () => {
  const large = { shapes: [{ kind: "circle", center: [0, 0], radius: 3 }] };
  const point = describeModel(3, "point", { body: { shapes: [] } });
  const list = [describeModel(1, "large", { body: large }), describeModel(2, "small"), point];
  const state = world(list, { 10: [0, 0, 0], 20: [1, 0, 0], 30: [0, 0, 0] });
  assert.equal(nameAt(state, 1, 0), "small");
  assert.equal(nameAt(state, 0, 0), "large");
  state.applyPoses(poses({ 30: [9, 9, 0] }));
  assert.equal(nameAt(state, 9.05, 9), "point");
});

test("a model without a pose is not hit", () => {
  assert.equal(nameAt(world([describeModel(1, "robot")]), 0, 0), null);
});

test("the radius of a model contains all of its bodies", () => {
  const disc = [{ kind: "circle", center: [0, 0], radius: 0.5 }];
  const bodies = [5, 6].map((id) => ({ id, name: "b", color: [1, 1, 1, 1], shapes: disc }));
  const state = world([describeModel(1, "train", { bodies })], { 5: [1, 1, 0], 6: [4, 5, 0] });
  assert.equal(modelRadius(state, state.modelByName("train")), 5.5);
});
