import { byId, element, icon, setPressed, setText } from "../dom.js";
import { numbersIn } from "../foreign_topics.js";
import { significant } from "../format.js";
import { Chart, loadUPlot } from "./chart.js";
import { Completion } from "./completion.js";

/** Largest number of samples of a series. */
const CAPACITY = 4000;
const MAX_PLOTS = 12;
/** Least time between two drawings [ms]. */
const DRAW_PERIOD = 100;
/** Simulated time by which values of other topics may be late [s]. */
const LARGEST_DELAY = 1;

/**
 * @typedef {object} Plot
 * @property {number[]} times  simulated time [s]
 * @property {number[]} values
 * @property {HTMLElement} figure
 * @property {HTMLElement} area  element of the chart
 * @property {HTMLElement} latest
 * @property {Chart | null} chart  null without uPlot
 */

/** Plots of published numbers over time. */
export class Plots {
  /**
   * @param {import("../session.js").Session} session
   * @param {() => boolean} isDark
   * @param {() => Promise<import("./chart.js").UPlot>} load  loads uPlot at the first plot
   */
  constructor(session, isDark, load = loadUPlot) {
    this.session = session;
    this.isDark = isDark;
    this.load = load;
    this.panel = byId("plots");
    this.list = byId("plot-list");
    this.field = byId("plot-series", HTMLInputElement);
    this.window = byId("plot-window", HTMLSelectElement);
    this.latest = byId("plot-latest");
    this.completion = new Completion(this.field, byId("plot-matches"), (name) => this.add(name));
    /** @type {Map<string, Plot>} */
    this.plots = new Map();
    /** @type {import("./chart.js").UPlot | null} */
    this.UPlot = null;
    /** Times that the user has selected, null for the latest ones [s].
     * @type {[number, number] | null} */
    this.range = null;
    /** Number of plots added so far, which selects the colour. */
    this.added = 0;
    this.time = 0;
    this.drawn = 0;
    byId("plots-toggle").addEventListener("click", () => this.toggle());
    byId("plots-close").addEventListener("click", () => this.setOpen(false));
    this.field.addEventListener("focus", () => this.refreshNames());
    this.window.addEventListener("change", () => this.setRange(null));
    this.latest.addEventListener("click", () => this.setRange(null));
    session.on("values", (message) => this.receive(message));
    session.topics.on("values", (message) => this.receiveTopic(message));
    session.on("current", () => this.clear());
    session.on("models", () => {
      if (!this.panel.hidden) this.refreshNames();
    });
    this.showNames([]);
  }

  toggle() {
    const open = this.panel.hasAttribute("hidden");
    this.setOpen(open);
    if (open) this.field.focus();
  }

  /** @param {boolean} open */
  setOpen(open) {
    this.panel.hidden = !open;
    setPressed(byId("plots-toggle"), open);
    this.sendSeries();
    if (open) {
      this.refreshNames();
      this.draw();
    } else if (document.activeElement === document.body) byId("plots-toggle").focus();
  }

  /** Requests the names of all numbers that can be plotted. */
  async refreshNames() {
    if (!this.session.world) return;
    try {
      this.showNames(await this.session.request("describe_series", {}));
    } catch {
      this.showNames([]);
    }
  }

  /** @param {string[]} names */
  showNames(names) {
    this.field.placeholder = names.length > 0 ? `Search ${names.length} numbers` : "Nothing is published";
    this.completion.setNames(names);
  }

  /**
   * Opens the panel with a plot of a number.
   *
   * @param {string} name
   */
  show(name) {
    if (this.panel.hidden) this.setOpen(true);
    this.add(name);
    this.plots.get(name)?.figure.scrollIntoView({ block: "nearest" });
  }

