import assert from "node:assert/strict";
import { test } from "node:test";
import { createToolbar } from "../../../flatland/web/page/js/panels/toolbar.js";
import { PanTool } from "../../../flatland/web/page/js/tools/pan_tool.js";
import { ToolBox } from "../../../flatland/web/page/js/tools/tool_box.js";
import { openRoom } from "../fake_server.js";

function open(options, prepare = () => {}) {
  const { elements, session, stage } = openRoom(options);
  prepare();
  const measure = Object.assign(new PanTool(), { hint: "Select the first point" });
  const tools = new ToolBox({ select: new PanTool(), pan: new PanTool(), measure, spawn: new PanTool() });
  const calls = [];
  const names = ["toggleFollow", "zoomIn", "zoomOut"];
  const actions = Object.fromEntries(names.map((name) => [name, () => calls.push(name)]));
  createToolbar(session, stage, tools, actions);
  session.emit("hello", undefined);
  return { elements, session, stage, tools, calls };
}

function pressed(element) {
  return element.getAttribute("aria-pressed") === "true";
}

test("buttons select a tool, and again the selection tool", () => {
  const { elements, tools } = open();
  elements.measure.click();
  assert.deepEqual([tools.name, pressed(elements.measure)], ["measure", true]);
  assert.equal(elements.hint.textContent, "Select the first point");
  elements.measure.click();
  assert.deepEqual([tools.name, pressed(elements.measure)], ["select", false]);
});

test("a model is followed if one is selected", () => {
  const { elements, session, stage, calls } = open();
  assert.ok(elements.follow.disabled);
  session.select("robot");
  elements.follow.click();
  stage.follow("robot");
  assert.deepEqual([calls, pressed(elements.follow)], [["toggleFollow"], true]);
});

test("the tools of one world are disabled in a grid", () => {
  const { elements, session } = open({ worlds: 2 });
  assert.ok(elements.measure.disabled && elements.spawn.disabled);
  session.show(1);
  assert.ok(!elements.measure.disabled && !elements.spawn.disabled);
});

test("a read-only page hides what changes the world", () => {
  const { elements } = open({ readOnly: true });
  assert.ok(elements.spawn.hidden);
  assert.ok(!open().elements.spawn.hidden);
});

test("the side panel remains closed in the next visit, and is closed at first on a phone", () => {
  const { elements } = open();
  assert.ok(pressed(elements["panel-toggle"]));
  elements["panel-toggle"].click();
  assert.equal(document.body.dataset.panel, "closed");
  assert.equal(window.localStorage.getItem("flatland.panel"), "closed");
  open({}, () => window.localStorage.setItem("flatland.panel", "closed"));
  assert.equal(document.body.dataset.panel, "closed");
  open({}, () => Object.assign(window, { innerWidth: 390 }));
  assert.equal(document.body.dataset.panel, "closed");
});
