import assert from "node:assert/strict";
import { test } from "node:test";
import { Capture } from "../../../flatland/web/page/js/panels/capture.js";
import { openRoom, worldMessage } from "../fake_server.js";

function open({ formats = ["video/webm"] } = {}) {
  const room = openRoom();
  const recorders = [];
  class FakeRecorder {
    static isTypeSupported(format) {
      return formats.includes(format);
    }

    constructor(stream, options) {
      Object.assign(this, { stream, options });
      recorders.push(this);
    }

    start() {}

    stop() {
      this.onstop();
    }
  }
  window.MediaRecorder = globalThis.MediaRecorder = FakeRecorder;
  const tracks = [{ stop: () => tracks.push("stopped") }];
  room.stage.canvas.captureStream = () => ({ getTracks: () => [tracks[0]] });
  return { ...room, recorders, tracks, capture: new Capture(room.stage, room.session) };
}

test("the name of a file contains that of the world, without special characters", () => {
  const { connection, capture } = open();
  connection.emit("message", worldMessage(0, { name: "../my room:1" }));
  assert.match(capture.fileName("png"), /^flatland-.._my_room_1-\d{4}-\d\d-\d\dT\d\d-\d\d-\d\d\.png$/);
});

test("a recording is started, stopped and saved", (t) => {
  t.mock.timers.enable({ apis: ["setTimeout"] });
  const { elements, notices, recorders, tracks } = open();
  elements.record.click();
  assert.equal(recorders[0].options.mimeType, "video/webm");
  assert.equal(elements.record.getAttribute("aria-pressed"), "true");
  recorders[0].ondataavailable({ data: new Blob(["x"]) });
  elements.record.click();
  assert.deepEqual([elements.record.getAttribute("aria-pressed"), tracks[1]], ["false", "stopped"]);
  assert.match(notices[1], /^Recording saved as flatland-room_0-.*\.webm$/);
  elements.record.click();
  assert.equal(recorders.length, 2);
});

test("a browser that cannot record or draw shows an error", () => {
  const { elements, stage, notices } = open({ formats: [] });
  elements.record.click();
  stage.canvas.toBlob = (callback) => callback(null);
  elements.screenshot.click();
  assert.deepEqual(notices, [
    "This browser cannot record WebM videos",
    "The browser cannot create a picture of the view",
  ]);
});
