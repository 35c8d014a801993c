import { wrapAngle } from "../geometry.js";

/** Time between two messages that keep the world paused [ms]. */
const HOLD_PERIOD = 1000;

/**
 * @typedef {import("../geometry.js").Pose} Pose
 * @typedef {import("../world_state.js").Model} Model
 */

/** The drag of a model, which moves or turns the model. The world is paused during a drag. */
export class ModelDrag {
  /**
   * @param {import("../session.js").Session} session
   * @param {Model} model
   * @param {"move" | "turn"} mode
   * @param {Pose} start  pose of the model
   * @param {{x: number, y: number}} spot  where the drag begins [m]
   */
  constructor(session, model, mode, start, spot) {
    this.session = session;
    this.model = model;
    this.mode = mode;
    this.start = start;
    this.origin = { x: spot.x, y: spot.y };
    /** @type {Pose} */
    this.pose = [...start];
    const hold = () => session.request("hold", { model: model.id });
    this.held = hold().catch((error) => session.notify("error", error.message));
    this.timer = window.setInterval(() => hold().catch(() => {}), HOLD_PERIOD);
  }

  /** @param {{x: number, y: number}} spot  [m] */
  to({ x, y }) {
    const [startX, startY, heading] = this.start;
    if (this.mode === "move") {
      this.pose = [startX + x - this.origin.x, startY + y - this.origin.y, heading];
      return;
    }
    const before = Math.atan2(this.origin.y - startY, this.origin.x - startX);
    const now = Math.atan2(y - startY, x - startX);
    this.pose = [startX, startY, wrapAngle(heading + now - before)];
  }

  /** Moves the model to its new pose. */
  async drop() {
    window.clearInterval(this.timer);
    await this.held;
    await this.session.move(this.model.id, this.pose);
    await this.release();
  }

  /** Ends the drag without moving the model. */
  async cancel() {
    window.clearInterval(this.timer);
    await this.held;
    await this.release();
  }

  async release() {
    await this.session.request("release", { model: this.model.id }).catch(() => {});
  }
}
