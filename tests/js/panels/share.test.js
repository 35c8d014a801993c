import assert from "node:assert/strict";
import { test } from "node:test";
import { createShare } from "../../../flatland/web/page/js/panels/share.js";
import { settle } from "../fake_page.js";
import { openRoom } from "../fake_server.js";

async function share({ clipboard, search = "" }) {
  const { elements, session, notices } = openRoom({ search });
  Object.defineProperty(globalThis, "navigator", { value: { clipboard }, configurable: true });
  let written = 0;
  createShare(session, { write: () => written++ });
  elements.share.click();
  await settle();
  assert.equal(written, 1, "the address is that of the current view");
  return notices;
}

test("the address is copied", async () => {
  const copied = [];
  const clipboard = { writeText: async (text) => copied.push(text) };
  assert.deepEqual(await share({ clipboard }), ["Link to this view copied"]);
  assert.deepEqual(copied, ["http://localhost/"]);
  const [notice] = await share({ clipboard, search: "?token=a" });
  assert.match(notice, /contains the access token/);
});

test("a page without a clipboard refers to its address", async () => {
  assert.match((await share({}))[0], /^The address of the page is a link/);
});
