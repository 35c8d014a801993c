import { byId, element, firstChild, icon, setText } from "../dom.js";
import { brief, fixed, significant } from "../format.js";
import { renderTopicValue } from "./topic_value.js";

/** Time between two updates of the pose from the view [ms]. */
const POSE_PERIOD = 200;

/** The properties of the selected model. */
export class Inspector {
  /**
   * @param {import("../session.js").Session} session
   * @param {import("../stage.js").Stage} stage
   * @param {{deleteSelected: () => void, plot: (name: string) => void}} actions
   */
  constructor(session, stage, actions) {
    this.session = session;
    this.actions = actions;
    this.root = byId("inspector");
    /** @type {number | null} */
    this.shownId = null;
    this.poseTime = 0;
    /** @type {HTMLInputElement[]} */
    this.fields = [];
    this.isEdited = false;
    /** Whether the fields have contained a pose, which arrives later than the model. */
    this.isFilled = false;
    this.empty = firstChild(this.root);
    session.on("selection", () => this.rebuild());
    session.on("models", () => {
      if (this.shownId !== (session.selected?.id ?? null)) this.rebuild();
    });
    session.on("hello", () => this.rebuild());
    session.on("current", () => this.rebuild());
    session.on("details", (details) => this.update(details));
    stage.on("frame", () => this.updatePose());
  }

  rebuild() {
    const { selected, readOnly } = this.session;
    this.shownId = selected?.id ?? null;
    this.isEdited = this.isFilled = false;
    if (!selected) {
      const place = this.session.world
        ? "Select a model in the view or in the list."
        : "Enlarge a world to select a model.";
      setText(this.empty, place);
      this.root.replaceChildren(this.empty);
      return;
    }
    // A model that was not read from a file has a name such as <text>.
    const file = selected.file.startsWith("<") ? "" : selected.file.split("/").slice(-2).join("/");
    const head = element("div", { class: "model-head" }, element("h3", {}, selected.name));
    if (file) head.append(element("span", { class: "muted", title: selected.file }, file));
    /** @type {HTMLElement[]} */
    const parts = [head];
    parts.push(this.createPose(readOnly));
    if (!readOnly) {
      const remove = element("button", { type: "button", id: "delete", class: "button outlined danger" });
      remove.append(icon("delete"), "Delete");
      remove.title = "Delete the model (Delete)";
      remove.addEventListener("click", () => this.actions.deleteSelected());
      parts.push(element("div", { class: "row" }, remove));
    }
    parts.push(element("div", { id: "details", class: "pose-form" }));
    this.root.replaceChildren(...parts);
    this.poseTime = 0;
    this.updatePose();
  }

