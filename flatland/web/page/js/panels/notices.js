import { byId, element, icon } from "../dom.js";
import { UNDO_TOPIC } from "../undo.js";

/** Time after which a notice disappears [ms].
 * @type {Record<import("../protocol.js").Level, number>} */
const LIFETIME = { info: 5000, warning: 9000, error: 12_000 };
/** Least time for a notice with a button [ms]. */
const ACTION_LIFETIME = 10_000;
const MAX_NOTICES = 4;

/**
 * Shows the notices of a session in a live region.
 *
 * @param {import("../session.js").Session} session
 */
export function createNotices(session) {
  const list = byId("notices");
  /** @param {string} topic */
  const remove = (topic) => {
    for (const old of [...list.children]) if (old.getAttribute("data-topic") === topic) old.remove();
  };
  session.on("outdated", () => remove(UNDO_TOPIC));
  session.on("notice", ({ level, text, topic, action }) => {
    remove(topic);
    const close = element(
      "button",
      { type: "button", class: "button square", "aria-label": "Dismiss" },
      icon("close"),
    );
    const notice = element(
      "div",
      { class: "notice", "data-level": level, "data-topic": topic },
      element("p", {}, text),
    );
    if (action) {
      const button = element("button", { type: "button", class: "button outlined" }, action.text);
      button.addEventListener("click", () => {
        notice.remove();
        action.run();
      });
      notice.append(button);
    }
    notice.append(close);
    close.addEventListener("click", () => notice.remove());
    list.append(notice);
    while (list.children.length > MAX_NOTICES) list.firstElementChild?.remove();
    const lifetime = action ? Math.max(ACTION_LIFETIME, LIFETIME[level]) : LIFETIME[level];
    window.setTimeout(() => notice.remove(), lifetime);
  });
}
