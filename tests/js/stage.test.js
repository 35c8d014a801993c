import assert from "node:assert/strict";
import { test } from "node:test";
import { nextFrame } from "./fake_page.js";
import { openRoom, poses } from "./fake_server.js";

test("the view is fitted to the world until the user moves it", () => {
  const { stage } = openRoom();
  stage.fit();
  stage.updateCamera();
  assert.equal(stage.camera.zoom.toFixed(2), "9.20", "10 m in 100 pixels, less a margin");
  stage.moveView((camera) => camera.pan(20, 0));
  const { x } = stage.camera;
  stage.updateCamera();
  assert.equal(stage.camera.x, x);
});

test("a fitted view is only enlarged while models move", () => {
  const { connection, stage, world } = openRoom();
  world.layers[0].edges = null;
  stage.fit();
  stage.updateCamera();
  const { zoom } = stage.camera;
  connection.emit("data", poses({ 10: [-30, 1, 0] }));
  stage.updateCamera();
  assert.ok(stage.camera.zoom < zoom);
  const { zoom: least } = stage.camera;
  connection.emit("data", poses({ 10: [-2, 1, 0] }));
  stage.updateCamera();
  assert.equal(stage.camera.zoom, least);
  stage.fit();
  stage.updateCamera();
  assert.equal(stage.camera.zoom, zoom);
});

test("the view follows a model until the view is fitted or centred elsewhere", () => {
  const { connection, stage } = openRoom();
  const views = [];
  stage.on("view", () => views.push(stage.followed));
  stage.follow("robot");
  connection.emit("data", poses({ 10: [3, 4, 0] }));
  stage.updateCamera();
  assert.deepEqual([stage.camera.x, stage.camera.y], [3, 4]);
  stage.centerOn(1, 1);
  stage.follow("robot");
  stage.fit();
  assert.deepEqual(views, ["robot", null, "robot", null]);
});

test("a frame is requested when something has changed, and only then", (t) => {
  const { connection, stage } = openRoom();
  nextFrame();
  const draw = t.mock.method(stage, "draw");
  assert.equal(nextFrame(), 0, "nothing has changed");
  connection.emit("data", poses({ 10: [3, 4, 0] }));
  stage.moveView((camera) => camera.pan(20, 0));
  assert.equal(nextFrame(), 1, "both changes are drawn together");
  assert.equal(draw.mock.callCount(), 1);
  stage.invalidate();
  stage.resize();
  nextFrame();
  assert.equal(draw.mock.callCount(), 2, "drawn when the size has changed");
  assert.equal(nextFrame(), 0);
});

test("the view glides to a new centre", (t) => {
  let now = 1000;
  t.mock.method(performance, "now", () => now);
  const { stage } = openRoom();
  stage.centerOn(4, -2);
  const seen = [0, 110, 220].map((time) => {
    now = 1000 + time;
    stage.updateCamera();
    return `${stage.camera.x} ${stage.camera.y}`;
  });
  assert.deepEqual(seen, ["0 0", "2 -1", "4 -2"]);
  assert.equal(stage.glide, null);
});

test("the view does not glide if the user prefers reduced motion", () => {
  const { stage } = openRoom();
  window.matchMedia = () => ({ matches: true });
  stage.centerOn(4, -2);
  assert.deepEqual([stage.camera.x, stage.camera.y], [4, -2]);
});

test("one world fills the canvas, several worlds are tiles with own cameras", () => {
  const { stage } = openRoom();
  assert.deepEqual(stage.viewport(stage.tiles()[0]).camera, stage.camera);
  const { session, stage: grid } = openRoom({ worlds: 4 });
  const tiles = grid.tiles();
  assert.equal(tiles.map(({ world }) => world.index).join(), "0,1,2,3");
  const viewports = tiles.map((tile) => grid.viewport(tile));
  assert.equal(new Set(viewports.map(({ camera }) => camera)).size, 4);
  assert.ok(viewports.every(({ bottom, height }) => bottom >= 0 && bottom + height <= 100));
  assert.equal(grid.viewport(tiles[1]).camera, viewports[1].camera, "the camera is kept");
  session.show(1);
  assert.equal(grid.tiles().length, 1);
});

test("a browser without WebGL 2 is not supported", () => {
  assert.equal(openRoom().stage.isSupported, false);
});
