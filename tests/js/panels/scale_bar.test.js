import assert from "node:assert/strict";
import { test } from "node:test";
import { createScaleBar } from "../../../flatland/web/page/js/panels/scale_bar.js";
import { openRoom } from "../fake_server.js";

test("the bar has a round length of at most 120 pixels", () => {
  const { elements, session, stage } = openRoom();
  createScaleBar(session, stage);
  for (const [zoom, width, text] of [
    [20, "100px", "5 m"],
    [50, "100px", "2 m"],
    [1000, "100px", "10 cm"],
    [0.05, "100px", "2000 m"],
  ]) {
    stage.camera.zoom = zoom;
    stage.emit("frame", undefined);
    assert.deepEqual([elements.scale.style.width, elements["scale-text"].textContent], [width, text]);
  }
});

test("a grid of worlds has no scale", () => {
  const { elements, session, stage } = openRoom({ worlds: 2 });
  createScaleBar(session, stage);
  stage.emit("frame", undefined);
  assert.ok(elements.scale.hidden);
});
