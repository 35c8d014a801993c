import assert from "node:assert/strict";
import { test } from "node:test";
import { Plots } from "../../../flatland/web/page/js/panels/plots.js";
import { dispatch, settle } from "../fake_page.js";
import { openRoom } from "../fake_server.js";

const NAMES = ["/odom/pose/0", "/odom/pose/1"];

/** Stands for uPlot, which needs a browser; records what is drawn. */
class RecordedPlot {
  static all = [];

  constructor(options, _data, parent) {
    Object.assign(this, { options, parent, width: options.width, isDisposed: false });
    RecordedPlot.all.push(this);
  }

  batch(change) {
    change();
  }

  setData(data) {
    this.data = data;
  }

  setScale(_axis, { min, max }) {
    this.range = [min, max];
  }

  destroy() {
    this.isDisposed = true;
  }
}

async function open(options) {
  const { elements, connection, session, notices } = openRoom(options);
  connection.replies.describe_series = NAMES;
  RecordedPlot.all = [];
  const plots = new Plots(session, () => false, options?.load ?? (async () => RecordedPlot));
  elements["plots-toggle"].click();
  await settle();
  const values = (time, series) => connection.emit("message", { type: "values", world: 0, time, series });
  const wanted = async () => {
    await settle();
    return connection.take("look").at(-1)?.series;
  };
  const type = (text) => {
    elements["plot-series"].value = text;
    dispatch(elements["plot-series"], "input");
  };
  return { elements, connection, session, notices, plots, values, wanted, type };
}

function plotted(elements) {
  return elements["plot-list"].children.map(({ dataset }) => dataset.series);
}

test("the field searches the numbers of the world when the panel opens", async () => {
  const { elements, type } = await open();
  assert.equal(document.activeElement, elements["plot-series"]);
  assert.equal(elements["plot-series"].placeholder, "Search 2 numbers");
  type("pose 1");
  assert.equal(elements["plot-matches"].textContent, NAMES[1]);
  assert.equal(elements["plots-toggle"].getAttribute("aria-pressed"), "true");
});

test("a picked number is plotted once, and requested while the panel is open", async () => {
  const { elements, plots, wanted, type } = await open();
  for (let i = 0; i < 2; i++) {
    type(NAMES[0]);
    dispatch(elements["plot-series"], "keydown", { key: "Enter" });
  }
  assert.deepEqual(plotted(elements), [NAMES[0]]);
  assert.equal(elements["plot-series"].value, "");
  assert.deepEqual(await wanted(), [NAMES[0]]);
  elements["plots-close"].click();
  assert.deepEqual(await wanted(), []);
  elements["plots-toggle"].click();
  assert.deepEqual(await wanted(), [NAMES[0]]);
  elements["plot-list"].querySelector("button").click();
  assert.equal(plots.plots.size, 0);
  assert.ok(RecordedPlot.all[0].isDisposed);
  assert.deepEqual(await wanted(), []);
});

test("a number of the inspector opens the panel", async () => {
  const { elements, plots, wanted } = await open();
  elements["plots-close"].click();
  plots.show(NAMES[1]);
  assert.deepEqual(plotted(elements), [NAMES[1]]);
  assert.deepEqual(await wanted(), [NAMES[1]]);
});

test("the latest times are drawn until the user selects a range", async (t) => {
  let now = 0;
  t.mock.method(performance, "now", () => (now += 1000));
  const { elements, plots, values } = await open();
  plots.add(NAMES[0]);
  await settle();
  const [chart] = RecordedPlot.all;
  values(40, { [NAMES[0]]: 0.5 });
  assert.deepEqual(chart.data, [[40], [0.5]]);
  assert.deepEqual(chart.range, [10, 40]);
  elements["plot-window"].value = "10";
  dispatch(elements["plot-window"], "change");
  assert.deepEqual(chart.range, [30, 40]);
  Object.assign(chart, {
    select: { left: 10, width: 20 },
    setSelect: (select) => Object.assign(chart, { select }),
    posToVal: (position) => 30 + position / 10,
  });
  chart.options.hooks.setSelect[0](chart);
  assert.equal(chart.select.width, 0);
  values(41, { [NAMES[0]]: 0.75 });
  assert.deepEqual([chart.range, elements["plot-latest"].hidden], [[31, 33], false]);
  elements["plot-latest"].click();
  assert.deepEqual([chart.range, elements["plot-latest"].hidden], [[31, 41], true]);
});

test("without uPlot, the panel says so and shows the latest values", async () => {
  const load = () => Promise.reject(new TypeError("Failed to fetch"));
  const { elements, plots, values } = await open({ load });
  assert.ok(elements["plots-missing"].hidden);
  plots.add(NAMES[0]);
  await settle();
  assert.ok(!elements["plots-missing"].hidden);
  values(1, { [NAMES[0]]: 0.5 });
  assert.equal(elements["plot-list"].querySelector("output").textContent, "0.5");
});

test("samples are collected in the order of their time", async () => {
  const { elements, plots, values } = await open();
  plots.add(NAMES[0]);
  values(1, { [NAMES[0]]: 0.5 });
  values(1, { [NAMES[0]]: 0.75 });
  values(2, { other: 3 });
  values(3, { [NAMES[0]]: -1.25 });
  const { times, values: samples } = plots.plots.get(NAMES[0]);
  assert.deepEqual(times, [1, 3]);
  assert.deepEqual(samples, [0.5, -1.25]);
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
  const { notices, plots } = await open();
  for (let i = 0; i < 13; i++) plots.add(`/n/${i}`);
  assert.equal(plots.plots.size, 12);
  assert.deepEqual(notices, ["At most 12 plots are shown"]);
});

test("plots belong to a world", async () => {
  const { elements, session, plots, wanted } = await open({ worlds: 2 });
  assert.equal(elements["plot-series"].placeholder, "Nothing is published");
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
  const message = { type: "topic_values", world: 0, topic: "/amcl_pose" };
  const send = (time, x) =>
    connection.emit("message", { ...message, time, value: { pose: { position: { x } } } });
  send(1, 5);
  values(2, {});
  send(1.9, 6);
  const plot = plots.plots.get(name);
  assert.deepEqual(plot.times, [1, 2]);
  assert.deepEqual(plot.values, [5, 6]);
  send(0.5, 7); // The world was reset.
  assert.deepEqual(plot.values, [7]);
});
