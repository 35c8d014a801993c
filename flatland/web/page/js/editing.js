import { wrapAngle } from "./geometry.js";
import { spawnModel } from "./tools/spawn_tool.js";
import { notifyEdit } from "./undo.js";

/**
 * Returns a name that no model has: that of a copied model with the lowest free number from 2 on.
 *
 * @param {string} name  name of the copied model
 * @param {(name: string) => boolean} isUsed
 */
export function nameOfCopy(name, isUsed) {
  const base = name.replace(/_\d+$/, "");
  for (let i = 2; ; i++) if (!isUsed(`${base}_${i}`)) return `${base}_${i}`;
}

/**
 * Returns the namespace of a copy: the name of the copy, in the namespace around that of the model.
 *
 * @param {string} namespace  namespace of the copied model, may be empty
 * @param {string} name  name of the copy
 */
export function namespaceOfCopy(namespace, name) {
  const outer = namespace.slice(0, namespace.lastIndexOf("/") + 1);
  return outer + name.replace(/[^A-Za-z0-9_]/g, "_");
}

/** Deletes, copies and pastes models, and resets the world. */
export class Editing {
  /**
   * @param {import("./session.js").Session} session
   * @param {() => {x: number, y: number}} place  returns where a copy is pasted [m]
   */
  constructor(session, place) {
    this.session = session;
    this.place = place;
    /** @type {{name: string, file: string, namespace: string, heading: number} | null} */
    this.copied = null;
    /** Names of copies that the server has not listed yet.
     * @type {Set<string>} */
    this.pending = new Set();
    session.on("models", (world) => {
      for (const name of this.pending) if (world.modelByName(name)) this.pending.delete(name);
    });
    session.on("current", () => this.pending.clear());
  }

  /** Deletes the selected model; returns whether it was deleted. */
  async deleteSelected() {
    const { session } = this;
    const { selected } = session;
    if (!selected || session.readOnly) return false;
    const reply = await session.attempt("delete", { model: selected.id });
    if (!reply) return false;
    notifyEdit(session, `Deleted ${selected.name}`, reply.result.can_undo);
    if (session.selectedName === selected.name) session.select(null);
    return true;
  }

  copy() {
    const { session } = this;
    const { selected, world } = session;
    if (!selected || !world || session.readOnly) return;
    const { name, file, namespace } = selected;
    if (!file) {
      session.notify("error", `Model "${name}" was not read from a file and cannot be copied`);
      return;
    }
    const heading = wrapAngle(world.modelPose(selected)?.[2] ?? 0);
    this.copied = { name, file, namespace, heading };
    session.notify("info", `Copied ${name}; Ctrl+V pastes it at the pointer`, "copy");
  }

  /** @param {{x: number, y: number}} [spot]  where, by default at the pointer [m] */
  async paste(spot = this.place()) {
    const { session, copied, pending } = this;
    const { world } = session;
    if (!copied || !world || session.readOnly) return;
    const isUsed = (/** @type {string} */ name) => pending.has(name) || world.modelByName(name) !== null;
    const name = nameOfCopy(copied.name, isUsed);
    const namespace = namespaceOfCopy(copied.namespace, name);
    pending.add(name);
    const text = `Pasted ${name}; its topics begin with /${namespace}/`;
    /** @type {import("./geometry.js").Pose} */
    const pose = [spot.x, spot.y, copied.heading];
    if (!(await spawnModel(session, copied.file, name, namespace, pose, text))) pending.delete(name);
  }

  async reset() {
    const { session } = this;
    if (session.readOnly || !session.world) return;
    const reply = await session.attempt("reset", {});
    if (!reply) return;
    notifyEdit(session, "World reset to its state after loading", reply.result.can_undo);
    session.notifySetBack(reply.result.effect);
  }
}
