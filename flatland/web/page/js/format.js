/**
 * Returns a number as text for users: fixed decimals, a typographic minus sign, no negative zero.
 *
 * @param {number | null | undefined} value
 * @param {number} [decimals]
 */
export function fixed(value, decimals = 2) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−");
}

/**
 * Returns a number with a number of significant digits.
 *
 * @param {number} value
 * @param {number} [digits]
 */
export function significant(value, digits = 4) {
  if (!Number.isFinite(value)) return fixed(value);
  return String(Number(value.toPrecision(digits))).replace("-", "−");
}

/**
 * A part of a line: text, and the path of names and indices if it is a number that can be plotted.
 *
 * @typedef {{text: string, path: string[] | null}} Part
 */

/** Largest number of items of a list whose numbers are parts of their own. */
const MAX_PARTS = 8;
/** Depth of the numbers of a value that the server can send. */
const MAX_DEPTH = 4;

/**
 * Returns the value of a topic as lines of parts, with a line for each field.
 *
 * @param {import("./protocol.js").Json} value
 * @returns {Part[][]}
 */
export function describeValue(value) {
  if (value === null || typeof value !== "object" || Array.isArray(value)) return [valueParts(value, [])];
  return Object.entries(value).map(([key, item]) => {
    if (key === "stamp" && typeof item === "number") {
      return [{ text: `${key}: ${item / 1e9} s`, path: null }];
    }
    return [{ text: `${key}: `, path: null }, ...valueParts(item, [key])];
  });
}

/**
 * Returns the parts of a value; the numbers of long lists and deep values are not parts.
 *
 * @param {import("./protocol.js").Json} value
 * @param {string[]} path
 * @returns {Part[]}
 */
function valueParts(value, path) {
  const isNumber = typeof value === "number" || typeof value === "boolean";
  if (isNumber || value === null || typeof value !== "object" || path.length >= MAX_DEPTH) {
    return [{ text: brief(value), path: isNumber ? path : null }];
  }
  if (Array.isArray(value)) {
    const isPlain = value.length <= MAX_PARTS && value.every((item) => typeof item === "number");
    if (!isPlain) return [{ text: brief(value), path: null }];
    return value.map((item, i) => ({ text: brief(item), path: [...path, String(i)] }));
  }
  return Object.entries(value).flatMap(([key, item]) => [
    { text: `${key}: `, path: null },
    ...valueParts(item, [...path, key]),
  ]);
}

/** Last item of a list that the server has shortened. */
const REST = /^… (\d+) items$/;

/**
 * Returns a long list as its length and first items.
 *
 * @param {import("./protocol.js").Json[]} list
 */
function briefList(list) {
  const rest = REST.exec(String(list.at(-1)));
  const first = list.slice(0, 3).map((item) => brief(item, 40));
  return `${rest ? rest[1] : list.length} values: ${first.join(", ")}, …`;
}

/**
 * Returns any value of a message as short text.
 *
 * @param {import("./protocol.js").Json | undefined} value
 * @param {number} [limit]  largest number of characters
 * @returns {string}
 */
export function brief(value, limit = 160) {
  let text;
  if (typeof value === "number") text = Number.isInteger(value) ? fixed(value, 0) : significant(value);
  else if (typeof value === "string") text = value;
  else if (value === null || value === undefined) text = "–";
  else if (Array.isArray(value) && value.length > 2 && Array.isArray(value[0])) {
    text = `${value.length} × ${value[0].length} values`;
  } else if (Array.isArray(value) && value.length > 8) text = briefList(value);
  else if (Array.isArray(value)) text = `[${value.map((item) => brief(item, 40)).join(", ")}]`;
  else if (typeof value === "object") {
    text = Object.entries(value)
      .map(([key, item]) => `${key}: ${brief(item, 60)}`)
      .join("  ");
  } else text = String(value);
  return text.length > limit ? `${text.slice(0, limit - 1)}…` : text;
}
