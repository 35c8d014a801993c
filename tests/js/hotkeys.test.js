import assert from "node:assert/strict";
import { test } from "node:test";
import { Hotkeys } from "../../flatland/web/page/js/hotkeys.js";
import { Drive } from "../../flatland/web/page/js/tools/drive.js";
import { MeasureTool } from "../../flatland/web/page/js/tools/measure_tool.js";
import { PanTool } from "../../flatland/web/page/js/tools/pan_tool.js";
import { SelectTool } from "../../flatland/web/page/js/tools/select_tool.js";
import { SpawnTool } from "../../flatland/web/page/js/tools/spawn_tool.js";
import { ToolBox } from "../../flatland/web/page/js/tools/tool_box.js";
import { dispatch } from "./fake_page.js";
import { openRoom } from "./fake_server.js";

/** Actions without modifiers, in the order of their keys in `KEYS`. */
const NAMES = "togglePause step openSpawn deleteSelected toggleFollow togglePlots showAll openHelp";
const ACTIONS = NAMES.split(" ");
const KEYS = [" ", ".", "n", "Delete", "T", "p", "g", "?"];
const TOPICS = { type: "topics", world: 0, topics: [], pose_topics: {} };

function open(options) {
  const { elements, session, stage } = openRoom(options);
  const tools = new ToolBox({
    select: new SelectTool(session, stage),
    pan: new PanTool(),
    measure: new MeasureTool(stage),
    spawn: new SpawnTool(session, stage),
    goal: new PanTool(),
    initial_pose: new PanTool(),
  });
  const drive = new Drive(session);
  const calls = [];
  const names = [...ACTIONS, "copy", "paste", "undo", "redo"];
  const actions = Object.fromEntries(names.map((name) => [name, () => calls.push(name)]));
  const hotkeys = new Hotkeys(stage, session, tools, drive, actions);
  /** Returns the keys that the help lists. */
  const helpKeys = () => {
    hotkeys.createHelp();
    return elements["help-content"].querySelectorAll("kbd").map((key) => key.textContent);
  };
  return { elements, session, stage, tools, drive, calls, hotkeys, helpKeys };
}

/** Presses a key; the event is at an element of the page. */
function press(key, fields = {}, target = document.body) {
  return dispatch(document, "keydown", { key, code: "", target, ...fields }).defaultPrevented;
}

test("keys run their actions", () => {
  const { calls, tools } = open();
  for (const key of KEYS) assert.ok(press(key), key);
  assert.deepEqual(calls, ACTIONS);
  press("m");
  assert.equal(tools.name, "measure");
  press("Escape");
  assert.equal(tools.name, "select");
  for (const key of ["x", "Backspace"]) assert.ok(!press(key), key);
});

test("keys of tools that publish poses require topics of other programs", () => {
  const { session, helpKeys, tools } = open();
  assert.ok(!press("o"));
  assert.ok(!helpKeys().includes("O"));
  session.topics.receiveList(TOPICS);
  assert.ok(helpKeys().includes("O") && helpKeys().includes("I"));
  for (const [key, name] of Object.entries({ o: "goal", i: "initial_pose" })) {
    assert.ok(press(key));
    assert.equal(tools.name, name);
  }
});

test("a read-only page has no keys that change the world", () => {
  const { calls, session, helpKeys } = open({ readOnly: true });
  for (const key of [" ", ".", "n", "Delete"]) assert.ok(!press(key), key);
  press("p");
  assert.deepEqual(calls, ["togglePlots"]);
  session.topics.receiveList(TOPICS);
  for (const key of ["O", "I", "N", "Ctrl+Z", "Ctrl+V"]) assert.ok(!helpKeys().includes(key), key);
});