  /** @param {boolean} readOnly */
  createPose(readOnly) {
    const form = element("form", { class: "pose-form", "aria-label": "Pose" });
    const row = element("div", { class: "triple" });
    this.fields = [];
    for (const [id, label] of [
      ["pose-x", "x [m]"],
      ["pose-y", "y [m]"],
      ["pose-theta", "θ [rad]"],
    ]) {
      const field = element("input", { id, inputmode: "decimal", autocomplete: "off", readonly: readOnly });
      field.addEventListener("input", () => {
        this.isEdited = true;
        field.removeAttribute("aria-invalid");
      });
      field.addEventListener("keydown", (event) => {
        if (event.key !== "Escape") return;
        event.stopPropagation();
        this.isEdited = false;
        field.blur();
      });
      this.fields.push(field);
      row.append(element("label", { for: id }, label, field));
    }
    form.append(row);
    if (!readOnly) {
      const apply = { type: "submit", id: "pose-apply", class: "button outlined" };
      form.append(element("button", apply, "Move to these coordinates"));
    }
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.applyPose();
    });
    return form;
  }

  async applyPose() {
    const { session } = this;
    if (session.readOnly || this.shownId === null) return;
    const pose = this.fields.map((field) => parseNumber(field.value));
    for (const [i, field] of this.fields.entries()) {
      field.setAttribute("aria-invalid", String(Number.isNaN(pose[i])));
    }
    if (pose.some(Number.isNaN)) {
      session.notify("error", "The coordinates must be numbers");
      return;
    }
    this.isEdited = false;
    await session.move(this.shownId, [pose[0], pose[1], pose[2]]);
  }

  /** Shows the pose of the model in the view, unless the user is editing the pose. */
  updatePose() {
    const now = performance.now();
    const isFocused = this.fields.some((field) => field === document.activeElement);
    if (this.isFilled && (this.isEdited || isFocused || now - this.poseTime < POSE_PERIOD)) return;
    const { selected, world } = this.session;
    const pose = selected && world?.modelPose(selected);
    if (!pose) return;
    this.poseTime = now;
    this.fields.forEach((field, i) => {
      const text = pose[i].toFixed(3).replace(/^-(0\.0+)$/, "$1");
      const isTyped = !this.isFilled && field.value !== "";
      if (field.value !== text && !isTyped) field.value = text;
    });
    this.isFilled = true;
  }

  /** @param {import("../protocol.js").DetailsMessage} details */
  update(details) {
    const root = document.getElementById("details");
    if (details.model !== this.shownId || !root) return;
    const [vx, vy, omega] = details.velocity ?? [NaN, NaN, NaN];
    const contacts = details.contacts.length > 0 ? details.contacts.join(", ") : "none";
    /** @type {[string, string][]} */
    const facts = [
      ["Speed", `${fixed(Math.hypot(vx, vy), 3)} m/s`],
      ["Velocity x, y", `${fixed(vx, 3)}, ${fixed(vy, 3)} m/s`],
      ["Angular velocity", `${fixed(omega, 3)} rad/s`],
      ["Mass", `${significant(details.mass)} kg`],
      ["Moment of inertia", `${significant(details.inertia)} kg m²`],
      ["Contacts", contacts],
    ];
    let list = root.querySelector("dl.facts");
    if (!list) {
      list = element("dl", { class: "facts" });
      root.append(list);
    }
    renderFacts(list, facts);
    this.updateTopics(root, details.topics);
    this.updatePlugins(root, details.plugins);
  }

  /**
   * @param {HTMLElement} root
   * @param {import("../protocol.js").TopicValue[]} topics
   */
  updateTopics(root, topics) {
    const section = subsection(root, "topics", `Topics (${topics.length})`, true);
    while (section.children.length > topics.length + 1) section.lastElementChild?.remove();
    while (section.children.length < topics.length + 1) {
      section.append(element("div", { class: "topic" }, element("code"), element("div", { class: "value" })));
    }
    topics.forEach((each, i) => {
      const { topic, type, kind } = each;
      const [name, value] = section.children[i + 1].children;
      setText(name, topic);
      name.setAttribute("title", `${type}, ${kind}`);
      renderTopicValue(value, each, this.actions.plot);
    });
  }

  /**
   * @param {HTMLElement} root
   * @param {import("../protocol.js").PluginInfo[]} plugins
   */
  updatePlugins(root, plugins) {
    const section = subsection(root, "plugins", `Plugins (${plugins.length})`, false);
    const key = JSON.stringify(plugins);
    if (section.dataset.key === key) return;
    section.dataset.key = key;
    const summary = firstChild(section);
    const parts = plugins.map(({ name, type, parameters }) => {
      const list = element("dl", { class: "facts" });
      renderFacts(
        list,
        Object.entries(parameters).map(([each, value]) => [each, brief(value, 300)]),
      );
      return element(
        "div",
        { class: "topic" },
        element("span", {}, name, " ", element("code", {}, type)),
        list,
      );
    });
    section.replaceChildren(summary, ...parts);
  }
}

/**
 * @param {Element} list
 * @param {[string, string][]} facts
 */
function renderFacts(list, facts) {
  while (list.children.length > 2 * facts.length) list.lastElementChild?.remove();
  while (list.children.length < 2 * facts.length) list.append(element("dt"), element("dd"));
  facts.forEach(([name, value], i) => {
    setText(list.children[2 * i], name);
    setText(list.children[2 * i + 1], value);
  });
}

/**
 * Returns a collapsible part of the inspector; creates the part at the first call.
 *
 * @param {HTMLElement} root
 * @param {string} name
 * @param {string} title
 * @param {boolean} open
 */
function subsection(root, name, title, open) {
  let found = [...root.querySelectorAll("details")].find(({ dataset }) => dataset.part === name);
  if (!found) {
    found = element("details", { class: "sub", "data-part": name, open }, element("summary"));
    root.append(found);
  }
  setText(firstChild(found), title);
  return found;
}

/**
 * Returns the number in a field, NaN for any other text.
 *
 * @param {string} text
 */
export function parseNumber(text) {
  const plain = text.trim().replace("−", "-").replace(",", ".");
  return plain === "" ? NaN : Number.isFinite(Number(plain)) ? Number(plain) : NaN;
}
