/** The page without a browser: enough of the document and of the window for the modules. */

import { readFileSync } from "node:fs";

const INDEX = new URL("../../flatland/web/page/index.html", import.meta.url);
const VOID_TAGS = new Set(["input", "link", "meta", "br"]);
/** Attributes with a property of the same name and value. */
const REFLECTED = new Set(["id", "title", "type", "name", "min", "max", "href", "download"]);

/** Width of a character of the fake context of a canvas [pixels]. */
export const CHARACTER_WIDTH = 6;

/** An element; only `dispatchEvent` of the event's own target calls listeners. */
export class FakeElement extends EventTarget {
  #text = "";
  #value = "";
  /** Whether an option of a list has been selected. */
  #chosen = false;

  constructor(tag = "div") {
    super();
    this.tag = tag;
    this.parent = null;
    this.children = [];
    this.attributes = new Map();
    this.dataset = {};
    this.style = {};
    this.checked = this.disabled = this.open = false;
    this.clientWidth = this.offsetWidth = 200;
    this.clientHeight = this.offsetHeight = 100;
  }

  setAttribute(name, value) {
    const text = String(value);
    this.attributes.set(name, text);
    if (name.startsWith("data-")) this.dataset[name.slice(5)] = text;
    if (REFLECTED.has(name)) this[name] = text;
    if (name === "value") this.#value = text;
    if (name === "checked") this.checked = true;
  }

  getAttribute(name) {
    if (name.startsWith("data-")) return this.dataset[name.slice(5)] ?? null;
    return this.attributes.get(name) ?? null;
  }

  hasAttribute(name) {
    return this.getAttribute(name) !== null;
  }

  removeAttribute(name) {
    this.attributes.delete(name);
    if (name.startsWith("data-")) delete this.dataset[name.slice(5)];
  }

  toggleAttribute(name, on) {
    if (on) this.setAttribute(name, "");
    else this.removeAttribute(name);
  }

  get hidden() {
    return this.hasAttribute("hidden");
  }

  set hidden(hidden) {
    this.toggleAttribute("hidden", hidden);
  }

  get options() {
    return this.children;
  }

  get selectedOptions() {
    return this.options.filter((option) => option.value === this.value);
  }