test("Ctrl and Cmd copy, paste, undo and redo; selected text is copied by the browser", () => {
  const { calls, session } = open();
  session.select("robot");
  assert.ok(press("c", { ctrlKey: true }));
  assert.ok(press("v", { metaKey: true }));
  assert.ok(press("z", { ctrlKey: true }));
  assert.ok(press("Z", { ctrlKey: true, shiftKey: true }));
  assert.ok(press("y", { ctrlKey: true }));
  assert.deepEqual(calls.splice(0), ["copy", "paste", "undo", "redo", "redo"]);
  assert.ok(!press("w", { ctrlKey: true, code: "KeyW" }), "does not drive");
  window.getSelection = () => "selected text";
  assert.ok(!press("c", { ctrlKey: true }));
  assert.ok(press("z", { ctrlKey: true }));
  assert.deepEqual(calls, ["undo"]);
});

test("typed text, shortcuts of the browser and dialogs have no effect", () => {
  const { calls, elements, session, tools } = open();
  session.topics.receiveList(TOPICS);
  press("n", { ctrlKey: true });
  press("n", {}, elements["model-filter"]);
  for (const key of ["z", "y", "c", "v"]) press(key, { ctrlKey: true }, elements["model-filter"]);
  for (const key of ["o", "i"]) press(key, {}, elements["plot-series"]);
  press(" ", {}, elements.pause);
  elements["help-dialog"].showModal();
  press("n");
  assert.deepEqual([calls, tools.name], [[], "select"]);
  elements["help-dialog"].close();
  press("n", {}, elements["toggle-names"]);
  assert.deepEqual(calls, ["openSpawn"], "a check box takes no text");
});

test("a held key repeats only steps and movements of the view", () => {
  const { calls, stage } = open();
  press(".", { repeat: true });
  press(" ", { repeat: true });
  assert.deepEqual(calls, ["step"]);
  press("ArrowRight", { repeat: true });
  assert.ok(stage.camera.x > 0);
});

test("arrows and signs move, zoom and turn the view", () => {
  const { stage } = open();
  const { camera } = stage;
  press("ArrowUp");
  press("ArrowLeft");
  assert.equal(`${camera.x.toFixed(2)} ${camera.y.toFixed(2)}`, "-2.40 2.40");
  press("=");
  assert.equal(camera.zoom, 25);
  press("-");
  assert.equal(camera.zoom, 20);
  press("[");
  assert.ok(camera.angle > 0);
});

test("keys drive the selected robot; with Shift, they move the view", () => {
  const { session, stage, drive } = open();
  session.select("robot");
  assert.ok(press("ArrowUp", { code: "ArrowUp" }));
  assert.deepEqual(drive.velocity(), [0.8, 0, 0]);
  drive.stop();
  press("ArrowUp", { code: "ArrowUp", shiftKey: true });
  assert.deepEqual(drive.velocity(), [0, 0, 0]);
  assert.ok(stage.camera.y > 0);
});

test("Enter clicks at the centre of the view", () => {
  const { session, stage, tools } = open();
  stage.moveView((camera) => Object.assign(camera, { x: 2.1, y: -2 }));
  dispatch(stage.canvas, "keydown", { key: "Enter" });
  assert.equal(session.selectedName, "crate");
  tools.use("measure");
  dispatch(stage.canvas, "keydown", { key: "Enter" });
  press("ArrowRight");
  assert.match(tools.active.hint, /^2.400 m/, "the centre acts as the pointer");
});

test("the help lists each key once", () => {
  const names = open().helpKeys();
  for (const name of ["Space", "Esc", "Ctrl+Z", "Ctrl+Shift+Z", "Ctrl+Y", "Ctrl+C", "Ctrl+V"])
    assert.ok(names.includes(name), name);
  assert.equal(names.length, new Set(names).size);
});

test("the help begins with what the device has", () => {
  const { hotkeys, elements } = open();
  for (const first of ["Keys", "Touch"]) {
    window.matchMedia = () => ({ matches: first === "Touch" });
    hotkeys.createHelp();
    assert.equal(elements["help-content"].querySelector("h3").textContent, first);
  }
});
