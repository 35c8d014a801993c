import assert from "node:assert/strict";
import { test } from "node:test";
import { loadSetting, saveSetting } from "../../flatland/web/page/js/settings.js";
import { openPage } from "./fake_page.js";

test("a browser that denies access has no preferences", () => {
  openPage();
  Object.defineProperty(window, "localStorage", {
    get() {
      throw new Error("denied");
    },
  });
  saveSetting("theme", "dark");
  assert.equal(loadSetting("theme"), null);
});
