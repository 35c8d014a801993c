import { byId, element, icon, setPressed, setText } from "../dom.js";
import { MAX_INSPECTED, MAX_SHOWN, seriesName } from "../foreign_topics.js";
import { updateTree } from "./value_tree.js";

/**
 * @typedef {import("../protocol.js").TopicEntry} TopicEntry
 *
 * @typedef {object} Row  the elements of a topic
 * @property {HTMLElement} root
 * @property {HTMLInputElement | null} box
 * @property {HTMLElement} status
 * @property {HTMLButtonElement} inspect
 * @property {HTMLElement} tree
 */

/** Heading of the topics that cannot be drawn. */
const OTHERS = "Other topics";

/**
 * Lists the topics of other programs by type: check boxes of those that can be drawn, and the values
 * of all. Hidden in programs without such topics.
 *
 * @param {import("../session.js").Session} session
 * @param {(name: string) => void} plot  plots the number with a name
 */
export function createTopicList(session, plot) {
  const { topics } = session;
  const root = byId("topics");
  const list = byId("topic-list");
  const filter = byId("topic-filter", HTMLInputElement);
  /** @type {Map<string, Row>} */
  let rows = new Map();
  let shape = "";

  const update = () => {
    root.hidden = topics.entries === null;
    const wanted = filter.value.trim().toLowerCase();
    const entries = (topics.entries ?? []).filter(
      ({ topic, type }) => !wanted || `${topic} ${type}`.toLowerCase().includes(wanted),
    );
    const newShape = JSON.stringify(entries.map(({ id, type, drawn_as }) => [id, type, drawn_as]));
    if (newShape !== shape) {
      shape = newShape;
      rebuild(entries);
    }
    for (const { topic, status } of entries) {
      const row = rows.get(topic);
      if (!row) continue;
      setText(row.status, status);
      row.status.hidden = status === "";
      if (row.box) row.box.checked = topics.shown.has(topic);
      setPressed(row.inspect, topics.inspected.has(topic));
      row.tree.hidden = !topics.inspected.has(topic);
    }
  };

  /** @param {TopicEntry[]} entries */
  const rebuild = (entries) => {
    const before = rows;
    const focused = document.activeElement;
    const wasOpen = list.querySelector("details")?.open ?? false;
    rows = new Map();
    /** @type {Map<string, HTMLElement[]>} */
    const groups = new Map();
    for (const entry of entries) {
      const row = before.get(entry.topic) ?? createRow(entry);
      const isSame = (row.box !== null) === (entry.drawn_as !== null);
      const kept = isSame ? row : createRow(entry);
      rows.set(entry.topic, kept);
      const group = entry.drawn_as ? entry.type : OTHERS;
      groups.set(group, [...(groups.get(group) ?? []), kept.root]);
    }
    const others = groups.get(OTHERS);
    groups.delete(OTHERS);
    const parts = [...groups.keys()]
      .sort()
      .flatMap((type) => [element("h4", {}, type), ...(groups.get(type) ?? [])]);
    list.replaceChildren(...parts);
    if (others) {
      const summary = element("summary", {}, `${OTHERS} (${others.length})`);
      const isOpen = wasOpen || filter.value !== "";
      list.append(element("details", { class: "sub", open: isOpen }, summary, ...others));
    }
    // Elements that are inserted again have lost the focus.
    if (focused instanceof HTMLElement && list.contains(focused)) focused.focus();
    if (entries.length === 0) list.append(element("p", { class: "muted" }, "No topics"));
  };

  /**
   * @param {TopicEntry} entry
   * @returns {Row}
   */
  const createRow = ({ id, topic, type, drawn_as }) => {
    const status = element("p", { class: "status", hidden: true });
    const tree = element("div", { class: "tree", hidden: true });
    const inspect = element(
      "button",
      {
        type: "button",
        class: "button square",
        "aria-label": `Values of ${topic}`,
        title: "Values",
        "data-inspect": topic,
      },
      icon("values"),
    );
    inspect.addEventListener("click", () => {
      const isFull = topics.inspected.size >= MAX_INSPECTED && !topics.inspected.has(topic);
      if (isFull) {
        session.notify("warning", `The values of at most ${MAX_INSPECTED} topics are shown`);
        return;
      }
      topics.inspect(topic, !topics.inspected.has(topic));
      tree.replaceChildren();
      tree.removeAttribute("data-shape");
      update();
    });
    const name = element("code", { title: `${topic}, ${type}` }, topic);
    const head = element("div", { class: "topic-head" });
    let box = null;
    if (drawn_as) {
      const shown = element("input", { type: "checkbox", "data-topic": topic });
      shown.addEventListener("change", () => {
        if (shown.checked && topics.shown.size >= MAX_SHOWN) {
          shown.checked = false;
          session.notify("warning", `At most ${MAX_SHOWN} topics are shown`);
        } else topics.show(topic, shown.checked);
      });
      const swatch = element("span", { class: `swatch series-${id % 8}`, "aria-hidden": "true" });
      head.append(element("label", {}, shown, drawn_as === "marks" ? swatch : "", name));
      box = shown;
    } else head.append(name, element("span", { class: "muted" }, type));
    head.append(inspect);
    const row = element("div", { class: "foreign-topic" }, head);
    if (drawn_as === "grid") row.append(costmapSwitch(topic));
    row.append(status, tree);
    return { root: row, box, status, inspect, tree };
  };

  /** @param {string} topic */
  const costmapSwitch = (topic) => {
    const box = element("input", { type: "checkbox", "data-costmap": topic });
    box.checked = topics.isCostmap(topic);
    box.addEventListener("change", () => topics.setCostmap(topic, box.checked));
    return element("label", { class: "costmap" }, box, "Colours of a costmap");
  };

  topics.on("list", update);
  topics.on("demand", update);
  topics.on("values", ({ topic, value }) => {
    const row = rows.get(topic);
    if (!row || !topics.inspected.has(topic)) return;
    updateTree(row.tree, value, (path) => plot(seriesName(topic, path)));
  });
  filter.addEventListener("input", update);
  update();
}
