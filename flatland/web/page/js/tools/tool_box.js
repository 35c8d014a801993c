import { Emitter } from "../events.js";

/**
 * A position of the pointer in the view.
 *
 * @typedef {object} Spot
 * @property {number} px  [CSS pixels]
 * @property {number} py  [CSS pixels]
 * @property {number} x  [m]
 * @property {number} y  [m]
 * @property {boolean} isTouch
 *
 * @typedef {object} Tool
 * @property {string} hint  next action of the user; may be empty
 * @property {(spot: Spot) => boolean} down  returns whether the tool handles the drag; otherwise
 *   the drag moves the view
 * @property {(spot: Spot) => void} drag
 * @property {(spot: Spot, moved: boolean) => void} up  also called for a click
 * @property {(spot: Spot) => string} hover  returns the name of a cursor
 * @property {() => boolean} cancel  cancels the current action; returns whether there was one
 * @property {() => void} leave  called when another tool becomes active
 * @property {import("../renderer/renderer.js").Overlay} draw
 *
 * @typedef {"select" | "pan" | "measure" | "spawn" | "goal" | "initial_pose"} ToolName
 */

/**
 * The tools, of which one is active.
 *
 * @extends {Emitter<{change: ToolName, hint: string}>}
 */
export class ToolBox extends Emitter {
  /** @param {Record<ToolName, Tool>} tools */
  constructor(tools) {
    super();
    this.tools = tools;
    /** @type {ToolName} */
    this.name = "select";
    this.lastHint = "";
  }

  get active() {
    return this.tools[this.name];
  }

  /** @param {ToolName} name */
  use(name) {
    if (name !== this.name) {
      this.active.leave();
      this.name = name;
      this.emit("change", name);
    }
    this.updateHint();
  }

  /** Cancels the action of the active tool; without an action, activates the selection tool. */
  cancel() {
    if (!this.active.cancel()) this.use("select");
    this.updateHint();
  }

  updateHint() {
    const { hint } = this.active;
    if (hint === this.lastHint) return;
    this.lastHint = hint;
    this.emit("hint", hint);
  }
}
