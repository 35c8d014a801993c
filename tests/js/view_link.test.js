import assert from "node:assert/strict";
import { test } from "node:test";
import { ViewLink } from "../../flatland/web/page/js/view_link.js";
import { dispatch } from "./fake_page.js";
import { hello, openRoom } from "./fake_server.js";

function open(t, hash = "", options = {}) {
  t.mock.timers.enable({ apis: ["setTimeout"] });
  const room = openRoom({ hash, ...options });
  return { ...room, link: new ViewLink(room.session, room.stage) };
}

function follow(hash) {
  window.location.hash = hash;
  dispatch(window, "hashchange");
}

test("a link restores the view, the selection and the displays", (t) => {
  const hash = "#x=2.5&y=-1&zoom=40&turn=0.2&follow=robot&select=crate&hide=names,scans&show=trails";
  const { session, stage, link } = open(t, hash);
  const { x, y, zoom, angle } = stage.camera;
  assert.deepEqual([x, y, zoom, angle], [2.5, -1, 40, 0.2]);
  assert.deepEqual([stage.followed, session.selectedName], ["robot", "crate"]);
  const { names, scans, trails, layers } = session.displays;
  assert.deepEqual([names, scans, trails, layers], [false, false, true, true]);
  const again = Object.fromEntries(new URLSearchParams(link.hash().slice(1)));
  const view = { x: "2.500", y: "-1.000", zoom: "40.00", turn: "0.200", follow: "robot" };
  assert.deepEqual(again, { ...view, select: "crate", show: "trails", hide: "scans,names" });
});

test("the address of the first view has no hash", (t) => {
  const { link } = open(t);
  assert.equal(link.hash(), "");
});

test("changes are written to the address after a while, once", (t) => {
  const { session, stage } = open(t);
  stage.moveView((camera) => {
    camera.x = 1;
  });
  session.select("robot");
  assert.equal(window.location.hash, "");
  t.mock.timers.tick(300);
  assert.equal(window.location.hash, "#x=1.000&y=0.000&zoom=20.00&select=robot");
});

test("a link that is opened in the same tab replaces view, selection and displays", (t) => {
  const { session, stage } = open(t, "#x=1&y=1&zoom=50&follow=robot&select=robot&hide=names");
  follow("#x=3&y=2&zoom=30&select=crate");
  assert.deepEqual([stage.camera.x, stage.camera.zoom, stage.followed], [3, 30, null]);
  assert.deepEqual([session.selectedName, session.displays.names], ["crate", true]);
  follow("#show=frames");
  assert.deepEqual([stage.isFitting, session.selectedName, session.displays.frames], [true, null, true]);
});

test("a link that is opened while a change waits to be written replaces the view", (t) => {
  const { stage } = open(t);
  stage.moveView((camera) => {
    camera.x = 1;
  });
  window.location.hash = "#x=3&y=2&zoom=30";
  t.mock.timers.tick(300);
  dispatch(window, "hashchange");
  assert.deepEqual([stage.camera.x, window.location.hash], [3, "#x=3&y=2&zoom=30"]);
});

test("the page does not read what it has written", (t) => {
  const { session, stage, link } = open(t);
  stage.moveView((camera) => {
    camera.x = 1;
  });
  link.write();
  session.selectedName = "robot";
  dispatch(window, "hashchange");
  assert.equal(session.selectedName, "robot");
});

test("invalid numbers are ignored", (t) => {
  for (const hash of ["#x=1&y=2", "#x=a&y=2&zoom=3", "#x=1&y=2&zoom=0", "#x=&y=2&zoom=3"]) {
    const { stage } = open(t, hash);
    assert.ok(stage.isFitting, hash);
    t.mock.timers.reset();
  }
  const { stage } = open(t, "#x=1&y=2&zoom=1e99");
  assert.equal(stage.camera.zoom, 20_000);
});

test("the world of the address is displayed as soon as the server lists it", (t) => {
  const { connection, session, link } = open(t, "#world=2&select=robot", { worlds: 2 });
  assert.equal(session.currentIndex, null);
  connection.emit("message", hello([0, 1, 2]));
  assert.deepEqual([session.currentIndex, session.selectedName], [2, "robot"]);
  assert.ok(link.hash().startsWith("#world=2"));
});
