import assert from "node:assert/strict";
import { test } from "node:test";
import { bodyColor, colorKey, modelColor } from "../../../flatland/web/page/js/renderer/model_colors.js";
import { createPalette } from "../../../flatland/web/page/js/renderer/palette.js";

const PALETTE = createPalette(true);
const UNSET = [1, 1, 1, 0.5];

function model(index, color, { commands = ["/cmd_vel"], lasers = [] } = {}) {
  const created = { index, commands, lasers, bodies: [] };
  created.bodies.push({ color, model: created });
  return created;
}

test("scans have the colour of the robot", () => {
  const robot = model(3, [1, 0.5, 0.5, 1]);
  assert.deepEqual(modelColor(robot, PALETTE), [1, 0.5, 0.5, 1]);
  assert.deepEqual(bodyColor(robot.bodies[0], PALETTE), modelColor(robot, PALETTE));
  assert.equal(colorKey(robot), colorKey(model(4, [1, 0.5, 0.5, 1])));
});

test("robots without a colour are distinguished, other models are not", () => {
  const [first, second] = [model(0, UNSET), model(1, UNSET)];
  assert.deepEqual(modelColor(first, PALETTE), [...PALETTE.series[0], 1]);
  assert.deepEqual(modelColor(second, PALETTE), [...PALETTE.series[1], 1]);
  assert.notEqual(colorKey(first), colorKey(second));
  assert.deepEqual(modelColor(model(1, UNSET, { commands: [] }), PALETTE), UNSET);
});

test("a model without bodies has a colour", () => {
  assert.equal(modelColor({ index: 0, bodies: [], commands: [], lasers: [] }, PALETTE).length, 4);
});
