import assert from "node:assert/strict";
import { test } from "node:test";
import { ModelDrag } from "../../../flatland/web/page/js/tools/model_drag.js";
import { CRATE, showRoom } from "../fake_server.js";

function begin(t, mode = "move", start = [2, -2, 0.5], spot = { x: 2.25, y: -2 }) {
  t.mock.timers.enable({ apis: ["setInterval"] });
  const room = showRoom();
  const drag = new ModelDrag(room.session, room.world.modelByName("crate"), mode, start, spot);
  return { ...room, drag };
}

function types(connection) {
  return connection.requests.map(({ type }) => type).filter((type) => type !== "look");
}

test("the world is held during the drag, and released after the model has moved", async (t) => {
  const { connection, drag } = begin(t);
  t.mock.timers.tick(2000);
  drag.to({ x: -1, y: -3 });
  await drag.drop();
  t.mock.timers.tick(5000);
  assert.deepEqual(types(connection), ["hold", "hold", "hold", "move", "release"]);
  assert.deepEqual(connection.take("move"), [{ world: 0, model: CRATE, pose: [-1.25, -3, 0.5] }]);
});

test("a turn is around the origin of the model, and wrapped", (t) => {
  const { drag } = begin(t, "turn", [1, 1, 3], { x: 2, y: 1 });
  drag.to({ x: 1, y: 5 });
  const [x, y, heading] = drag.pose;
  assert.deepEqual([x, y], [1, 1]);
  assert.equal(heading.toFixed(6), (3 + Math.PI / 2 - 2 * Math.PI).toFixed(6));
});

test("the user learns what the model overlaps", async (t) => {
  const { connection, session, notices, drag } = begin(t);
  const place = 'overlaps layer "walls" at (1.000, 2.000, 0.000)';
  connection.replies.move = { overlap: place };
  await drag.drop();
  assert.deepEqual(notices, [`Model "crate" ${place}; the physics separates them`]);
  connection.replies.move = { overlap: "" };
  await session.move(CRATE, [0, 0, 0]);
  assert.equal(notices.length, 1);
});

test("errors are shown, and the world is released all the same", async (t) => {
  const { connection, notices, drag } = begin(t);
  connection.replies.move = new Error("the model does not exist any more");
  await drag.drop();
  assert.deepEqual(notices, ["the model does not exist any more"]);
  assert.equal(types(connection).at(-1), "release");
});
