import assert from "node:assert/strict";
import { test } from "node:test";
import { Plots } from "../../../flatland/web/page/js/panels/plots.js";
import { dispatch, openPage, settle } from "../fake_page.js";
import { showRoom } from "../fake_server.js";

const NAMES = ["/odom/pose/0", "/odom/pose/1"];

async function open(options) {
  const elements = openPage();
  const { connection, session } = showRoom(options);
  connection.replies.describe_series = NAMES;
  const plots = new Plots(session, () => false);
  elements["plots-toggle"].click();
  await settle();
  const values = (time, series) => connection.emit("message", { type: "values", world: 0, time, series });
  const wanted = async () => {
    await settle();
    return connection.take("look").at(-1)?.series;
  };
  return { elements, connection, session, plots, values, wanted };
}

test("the numbers of the world are listed when the panel opens", async () => {
  const { elements } = await open();
  assert.deepEqual(
    elements["plot-series"].options.map(({ value }) => value ?? ""),
    ["", ...NAMES],
  );
  assert.equal(elements["plots-toggle"].getAttribute("aria-pressed"), "true");
});

test("a selected number is plotted once, and requested while the panel is open", async () => {
  const { elements, plots, wanted } = await open();
  for (let i = 0; i < 2; i++) {
    elements["plot-series"].value = NAMES[0];
    dispatch(elements["plot-series"], "keydown", { key: "Enter" });
  }
  assert.deepEqual(
    elements["plot-list"].children.map(({ dataset }) => dataset.series),
    [NAMES[0]],
  );
  assert.equal(elements["plot-series"].value, "");
  assert.deepEqual(await wanted(), [NAMES[0]]);
  elements["plots-close"].click();
  assert.deepEqual(await wanted(), []);
  elements["plots-toggle"].click();
  assert.deepEqual(await wanted(), [NAMES[0]]);
  elements["plot-list"].querySelector("button").click();
  assert.equal(plots.plots.size, 0);
  assert.deepEqual(await wanted(), []);
});

test("samples are collected in the order of their time", async () => {
  const { elements, plots, values } = await open();
  plots.add(NAMES[0]);
  values(1, { [NAMES[0]]: 0.5 });
  values(1, { [NAMES[0]]: 0.75 });
  values(2, { other: 3 });
  values(3, { [NAMES[0]]: -1.25 });
  const { times, samples } = {
    times: plots.plots.get(NAMES[0]).times,
    samples: plots.plots.get(NAMES[0]).values,
  };
  assert.deepEqual(
    [times, samples],
    [
      [1, 3],
      [0.5, -1.25],
    ],
  );
  assert.equal(elements["plot-list"].querySelector("output").textContent, "−1.25");
  values(0, { [NAMES[0]]: 9 });
  assert.deepEqual(times, [0], "the simulation was reset");
});

test("old samples are discarded", async () => {
  const { plots, values } = await open();
  plots.add(NAMES[0]);
  for (let i = 0; i <= 4000; i++) values(i + 1, { [NAMES[0]]: i });
  const { times } = plots.plots.get(NAMES[0]);
  assert.deepEqual([times.length, times[0]], [3001, 1001]);
});

test("the number of plots is limited", async () => {
  const { session, plots } = await open();
  const notices = [];
  session.on("notice", ({ text }) => notices.push(text));
  for (let i = 0; i < 13; i++) plots.add(`/n/${i}`);
  assert.equal(plots.plots.size, 12);
  assert.deepEqual(notices, ["At most 12 plots are shown"]);
});

test("plots belong to a world", async () => {
  const { elements, session, plots, wanted } = await open({ worlds: 2 });
  assert.equal(elements["plot-series"].textContent, "Nothing is published");
  session.show(1);
  plots.add(NAMES[0]);
  assert.deepEqual(await wanted(), [NAMES[0]]);
  session.show(0);
  assert.equal(plots.plots.size, 0);
  assert.deepEqual(await wanted(), []);
});

test("numbers of other topics are plotted, also if their values are slightly older", async () => {
  const { session, connection, plots, values } = await open();
  const name = "/amcl_pose:pose/position/x";
  plots.add(name);
  await settle();
  assert.deepEqual(session.demands().topic_values, ["/amcl_pose"]);
  const send = (time, x) =>
    connection.emit("message", {
      type: "topic_values",
      world: 0,
      topic: "/amcl_pose",
      time,
      value: { pose: { position: { x } } },
    });
  send(1, 5);
  values(2, {});
  send(1.9, 6);
  assert.deepEqual(
    [plots.plots.get(name).times, plots.plots.get(name).values],
    [
      [1, 2],
      [5, 6],
    ],
  );
  send(0.5, 7); // The world was reset.
  assert.deepEqual(plots.plots.get(name).values, [7]);
});
