import assert from "node:assert/strict";
import { test } from "node:test";
import { MeasureTool } from "../../../flatland/web/page/js/tools/measure_tool.js";
import { PanTool } from "../../../flatland/web/page/js/tools/pan_tool.js";
import { ToolBox } from "../../../flatland/web/page/js/tools/tool_box.js";

function open() {
  const measure = new MeasureTool({ invalidate() {} });
  const tools = new ToolBox({ select: new PanTool(), pan: new PanTool(), measure });
  const events = [];
  for (const name of ["change", "hint"]) tools.on(name, (value) => events.push(`${name}: ${value}`));
  return { tools, events };
}

test("one tool is active, and its hint is shown", () => {
  const { tools, events } = open();
  tools.use("measure");
  tools.use("measure");
  tools.use("select");
  assert.deepEqual(events, ["change: measure", "hint: Select the first point", "change: select", "hint: "]);
});

test("Escape cancels the action, then the tool", () => {
  const { tools } = open();
  tools.use("measure");
  tools.active.down({ x: 0, y: 0 });
  tools.cancel();
  assert.equal(tools.name, "measure");
  tools.cancel();
  assert.equal(tools.name, "select");
});

test("a tool forgets its action when another one becomes active", () => {
  const { tools } = open();
  tools.use("measure");
  tools.active.down({ x: 0, y: 0 });
  tools.use("pan");
  assert.equal(tools.tools.measure.lines.length, 0);
});
