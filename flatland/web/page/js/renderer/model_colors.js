import { isRobot } from "../robots.js";
import { readable } from "./palette.js";

/**
 * @typedef {import("../world_state.js").Body} Body
 * @typedef {import("../world_state.js").Model} Model
 * @typedef {import("./palette.js").Palette} Palette
 */

/** Colour of a body whose file states none, see flatland/loading/model_loader.py. */
const DEFAULT_COLOR = [1, 1, 1, 0.5];

/** Number of colours of `Palette.series`. */
const SERIES = 8;

/** @param {number[]} color */
function isDefault(color) {
  return DEFAULT_COLOR.every((part, i) => part === color[i]);
}

/**
 * Returns the colour of a body. A robot without a colour has one of eight colours.
 *
 * @param {Body} body
 * @param {Palette} palette
 * @returns {import("./palette.js").Rgba}
 */
export function bodyColor({ color, model }, palette) {
  if (!isRobot(model) || !isDefault(color)) return readable(color, palette);
  const [r, g, b] = palette.series[model.index % SERIES];
  return [r, g, b, 1];
}

/**
 * Returns the colour of a model, which its scans and its trail share: that of its first body.
 *
 * @param {Model} model
 * @param {Palette} palette
 * @returns {import("./palette.js").Rgba}
 */
export function modelColor({ bodies: [body] }, palette) {
  return body ? bodyColor(body, palette) : [...palette.ink, 1];
}

/**
 * Returns a text that is equal for models of the same colour.
 *
 * @param {Model} model  with a laser
 */
export function colorKey({ bodies: [body], index }) {
  return !body || isDefault(body.color) ? `index ${index % SERIES}` : body.color.join();
}
