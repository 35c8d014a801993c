import assert from "node:assert/strict";
import { test } from "node:test";
import { PointerInput } from "../../../flatland/web/page/js/tools/pointer.js";
import { dispatch } from "../fake_page.js";
import { openRoom } from "../fake_server.js";

/** A tool that records its calls. */
function recordingTool(handles) {
  const calls = [];
  const tool = { hint: "", calls };
  for (const name of ["down", "drag", "up", "hover", "cancel"]) {
    tool[name] = (spot, moved) => {
      calls.push(spot ? `${name} ${spot.px},${spot.py}${moved === undefined ? "" : ` ${moved}`}` : name);
      return name === "hover" ? "cross" : handles;
    };
  }
  return tool;
}

function open({ handles = true, worlds = 1 } = {}) {
  const { session, stage } = openRoom({ worlds });
  const active = recordingTool(handles);
  const tools = { active, name: "select", updateHint() {} };
  const menus = [];
  new PointerInput(stage, session, tools, ({ px, py }) => menus.push([px, py]));
  const send = (type, clientX, clientY, fields = {}) => {
    const rest = { pointerId: 1, pointerType: "mouse", button: 0, shiftKey: false, ...fields };
    return dispatch(stage.canvas, type, { clientX, clientY, ...rest });
  };
  return { stage, session, send, menus, calls: active.calls, camera: stage.camera };
}

/** Returns the fields of the events of a finger. */
function finger(pointerId) {
  return { pointerId, pointerType: "touch" };
}

test("the tool receives the pointer", () => {
  const { send, calls, stage } = open();
  send("pointermove", 1, 2);
  assert.equal(stage.canvas.dataset.cursor, "cross");
  send("pointerdown", 10, 10);
  send("pointermove", 20, 10);
  send("pointerup", 21, 10);
  assert.deepEqual(calls, ["hover 1,2", "down 10,10", "drag 20,10", "up 21,10 true"]);
});

test("a drag that the tool does not handle moves the view, and a click reaches the tool", () => {
  const { send, calls, stage, camera } = open({ handles: false });
  stage.follow("robot");
  send("pointerdown", 10, 10);
  send("pointermove", 12, 10);
  assert.equal(stage.followed, "robot");
  send("pointermove", 30, 20);
  send("pointerup", 30, 20);
  assert.deepEqual([camera.x.toFixed(2), camera.y.toFixed(2), stage.followed], ["-0.90", "0.50", null]);
  send("pointerdown", 10, 10);
  send("pointerup", 10, 10);
  assert.deepEqual(calls, ["down 10,10", "down 10,10", "up 10,10 false"]);
});

test("Shift and the middle button move the view, the right button turns it", () => {
  for (const fields of [{ shiftKey: true }, { button: 1 }]) {
    const { send, calls, camera } = open();
    send("pointerdown", 50, 50, fields);
    send("pointermove", 70, 50, fields);
    assert.equal(camera.x, -1);
    assert.deepEqual(calls, []);
  }
  const { send, camera, menus } = open();
  send("pointerdown", 50, 50, { button: 2 });
  send("pointermove", 100, 50, { button: 2 });
  assert.equal(camera.angle.toFixed(3), "-0.300");
  send("pointerup", 100, 50, { button: 2 });
  assert.ok(send("contextmenu", 100, 50).defaultPrevented);
  assert.deepEqual(menus, [], "the drag was no click");
  send("pointerdown", 50, 50, { button: 2 });
  send("contextmenu", 50, 50);
  assert.deepEqual(menus, [[50, 50]]);
});

test("two fingers zoom, move and turn the view", () => {
  const { send, calls, camera } = open();
  send("pointerdown", 90, 50, finger(1));
  send("pointerdown", 110, 50, finger(2));
  assert.equal(calls.at(-1), "cancel", "the second finger ends the action of the tool");
  send("pointermove", 70, 50, finger(1));
  send("pointermove", 130, 50, finger(2));
  assert.equal(camera.zoom, 60);
  assert.deepEqual(camera.toScreen(0, 0).map(Math.round), [100, 50]);
  send("pointermove", 70, 110, finger(2));
  assert.equal(camera.angle.toFixed(4), (-Math.PI / 2).toFixed(4));
  send("pointerup", 70, 110, finger(2));
  send("pointerup", 70, 50, finger(1));
  assert.equal(calls.at(-1), "cancel");
});

test("a movement of two fingers moves the view", () => {
  const { send, camera } = open();
  send("pointerdown", 90, 50, finger(1));
  send("pointerdown", 110, 50, finger(2));
  send("pointermove", 90, 30, finger(1));
  send("pointermove", 110, 30, finger(2));
  assert.deepEqual(camera.toScreen(0, 0).map(Math.round), [100, 30]);
});

test("the wheel zooms at the pointer, and at the model that the view follows", () => {
  const { send, stage, camera } = open();
  const point = camera.toWorld(30, 20);
  const event = send("wheel", 30, 20, { deltaY: -100, deltaMode: 0, ctrlKey: false });
  assert.ok(event.defaultPrevented);
  assert.ok(camera.zoom > 20);
  assert.deepEqual(camera.toScreen(...point).map(Math.round), [30, 20]);
  stage.follow("robot");
  const { x, y } = camera;
  send("wheel", 30, 20, { deltaY: 5, deltaMode: 1, ctrlKey: false });
  assert.deepEqual([camera.x.toFixed(9), camera.y.toFixed(9)], [x.toFixed(9), y.toFixed(9)]);
});

test("a cancelled pointer cancels the tool", () => {
  const { send, calls } = open();
  send("pointerdown", 10, 10);
  send("pointercancel", 10, 10);
  send("pointerup", 10, 10);
  assert.deepEqual(calls, ["down 10,10", "cancel"]);
});

test("a double click centres the selected model if it is near", () => {
  const { send, session, stage } = open();
  const centred = [];
  stage.centerOn = (x, y) => centred.push([x, y]);
  session.select("robot");
  send("dblclick", 60, 30);
  session.select("crate");
  send("dblclick", 10, 0);
  assert.deepEqual(centred, [[-2, 1]]);
});

test("the pointer has no effect on a grid of worlds", () => {
  const { send, calls, camera } = open({ worlds: 2 });
  const { zoom } = camera;
  for (const type of ["pointerdown", "pointermove", "wheel"]) send(type, 10, 10, { deltaY: 1 });
  assert.deepEqual([calls, camera.zoom], [[], zoom]);
});
