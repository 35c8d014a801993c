import assert from "node:assert/strict";
import { test } from "node:test";
import { Editing, nameOfCopy, namespaceOfCopy } from "../../flatland/web/page/js/editing.js";
import { createNotices } from "../../flatland/web/page/js/panels/notices.js";
import { saveWorld } from "../../flatland/web/page/js/panels/save_world.js";
import { redo, undo } from "../../flatland/web/page/js/undo.js";
import { settle } from "./fake_page.js";
import { CRATE, describeModel, models, openRoom } from "./fake_server.js";

function open(options) {
  const room = openRoom(options);
  createNotices(room.session);
  const editing = new Editing(room.session, () => ({ x: 3, y: 4 }));
  const undoButton = () =>
    room.elements.notices.querySelectorAll("button").find((each) => each.textContent === "Undo") ?? null;
  return { ...room, editing, undoButton };
}

test("a copy has the lowest free number, and a namespace beside that of the model", () => {
  const used = new Set(["robot", "robot_2", "box_7"]);
  assert.deepEqual(
    ["robot", "robot_2", "box_7", "crate"].map((name) => nameOfCopy(name, (each) => used.has(each))),
    ["robot_3", "robot_3", "box_2", "crate_2"],
  );
  assert.equal(namespaceOfCopy("", "robot_2"), "robot_2");
  assert.equal(namespaceOfCopy("fleet/robot", "robot_2"), "fleet/robot_2");
  assert.equal(namespaceOfCopy("", "my robot_2"), "my_robot_2");
});

test("a deleted model can be undone in the notice", async () => {
  const { connection, session, editing, notices, undoButton } = open();
  connection.replies = { delete: { can_undo: true }, undo: { text: 'the deletion of "crate"', effect: "" } };
  session.select("crate");
  assert.ok(await editing.deleteSelected());
  assert.deepEqual(connection.take("delete"), [{ world: 0, model: CRATE }]);
  assert.deepEqual([notices.splice(0), session.selectedName], [["Deleted crate"], null]);
  undoButton().click();
  await settle();
  assert.deepEqual(connection.take("undo"), [{ world: 0 }]);
  assert.deepEqual(notices, ['Undone: the deletion of "crate"']);
});

test("a notice has no button for what cannot be undone, or is not the last edit", async () => {
  const { connection, session, editing, undoButton } = open();
  connection.replies = { delete: { can_undo: false }, reset: { can_undo: true, effect: "" } };
  session.select("crate");
  await editing.deleteSelected();
  assert.equal(undoButton(), null);
  await editing.reset();
  assert.ok(undoButton());
  connection.replies.move = { overlap: "" };
  await session.move(CRATE, [0, 0, 0]);
  assert.equal(undoButton(), null);
});

test("copies are pasted at the pointer with names of their own", async () => {
  const { connection, session, world, editing, notices } = open();
  const crate = describeModel(CRATE, "crate", { namespace: "depot/crate", file: "/w/crate.yaml" });
  connection.emit("message", models([crate], { complete: false }));
  await editing.paste();
  assert.deepEqual(connection.take("spawn"), [], "nothing was copied");
  session.select("crate");
  editing.copy();
  await editing.paste();
  await editing.paste({ x: 1, y: 2 });
  const shared = { world: 0, file: "/w/crate.yaml" };
  assert.deepEqual(connection.take("spawn"), [
    { ...shared, name: "crate_2", pose: [3, 4, 0], namespace: "depot/crate_2" },
    { ...shared, name: "crate_3", pose: [1, 2, 0], namespace: "depot/crate_3" },
  ]);
  assert.ok(notices.includes("Pasted crate_3; its topics begin with /depot/crate_3/"));
  // Once the server has listed and removed a copy, its name is free again.
  connection.emit("message", models([describeModel(8, "crate_2")], { complete: false }));
  connection.emit("message", models([], { complete: false, removed: [8] }));
  assert.equal(world.modelByName("crate_2"), null);
  connection.replies.spawn = new Error("blocked");
  await editing.paste();
  connection.replies.spawn = undefined;
  await editing.paste();
  const names = connection.take("spawn").map(({ name }) => name);
  assert.deepEqual(names, ["crate_2", "crate_2"]);
});

test("a model without a file is not copied", () => {
  const { connection, session, editing, notices } = open();
  connection.emit("message", models([describeModel(CRATE, "crate", { file: null })], { complete: false }));
  session.select("crate");
  editing.copy();
  assert.equal(editing.copied, null);
  assert.match(notices[0], /cannot be copied/);
});

test("the effect of a time that is set back is shown", async () => {
  const { connection, session, editing, notices } = open();
  const reset = { can_undo: true, effect: "/clock is set back" };
  connection.replies = { reset, redo: { text: "the reset", effect: "" } };
  await editing.reset();
  assert.ok(notices.includes("/clock is set back"));
  await redo(session);
  assert.ok(notices.includes("Redone: the reset"));
});

test("a saved world is a file, with notes on what is missing", async (t) => {
  const { connection, session, notices } = open();
  const saved = [];
  t.mock.method(URL, "createObjectURL", (blob) => {
    saved.push(blob);
    return "blob:1";
  });
  t.mock.timers.enable({ apis: ["setTimeout"] });
  const file = { text: "models: []\n", name: "w_saved.yaml", folder: "/w" };
  connection.replies.save = { ...file, notes: ["no people"] };
  await saveWorld(session);
  assert.equal(await saved[0].text(), "models: []\n");
  assert.deepEqual(notices, ["World saved as w_saved.yaml; put the file into /w", "no people"]);
});

test("a read-only page changes nothing", async () => {
  const { connection, session, editing } = open({ readOnly: true });
  session.select("crate");
  await settle();
  connection.requests = [];
  editing.copy();
  for (const edit of [() => editing.deleteSelected(), () => editing.paste(), () => editing.reset()])
    await edit();
  for (const edit of [undo, redo, saveWorld]) await edit(session);
  assert.deepEqual(connection.requests, []);
});
