import { byId, element, icon } from "../dom.js";

/** Time after which a notice disappears [ms].
 * @type {Record<import("../protocol.js").Level, number>} */
const LIFETIME = { info: 5000, warning: 9000, error: 12_000 };
const MAX_NOTICES = 4;

/**
 * Shows the notices of a session in a live region.
 *
 * @param {import("../session.js").Session} session
 */
export function createNotices(session) {
  const list = byId("notices");
  session.on("notice", ({ level, text, topic }) => {
    for (const old of [...list.children]) if (old.getAttribute("data-topic") === topic) old.remove();
    const close = element(
      "button",
      { type: "button", class: "button square", "aria-label": "Dismiss" },
      icon("close"),
    );
    const notice = element(
      "div",
      { class: "notice", "data-level": level, "data-topic": topic },
      element("p", {}, text),
      close,
    );
    close.addEventListener("click", () => notice.remove());
    list.append(notice);
    while (list.children.length > MAX_NOTICES) list.firstElementChild?.remove();
    window.setTimeout(() => notice.remove(), LIFETIME[level]);
  });
}
