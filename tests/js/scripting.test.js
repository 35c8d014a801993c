import assert from "node:assert/strict";
import { test } from "node:test";
import { exposeScripting } from "../../flatland/web/page/js/scripting.js";
import { openRoom } from "./fake_server.js";

test("tiles exist in a grid only", () => {
  const { session, stage } = openRoom({ worlds: 2 });
  exposeScripting(session, stage);
  const api = window.flatland;
  assert.equal(api.tile(1).length, 4);
  assert.equal(api.tile(5), null);
  session.show(1);
  assert.equal(api.tile(1), null);
});
