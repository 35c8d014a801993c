import assert from "node:assert/strict";
import { test } from "node:test";
import { createTopicList } from "../../../flatland/web/page/js/panels/topic_list.js";
import { dispatch } from "../fake_page.js";
import { openRoom } from "../fake_server.js";

const PLAN = { id: 1, topic: "/plan", type: "nav_msgs/Path", drawn_as: "marks", status: "" };
const MAP = { id: 2, topic: "/map", type: "nav_msgs/OccupancyGrid", drawn_as: "grid", status: "" };
const ODOM = { id: 3, topic: "/odom", type: "nav_msgs/Odometry", drawn_as: null, status: "" };

function open() {
  const room = openRoom();
  const plotted = [];
  createTopicList(room.session, (name) => plotted.push(name));
  const list = (topics) =>
    room.connection.emit("message", { type: "topics", world: 0, topics, pose_topics: {} });
  const find = (selector) => room.elements["topic-list"].querySelector(selector);
  return { plotted, list, find, topics: room.session.topics, ...room };
}

function check(box) {
  box.checked = true;
  dispatch(box, "change");
}

test("without topics of other programs, the list is hidden", () => {
  const { elements, list } = open();
  assert.ok(elements.topics.hidden);
  list([]);
  assert.ok(!elements.topics.hidden);
});

test("topics are grouped by type and follow their publishers", () => {
  const { elements, list } = open();
  list([ODOM, MAP, PLAN]);
  const texts = () => elements["topic-list"].querySelectorAll("h4, code, summary").map((e) => e.textContent);
  const others = ["Other topics (1)", "/odom"];
  assert.deepEqual(texts(), ["nav_msgs/OccupancyGrid", "/map", "nav_msgs/Path", "/plan", ...others]);
  list([PLAN]);
  assert.deepEqual(texts(), ["nav_msgs/Path", "/plan"]);
  elements["topic-filter"].value = "odom";
  dispatch(elements["topic-filter"], "input");
  assert.deepEqual(texts(), []);
});

test("a check box shows a topic, whose status is displayed at its entry", () => {
  const { list, find, topics } = open();
  list([PLAN]);
  check(find("[data-topic=/plan]"));
  assert.deepEqual([...topics.shown], ["/plan"]);
  assert.ok(find(".status").hidden);
  list([{ ...PLAN, status: 'no transform from "odom" to "map"' }]);
  assert.equal(find(".status").textContent, 'no transform from "odom" to "map"');
  assert.ok(!find(".status").hidden && find("[data-topic=/plan]").checked);
});

test("a control keeps the focus when other topics appear", () => {
  const { list, find } = open();
  list([PLAN]);
  const box = find("[data-topic=/plan]");
  box.focus();
  let focused = 0;
  box.focus = () => focused++;
  list([MAP, PLAN]);
  assert.equal(find("[data-topic=/plan]"), box);
  assert.equal(focused, 1);
});

test("the number of topics that are drawn is limited", () => {
  const { list, find, topics, notices } = open();
  list(Array.from({ length: 33 }, (_, id) => ({ ...PLAN, id, topic: `/plan${id}` })));
  for (let i = 0; i < 33; i++) check(find(`[data-topic=/plan${i}]`));
  assert.equal(topics.shown.size, 32);
  assert.ok(!find("[data-topic=/plan32]").checked);
  assert.deepEqual(notices, ["At most 32 topics are shown"]);
});

test("a grid can have the colours of a costmap", () => {
  const { list, find, topics } = open();
  list([MAP]);
  const box = find("[data-costmap=/map]");
  assert.ok(!box.checked);
  check(box);
  assert.ok(topics.isCostmap("/map"));
});

test("values are a tree that changes in place, and whose numbers can be plotted", () => {
  const { list, find, connection, plotted, elements } = open();
  list([ODOM]);
  const send = (value) =>
    connection.emit("message", { type: "topic_values", world: 0, topic: "/odom", time: 1, value });
  send({ x: 0 });
  assert.equal(find(".leaf"), null);
  find("[data-inspect=/odom]").click();
  send({ header: { frame_id: "odom" }, poses: [{ x: 1.25 }, { x: 2 }], ranges: [1, 2] });
  const leaves = () => elements["topic-list"].querySelectorAll(".leaf");
  const texts = () => leaves().map((leaf) => leaf.textContent);
  assert.deepEqual(texts(), ["frame_id:odom", "x:1.25", "x:2", "ranges:[1, 2]"]);
  const before = leaves();
  send({ header: { frame_id: "odom" }, poses: [{ x: 3 }, { x: 2 }], ranges: [1, 2] });
  assert.deepEqual(texts(), ["frame_id:odom", "x:3", "x:2", "ranges:[1, 2]"]);
  assert.equal(leaves()[1], before[1]);
  leaves()[1].querySelector("button").click();
  assert.deepEqual(plotted, ["/odom:poses/0/x"]);
  find("[data-inspect=/odom]").click();
  assert.ok(find(".tree").hidden);
});
