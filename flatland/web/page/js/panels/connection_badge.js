import { byId, setText } from "../dom.js";

const CHECK_PERIOD = 500; // ms
/** Checks without the state of a world, which arrives 5 times per second, after which it is stale. */
const SILENT_CHECKS = 3;

/**
 * Shows the state of the connection, and a message while there is no world to draw or its state is
 * stale.
 *
 * @param {import("../session.js").Session} session
 * @param {import("../stage.js").Stage} stage
 */
export function createConnectionBadge(session, stage) {
  const badge = byId("connection");
  const message = byId("message");
  const { connection } = session;

  // Counted, because a time would include stalls of the browser.
  let checks = 0;
  /** Whether nothing arrives, although the connection is open. A hidden page receives nothing. */
  const isSilent = () =>
    connection.state === "connected" &&
    !document.hidden &&
    [...session.worlds.values()].some((world) => world.status) &&
    checks > SILENT_CHECKS;
  const restart = () => {
    checks = 0;
  };
  document.addEventListener("visibilitychange", restart);
  connection.on("state", restart);
  session.on("status", restart);

  const stateText = () => {
    const stale = session.world?.status?.stale ?? 0;
    if (connection.state === "refused") return "access denied";
    if (isSilent()) return "no response";
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
    if (isSilent()) return "The simulator does not respond. The picture shows its last state.";
    if (isLoaded) return "";
    return connection.state === "connected" ? "Waiting for a world…" : "Connecting to the simulator…";
  };
  const update = () => {
    setText(badge, stateText());
    const isStale = isSilent() || (session.world?.status?.stale ?? 0) >= 1;
    badge.dataset.state = isStale ? "stale" : connection.state;
    document.body.toggleAttribute("data-silent", isSilent());
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
  window.setInterval(() => {
    checks += 1;
    update();
  }, CHECK_PERIOD);
  update();
}
