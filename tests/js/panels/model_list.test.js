import assert from "node:assert/strict";
import { test } from "node:test";
import { createModelList } from "../../../flatland/web/page/js/panels/model_list.js";
import { dispatch, nextFrame } from "../fake_page.js";
import { describeModel, models, openRoom, poses } from "../fake_server.js";

function open(options) {
  const room = openRoom(options);
  createModelList(room.session, room.stage);
  room.session.emit("models", room.world);
  nextFrame();
  const rows = () => room.elements["model-list"].querySelectorAll("button");
  return { ...room, rows };
}

function names(rows) {
  return rows().map((row) => row.dataset.model);
}

test("all models are listed, and a click selects a model", () => {
  const { elements, session, rows } = open();
  assert.deepEqual(names(rows), ["robot", "crate"]);
  assert.equal(elements["model-count"].textContent, "2");
  rows()[1].click();
  assert.equal(session.selectedName, "crate");
  const pressed = rows().map((row) => row.getAttribute("aria-pressed"));
  assert.deepEqual(pressed, ["false", "true"]);
});

test("models that can be driven are marked", () => {
  const marked = (rows) => rows().map((row) => /can be driven/.test(row.textContent));
  assert.deepEqual(marked(open().rows), [true, false]);
  assert.deepEqual(marked(open({ readOnly: true }).rows), [false, false]);
});

test("models without shapes are hidden behind a switch, unless selected", () => {
  const { elements, connection, session, rows } = open();
  assert.ok(elements.shapeless.hidden);
  const frame = describeModel(8, "map_to_odom", { body: { shapes: [] } });
  connection.emit("message", models([frame], { complete: false }));
  nextFrame();
  assert.deepEqual(names(rows), ["robot", "crate"]);
  assert.equal(elements["shapeless-text"].textContent, "Models without shapes (1)");
  session.select("map_to_odom");
  nextFrame();
  assert.deepEqual(names(rows), ["robot", "crate", "map_to_odom"]);
  session.select(null);
  elements["toggle-shapeless"].checked = true;
  dispatch(elements["toggle-shapeless"], "change");
  nextFrame();
  assert.deepEqual(names(rows), ["robot", "crate", "map_to_odom"]);
  assert.equal(window.localStorage.getItem("flatland.shapeless"), "shown");
});

test("a model outside of the view is centred", () => {
  const { connection, stage, rows } = open();
  const centred = [];
  stage.centerOn = (x, y) => centred.push([x, y]);
  rows()[0].click();
  connection.emit("data", poses({ 10: [50, 0, 0] }));
  rows()[0].click();
  assert.deepEqual(centred, [[50, 0]]);
});

test("long lists are shortened, and filtered by name", () => {
  const { elements, connection, rows } = open();
  const list = Array.from({ length: 250 }, (_, i) => describeModel(100 + i, `Box_${i}`));
  connection.emit("message", models(list));
  connection.emit("message", models([describeModel(9, "last")], { complete: false }));
  nextFrame();
  assert.equal(rows().length, 200);
  assert.match(elements["model-list"].textContent, /and 51 more/);
  elements["model-filter"].value = " box_24 ";
  dispatch(elements["model-filter"], "input");
  nextFrame();
  assert.equal(names(rows).join(), ["Box_24", ...Array.from({ length: 10 }, (_, i) => `Box_24${i}`)].join());
});

test("the focus remains on the row of a model when the list is rebuilt", () => {
  const { connection, rows } = open();
  rows()[1].focus();
  connection.emit("message", models([describeModel(7, "new")], { complete: false }));
  nextFrame();
  assert.equal(document.activeElement, rows()[1]);
});
