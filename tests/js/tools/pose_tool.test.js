import assert from "node:assert/strict";
import { test } from "node:test";
import { createPoseTools } from "../../../flatland/web/page/js/panels/pose_tools.js";
import { PanTool } from "../../../flatland/web/page/js/tools/pan_tool.js";
import { PoseTool } from "../../../flatland/web/page/js/tools/pose_tool.js";
import { ToolBox } from "../../../flatland/web/page/js/tools/tool_box.js";
import { dispatch, settle } from "../fake_page.js";
import { describeModel, models, openRoom, spotAt } from "../fake_server.js";

const POSE_TOPICS = { goal: ["/goal", "/r2/goal"], initial_pose: ["/initialpose"] };

function open(options) {
  const shown = openRoom(options);
  const { connection, session, stage } = shown;
  const goal = new PoseTool(session, stage, "goal", "Goal");
  const initial = new PoseTool(session, stage, "initial_pose", "Initial pose");
  const tools = new ToolBox({ select: new PanTool(), goal, initial_pose: initial });
  createPoseTools(session, tools, { "tool-goal": goal, "tool-initial-pose": initial });
  connection.replies.publish_pose = { received: true };
  const list = () =>
    connection.emit("message", { type: "topics", world: 0, topics: [], pose_topics: POSE_TOPICS });
  const at = (x, y) => spotAt(stage, x, y);
  return { goal, tools, list, at, ...shown };
}

test("the tools are shown if poses can be published", () => {
  const { elements, list } = open();
  assert.ok(elements["tool-goal"].hidden && elements["pose-topics"].hidden);
  list();
  assert.ok(!elements["tool-goal"].hidden && !elements["tool-initial-pose"].hidden);
  const readOnly = open({ readOnly: true });
  readOnly.list();
  assert.ok(readOnly.elements["tool-goal"].hidden && readOnly.elements["pose-topics"].hidden);
});

test("a press sets the position, a drag the heading", async () => {
  const { connection, elements, tools, list, at } = open();
  list();
  elements["tool-goal"].click();
  assert.ok(tools.active.hint.startsWith("Goal on /goal: press"));
  tools.active.down(at(1, 2));
  tools.active.drag(at(1, 2.5));
  tools.active.up(at(1, 3), true);
  await settle();
  const [{ pose, ...rest }] = connection.take("publish_pose");
  assert.deepEqual(rest, { world: 0, purpose: "goal", topic: "/goal" });
  assert.deepEqual(pose, [1, 2, Math.PI / 2]);
  assert.equal(tools.name, "select");
});

test("after a click, the next one sets the heading, also at the same place", async () => {
  const { connection, goal, list, at } = open();
  list();
  const click = (x, y) => {
    goal.down(at(x, y));
    goal.up(at(x, y), false);
  };
  click(0, 0);
  goal.hover(at(3, 0));
  assert.deepEqual(connection.take("publish_pose"), []);
  click(-1, 0);
  click(2, 2);
  click(2, 2);
  await settle();
  const poses = connection.take("publish_pose").map(({ pose }) => pose.join(" "));
  assert.deepEqual(poses, [`0 0 ${Math.PI}`, "2 2 0"]);
  click(0, 0);
  assert.deepEqual([goal.cancel(), goal.cancel()], [true, false]);
});

test("the topic is that of the selected model, or the one that the user has chosen", () => {
  const { connection, session, elements, goal, list } = open();
  connection.emit("message", models([describeModel(5, "second", { namespace: "r2" })], { complete: false }));
  list();
  session.select("second");
  assert.equal(goal.topic, "/r2/goal");
  elements["goal-topic"].value = "/goal";
  dispatch(elements["goal-topic"], "change");
  assert.equal(goal.topic, "/goal");
});

test("a pose that no node receives is reported", async () => {
  const { connection, session, goal, list, at } = open();
  list();
  const notices = [];
  session.on("notice", ({ level, text }) => notices.push([level, text]));
  connection.replies.publish_pose = { received: false };
  goal.down(at(0, 0));
  goal.up(at(1, 0), true);
  await settle();
  assert.deepEqual(notices, [["warning", "No node subscribes to /goal"]]);
});
