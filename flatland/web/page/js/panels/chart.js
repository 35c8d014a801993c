import { element } from "../dom.js";
import { significant } from "../format.js";
import { createPalette, css } from "../renderer/palette.js";

/** @typedef {typeof import("../../vendor/uplot/uPlot.esm.js")} UPlot */

const HEIGHT = 130;
const FONT = "11px system-ui, sans-serif";
/** Least number of pixels between two numbers of an axis. */
const SPACE = { x: 70, y: 26 };

/**
 * Loads uPlot and its style sheet, which a page without plots does not need.
 *
 * @returns {Promise<UPlot>}
 * @throws {TypeError} if the file cannot be loaded
 */
export async function loadUPlot() {
  const { default: UPlot } = await import("../../vendor/uplot/uPlot.esm.js");
  const { href } = new URL("../../vendor/uplot/uPlot.min.css", import.meta.url);
  document.head.append(element("link", { rel: "stylesheet", href }));
  return UPlot;
}

/** A curve of one number over simulated time, drawn by uPlot. */
export class Chart {
  /**
   * @param {UPlot} UPlot
   * @param {HTMLElement} parent
   * @param {object} options
   * @param {number} options.index  of the colour
   * @param {boolean} options.dark  whether the theme is dark
   * @param {(range: [number, number] | null) => void} options.onRange  called with the times that the user
   *   has selected [s], null for the latest ones
   * @param {(value: number | null) => void} options.onCursor  called with the value at the pointer
   */
  constructor(UPlot, parent, { index, dark, onRange, onCursor }) {
    this.parent = parent;
    this.palette = createPalette(dark);
    const { series } = this.palette;
    const axis = {
      font: FONT,
      stroke: () => css(this.palette.ink),
      grid: { stroke: () => css(this.palette.grid), width: 1 },
      ticks: { stroke: () => css(this.palette.gridAxis), width: 1, size: 4 },
    };
    this.plot = new UPlot(
      {
        width: this.width,
        height: HEIGHT,
        legend: { show: false },
        cursor: {
          sync: { key: "plots" },
          points: { size: 7 },
          drag: { setScale: false },
          bind: {
            dblclick: () => () => {
              onRange(null);
              return null;
            },
          },
        },
        scales: {
          x: { time: false, auto: false },
          y: { range: (_plot, low, high) => valueRange(low, high) },
        },
        axes: [
          {
            ...axis,
            size: 26,
            space: SPACE.x,
            values: (_plot, times) => times.map((time) => `${significant(time, 7)} s`),
          },
          {
            ...axis,
            size: 56,
            space: SPACE.y,
            values: (_plot, values) => values.map((value) => significant(value, 5)),
          },
        ],
        series: [
          {},
          {
            stroke: () => css(this.palette.series[(index + 1) % series.length]),
            width: 1.8,
            points: { show: false },
          },
        ],
        hooks: {
          setSelect: [
            (plot) => {
              const { left, width } = plot.select;
              if (width === 0) return;
              plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
              onRange([plot.posToVal(left, "x"), plot.posToVal(left + width, "x")]);
            },
          ],
          setCursor: [
            ({ cursor, data }) => {
              const at = cursor.idx;
              onCursor(at === null || at === undefined ? null : (data[1][at] ?? null));
            },
          ],
        },
      },
      [[], []],
      parent,
    );
  }

  get width() {
    return Math.max(1, this.parent.clientWidth);
  }

  /**
   * @param {number[]} times  [s], ascending
   * @param {number[]} values
   * @param {[number, number]} range  of the axis of time [s]
   */
  draw(times, values, [min, max]) {
    const { plot, width } = this;
    if (plot.width !== width) plot.setSize({ width, height: HEIGHT });
    plot.batch(() => {
      plot.setData([times, values], false);
      plot.setScale("x", { min, max });
    });
  }

  /** @param {boolean} dark  whether the theme is dark */
  setTheme(dark) {
    this.palette = createPalette(dark);
    this.plot.redraw(false);
  }

  dispose() {
    this.plot.destroy();
  }
}

/**
 * Returns the limits of the axis of values.
 *
 * @param {number | null} low  least value that is shown
 * @param {number | null} high
 * @returns {[number, number]}
 */
export function valueRange(low, high) {
  if (low === null || high === null || !Number.isFinite(high - low)) return [0, 1];
  const size = Math.max(Math.abs(low), Math.abs(high));
  // A constant is drawn in the middle, not as magnified rounding errors.
  const margin = high - low <= 1e-6 * size ? size / 10 || 1 : 0.08 * (high - low);
  return [low - margin, high + margin];
}
