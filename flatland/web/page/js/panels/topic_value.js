import { element, icon, setText } from "../dom.js";
import { describeValue } from "../format.js";

/**
 * Shows the value of a topic, with a button beside each number that plots it. The elements are kept
 * while the value has the same fields, so that a button keeps the focus.
 *
 * @param {Element} root
 * @param {import("../protocol.js").TopicValue} topic
 * @param {(name: string) => void} plot  called with the name of the number
 */
export function renderTopicValue(root, { topic, value, kind }, plot) {
  const lines = describeValue(value);
  // Commands are not published, so that their numbers cannot be plotted.
  const nameOf = (/** @type {import("../format.js").Part} */ { path }) =>
    path === null || kind === "command" ? null : [topic, ...path].join("/");
  const key = lines.map((parts) => parts.map((part) => nameOf(part) ?? "").join("\t")).join("\n");
  if (root.getAttribute("data-key") !== key) {
    root.setAttribute("data-key", key);
    root.replaceChildren(
      ...lines.map((parts) => {
        const line = element("div", { class: "value-line" });
        for (const part of parts) line.append(createPart(nameOf(part), plot));
        return line;
      }),
    );
  }
  lines.forEach((parts, i) => {
    parts.forEach(({ text }, j) => {
      const [shown] = root.children[i].children[j].children;
      setText(shown, text);
    });
  });
}

/**
 * @param {string | null} name  of the number, null for text
 * @param {(name: string) => void} plot
 */
function createPart(name, plot) {
  const part = element("span", {}, element("span"));
  if (name === null) return part;
  const label = `Plot ${name}`;
  const button = element(
    "button",
    { type: "button", class: "button plot-number", title: label, "aria-label": label, "data-series": name },
    icon("plot"),
  );
  button.addEventListener("click", () => plot(name));
  part.append(button);
  return part;
}
