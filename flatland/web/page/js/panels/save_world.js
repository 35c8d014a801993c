import { saveFile } from "../dom.js";

/**
 * Saves the displayed world, with its present models and poses, as a world file of the user.
 *
 * @param {import("../session.js").Session} session
 */
export async function saveWorld(session) {
  if (session.readOnly || !session.world) return;
  const reply = await session.attempt("save", {});
  if (!reply) return;
  const { text, name, folder, notes } = reply.result;
  saveFile(new Blob([text], { type: "application/yaml" }), name);
  session.notify("info", `World saved as ${name}; put the file into ${folder}`);
  for (const note of notes) session.notify("warning", note);
}
