import assert from "node:assert/strict";
import { test } from "node:test";
import { factorOf, positionOf, TimeBar } from "../../../flatland/web/page/js/panels/time_bar.js";
import { dispatch } from "../fake_page.js";
import { openRoom, status } from "../fake_server.js";

function open(t, options) {
  let now = 0;
  t.mock.timers.enable({ apis: ["setTimeout"] });
  t.mock.method(performance, "now", () => now);
  const { elements, connection, session } = openRoom(options);
  new TimeBar(session);
  const wait = (time) => {
    now += time;
    t.mock.timers.tick(time);
  };
  const slide = (position) => {
    elements.rate.value = position;
    dispatch(elements.rate, "input");
  };
  return { elements, connection, wait, slide };
}

test("positions of the slider are factors of real time", () => {
  assert.equal(factorOf(0).toFixed(4), "0.0500");
  assert.equal(factorOf(99).toFixed(4), "50.0000");
  for (let position = 0; position < 100; position++) assert.equal(positionOf(factorOf(position)), position);
  for (const factor of [0.1, 1, 2, 10]) assert.equal(factorOf(positionOf(factor)), factor);
  assert.deepEqual([positionOf(1e-9), positionOf(1e9)], [0, 99]);
});

test("the state of the world is displayed", (t) => {
  const { elements, connection, wait } = open(t);
  wait(5000);
  connection.emit("message", status({ time: 12.5, real_time_factor: 0.98, rate: 200 }));
  const texts = ["time", "rtf", "rate-text"].map((id) => elements[id].textContent);
  assert.deepEqual(texts, ["12.50 s", "0.98×", "200 Hz (1×)"]);
  assert.equal(elements.rate.value, "43");
  connection.emit("message", status({ rate: 0, real_time_factor: null }));
  assert.deepEqual([elements.rate.value, elements["rate-text"].textContent], ["100", "as fast as possible"]);
  assert.equal(elements.rtf.textContent, "–");
  connection.emit("message", status({ rate: null }));
  assert.ok(elements.rate.disabled);
  assert.equal(elements["rate-text"].textContent, "set by a program");
});

test("a pause, also by another program, changes the button", (t) => {
  const { elements, connection } = open(t);
  elements.pause.click();
  assert.equal(connection.take("pause").length, 1);
  connection.emit("message", status({ paused: true }));
  assert.equal(elements.rtf.textContent, "paused");
  assert.equal(elements.pause.textContent, "Resume");
  elements.pause.click();
  assert.equal(connection.take("resume").length, 1);
});

test("the buttons concern all worlds of a grid", (t) => {
  const { elements, connection } = open(t, { worlds: 2 });
  elements.step.click();
  assert.deepEqual(connection.take("step"), [
    { world: 0, n: 1 },
    { world: 1, n: 1 },
  ]);
});

test("a read-only page changes nothing", (t) => {
  const { elements, connection } = open(t, { readOnly: true });
  elements.pause.click();
  assert.deepEqual(connection.take("pause"), []);
});

test("the newest rate is sent once per period", (t) => {
  const { connection, wait, slide, elements } = open(t);
  slide(10);
  slide(0);
  assert.equal(elements["rate-text"].textContent, "10 Hz (0.05×)");
  wait(120);
  slide(100);
  wait(120);
  const rates = connection.take("set_rate").map(({ rate }) => rate);
  assert.deepEqual(rates, [10, 0]);
});

test("the slider ignores the state of the world for a while after an input", (t) => {
  const { elements, connection, wait, slide } = open(t);
  slide(0);
  wait(1000);
  connection.emit("message", status({ rate: 200 }));
  assert.equal(elements.rate.value, "0");
  wait(2000);
  connection.emit("message", status({ rate: 200 }));
  assert.equal(elements.rate.value, "43");
});
