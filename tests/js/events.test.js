import assert from "node:assert/strict";
import { test } from "node:test";
import { Emitter } from "../../flatland/web/page/js/events.js";

test("listeners are called in the order of their registration", () => {
  const emitter = new Emitter();
  const calls = [];
  emitter.on("a", (value) => calls.push(["first", value]));
  emitter.on("a", (value) => calls.push(["second", value]));
  emitter.on("b", () => calls.push("other"));
  emitter.emit("a", 3);
  emitter.emit("nothing", null);
  assert.deepEqual(calls, [
    ["first", 3],
    ["second", 3],
  ]);
});

test("a listener that is added during an event is called from the next event on", () => {
  const emitter = new Emitter();
  const calls = [];
  emitter.on("a", (value) => emitter.on("a", () => calls.push(value)));
  emitter.emit("a", 1);
  assert.deepEqual(calls, []);
  emitter.emit("a", 2);
  assert.deepEqual(calls, [1]);
});
