import assert from "node:assert/strict";
import { test } from "node:test";
import { createNotices } from "../../../flatland/web/page/js/panels/notices.js";
import { openRoom } from "../fake_server.js";

function open(t) {
  t.mock.timers.enable({ apis: ["setTimeout"] });
  const { elements, session } = openRoom();
  createNotices(session);
  const texts = () => elements.notices.querySelectorAll("p").map((each) => each.textContent);
  return { elements, session, texts };
}

test("notices disappear after a time that depends on their level", (t) => {
  const { session, texts } = open(t);
  session.notify("error", "wrong");
  session.notify("info", "done");
  t.mock.timers.tick(5000);
  assert.deepEqual(texts(), ["wrong"]);
  t.mock.timers.tick(7000);
  assert.deepEqual(texts(), []);
});

test("a notice replaces those of its topic", (t) => {
  const { session, texts } = open(t);
  session.notify("warning", "Connection lost", "connection");
  session.notify("info", "other");
  session.notify("info", "Connected again", "connection");
  session.notify("info", "other");
  assert.deepEqual(texts(), ["Connected again", "other"]);
});

test("at most four notices are shown, and the user can dismiss them", (t) => {
  const { elements, session, texts } = open(t);
  for (let i = 0; i < 6; i++) session.notify("info", `${i}`);
  assert.deepEqual(texts(), ["2", "3", "4", "5"]);
  elements.notices.querySelector("button").click();
  assert.deepEqual(texts(), ["3", "4", "5"]);
});

test("a button of a notice runs its action once; such a notice stays longer", (t) => {
  const { elements, session, texts } = open(t);
  const calls = [];
  const action = { text: "Undo", run: () => calls.push("undo") };
  session.notify("info", "Deleted crate", "undo", action);
  t.mock.timers.tick(9000);
  assert.deepEqual(texts(), ["Deleted crate"]);
  elements.notices.querySelector("button").click();
  assert.deepEqual([calls, texts()], [["undo"], []]);
  session.notify("info", "Deleted crate", "undo", action);
  t.mock.timers.tick(10_000);
  assert.deepEqual(texts(), []);
});
