import { element, setText } from "../dom.js";
import { brief, significant } from "../format.js";

/**
 * @typedef {import("../protocol.js").Json} Json
 */

/** Digits of numbers, and of large ones such as stamps. */
const DIGITS = 7;
const LARGE = 1e5;
const LARGE_DIGITS = 13;

/**
 * Shows a value as a tree, in which the user opens and closes branches. Elements are replaced only
 * if the names have changed. A click on a number selects it.
 *
 * @param {HTMLElement} root
 * @param {Json} value  an object or a list
 * @param {(path: string[]) => void} select  called with the names and indices of a number
 * @param {string[]} [path]  of the value
 */
export function updateTree(root, value, select, path = []) {
  const entries = Object.entries(value ?? {});
  const shape = entries.map(([name, item]) => name + kindOf(item)).join();
  if (root.dataset.shape !== shape) {
    root.dataset.shape = shape;
    root.replaceChildren(
      ...entries.map(([name, item]) => {
        if (kindOf(item) === "/") return branch(name);
        return kindOf(item) === "#" ? number(name, () => select([...path, name])) : leaf(name);
      }),
    );
  }
  entries.forEach(([name, item], i) => {
    const target = root.children[i].lastElementChild;
    if (!(target instanceof HTMLElement)) return;
    if (isBranch(item)) updateTree(target, item, select, [...path, name]);
    else setText(target, leafText(item));
  });
}

/**
 * Returns whether a value has a branch of its own: an object, or a list of objects.
 *
 * @param {Json} value
 */
function isBranch(value) {
  if (Array.isArray(value)) return value.some((item) => typeof item === "object" && item !== null);
  return typeof value === "object" && value !== null;
}

/** @param {Json} value */
function kindOf(value) {
  if (isBranch(value)) return "/";
  return typeof value === "number" ? "#" : "";
}

/** @param {string} name */
function branch(name) {
  return element("details", { open: true }, element("summary", {}, name), element("div"));
}

/** @param {string} name */
function leaf(name) {
  return element("div", { class: "leaf" }, element("span", {}, `${name}:`), element("span"));
}

/**
 * @param {string} name
 * @param {() => void} select
 */
function number(name, select) {
  const button = element("button", { type: "button", title: `Plot ${name}` });
  button.addEventListener("click", select);
  return element("div", { class: "leaf" }, element("span", {}, `${name}:`), button);
}

/** @param {Json} value */
function leafText(value) {
  if (typeof value !== "number" || Number.isInteger(value)) return brief(value, 400);
  return significant(value, Math.abs(value) >= LARGE ? LARGE_DIGITS : DIGITS);
}
