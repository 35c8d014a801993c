import assert from "node:assert/strict";
import { test } from "node:test";
import { deflateSync } from "node:zlib";
import { eventually, settle } from "./fake_page.js";
import { hello, showRoom } from "./fake_server.js";

const PATH = { id: 1, topic: "/plan", type: "nav_msgs/Path", drawn_as: "marks", status: "" };
const GRID = { id: 2, topic: "/costmap", type: "nav_msgs/OccupancyGrid", drawn_as: "grid", status: "" };
const POSE_TOPICS = {
  goal: ["/move_base_simple/goal", "/r2/move_base_simple/goal"],
  initial_pose: ["/initialpose"],
};

function open() {
  const shown = showRoom();
  const topics = { type: "topics", world: 0, topics: [PATH, GRID], pose_topics: POSE_TOPICS };
  shown.connection.emit("message", topics);
  return { ...shown, topics: shown.session.topics };
}

function marks(topic) {
  const none = { triangles: new Float32Array(), triangleColors: new Uint32Array(), texts: [] };
  const lines = { lines: new Float32Array([0, 0, 1, 1, 0]), lineColors: new Uint32Array([0]) };
  return { kind: "marks", world: 0, time: 1, topic, ...lines, ...none };
}

function grid(cells, size = cells.length) {
  const compressed = new Uint8Array(deflateSync(new Uint8Array(cells)));
  const place = { pose: [0, 0, 0], resolution: 1, width: size, height: 1 };
  return { kind: "grid", world: 0, time: 1, topic: 2, ...place, compressed };
}

test("selected topics are requested", async () => {
  const { connection, topics } = open();
  await settle();
  connection.take("look");
  topics.show("/plan", true);
  topics.inspect("/costmap", true);
  topics.setPlotted(["/odom/x", "/scan:ranges/0", "/scan:ranges/1"]);
  await settle();
  const [look] = connection.take("look");
  assert.deepEqual([look.topics, look.topic_values], [["/plan"], ["/costmap", "/scan"]]);
  topics.show("/plan", false);
  await settle();
  assert.deepEqual(connection.take("look")[0].topics, []);
});

test("a drawing is removed with its topic, and one that arrives later is not shown", () => {
  const { connection, topics } = open();
  topics.show("/plan", true);
  connection.emit("data", marks(1));
  assert.ok(topics.marks.has(1));
  topics.show("/plan", false);
  assert.ok(!topics.marks.has(1));
  connection.emit("data", marks(1));
  assert.ok(!topics.marks.has(1));
});

test("the newest grid is decompressed and shown", async () => {
  const { connection, topics } = open();
  topics.show("/costmap", true);
  const before = topics.gridsVersion;
  connection.emit("data", grid([255, 0]));
  connection.emit("data", grid([0, 100, 255]));
  await eventually(() => topics.grids.has(2));
  assert.deepEqual([...topics.grids.get(2).cells], [0, 100, 255]);
  assert.ok(topics.gridsVersion > before);
  // Without a transform, the server replaces the grid by no marks.
  connection.emit("data", marks(2));
  assert.ok(!topics.grids.has(2));
});

test("a grid that arrives after its topic was hidden, or of a wrong size, is discarded", async () => {
  const { topics } = open();
  topics.show("/costmap", true);
  await topics.receiveGrid(grid([0, 0], 3));
  const late = topics.receiveGrid(grid([0, 0]));
  topics.show("/costmap", false);
  await late;
  assert.equal(topics.grids.size, 0);
});

test("a new connection keeps the selection and discards the drawings", () => {
  const { connection, session, topics } = open();
  topics.show("/plan", true);
  connection.emit("data", marks(1));
  connection.emit("state", "reconnecting");
  connection.emit("message", hello([0]));
  assert.equal(topics.entries, null);
  assert.equal(topics.marks.size, 0);
  assert.deepEqual(session.demands().topics, ["/plan"]);
});

test("a page in the background discards its drawings, which the server sends again", () => {
  const { connection, session, topics } = open();
  topics.show("/plan", true);
  connection.emit("data", marks(1));
  session.setHidden(true);
  assert.equal(topics.marks.size, 0);
  session.setHidden(false);
  assert.deepEqual(connection.take("probe look")[0].topics, ["/plan"]);
});

test("a pose is published in the namespace of the selected model if there is a topic", () => {
  const { topics } = open();
  assert.equal(topics.poseTopic("goal", ""), "/move_base_simple/goal");
  for (const namespace of ["r2", "/r2/"]) {
    assert.equal(topics.poseTopic("goal", namespace), "/r2/move_base_simple/goal");
  }
  assert.equal(topics.poseTopic("goal", "r"), "/move_base_simple/goal");
});

test("costmaps are recognized by their names, unless the user decides otherwise", () => {
  const { topics } = open();
  assert.deepEqual([topics.isCostmap("/costmap"), topics.isCostmap("/map")], [true, false]);
  topics.setCostmap("/costmap", false);
  assert.ok(!topics.isCostmap("/costmap"));
});
