import assert from "node:assert/strict";
import { test } from "node:test";
import { Drive } from "../../../flatland/web/page/js/tools/drive.js";
import { dispatch, settle } from "../fake_page.js";
import { describeModel, models, openRoom, ROBOT } from "../fake_server.js";

function open(t, options) {
  t.mock.timers.enable({ apis: ["setInterval"] });
  const room = openRoom(options);
  room.session.select("robot");
  return { ...room, drive: new Drive(room.session) };
}

/** Returns the velocities of all commands since the last call. */
function sent(connection) {
  return connection.take("drive").map(({ linear, angular }) => [...linear, angular]);
}

test("each key drives in its direction", (t) => {
  const { drive } = open(t);
  const velocities = {
    ArrowUp: [0.8, 0, 0],
    KeyS: [-0.8, 0, 0],
    ArrowLeft: [0, 0, 1],
    KeyD: [0, 0, -1],
    KeyQ: [0, 0.8, 0],
    KeyE: [0, -0.8, 0],
    "KeyW KeyA": [0.8, 0, 1],
    "KeyW ArrowUp": [0.8, 0, 0],
    "KeyW KeyS": [0, 0, 0],
  };
  for (const [codes, expected] of Object.entries(velocities)) {
    for (const code of codes.split(" ")) assert.ok(drive.press(code));
    assert.deepEqual(drive.velocity(), expected, codes);
    drive.stop();
  }
  assert.ok(!drive.press("KeyX"));
});

test("commands are repeated while a key is held, and the robot stops on release", (t) => {
  const { connection, drive } = open(t);
  const active = [];
  drive.on("active", (value) => active.push(value));
  drive.press("KeyW");
  drive.press("KeyW");
  t.mock.timers.tick(100);
  const ahead = [0.8, 0, 0];
  assert.deepEqual(sent(connection), [ahead, ahead, ahead]);
  dispatch(document, "keyup", { code: "KeyW" });
  t.mock.timers.tick(1000);
  assert.deepEqual(sent(connection), [[0, 0, 0]]);
  assert.deepEqual(active, [true, false]);
});

test("the stick drives with the limits of the sliders", (t) => {
  const { connection, drive } = open(t);
  drive.limits = { speed: 2, turn: 3 };
  drive.deflect(0.5, -1);
  assert.deepEqual(connection.take("drive"), [
    { world: 0, model: ROBOT, command: "/cmd_vel", linear: [1, 0], angular: -3 },
  ]);
});

test("the robot stops if the page loses the focus, is hidden, or another model is selected", (t) => {
  const { connection, session, drive } = open(t);
  for (const end of [
    () => dispatch(window, "blur"),
    () => dispatch(document, "visibilitychange"),
    () => dispatch(document, "focusin"),
    () => connection.emit("state", "reconnecting"),
    () => session.select("crate"),
  ]) {
    session.select("robot");
    drive.press("KeyW");
    end();
    assert.deepEqual(sent(connection).at(-1), [0, 0, 0]);
    assert.equal(drive.model, null);
  }
});

test("only a model with commands can be driven, and none of a read-only page", (t) => {
  const { connection, session, drive } = open(t);
  session.select("crate");
  assert.ok(!drive.press("KeyW"));
  drive.deflect(1, 0);
  assert.deepEqual(sent(connection), []);
  t.mock.timers.reset();
  assert.ok(!open(t, { readOnly: true }).drive.isPossible);
});

test("an error ends the drive", async (t) => {
  const { connection, notices, drive } = open(t);
  connection.replies.drive = new Error("not possible");
  drive.press("KeyW");
  await settle();
  assert.deepEqual(notices, ["not possible"]);
  assert.equal(drive.keys.size, 0);
});

test("a robot that is deleted is not driven any more", (t) => {
  const { connection, drive } = open(t);
  drive.press("KeyW");
  connection.emit("message", models([describeModel(2, "crate")], { complete: true }));
  assert.equal(drive.model, null);
});
