import assert from "node:assert/strict";
import { test } from "node:test";
import { createDisplays } from "../../../flatland/web/page/js/panels/displays.js";
import { dispatch } from "../fake_page.js";
import { openRoom, worldMessage } from "../fake_server.js";

function open() {
  const room = openRoom();
  createDisplays(room.session);
  return room;
}

function check(box, checked) {
  box.checked = checked;
  dispatch(box, "change");
}

test("a check box switches its display", () => {
  const { elements, session } = open();
  assert.deepEqual([elements["toggle-names"].checked, elements["toggle-trails"].checked], [true, false]);
  check(elements["toggle-trails"], true);
  assert.ok(session.displays.trails);
  session.setDisplay("names", false);
  assert.ok(!elements["toggle-names"].checked);
});

test("each layer of several has a check box", () => {
  const { elements, connection, session, world } = open();
  assert.ok(elements["layer-list"].hidden);
  const layers = ["walls", "glass"].map((name) => ({ name, color: [1, 0, 0, 1], edges: 0 }));
  connection.emit("message", worldMessage(0, { layers }));
  const list = elements["layer-list"];
  assert.ok(!list.hidden);
  const names = list.querySelectorAll("label").map((label) => label.textContent);
  assert.deepEqual(names, ["walls", "glass"]);
  let redrawn = 0;
  session.on("redraw", () => redrawn++);
  check(list.querySelectorAll("input")[1], false);
  const visible = world.layers.map((layer) => layer.visible);
  assert.deepEqual([visible, redrawn], [[true, false], 1]);
});
