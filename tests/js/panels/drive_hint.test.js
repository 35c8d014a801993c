import assert from "node:assert/strict";
import { test } from "node:test";
import { createDriveHint } from "../../../flatland/web/page/js/panels/drive_hint.js";
import { Drive } from "../../../flatland/web/page/js/tools/drive.js";
import { describeModel, models, openRoom } from "../fake_server.js";

function open({ prepare = () => {}, ...options } = {}) {
  const room = openRoom(options);
  const { elements, session } = room;
  prepare();
  const drive = new Drive(session);
  createDriveHint(session, drive);
  const text = () => (elements["drive-hint"].hidden ? "" : elements["drive-hint-text"].textContent);
  return { ...room, drive, text };
}

test("the hint explains how to drive, in two steps", (t) => {
  t.mock.timers.enable({ apis: ["setInterval"] });
  const { session, drive, text } = open();
  assert.equal(text(), "Click a robot, then W A S D");
  session.select("robot");
  assert.equal(text(), "Hold W A S D to drive robot");
  drive.press("KeyW");
  assert.equal(text(), "");
  assert.equal(window.localStorage.getItem("flatland.drive-hint"), "done");
  drive.stop();
});

test("a dismissed hint is not shown again in the same browser", () => {
  const { elements, text } = open();
  elements["drive-hint-close"].click();
  assert.equal(text(), "");
  const again = open({ prepare: () => window.localStorage.setItem("flatland.drive-hint", "done") });
  assert.equal(again.text(), "");
});

test("a touch screen has no keys", () => {
  const prepare = () => Object.assign(window, { matchMedia: () => ({ matches: true }) });
  assert.equal(open({ prepare }).text(), "Tap a robot, then drag the stick");
});

test("there is no hint where nothing can be driven", () => {
  assert.equal(open({ readOnly: true }).text(), "");
  assert.equal(open({ worlds: 2 }).text(), "");
  const { connection, text } = open();
  connection.emit("message", models([describeModel(5, "crate")]));
  assert.equal(text(), "");
});
