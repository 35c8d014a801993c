import { byId, setPressed, setText } from "../dom.js";
import { loadSetting, saveSetting } from "../settings.js";

/** Width up to which the side panel is closed at first [CSS pixels]. */
const NARROW = 640;

/**
 * Connects the buttons of the tools and of the side panel.
 *
 * @param {import("../session.js").Session} session
 * @param {import("../stage.js").Stage} stage
 * @param {import("../tools/tool_box.js").ToolBox} tools
 * @param {{toggleFollow: () => void, zoomIn: () => void, zoomOut: () => void}} actions
 */
export function createToolbar(session, stage, tools, actions) {
  /** @type {Record<string, import("../tools/tool_box.js").ToolName>} */
  const names = { "tool-select": "select", "tool-pan": "pan", measure: "measure" };
  const updateTools = () => {
    for (const [id, name] of Object.entries(names)) setPressed(byId(id), tools.name === name);
  };
  for (const [id, name] of Object.entries(names)) {
    byId(id).addEventListener("click", () => tools.use(tools.name === name ? "select" : name));
  }
  tools.on("change", updateTools);
  tools.on("hint", (text) => setText(byId("hint"), text));
  updateTools();

  const follow = byId("follow", HTMLButtonElement);
  const updateFollow = () => {
    follow.disabled = session.selected === null && stage.followed === null;
    setPressed(follow, stage.followed !== null);
  };
  follow.addEventListener("click", actions.toggleFollow);
  session.on("selection", updateFollow);
  session.on("models", updateFollow);
  stage.on("view", updateFollow);
  updateFollow();

  byId("fit").addEventListener("click", () => stage.fit());
  byId("zoom-in").addEventListener("click", actions.zoomIn);
  byId("zoom-out").addEventListener("click", actions.zoomOut);

  const updateWorld = () => {
    for (const id of [
      ...Object.keys(names),
      "spawn",
      "undo",
      "reset",
      "save-world",
      "fit",
      "zoom-in",
      "zoom-out",
    ]) {
      byId(id, HTMLButtonElement).disabled = session.world === null;
    }
  };
  session.on("current", updateWorld);
  session.on("hello", updateWorld);
  updateWorld();

  const panel = byId("panel-toggle");
  /** @param {boolean} open */
  const setPanel = (open) => {
    document.body.dataset.panel = open ? "open" : "closed";
    setPressed(panel, open);
  };
  panel.addEventListener("click", () => {
    const open = document.body.dataset.panel === "closed";
    setPanel(open);
    saveSetting("panel", open ? "open" : "closed");
  });
  const isNarrow = window.innerWidth <= NARROW;
  setPanel(!isNarrow && loadSetting("panel") !== "closed");

  const updateReadOnly = () => {
    for (const part of document.querySelectorAll("[data-writes]:not(#drive)")) {
      part.toggleAttribute("hidden", session.readOnly);
    }
  };
  session.on("hello", updateReadOnly);
}
