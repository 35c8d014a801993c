import assert from "node:assert/strict";
import { test } from "node:test";
import { exposeScripting } from "../../flatland/web/page/js/scripting.js";
import { openPage } from "./fake_page.js";
import { createStage, showRoom } from "./fake_server.js";

function open(options) {
  openPage();
  const { session } = showRoom(options);
  const stage = createStage(session);
  exposeScripting(session, stage);
  return { session, stage, api: window.flatland };
}

test("scripts read the state of the page", () => {
  const { session, api } = open();
  session.select("robot");
  const { connection, current, selected, view, worlds } = api.state;
  assert.deepEqual([connection, current, selected], ["connected", 0, "robot"]);
  assert.deepEqual(view, { x: 0, y: 0, zoom: 20, turn: 0 });
  const [{ name, time, paused, rate, edges, models }] = worlds;
  assert.deepEqual([name, time, paused, rate, edges], ["room 0", 1, false, 200, 1]);
  assert.deepEqual(models.crate, { id: 2, pose: [2, -2, 0] });
});

test("points of the world and of the page are converted", () => {
  const { api } = open();
  assert.deepEqual(api.toScreen(1, 1), [120, 30]);
  assert.deepEqual(api.toWorld(120, 30), [1, 1]);
});

test("tiles exist in a grid only", () => {
  const { session, api } = open({ worlds: 2 });
  assert.equal(api.tile(1).length, 4);
  assert.equal(api.tile(5), null);
  session.show(1);
  assert.equal(api.tile(1), null);
});
