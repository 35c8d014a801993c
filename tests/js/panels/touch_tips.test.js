import assert from "node:assert/strict";
import { test } from "node:test";
import { createTouchTips } from "../../../flatland/web/page/js/panels/touch_tips.js";
import { dispatch, openPage } from "../fake_page.js";

function open(t) {
  t.mock.timers.enable({ apis: ["setTimeout"] });
  const elements = openPage();
  createTouchTips();
  const finger = { target: elements.fit, pointerType: "touch", clientX: 0, clientY: 0 };
  const send = (type, fields = {}) => dispatch(document, type, { ...finger, ...fields });
  const shown = () => (elements.tip.hidden ? null : elements.tip.textContent);
  return { elements, send, shown };
}

test("a long press shows the title of a button and does not click", (t) => {
  const { elements, send, shown } = open(t);
  send("pointerdown");
  assert.equal(shown(), null);
  t.mock.timers.tick(500);
  assert.equal(shown(), elements.fit.title);
  assert.ok(send("contextmenu").defaultPrevented);
  send("pointerup");
  assert.ok(send("click").defaultPrevented);
  assert.ok(!send("click").defaultPrevented);
  t.mock.timers.tick(1500);
  assert.equal(shown(), null);
});

test("a tap, a drag and a mouse show no title", (t) => {
  const { send, shown } = open(t);
  send("pointerdown");
  send("pointerup");
  assert.ok(!send("click").defaultPrevented);
  t.mock.timers.tick(500);
  assert.equal(shown(), null);
  send("pointerdown");
  send("pointermove", { clientX: 11 });
  t.mock.timers.tick(500);
  assert.equal(shown(), null);
  send("pointerdown", { pointerType: "mouse" });
  t.mock.timers.tick(500);
  assert.equal(shown(), null);
});
