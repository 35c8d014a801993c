import assert from "node:assert/strict";
import { test } from "node:test";
import { SpawnTool } from "../../../flatland/web/page/js/tools/spawn_tool.js";
import { settle } from "../fake_page.js";
import { openRoom, spotAt } from "../fake_server.js";

function open(t) {
  let now = 0;
  t.mock.method(performance, "now", () => now);
  const room = openRoom();
  const tool = new SpawnTool(room.session, room.stage);
  let done = 0;
  tool.onDone = () => done++;
  tool.begin({ file: "crate.yaml", nextName: () => "crate1", namespace: "", bodies: [] });
  const wait = (time) => {
    now += time;
  };
  return { ...room, tool, wait, at: (x, y) => spotAt(room.stage, x, y), done: () => done };
}

function click(tool, spot) {
  tool.down(spot);
  tool.up(spot);
}

test("a click sets the position, another one the heading", async (t) => {
  const { connection, session, notices, tool, at, wait, done } = open(t);
  tool.hover(at(1, 1));
  assert.deepEqual(tool.pose, [1, 1, 0]);
  assert.equal(tool.hint, "crate1: click or Enter sets the position, Escape cancels");
  click(tool, at(-3, -3));
  assert.match(tool.hint, /heading/);
  wait(1000);
  tool.hover(at(-3, 2));
  click(tool, at(-3, 2));
  await settle();
  assert.deepEqual(connection.take("spawn"), [
    { world: 0, file: "crate.yaml", name: "crate1", pose: [-3, -3, Math.PI / 2], namespace: "crate1" },
  ]);
  assert.deepEqual([done(), session.selectedName, notices], [1, "crate1", ["Spawned crate1"]]);
});

test("a drag sets position and heading", async (t) => {
  const { connection, tool, at } = open(t);
  tool.down(at(1, 1));
  tool.drag(at(0, 1));
  tool.up(at(0, 1));
  await settle();
  assert.deepEqual(connection.take("spawn")[0].pose, [1, 1, Math.PI]);
});

test("a double click keeps the heading", async (t) => {
  const { connection, tool, at, wait } = open(t);
  click(tool, at(1, 1));
  wait(100);
  click(tool, at(1.1, 1.1));
  await settle();
  assert.deepEqual(connection.take("spawn")[0].pose, [1, 1, 0]);
});

test("Escape cancels", (t) => {
  const { connection, tool, at, done } = open(t);
  click(tool, at(1, 1));
  assert.deepEqual([tool.cancel(), tool.cancel()], [true, false]);
  assert.deepEqual([tool.hint, tool.phase, done()], ["", "position", 1]);
  assert.deepEqual(connection.take("spawn"), []);
});

test("a model that cannot be spawned is not selected", async (t) => {
  const { connection, session, tool, at } = open(t);
  connection.replies.spawn = new Error('the name "crate1" is in use');
  click(tool, at(1, 1));
  click(tool, at(1, 2));
  await settle();
  assert.equal(session.selectedName, null);
});
