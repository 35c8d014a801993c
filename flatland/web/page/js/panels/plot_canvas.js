import { context2d } from "../dom.js";
import { significant } from "../format.js";
import { createPalette, css } from "../renderer/palette.js";

const MARGIN = { left: 54, right: 8, top: 8, bottom: 20 };
const FONT = "11px system-ui, sans-serif";

/** Draws one series over time. */
export class PlotCanvas {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.context = context2d(canvas);
  }

  /**
   * @param {number[]} times  [s], ascending
   * @param {number[]} values
   * @param {number} now  right end of the axis of time [s]
   * @param {number} span  [s]
   * @param {boolean} dark
   * @param {number} index  of the colour
   */
  draw(times, values, now, span, dark, index) {
    const { canvas, context } = this;
    const ratio = window.devicePixelRatio;
    const width = canvas.clientWidth;
    const height = canvas.clientHeight;
    if (width === 0) return;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    context.scale(ratio, ratio);
    const palette = createPalette(dark);
    const first = firstAfter(times, now - span);
    const { low, high } = limits(values, Math.max(0, first - 1));
    /** @type {(time: number) => number} */
    const xOf = (time) => MARGIN.left + (1 - (now - time) / span) * (width - MARGIN.left - MARGIN.right);
    /** @type {(value: number) => number} */
    const yOf = (value) =>
      height - MARGIN.bottom - ((value - low) / (high - low)) * (height - MARGIN.top - MARGIN.bottom);

    context.font = FONT;
    context.textBaseline = "middle";
    context.lineWidth = 1;
    context.strokeStyle = css(palette.gridAxis);
    context.fillStyle = css(palette.ink);
    context.textAlign = "right";
    for (const value of ticks(low, high)) {
      const y = Math.round(yOf(value)) + 0.5;
      line(context, MARGIN.left, y, width - MARGIN.right, y);
      context.fillText(significant(value, 5), MARGIN.left - 6, y);
    }
    context.textAlign = "center";
    for (const time of ticks(Math.max(0, now - span), now)) {
      const x = Math.round(xOf(time)) + 0.5;
      line(context, x, height - MARGIN.bottom, x, height - MARGIN.bottom + 4);
      const text = `${significant(time, 6)} s`;
      const half = context.measureText(text).width / 2;
      if (x - half > MARGIN.left && x + half < width) context.fillText(text, x, height - 7);
    }

    context.save();
    context.beginPath();
    context.rect(MARGIN.left, 0, width - MARGIN.left - MARGIN.right, height);
    context.clip();
    context.beginPath();
    for (let i = Math.max(0, first - 1); i < times.length; i++) context.lineTo(xOf(times[i]), yOf(values[i]));
    context.strokeStyle = css(palette.series[(index + 1) % palette.series.length]);
    context.lineWidth = 1.8;
    context.lineJoin = "round";
    context.stroke();
    context.restore();
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {number} x1
 * @param {number} y1
 * @param {number} x2
 * @param {number} y2
 */
function line(context, x1, y1, x2, y2) {
  context.beginPath();
  context.moveTo(x1, y1);
  context.lineTo(x2, y2);
  context.stroke();
}

/**
 * Returns the index of the first time after a limit.
 *
 * @param {number[]} times
 * @param {number} limit
 */
function firstAfter(times, limit) {
  let [from, to] = [0, times.length];
  while (from < to) {
    const middle = (from + to) >> 1;
    if (times[middle] > limit) to = middle;
    else from = middle + 1;
  }
  return from;
}

/**
 * Returns the limits of the axis of values.
 *
 * @param {number[]} values
 * @param {number} first  index of the first value that is drawn
 */
function limits(values, first) {
  let [low, high] = [Infinity, -Infinity];
  for (let i = first; i < values.length; i++) {
    if (!Number.isFinite(values[i])) continue;
    low = Math.min(low, values[i]);
    high = Math.max(high, values[i]);
  }
  if (low > high) [low, high] = [0, 1];
  const size = Math.max(Math.abs(low), Math.abs(high));
  const isConstant = high - low <= 1e-6 * size;
  const margin = isConstant ? size / 10 || 1 : (high - low) * 0.08;
  return { low: low - margin, high: high + margin };
}

/**
 * Returns two to five round values between two limits.
 *
 * @param {number} low
 * @param {number} high
 */
export function ticks(low, high) {
  const rough = (high - low) / 3;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((each) => each >= rough) ?? rough;
  const found = [];
  for (let i = Math.ceil(low / step); i * step <= high; i++) found.push(i * step);
  return found;
}
