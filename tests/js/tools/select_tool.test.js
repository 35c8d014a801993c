import assert from "node:assert/strict";
import { test } from "node:test";
import { SelectTool } from "../../../flatland/web/page/js/tools/select_tool.js";
import { settle } from "../fake_page.js";
import { openRoom, spotAt } from "../fake_server.js";

function open(t, options) {
  t.mock.timers.enable({ apis: ["setInterval"] });
  const room = openRoom(options);
  const at = (x, y, isTouch) => spotAt(room.stage, x, y, isTouch);
  return { ...room, tool: new SelectTool(room.session, room.stage), at };
}

function click(tool, spot) {
  tool.down(spot);
  tool.up(spot, false);
}

test("a click selects a model, a click beside all models selects none", (t) => {
  const { session, tool, at } = open(t);
  click(tool, at(2, -2));
  assert.equal(session.selectedName, "crate");
  click(tool, at(4, 2));
  assert.equal(session.selectedName, null);
});

test("a small movement is a click, a larger one is a drag", async (t) => {
  const { connection, session, tool, at } = open(t);
  tool.down(at(2, -2));
  tool.drag(at(2.1, -2));
  assert.equal(tool.dragged, null);
  tool.drag(at(0, -1));
  assert.equal(session.selectedName, "crate");
  assert.equal(tool.hint, "x 0.00 m, y −1.00 m, θ 0.00 rad");
  tool.up(at(0, -1), true);
  await settle();
  assert.deepEqual(connection.take("move")[0].pose, [0, -1, 0]);
  assert.deepEqual([tool.hint, tool.dragged, tool.settling], ["", null, null]);
});

test("Escape ends a drag without effect, then the selection", async (t) => {
  const { connection, session, tool, at } = open(t);
  tool.down(at(2, -2));
  tool.drag(at(0, 0));
  assert.ok(tool.cancel());
  tool.up(at(0, 0), true);
  await settle();
  assert.deepEqual(connection.take("move"), []);
  assert.equal(connection.take("release").length, 1);
  assert.equal(session.selectedName, "crate");
  assert.deepEqual([tool.cancel(), session.selectedName, tool.cancel()], [true, null, false]);
});

test("the ring around the selected model turns it", async (t) => {
  const { connection, session, world, tool, at } = open(t);
  session.select("crate");
  const radius = tool.ringRadius(world.modelByName("crate"));
  assert.equal(radius, Math.SQRT1_2 + 14 / 20);
  assert.equal(tool.hover(at(2 + radius, -2)), "grab");
  assert.ok(tool.down(at(2 + radius, -2)));
  tool.drag(at(2, -2 + radius));
  tool.up(at(2, -2 + radius), true);
  await settle();
  const [{ pose }] = connection.take("move");
  assert.equal(pose.map((part) => part.toFixed(4)).join(" "), "2.0000 -2.0000 1.5708");
});

test("a model that is dropped while another one settles is shown until it settles itself", async (t) => {
  const { connection, tool, at } = open(t);
  let finish;
  connection.replies.move = new Promise((resolve) => {
    finish = resolve;
  });
  for (const spot of [at(2, -2), at(-2, 1)]) {
    tool.down(spot);
    tool.drag(at(0, 0));
    tool.up(at(0, 0), true);
    await settle();
    connection.replies.move = new Promise(() => {});
  }
  finish();
  await settle();
  assert.equal(tool.settling.model.name, "robot");
});

test("a finger moves only the selected model", (t) => {
  const { session, tool, at } = open(t);
  assert.ok(!tool.down(at(2, -2, true)));
  session.select("crate");
  assert.ok(tool.down(at(2, -2, true)));
});

test("a read-only page selects, but does not move", (t) => {
  const { connection, session, tool, at } = open(t, { readOnly: true });
  const spot = at(2, -2);
  assert.ok(!tool.down(spot));
  tool.drag(at(0, 0));
  tool.up(spot, false);
  assert.equal(session.selectedName, "crate");
  assert.equal(tool.hover(spot), "default");
  assert.deepEqual(connection.take("hold"), []);
});

test("hidden models are not selected", (t) => {
  const { session, tool, at } = open(t);
  session.setDisplay("models", false);
  assert.equal(tool.modelUnder(at(2, -2)), null);
});
