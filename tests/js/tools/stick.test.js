import assert from "node:assert/strict";
import { test } from "node:test";
import { Drive } from "../../../flatland/web/page/js/tools/drive.js";
import { createStick } from "../../../flatland/web/page/js/tools/stick.js";
import { dispatch } from "../fake_page.js";
import { openRoom } from "../fake_server.js";

function open(t) {
  t.mock.timers.enable({ apis: ["setInterval"] });
  const { elements, connection, session } = openRoom();
  const drive = new Drive(session);
  createStick(session, drive);
  const send = (type, clientX, clientY, pointerId = 1) =>
    dispatch(elements.stick, type, { clientX, clientY, pointerId });
  return { elements, connection, session, drive, send, knob: elements.stick.children[0] };
}

test("the stick is shown while a robot is selected", (t) => {
  const { elements, session } = open(t);
  assert.ok(elements.drive.hidden);
  session.select("robot");
  assert.ok(!elements.drive.hidden);
  session.select("crate");
  assert.ok(elements.drive.hidden);
});

test("the pad is collapsed, also in the next visit", (t) => {
  const { elements } = open(t);
  assert.equal(elements.drive.dataset.open, "true");
  elements["drive-toggle"].click();
  assert.equal(elements.drive.dataset.open, "false");
  assert.equal(elements["drive-toggle"].getAttribute("aria-expanded"), "false");
  assert.equal(window.localStorage.getItem("flatland.drive-pad"), "closed");
  elements["drive-toggle"].click();
  assert.equal(elements.drive.dataset.open, "true");
});

test("a deflection drives forward and to the left", (t) => {
  const { session, drive, send, knob } = open(t);
  session.select("robot");
  send("pointerdown", 100, 50);
  assert.deepEqual(drive.stick, [0, 0]);
  send("pointermove", 100, 0);
  assert.deepEqual(drive.stick, [1, 0]);
  assert.equal(knob.style.transform, "translate(0px, -34px)");
  send("pointermove", 0, 50);
  assert.deepEqual(drive.stick, [0, 1]);
  send("pointermove", 200, 0, 2);
  assert.deepEqual(drive.stick, [0, 1], "another finger has no effect");
});

test("the robot stops when the stick is released", (t) => {
  const { connection, session, send, knob } = open(t);
  session.select("robot");
  send("pointerdown", 100, 10);
  send("pointerup", 100, 10);
  assert.deepEqual(connection.take("drive").at(-1).linear, [0, 0]);
  assert.equal(knob.style.transform, "translate(0px, 0px)");
});

test("a finger that rests on the stick opens no menu", (t) => {
  const { send } = open(t);
  assert.ok(send("contextmenu", 100, 50).defaultPrevented);
});

test("the sliders limit the speeds", (t) => {
  const { elements, drive } = open(t);
  assert.deepEqual(drive.limits, { speed: 0.8, turn: 1 });
  elements["drive-speed"].value = 2.5;
  dispatch(elements["drive-speed"], "input");
  assert.equal(drive.limits.speed, 2.5);
  assert.equal(elements["drive-speed-text"].textContent, "2.5 m/s");
});
