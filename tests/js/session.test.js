import assert from "node:assert/strict";
import { test } from "node:test";
import { settle } from "./fake_page.js";
import { describeModel, hello, models, poses, ROBOT, showRoom, status } from "./fake_server.js";

/** Returns the names of events as they occur. */
function record(session, ...names) {
  const found = [];
  for (const name of names) session.on(name, () => found.push(name));
  return found;
}

test("the only world is displayed, several worlds are a grid", () => {
  assert.equal(showRoom().session.currentIndex, 0);
  const { session } = showRoom({ worlds: 3 });
  assert.equal(session.world, null);
  session.show(2);
  assert.equal(session.world.name, "room 2");
});

test("changes of a task are one request to the server", async () => {
  const { connection, session } = showRoom();
  await settle();
  connection.take("look");
  session.setDisplay("frames", true);
  session.setSeries(["/odom/pose/0"]);
  session.select("robot");
  session.select("robot");
  await settle();
  const views = { worlds: [0], scans: true, compact_scans: true, frames: true, history: true };
  const values = { inspect: ROBOT, series: ["/odom/pose/0"], topics: [], topic_values: [] };
  assert.deepEqual(connection.take("look"), [{ ...views, ...values, hidden: false }]);
});

test("a grid needs neither frames nor numbers nor earlier states", async () => {
  const { connection, session } = showRoom({ worlds: 2 });
  session.setDisplay("frames", true);
  session.setSeries(["/odom/pose/0"]);
  await settle();
  const { worlds, frames, history, series } = connection.take("look").at(-1);
  assert.deepEqual([worlds, frames, history, series], [[0, 1], false, false, []]);
});

test("a hidden page says so, and checks the connection when it is shown again", () => {
  const { connection, session } = showRoom();
  session.setHidden(true);
  assert.equal(connection.take("look").at(-1).hidden, true);
  session.setHidden(false);
  assert.equal(connection.take("probe look")[0].hidden, false);
});

test("a selected model is inspected as soon as it arrives, and again after it is replaced", async () => {
  const { connection, session } = showRoom();
  const events = record(session, "selection");
  session.select("late");
  await settle();
  assert.equal(session.selected, null);
  assert.equal(connection.take("look").at(-1).inspect, null);
  connection.emit("message", models([describeModel(7, "late")], { complete: false }));
  await settle();
  assert.equal(connection.take("look").at(-1).inspect, 7);
  connection.emit("message", models([describeModel(8, "late")], { complete: false, removed: [7] }));
  await settle();
  assert.equal(connection.take("look").at(-1).inspect, 8);
  assert.deepEqual(events, ["selection", "selection", "selection"]);
});

test("another world has no selection, but a selection before the first world remains", () => {
  const { session } = showRoom({ worlds: 2 });
  session.select("robot");
  session.show(1);
  assert.equal(session.selectedName, "robot");
  session.show(0);
  assert.equal(session.selectedName, null);
});

test("worlds of an earlier connection are discarded", () => {
  const { connection, session, world } = showRoom();
  connection.emit("message", hello([0, 1]));
  assert.equal(session.worlds.get(0), world, "hello lists a new world");
  connection.emit("state", "reconnecting");
  connection.emit("state", "connected");
  connection.emit("message", hello([0]));
  assert.notEqual(session.worlds.get(0), world);
  assert.equal(session.world.models.size, 0);
});

test("the grid is displayed when the displayed world is gone, and the last world alone", () => {
  const { connection, session } = showRoom({ worlds: 3 });
  session.show(1);
  connection.emit("message", { type: "gone", world: 1 });
  assert.equal(session.currentIndex, null);
  connection.emit("message", { type: "gone", world: 0 });
  assert.equal(session.currentIndex, 2);
});

test("messages about unknown worlds and data before the description are ignored", () => {
  const { connection, session } = showRoom();
  connection.emit("message", status({ world: 9 }));
  connection.emit("message", { type: "later", world: 0 });
  connection.emit("message", hello([0, 1]));
  connection.emit("data", poses({ 10: [1, 1, 1] }, { world: 1 }));
  assert.equal(session.worlds.get(1).time, 0);
});

test("details and values of the displayed world are events", () => {
  const { connection, session } = showRoom({ worlds: 2 });
  session.show(1);
  const events = record(session, "details", "values");
  for (const world of [0, 1]) {
    connection.emit("message", { type: "details", world });
    connection.emit("message", { type: "values", world });
  }
  assert.deepEqual(events, ["details", "values"]);
});

test("requests concern the displayed world, and errors are notices", async () => {
  const { connection, session } = showRoom({ worlds: 2 });
  session.show(1);
  const notices = [];
  session.on("notice", (notice) => notices.push(notice));
  connection.replies = { files: [], delete: new Error("not possible") };
  assert.deepEqual(await session.attempt("files", {}), { result: [] });
  assert.equal(await session.attempt("delete", { model: 1 }), null);
  assert.deepEqual(connection.take("delete"), [{ world: 1, model: 1 }]);
  connection.emit("message", { type: "notice", level: "warning", text: "slow" });
  assert.deepEqual(notices, [
    { level: "error", text: "not possible", topic: "not possible" },
    { level: "warning", text: "slow", topic: "slow" },
  ]);
});
