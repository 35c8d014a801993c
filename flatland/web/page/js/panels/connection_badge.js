import { byId, setText } from "../dom.js";

/**
 * Shows the state of the connection, and a message while there is no world to draw.
 *
 * @param {import("../session.js").Session} session
 * @param {import("../stage.js").Stage} stage
 */
export function createConnectionBadge(session, stage) {
  const badge = byId("connection");
  const message = byId("message");
  const { connection } = session;

  const stateText = () => {
    const stale = session.world?.status?.stale ?? 0;
    if (connection.state === "refused") return "access denied";
    if (connection.state !== "connected" || stale < 1) return connection.state;
    return `connected, no answer for ${Math.floor(stale)} s`;
  };
  const messageText = () => {
    if (!stage.isSupported) {
      return (
        "This browser does not support WebGL 2, which is required. Enable hardware acceleration, " +
        "or use a current version of Firefox, Chrome, Edge or Safari."
      );
    }
    if (connection.state === "refused") {
      return "The access token is missing or wrong. Open the complete address that the simulator printed.";
    }
    const isLoaded = [...session.worlds.values()].some((world) => world.present);
    if (isLoaded) return "";
    return connection.state === "connected" ? "Waiting for a world…" : "Connecting to the simulator…";
  };
  const update = () => {
    setText(badge, stateText());
    badge.dataset.state = (session.world?.status?.stale ?? 0) >= 1 ? "stale" : connection.state;
    const text = messageText();
    setText(message, text);
    message.hidden = text === "";
  };

  let wasLost = false;
  connection.on("state", (state) => {
    update();
    if (state === "reconnecting") session.notify("warning", "Connection lost; reconnecting", "connection");
    else if (state === "connected" && wasLost) session.notify("info", "Connected again", "connection");
    wasLost = state === "reconnecting";
  });
  let lastReason = "";
  connection.on("reason", (reason) => {
    if (reason !== lastReason) session.notify("warning", `The server closed the connection: ${reason}`);
    lastReason = reason;
  });
  for (const name of /** @type {const} */ (["hello", "world", "status", "current"])) session.on(name, update);
  update();
}