  get value() {
    if (this.tag !== "select" || this.#chosen) return this.#value;
    const first = this.options.find((option) => option.hasAttribute("selected")) ?? this.options[0];
    return first?.value ?? "";
  }

  set value(value) {
    this.#value = String(value);
    this.#chosen = true;
  }

  get textContent() {
    return this.#text + this.children.map((child) => child.textContent).join("");
  }

  set textContent(text) {
    this.replaceChildren();
    this.#text = text;
  }

  get firstElementChild() {
    return this.children[0] ?? null;
  }

  get lastElementChild() {
    return this.children.at(-1) ?? null;
  }

  append(...nodes) {
    for (const node of nodes) {
      if (node instanceof FakeElement) {
        node.remove();
        node.parent = this;
        this.children.push(node);
      } else this.#text += node;
    }
  }

  replaceChildren(...nodes) {
    for (const child of this.children) child.parent = null;
    this.children = [];
    this.#text = "";
    this.#chosen = false;
    this.append(...nodes);
  }

  remove() {
    if (this.parent) this.parent.children = this.parent.children.filter((child) => child !== this);
    this.parent = null;
  }

  contains(other) {
    return other === this || this.descendants().some((each) => each === other);
  }

  /** Returns all elements below this one, in the order of the document. */
  *descendants() {
    for (const child of this.children) {
      yield child;
      yield* child.descendants();
    }
  }

  /** Returns whether one of several simple selectors fits: tag, .class, #id, [name=value], :focus. */
  matches(selectors) {
    return selectors.split(",").some((selector) => {
      const parts = selector.trim().match(/:not\([^)]*\)|:focus|[.#]?[\w-]+|\[[^\]]+\]/g);
      return parts.every((part) => this.#hasPart(part));
    });
  }

  #hasPart(part) {
    if (part.startsWith(":not(")) return !this.matches(part.slice(5, -1));
    if (part === ":focus") return document.activeElement === this;
    if (part.startsWith(".")) return (this.getAttribute("class") ?? "").split(" ").includes(part.slice(1));
    if (part.startsWith("#")) return this.id === part.slice(1);
    if (!part.startsWith("[")) return this.tag === part;
    const [name, value] = part.slice(1, -1).split("=");
    if (name === "open") return this.open;
    return value === undefined ? this.hasAttribute(name) : this.getAttribute(name) === value;
  }

  closest(selectors) {
    return this.matches(selectors) ? this : (this.parent?.closest(selectors) ?? null);
  }

  querySelectorAll(selectors) {
    return [...this.descendants().filter((each) => each.matches(selectors))];
  }

  querySelector(selectors) {
    return this.querySelectorAll(selectors)[0] ?? null;
  }

  focus() {
    document.activeElement = this;
  }

  blur() {
    document.activeElement = document.body;
  }

  click() {
    if (!this.disabled) dispatch(this, "click");
  }

  showModal() {
    this.open = true;
  }

  close() {
    this.open = false;
  }

  getBoundingClientRect() {
    return { left: 0, top: 0, width: this.clientWidth, height: this.clientHeight };
  }

  scrollIntoView() {}

  setPointerCapture() {}

  getContext(kind) {
    this.context ??= new FakeContext();
    return kind === "2d" ? this.context : null;
  }
}

/** Records the calls that draw on a canvas. */
class FakeContext {
  constructor() {
    this.texts = [];
    this.points = [];
    const others = "scale save restore beginPath closePath rect clip moveTo stroke fill";
    for (const name of others.split(" ")) this[name] = () => {};
  }

  fillText(text) {
    this.texts.push(text);
  }

  lineTo(x, y) {
    this.points.push([x, y]);
  }

  measureText(text) {
    return { width: CHARACTER_WIDTH * text.length };
  }
}

/** Creates the elements of an HTML text below an element. */
function parse(html, root) {
  let parent = root;
  for (const [, closing, tag, attributes, text] of html.matchAll(/<(\/?)([\w-]+)([^>]*)>([^<]*)/g)) {
    if (closing) parent = parent.parent;
    else {
      const created = new FakeElement(tag.toLowerCase());
      for (const [, name, value] of attributes.matchAll(/([\w-]+)(?:="([^"]*)")?/g)) {
        created.setAttribute(name, value ?? "");
      }
      parent.append(created);
      if (!VOID_TAGS.has(tag) && !attributes.endsWith("/")) parent = created;
    }
    if (text.trim()) parent.append(text.trim());
  }
}

/** Calls the listeners of an event with these fields; returns the event. */
export function dispatch(target, type, fields = {}) {
  const event = new Event(type, { cancelable: true });
  const values = { target, ...fields };
  for (const [name, value] of Object.entries(values)) Object.defineProperty(event, name, { value });
  target.dispatchEvent(event);
  return event;
}

/** Ends all tasks that are ready. */
export function settle() {
  return new Promise((resolve) => setImmediate(resolve));
}

/** Waits until a condition holds, which depends on work outside of the page's own tasks. */
export async function eventually(condition) {
  while (!condition()) await settle();
}

let frames = [];

/** Calls the functions that wait for the next frame, and returns their number. */
export function nextFrame() {
  const waiting = frames;
  frames = [];
  for (const callback of waiting) callback();
  return waiting.length;
}

/** Opens the page anew: a document from index.html, and a window. Returns the elements by id. */
export function openPage({ hash = "", search = "" } = {}) {
  frames = [];
  const page = new FakeElement("html");
  parse(readFileSync(INDEX, "utf-8").replace(/^<!doctype[^>]*>\s*<html[^>]*>/i, ""), page);
  const [head, body] = page.children;
  const fakeDocument = new EventTarget();
  const getElementById = (id) => page.descendants().find((each) => each.id === id) ?? null;
  Object.assign(fakeDocument, {
    documentElement: page,
    head,
    body,
    activeElement: body,
    hidden: false,
    title: "",
    getElementById,
    createElement: (tag) => new FakeElement(tag),
    createElementNS: (_namespace, tag) => new FakeElement(tag),
    querySelector: (selectors) => page.querySelector(selectors),
    querySelectorAll: (selectors) => page.querySelectorAll(selectors),
  });
  const location = { pathname: "/", search, hash, href: `http://localhost/${search}${hash}` };
  const stored = new Map();
  const media = new EventTarget();
  const fakeWindow = new EventTarget();
  Object.assign(fakeWindow, {
    innerWidth: 1200,
    innerHeight: 800,
    devicePixelRatio: 1,
    location,
    history: {
      replaceState(_state, _title, address) {
        location.hash = address.includes("#") ? address.slice(address.indexOf("#")) : "";
      },
    },
    localStorage: {
      getItem: (name) => stored.get(name) ?? null,
      setItem: (name, value) => stored.set(name, value),
    },
    getSelection: () => "",
    matchMedia: () => Object.assign(media, { matches: false }),
    requestAnimationFrame: (callback) => frames.push(callback),
  });
  // Read at each call, because tests replace the timers.
  for (const name of ["setTimeout", "clearTimeout", "setInterval", "clearInterval"]) {
    fakeWindow[name] = (...values) => globalThis[name](...values);
  }
  for (const kind of ["", "Input", "Select", "Canvas", "Button", "Dialog"]) {
    globalThis[`HTML${kind}Element`] = FakeElement;
  }
  globalThis.Node = globalThis.Element = FakeElement;
  globalThis.PointerEvent = Event;
  globalThis.WheelEvent = { DOM_DELTA_LINE: 1 };
  globalThis.ResizeObserver = class {
    observe() {}
  };
  globalThis.getComputedStyle = () => ({ color: "black" });
  globalThis.document = fakeDocument;
  globalThis.window = fakeWindow;
  return new Proxy({}, { get: (_, id) => getElementById(id) });
}

openPage();
