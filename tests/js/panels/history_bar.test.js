import assert from "node:assert/strict";
import { test } from "node:test";
import { HistoryBar } from "../../../flatland/web/page/js/panels/history_bar.js";
import { dispatch, settle } from "../fake_page.js";
import { hello, openRoom } from "../fake_server.js";

const MOMENTS = [3, 4, 7].map((moment) => ({ moment, time: moment / 2, label: "" }));
const NEWEST = { moment: 9, time: 5, label: "before going back" };

function history(fields = {}) {
  return { type: "history", world: 0, moments: MOMENTS, current: null, obstacle: "", ...fields };
}

function open(options) {
  const { elements, connection, session, notices } = openRoom(options);
  new HistoryBar(session);
  connection.replies.visit = { effect: "" };
  connection.emit("message", history());
  const slide = (position) => {
    elements["history-slider"].value = position;
    dispatch(elements["history-slider"], "input");
  };
  const visits = () => connection.take("visit").map(({ moment }) => moment);
  const shown = () => [
    elements["history-slider"].value,
    elements["history-slider"].max,
    elements["history-text"].textContent,
    elements["history-continue"].disabled,
  ];
  return { elements, connection, session, notices, slide, visits, shown };
}

test("the last position is the newest state", () => {
  const { connection, shown, elements } = open();
  assert.deepEqual(shown(), ["3", "3", "newest", true]);
  connection.emit("message", history({ moments: [...MOMENTS, NEWEST], current: 4 }));
  assert.deepEqual(shown(), ["1", "3", "2.00 s", false]);
  assert.ok(!elements["history-newest"].disabled);
});

test("the state at the slider is visited, and left by returning or continuing", async () => {
  const { elements, connection, slide, visits, shown } = open();
  slide(0);
  assert.deepEqual([visits(), shown()[2]], [[3], "1.50 s"]);
  await settle();
  connection.emit("message", history({ moments: [...MOMENTS, NEWEST], current: 3 }));
  slide(3);
  assert.deepEqual(visits(), [9]);
  connection.emit("message", history());
  await settle();
  assert.deepEqual(shown(), ["3", "3", "newest", true]);
  connection.emit("message", history({ moments: [...MOMENTS, NEWEST], current: 7 }));
  elements["history-newest"].click();
  assert.deepEqual(visits(), [9]);
  assert.equal(document.activeElement, elements.canvas);
  elements["history-continue"].click();
  assert.deepEqual(connection.take("resume"), [{ world: 0 }]);
});

for (const order of ["reply", "history"]) {
  test(`while a visit is under way, only the last position waits; the ${order} comes first`, async () => {
    const { connection, slide, visits, shown } = open();
    let reply = () => {};
    connection.replies.visit = new Promise((resolve) => {
      reply = resolve;
    });
    slide(2);
    slide(1);
    slide(0);
    assert.deepEqual(visits(), [7]);
    const steps = [
      async () => {
        reply({ effect: "" });
        await settle();
      },
      async () => connection.emit("message", history({ moments: [...MOMENTS, NEWEST], current: 7 })),
    ];
    if (order === "history") steps.reverse();
    await steps[0]();
    assert.deepEqual([visits(), shown()[0]], [[], "0"]);
    await steps[1]();
    assert.deepEqual([visits(), shown()[0]], [[3], "0"]);
  });
}

test("a return to the newest state waits until the server has listed it", async () => {
  const { connection, slide, visits } = open();
  slide(1);
  slide(3);
  await settle();
  assert.deepEqual(visits(), [4]);
  connection.emit("message", history({ moments: [...MOMENTS, NEWEST], current: 4 }));
  assert.deepEqual(visits(), [9]);
});

test("a visit that another client replaces does not block the slider", async () => {
  const { connection, slide, visits } = open();
  connection.replies.visit = { superseded: true };
  slide(1);
  await settle();
  slide(0);
  assert.deepEqual(visits(), [4, 3]);
});

test("after an error, the slider shows the state of the world", async () => {
  const { connection, notices, slide, shown } = open();
  connection.replies.visit = new Error("this state is not kept any more");
  slide(0);
  await settle();
  assert.deepEqual([notices, shown()[0]], [["this state is not kept any more"], "3"]);
});

test("a connection that is lost during a visit does not block the slider", async () => {
  const { connection, session, slide, visits, elements } = open();
  let fail = () => {};
  connection.replies.visit = new Promise((_, reject) => {
    fail = () => reject(new Error("the connection is lost"));
  });
  slide(0);
  slide(1);
  connection.emit("state", "reconnecting");
  fail();
  await settle();
  connection.emit("state", "connected");
  connection.emit("message", hello([0]));
  assert.ok(elements["history-slider"].disabled, "the states of the new connection are not known");
  assert.deepEqual(visits(), [3], "the position that waited belongs to the lost connection");
  connection.replies.visit = { effect: "" };
  connection.emit("message", history());
  slide(2);
  await settle();
  assert.deepEqual([visits(), session.world.history.moments.length], [[7], 3]);
});

test("the reason for a missing history is shown", () => {
  const { elements, connection } = open();
  connection.emit("message", history({ moments: [], obstacle: "the world is recorded" }));
  assert.ok(elements["history-slider"].disabled);
  assert.equal(elements["history-slider"].title, "the world is recorded");
});

test("a read-only page and the grid have no history", () => {
  assert.ok(open({ readOnly: true }).elements.history.hidden);
  assert.ok(open({ worlds: 2 }).elements.history.hidden);
  assert.ok(!open().elements.history.hidden);
});
