import assert from "node:assert/strict";
import { test } from "node:test";
import { Completion } from "../../../flatland/web/page/js/panels/completion.js";
import { dispatch, openPage } from "../fake_page.js";

const NAMES = ["/a/x", "/a/y", "/b/x"];

function open() {
  const elements = openPage();
  const picked = [];
  const [field, list] = [elements["plot-series"], elements["plot-matches"]];
  const completion = new Completion(field, list, (name) => picked.push(name));
  completion.setNames(NAMES);
  const type = (text) => {
    field.value = text;
    dispatch(field, "input");
  };
  const press = (key) => dispatch(field, "keydown", { key });
  const shown = () => (list.hidden ? [] : list.children.map(({ dataset }) => dataset.name));
  const active = () => list.querySelector("[aria-selected=true]")?.dataset.name;
  return { field, list, completion, picked, type, press, shown, active };
}

test("the list shows the matches of the field while it has the focus", () => {
  const { field, completion, type, shown } = open();
  assert.deepEqual(shown(), []);
  dispatch(field, "focus");
  assert.deepEqual(shown(), NAMES);
  type("/b");
  assert.deepEqual(shown(), ["/b/x"]);
  completion.setNames(Array.from({ length: 50 }, (_, i) => `/c/${i}`));
  type("c");
  assert.equal(shown().length, 12);
  dispatch(field, "blur");
  assert.deepEqual([shown(), field.getAttribute("aria-expanded")], [[], "false"]);
});

test("Enter picks the first match of a text, and nothing without a text", () => {
  const { field, picked, type, press } = open();
  dispatch(field, "focus");
  press("Enter");
  assert.deepEqual(picked, []);
  type("a");
  press("Enter");
  assert.deepEqual([picked, field.value], [["/a/x"], ""]);
});

test("arrow keys move through the list and around its ends", () => {
  const { field, list, picked, press, active } = open();
  dispatch(field, "focus");
  const seen = ["Down", "Down", "Up", "Up", "Down"].map((direction) => {
    assert.ok(press(`Arrow${direction}`).defaultPrevented);
    return active();
  });
  assert.deepEqual(seen, ["/a/x", "/a/y", "/a/x", "/b/x", "/a/x"]);
  assert.equal(field.getAttribute("aria-activedescendant"), list.children[0].id);
  press("Enter");
  assert.deepEqual(picked, ["/a/x"]);
});

test("a click picks a name, and Escape closes the list only", () => {
  const { field, list, picked, type, press, shown } = open();
  type("y");
  press("Escape");
  assert.deepEqual([shown(), field.value], [[], "y"]);
  assert.ok(!press("Escape").defaultPrevented);
  press("ArrowDown");
  list.children[0].click();
  assert.deepEqual(picked, ["/a/y"]);
});
