import assert from "node:assert/strict";
import { test } from "node:test";
import { Emitter } from "../../flatland/web/page/js/events.js";

test("a listener that is added during an event is called from the next event on", () => {
  const emitter = new Emitter();
  const calls = [];
  emitter.on("a", (value) => emitter.on("a", () => calls.push(value)));
  emitter.emit("a", 1);
  assert.deepEqual(calls, []);
  emitter.emit("a", 2);
  assert.deepEqual(calls, [1]);
});
