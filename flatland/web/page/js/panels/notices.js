import { byId, element, icon } from "../dom.js";

/** Time after which a notice disappears [ms]. */
const LIFETIME = { info: 5000, warning: 9000, error: 12_000 };
const MAX_NOTICES = 4;

/**
 * Shows the notices of a session in a live region.
 *
 * @param {import("../session.js").Session} session
 */
export function createNotices(session) {
  const list = byId("notices");
  session.on("notice", ({ level, text }) => {
    for (const old of list.children) if (old.querySelector("p")?.textContent === text) old.remove();
    const close = element("button", { type: "button", class: "button square", "aria-label": "Dismiss" }, icon("close"));
    const notice = element("div", { class: "notice", "data-level": level }, element("p", {}, text), close);
    close.addEventListener("click", () => notice.remove());
    list.append(notice);
    while (list.children.length > MAX_NOTICES) list.firstElementChild?.remove();
    const lifetime = LIFETIME[/** @type {"info"} */ (level)] ?? LIFETIME.info;
    window.setTimeout(() => notice.remove(), lifetime);
  });
}