  /** @param {string} name */
  add(name) {
    if (this.plots.has(name)) return;
    if (this.plots.size >= MAX_PLOTS) {
      this.session.notify("warning", `At most ${MAX_PLOTS} plots are shown`);
      return;
    }
    const area = element("div", { class: "chart", role: "img", "aria-label": `Plot of ${name}` });
    const latest = element("output", {}, "–");
    const close = element(
      "button",
      { type: "button", class: "button square", "aria-label": `Remove the plot of ${name}` },
      icon("close"),
    );
    const caption = element("figcaption", {}, element("code", { title: name }, name), latest, close);
    const figure = element("figure", { class: "plot", "data-series": name }, caption, area);
    close.addEventListener("click", () => this.remove(name));
    this.list.append(figure);
    this.plots.set(name, { times: [], values: [], figure, area, latest, chart: null });
    this.sendSeries();
    this.createCharts();
  }

  /** Creates the charts of all plots that have none, after loading uPlot if necessary. */
  async createCharts() {
    try {
      this.UPlot ??= await this.load();
    } catch {
      byId("plots-missing").hidden = false;
      return;
    }
    byId("plots-missing").hidden = true;
    for (const plot of this.plots.values()) {
      plot.chart ??= new Chart(this.UPlot, plot.area, {
        index: this.added++,
        dark: this.isDark(),
        onRange: (range) => this.setRange(range),
        onCursor: (value) => setText(plot.latest, significant(value ?? plot.values.at(-1) ?? NaN)),
      });
    }
    this.draw();
  }

  /** @param {string} name */
  remove(name) {
    const plot = this.plots.get(name);
    plot?.chart?.dispose();
    plot?.figure.remove();
    this.plots.delete(name);
    if (this.plots.size === 0) this.setRange(null);
    this.sendSeries();
    this.field.focus();
  }

  /** Removes all plots, whose numbers belong to another world. */
  clear() {
    for (const { chart } of this.plots.values()) chart?.dispose();
    this.list.replaceChildren();
    this.plots.clear();
    this.showNames([]);
    this.setRange(null);
    this.sendSeries();
    if (!this.panel.hidden) this.refreshNames();
  }

  sendSeries() {
    const names = this.panel.hasAttribute("hidden") ? [] : [...this.plots.keys()];
    this.session.setSeries(names);
    this.session.topics.setPlotted(names);
  }

  /** @param {import("../protocol.js").TopicValuesMessage} message */
  receiveTopic(message) {
    const series = numbersIn(message, this.plots.keys());
    if (Object.keys(series).length === 0) return;
    // The two kinds of values are sent independently, so that these may be slightly older.
    const isOlder = message.time < this.time && this.time - message.time < LARGEST_DELAY;
    this.receive({ time: isOlder ? this.time : message.time, series });
  }

  /** @param {Pick<import("../protocol.js").ValuesMessage, "time" | "series">} message */
  receive({ time, series }) {
    const isReset = time < this.time;
    this.time = time;
    if (isReset) this.setRange(null);
    for (const [name, plot] of this.plots) {
      if (isReset) plot.times.length = plot.values.length = 0;
      const value = series[name];
      if (value === undefined || plot.times.at(-1) === time) continue;
      plot.times.push(time);
      plot.values.push(value);
      if (plot.times.length > CAPACITY) {
        plot.times.splice(0, CAPACITY / 4);
        plot.values.splice(0, CAPACITY / 4);
      }
      if (!plot.area.matches(":hover")) setText(plot.latest, significant(value));
    }
    if (performance.now() - this.drawn > DRAW_PERIOD) this.draw();
  }

  /**
   * Shows a range of time in all plots.
   *
   * @param {[number, number] | null} range  [s], null for the latest times
   */
  setRange(range) {
    this.range = range;
    this.latest.hidden = range === null;
    this.draw();
  }

  draw() {
    this.drawn = performance.now();
    const span = Number(this.window.value);
    const end = Math.max(this.time, span);
    const range = this.range ?? [end - span, end];
    for (const { times, values, chart } of this.plots.values())
      chart?.draw(times, values, [range[0], range[1]]);
  }

  /** @param {boolean} dark  whether the theme is dark */
  setTheme(dark) {
    for (const { chart } of this.plots.values()) chart?.setTheme(dark);
  }
}
