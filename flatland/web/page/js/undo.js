/** @typedef {import("./session.js").Session} Session */

/** Topic of the notices with a button that undoes the last edit: only the newest one is valid. */
export const UNDO_TOPIC = "undo";

/**
 * Reports an edit of this page, with a button that undoes it.
 *
 * @param {Session} session
 * @param {string} text
 * @param {boolean} [canUndo]
 */
export function notifyEdit(session, text, canUndo = true) {
  const action = { text: "Undo", run: () => void undo(session) };
  session.notify("info", text, UNDO_TOPIC, canUndo ? action : undefined);
}

/** @param {Session} session */
export function undo(session) {
  return repeat(session, "undo", "Undone");
}

/** @param {Session} session */
export function redo(session) {
  return repeat(session, "redo", "Redone");
}

/**
 * @param {Session} session
 * @param {"undo" | "redo"} type
 * @param {string} verb
 */
async function repeat(session, type, verb) {
  if (session.readOnly || !session.world) return;
  const reply = await session.attempt(type, {});
  if (!reply) return;
  session.notify("info", `${verb}: ${reply.result.text}`, UNDO_TOPIC);
  session.notifySetBack(reply.result.effect);
}
