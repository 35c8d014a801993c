import { byId, element, icon, setPressed, setText } from "../dom.js";
import { numbersIn } from "../foreign_topics.js";
import { significant } from "../format.js";
import { PlotCanvas } from "./plot_canvas.js";

/** Largest number of samples of a series. */
const CAPACITY = 4000;
const MAX_PLOTS = 12;
const DRAW_PERIOD = 100;
/** Simulated time by which values of other topics may be late [s]. */
const LARGEST_DELAY = 1;

/**
 * @typedef {object} Plot
 * @property {number[]} times  simulated time [s]
 * @property {number[]} values
 * @property {HTMLElement} figure
 * @property {HTMLElement} latest
 * @property {PlotCanvas} canvas
 */

/** Plots of published numbers over time. */
export class Plots {
  /**
   * @param {import("../session.js").Session} session
   * @param {() => boolean} isDark
   */
  constructor(session, isDark) {
    this.session = session;
    this.isDark = isDark;
    this.panel = byId("plots");
    this.list = byId("plot-list");
    this.select = byId("plot-series", HTMLSelectElement);
    this.window = byId("plot-window", HTMLSelectElement);
    /** @type {Map<string, Plot>} */
    this.plots = new Map();
    this.time = 0;
    this.drawn = 0;
    byId("plots-toggle").addEventListener("click", () => this.setOpen(this.panel.hasAttribute("hidden")));
    byId("plots-close").addEventListener("click", () => this.setOpen(false));
    this.select.addEventListener("focus", () => this.refreshNames());
    byId("plot-add").addEventListener("click", () => this.addSelected());
    // Not at "change", because each typed character selects the first number with a matching name.
    this.select.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" || !this.select.value) return;
      event.preventDefault();
      this.addSelected();
    });
    this.window.addEventListener("change", () => this.draw());
    session.on("values", (message) => this.receive(message));
    session.topics.on("values", (message) => this.receiveTopic(message));
    session.on("current", () => this.clear());
    session.on("models", () => {
      if (!this.panel.hidden) this.refreshNames();
    });
    this.showNames([]);
  }

  /** @param {boolean} open */
  setOpen(open) {
    this.panel.hidden = !open;
    setPressed(byId("plots-toggle"), open);
    this.sendSeries();
    if (open) {
      this.refreshNames();
      this.select.focus();
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
    const key = names.join("\n");
    if (this.select.dataset.key === key) return;
    this.select.dataset.key = key;
    const text = names.length > 0 ? "Select a number…" : "Nothing is published";
    const first = element("option", { value: "" }, text);
    const before = this.select.value;
    this.select.replaceChildren(first, ...names.map((name) => element("option", { value: name }, name)));
    if (names.includes(before)) this.select.value = before;
  }

  /** Adds a plot of the selected number. */
  addSelected() {
    if (this.select.value) this.add(this.select.value);
    this.select.value = "";
    this.select.focus();
  }

  /** @param {string} name */
  add(name) {
    if (this.plots.has(name)) return;
    if (this.plots.size >= MAX_PLOTS) {
      this.session.notify("warning", `At most ${MAX_PLOTS} plots are shown`);
      return;
    }
    const canvas = element("canvas", { role: "img", "aria-label": `Plot of ${name}` });
    const latest = element("output", {}, "–");
    const close = element(
      "button",
      { type: "button", class: "button square", "aria-label": `Remove the plot of ${name}` },
      icon("close"),
    );
    const caption = element("figcaption", {}, element("code", { title: name }, name), latest, close);
    const figure = element("figure", { class: "plot", "data-series": name }, caption, canvas);
    close.addEventListener("click", () => this.remove(name));
    this.list.append(figure);
    this.plots.set(name, { times: [], values: [], figure, latest, canvas: new PlotCanvas(canvas) });
    this.sendSeries();
    this.draw();
  }

  /** @param {string} name */
  remove(name) {
    this.plots.get(name)?.figure.remove();
    this.plots.delete(name);
    this.sendSeries();
    this.select.focus();
  }

  /** Removes all plots, whose numbers belong to another world. */
  clear() {
    this.list.replaceChildren();
    this.plots.clear();
    this.showNames([]);
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
      setText(plot.latest, significant(value));
    }
    if (performance.now() - this.drawn > DRAW_PERIOD) this.draw();
  }

  draw() {
    this.drawn = performance.now();
    const span = Number(this.window.value);
    let index = 0;
    for (const { times, values, canvas } of this.plots.values()) {
      canvas.draw(times, values, this.time, span, this.isDark(), index++);
    }
  }
}
