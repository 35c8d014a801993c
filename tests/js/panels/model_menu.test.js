import assert from "node:assert/strict";
import { test } from "node:test";
import { ModelMenu } from "../../../flatland/web/page/js/panels/model_menu.js";
import { dispatch, openPage } from "../fake_page.js";

function open(x = 1195, y = 10) {
  const elements = openPage();
  const menu = new ModelMenu();
  const calls = [];
  const item = (text) => ({ text, icon: "x", run: () => calls.push(text) });
  const items = ["Centre", "Follow", "Delete"].map(item);
  menu.open(x, y, items, elements.canvas);
  const key = (name) => dispatch(elements.menu, "keydown", { key: name });
  return { elements, calls, key, buttons: elements.menu.children };
}

test("the menu is within the page, and its first item has the focus", () => {
  const { elements, buttons } = open();
  assert.deepEqual(elements.menu.style, { left: "996px", top: "10px" });
  assert.equal(document.activeElement, buttons[0]);
});

test("an item runs its action and closes the menu", () => {
  const { elements, calls, buttons } = open();
  buttons[2].click();
  assert.deepEqual([calls, elements.menu.hidden], [["Delete"], true]);
  assert.equal(document.activeElement, elements.canvas);
});

test("arrows move the focus around, Escape closes", () => {
  const { elements, key, buttons } = open();
  assert.ok(key("ArrowUp").defaultPrevented);
  assert.equal(document.activeElement, buttons[2]);
  key("ArrowDown");
  key("ArrowDown");
  assert.equal(document.activeElement, buttons[1]);
  assert.ok(!key("x").defaultPrevented);
  key("Escape");
  assert.ok(elements.menu.hidden);
});

test("a press elsewhere closes the menu", () => {
  const { elements, buttons } = open();
  for (const target of [buttons[1], elements.canvas]) {
    dispatch(document, "pointerdown", { target });
    assert.equal(elements.menu.hidden, target === elements.canvas);
  }
});
