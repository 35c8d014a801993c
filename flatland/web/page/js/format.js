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
 * Returns the value of a topic as text with a line for each field.
 *
 * @param {import("./protocol.js").Json} value
 */
export function describeValue(value) {
  if (value === null || typeof value !== "object" || Array.isArray(value)) return brief(value);
  return Object.entries(value)
    .map(([key, item]) => {
      const isStamp = key === "stamp" && typeof item === "number";
      return `${key}: ${isStamp ? `${item / 1e9} s` : brief(item)}`;
    })
    .join("\n");
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
