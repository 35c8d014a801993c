import assert from "node:assert/strict";
import { test } from "node:test";
import { byId, element, saveFile, setText, takesKey } from "../../flatland/web/page/js/dom.js";
import { openPage } from "./fake_page.js";

test("a missing element is an error", () => {
  openPage();
  assert.throws(() => byId("nothing"), /the page has no .*#nothing/);
});

test("elements are created with attributes and children", () => {
  openPage();
  const created = element("p", { id: "a", hidden: true, title: false, "data-part": 3 }, "text", element("b"));
  assert.deepEqual([created.id, created.hidden, created.getAttribute("title")], ["a", true, null]);
  assert.deepEqual([created.dataset.part, created.textContent, created.children.length], ["3", "text", 1]);
});

test("a text is set only if it has changed", (t) => {
  openPage();
  const target = element("p", {}, "a");
  const set = t.mock.setter(target, "textContent");
  setText(target, "a");
  assert.equal(set.mock.callCount(), 0);
});

test("fields and menus take keys, buttons do not, and sliders only theirs", () => {
  const elements = openPage();
  assert.deepEqual(
    ["model-filter", "rate", "plot-series", "spawn-ok", "toggle-names", "pause", "canvas"].map((id) =>
      takesKey(elements[id], "w"),
    ),
    [true, false, true, true, false, false, false],
  );
  for (const key of ["ArrowUp", "ArrowLeft", "Home", "PageDown"]) assert.ok(takesKey(elements.rate, key));
  assert.ok(!takesKey(null, "w"));
});

test("a saved file is released later", (t) => {
  t.mock.timers.enable({ apis: ["setTimeout"] });
  openPage();
  const revoked = t.mock.method(URL, "revokeObjectURL", () => {});
  saveFile(new Blob(["x"]), "a.txt");
  assert.equal(revoked.mock.callCount(), 0);
  t.mock.timers.tick(10_000);
  assert.equal(revoked.mock.callCount(), 1);
});
