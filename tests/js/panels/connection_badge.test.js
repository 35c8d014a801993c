import assert from "node:assert/strict";
import { test } from "node:test";
import { createConnectionBadge } from "../../../flatland/web/page/js/panels/connection_badge.js";
import { dispatch } from "../fake_page.js";
import { openRoom, status } from "../fake_server.js";

function open(isSupported = true) {
  const room = openRoom();
  createConnectionBadge(room.session, { isSupported });
  const change = (state) => {
    room.connection.state = state;
    room.connection.emit("state", state);
  };
  return { ...room, change };
}

test("the state of the connection is displayed, and its loss is a notice", () => {
  const { elements, notices, change } = open();
  assert.equal(elements.connection.textContent, "connected");
  change("reconnecting");
  assert.equal(elements.connection.textContent, "reconnecting");
  assert.equal(elements.connection.dataset.state, "reconnecting");
  change("connected");
  assert.deepEqual(notices, ["Connection lost; reconnecting", "Connected again"]);
});

test("a simulator that does not answer is displayed", () => {
  const { elements, connection } = open();
  connection.emit("message", status({ stale: 3.7 }));
  assert.equal(elements.connection.textContent, "connected, no answer for 3 s");
  assert.equal(elements.connection.dataset.state, "stale");
});

test("a state that is not renewed is stale, unless the page is hidden", (t) => {
  t.mock.timers.enable({ apis: ["setInterval"] });
  const { elements, connection, change } = open();
  const shown = () => [elements.connection.textContent, elements.message.hidden];
  const wait = (time) => t.mock.timers.tick(time);
  wait(1000);
  assert.deepEqual(shown(), ["connected", true]);
  wait(1000);
  assert.deepEqual(shown(), ["no response", false]);
  assert.ok(document.body.hasAttribute("data-silent"));
  connection.emit("message", status({}));
  assert.deepEqual(shown(), ["connected", true]);
  assert.ok(!document.body.hasAttribute("data-silent"));
  wait(2000);
  change("reconnecting");
  change("connected");
  assert.deepEqual(shown(), ["connected", true]);
  document.hidden = true;
  wait(5000);
  assert.deepEqual(shown(), ["connected", true]);
  document.hidden = false;
  dispatch(document, "visibilitychange");
  wait(1000);
  assert.deepEqual(shown(), ["connected", true]);
});

test("the reasons of the server are notices, each once in a row", () => {
  const { connection, notices } = open();
  for (const reason of ["not JSON", "not JSON", "too many clients"]) connection.emit("reason", reason);
  assert.deepEqual(notices, [
    "The server closed the connection: not JSON",
    "The server closed the connection: too many clients",
  ]);
});

test("a message explains why there is no world", () => {
  const { elements, connection, change } = open();
  assert.ok(elements.message.hidden);
  connection.emit("message", { type: "gone", world: 0 });
  assert.equal(elements.message.textContent, "Waiting for a world…");
  change("refused");
  assert.match(elements.message.textContent, /token is missing or wrong/);
  assert.equal(elements.connection.textContent, "access denied");
  assert.match(open(false).elements.message.textContent, /WebGL 2/);
});
