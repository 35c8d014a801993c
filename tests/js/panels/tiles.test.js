import assert from "node:assert/strict";
import { test } from "node:test";
import { createTiles } from "../../../flatland/web/page/js/panels/tiles.js";
import { openRoom, status } from "../fake_server.js";

function open(options) {
  const room = openRoom(options);
  createTiles(room.session, room.stage);
  return room;
}

test("a click on a tile enlarges a world, and a button returns to the grid", () => {
  const { elements, session, stage } = open({ worlds: 3 });
  assert.equal(elements["world-name"].textContent, "3 worlds");
  const labels = elements.tiles.children.map((tile) => tile.textContent);
  assert.deepEqual(labels, ["room 0", "room 1", "room 2"]);
  assert.ok(elements["all-worlds"].hidden);
  elements.tiles.children[2].click();
  assert.deepEqual([session.currentIndex, stage.isFitting, elements.tiles.hidden], [2, true, true]);
  assert.equal(document.title, "room 2 – flatland");
  elements["all-worlds"].click();
  assert.equal(session.world, null);
  assert.ok(!elements.tiles.hidden);
});

test("tiles are where the worlds are drawn", () => {
  const { elements, stage } = open({ worlds: 2 });
  const shown = elements.tiles.children.map(({ style }) => parseFloat(style.left));
  const drawn = stage.tiles().map(({ left }) => left);
  assert.deepEqual(shown, drawn);
});

test("the label of a tile shows a pause", () => {
  const { elements, connection } = open({ worlds: 2 });
  connection.emit("message", status({ world: 1, paused: true }));
  assert.equal(elements.tiles.children[1].textContent, "room 1, paused");
});

test("a single world has no grid", () => {
  const { elements } = open();
  assert.ok(elements.tiles.hidden && elements["all-worlds"].hidden);
});
