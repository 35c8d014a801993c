import assert from "node:assert/strict";
import { test } from "node:test";
import { SpawnDialog } from "../../../flatland/web/page/js/panels/spawn_dialog.js";
import { PanTool } from "../../../flatland/web/page/js/tools/pan_tool.js";
import { SpawnTool } from "../../../flatland/web/page/js/tools/spawn_tool.js";
import { ToolBox } from "../../../flatland/web/page/js/tools/tool_box.js";
import { dispatch, settle } from "../fake_page.js";
import { describeModel, models, openRoom, SQUARE } from "../fake_server.js";

const FILES = [
  { label: "crate.model.yaml", path: "/w/crate.model.yaml" },
  { label: "3 wheels.yaml", path: "/w/3 wheels.yaml" },
];
const BODIES = [{ color: [1, 0, 0, 1], pose: [0, 0, 0], shapes: [{ kind: "polygon", points: SQUARE }] }];

async function open(options) {
  const { elements, connection, session, stage } = openRoom(options);
  connection.replies = { files: FILES, preview: { bodies: BODIES } };
  const tool = new SpawnTool(session, stage);
  const tools = new ToolBox({ select: new PanTool(), spawn: tool });
  const dialog = new SpawnDialog(session, tools, tool);
  elements.spawn.click();
  await settle();
  const select = async (path) => {
    elements["spawn-file"].value = path;
    dispatch(elements["spawn-file"], "change");
    await settle();
  };
  const submit = async () => {
    dispatch(elements["spawn-dialog"].querySelector("form"), "submit");
    await settle();
  };
  const byNumbers = () => {
    elements["spawn-by-numbers"].checked = true;
    dispatch(elements["spawn-by-numbers"], "change");
  };
  const error = () => elements["spawn-error"].textContent;
  return { elements, connection, dialog, tools, tool, select, submit, byNumbers, error };
}

test("the dialog lists the files, and shows the outline and a name for the first one", async () => {
  const { elements, connection } = await open();
  assert.ok(elements["spawn-dialog"].open);
  const labels = elements["spawn-file"].options.map((option) => option.textContent);
  assert.deepEqual(labels, ["crate.model.yaml", "3 wheels.yaml", "Other file…"]);
  assert.equal(elements["spawn-name"].value, "crate");
  assert.deepEqual(connection.take("preview"), [{ world: 0, file: "/w/crate.model.yaml" }]);
  const label = elements["spawn-preview"].getAttribute("aria-label");
  assert.equal(label, "Outline of the model, 1.00 by 1.00 m");
});

test("names are valid", async () => {
  const { elements, select } = await open();
  await select("/w/3 wheels.yaml");
  assert.equal(elements["spawn-name"].value, "model_3_wheels");
});

test("a number is appended to a name in use, unless the user wants none", async () => {
  const { elements, connection, dialog } = await open();
  assert.equal(dialog.nextName(), "crate1");
  connection.emit("message", models([describeModel(7, "crate1")], { complete: false }));
  assert.equal(dialog.nextName(), "crate2");
  elements["spawn-number"].checked = false;
  assert.equal(dialog.nextName(), "crate");
});

test("the model is placed with the pointer", async () => {
  const { elements, tools, tool, submit } = await open();
  await submit();
  assert.deepEqual([elements["spawn-dialog"].open, tools.name], [false, "spawn"]);
  const { file, bodies } = tool.plan;
  assert.deepEqual([file, bodies], ["/w/crate.model.yaml", BODIES]);
  tool.cancel();
  assert.equal(tools.name, "select");
});

test("a model is spawned at typed coordinates", async () => {
  const { elements, connection, byNumbers, submit } = await open();
  byNumbers();
  assert.equal(elements["spawn-ok"].textContent, "Spawn");
  elements["spawn-name"].value = "second";
  elements["spawn-namespace"].value = "ns";
  for (const [name, text] of Object.entries({ x: "3", y: "1,5", theta: "0.5" })) {
    elements[`spawn-${name}`].value = text;
  }
  await submit();
  assert.deepEqual(connection.take("spawn"), [
    { world: 0, file: "/w/crate.model.yaml", name: "second", pose: [3, 1.5, 0.5], namespace: "ns" },
  ]);
});

test("invalid coordinates are an error in the dialog", async () => {
  const { elements, connection, byNumbers, submit, error } = await open();
  byNumbers();
  elements["spawn-x"].value = "";
  await submit();
  assert.equal(error(), "The coordinates must be numbers");
  assert.ok(elements["spawn-dialog"].open);
  assert.deepEqual(connection.take("spawn"), []);
});

test("another file is typed, and its outline is shown before the model is placed", async () => {
  const { elements, connection, select, submit, error } = await open();
  await select("");
  assert.ok(!elements["spawn-path-field"].hidden);
  assert.equal(elements["spawn-preview"].getAttribute("aria-label"), "Outline of the model");
  await submit();
  assert.equal(error(), "The path of a model file is missing");
  connection.replies.preview = new Error("missing.yaml: File does not exist");
  elements["spawn-path"].value = "missing.yaml";
  dispatch(elements["spawn-path"], "change");
  await settle();
  await submit();
  assert.equal(error(), "missing.yaml: File does not exist");
  assert.ok(elements["spawn-dialog"].open);
  connection.replies.preview = { bodies: BODIES };
  elements["spawn-path"].value = " more/box.lua ";
  assert.ok(dispatch(elements["spawn-path"], "keydown", { key: "Enter" }).defaultPrevented);
  await settle();
  assert.deepEqual([error(), elements["spawn-name"].value], ["", "box"]);
  assert.equal(connection.take("preview").at(-1).file, "more/box.lua");
});

test("the outline of a file that is no longer selected is ignored", async () => {
  const { elements, connection, select, dialog } = await open();
  let answer;
  connection.replies.preview = new Promise((resolve) => {
    answer = resolve;
  });
  await select("/w/3 wheels.yaml");
  await select("");
  answer({ bodies: BODIES });
  await settle();
  assert.equal(dialog.bodies, null);
  assert.equal(elements["spawn-preview"].getAttribute("aria-label"), "Outline of the model");
});

test("a read-only page has no dialog", async () => {
  const { elements } = await open({ readOnly: true });
  assert.ok(!elements["spawn-dialog"].open);
});
