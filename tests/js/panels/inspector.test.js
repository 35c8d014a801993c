import assert from "node:assert/strict";
import { test } from "node:test";
import { Emitter } from "../../../flatland/web/page/js/events.js";
import { Inspector, parseNumber } from "../../../flatland/web/page/js/panels/inspector.js";
import { dispatch, settle } from "../fake_page.js";
import { CRATE, describeModel, models, openRoom, poses, ROBOT } from "../fake_server.js";

function open(t, options) {
  let now = 1000;
  t.mock.method(performance, "now", () => now);
  const room = openRoom(options);
  const { elements } = room;
  const stage = new Emitter();
  const [deleted, plotted] = [[], []];
  const actions = { deleteSelected: () => deleted.push(1), plot: (name) => plotted.push(name) };
  new Inspector(room.session, stage, actions);
  const frame = () => {
    now += 1000;
    stage.emit("frame", undefined);
  };
  const values = () => ["pose-x", "pose-y", "pose-theta"].map((id) => elements[id].value);
  const submit = () => dispatch(elements.inspector.querySelector("form"), "submit");
  return { ...room, frame, values, submit, plotted, deleted };
}

function details(model, fields = {}) {
  const rest = { velocity: [3, 4, -0.5], mass: 1.5, inertia: 0.25, contacts: [], plugins: [], topics: [] };
  return { type: "details", world: 0, model, ...rest, ...fields };
}

function facts(part) {
  return part.querySelectorAll("dd").map((each) => each.textContent);
}

test("numbers are read as people write them", () => {
  assert.deepEqual(["1.5", " −2,5 ", "1e3"].map(parseNumber), [1.5, -2.5, 1000]);
  for (const text of ["", "x", "1.2.3", "Infinity"]) assert.ok(Number.isNaN(parseNumber(text)), text);
});

test("the pose of the selected model is displayed and follows the model", (t) => {
  const { elements, connection, session, frame, values } = open(t);
  session.select("crate");
  assert.deepEqual(values(), ["2.000", "-2.000", "0.000"]);
  connection.emit("data", poses({ 20: [-0.00001, 1, 2] }));
  frame();
  assert.deepEqual(values(), ["0.000", "1.000", "2.000"]);
  session.select(null);
  assert.match(elements.inspector.textContent, /Select a model/);
});

test("a pose that the user edits is not overwritten", (t) => {
  const { elements, connection, session, frame, values } = open(t);
  session.select("crate");
  elements["pose-x"].value = "7";
  dispatch(elements["pose-x"], "input");
  connection.emit("data", poses({ 20: [1, 1, 1] }));
  frame();
  assert.deepEqual(values(), ["7", "-2.000", "0.000"]);
  dispatch(elements["pose-x"], "keydown", { key: "Escape" });
  frame();
  assert.deepEqual(values(), ["1.000", "1.000", "1.000"]);
});

test("typed coordinates move the model", async (t) => {
  const { elements, connection, session, submit } = open(t);
  session.select("crate");
  elements["pose-x"].value = "-1,5";
  elements["pose-theta"].value = "0.5";
  submit();
  await settle();
  assert.deepEqual(connection.take("move"), [{ world: 0, model: CRATE, pose: [-1.5, -2, 0.5] }]);
});

test("invalid coordinates are marked", async (t) => {
  const { elements, connection, session, notices, submit } = open(t);
  session.select("crate");
  elements["pose-y"].value = "north";
  submit();
  await settle();
  assert.deepEqual(connection.take("move"), []);
  assert.deepEqual(notices, ["The coordinates must be numbers"]);
  const marks = ["pose-x", "pose-y"].map((id) => elements[id].getAttribute("aria-invalid"));
  assert.deepEqual(marks, ["false", "true"]);
});

test("the properties, topics and plugins of the model are displayed", (t) => {
  const { elements, connection, session } = open(t);
  session.select("robot");
  const scan = { ranges: [1, 2, 3], stamp: 5e8 };
  connection.emit(
    "message",
    details(ROBOT, {
      contacts: ["layer walls", "crate"],
      topics: [
        { topic: "/cmd_vel", type: "Twist", time: null, value: null, kind: "command" },
        { topic: "/scan", type: "LaserScan", time: 0.5, value: scan, kind: "output" },
      ],
      plugins: [{ name: "drive", type: "DiffDrive", parameters: { pub_rate: 50 } }],
    }),
  );
  const [list, topics, plugins] = elements.details.children;
  const motion = ["5.000 m/s", "3.000, 4.000 m/s", "−0.500 rad/s"];
  assert.deepEqual(facts(list), [...motion, "1.5 kg", "0.25 kg m²", "layer walls, crate"]);
  assert.equal(topics.children[0].textContent, "Topics (2)");
  const lines = topics.children[2].children[1].children.map((line) => line.textContent);
  assert.deepEqual(lines, ["ranges: 123", "stamp: 0.5 s"]);
  assert.equal(topics.children[1].children[0].title, "Twist, command");
  assert.match(plugins.textContent, /DiffDrive.*pub_rate.*50/);
  connection.emit("message", details(ROBOT, { velocity: null }));
  assert.equal(topics.children.length, 1);
  assert.equal(facts(list)[0], "– m/s");
});

test("a button beside a number of an output plots the number", (t) => {
  const { elements, connection, session, plotted } = open(t);
  session.select("robot");
  const topics = (speed) => [
    { topic: "/cmd_vel", type: "Twist", time: 1, value: { linear_x: 1 }, kind: "command" },
    { topic: "/odom", type: "Odometry", time: 1, value: { pose: [1, speed], frame: "odom" }, kind: "output" },
  ];
  connection.emit("message", details(ROBOT, { topics: topics(2) }));
  const buttons = elements.details.querySelectorAll("button");
  const names = buttons.map((button) => button.dataset.series);
  assert.deepEqual(names, ["/odom/pose/0", "/odom/pose/1"]);
  buttons[1].focus();
  connection.emit("message", details(ROBOT, { topics: topics(3) }));
  assert.equal(document.activeElement, elements.details.querySelectorAll("button")[1]);
  assert.match(elements.details.textContent, /pose: 13/);
  buttons[1].click();
  assert.deepEqual(plotted, ["/odom/pose/1"]);
});

test("details of another model are ignored", (t) => {
  const { elements, connection, session } = open(t);
  session.select("robot");
  connection.emit("message", details(CRATE));
  assert.equal(elements.details.children.length, 0);
});

test("a model is deleted by a button, which a read-only page lacks", (t) => {
  const { elements, session, deleted } = open(t);
  session.select("crate");
  elements.delete.click();
  assert.equal(deleted.length, 1);
  const visited = open(t, { readOnly: true });
  visited.session.select("crate");
  assert.deepEqual([visited.elements.delete, visited.elements["pose-apply"]], [null, null]);
});

test("the model that replaces the selected one is displayed", (t) => {
  const { elements, connection, session } = open(t);
  session.select("crate");
  connection.emit("message", models([describeModel(9, "crate", { file: "<text>" })], { removed: [2] }));
  assert.equal(elements.inspector.querySelector("h3").textContent, "crate");
  assert.equal(elements.inspector.querySelector(".muted"), null, "a model without a file");
});
