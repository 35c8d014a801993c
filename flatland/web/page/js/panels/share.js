import { byId } from "../dom.js";

/**
 * Connects the button that copies a link to the view.
 *
 * @param {import("../session.js").Session} session
 * @param {import("../view_link.js").ViewLink} link
 */
export function createShare(session, link) {
  byId("share").addEventListener("click", async () => {
    link.write();
    const hasToken = new URLSearchParams(window.location.search).has("token");
    const note = hasToken ? "; it contains the access token" : "";
    try {
      await navigator.clipboard.writeText(window.location.href);
      session.notify("info", `Link to this view copied${note}`);
    } catch {
      // Pages without HTTPS have no clipboard.
      session.notify("info", `The address of the page is a link to this view${note}`);
    }
  });
}
