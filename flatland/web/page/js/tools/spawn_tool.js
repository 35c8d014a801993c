import { composePoses } from "../geometry.js";
import { packColor } from "../renderer/edge_batch.js";
import { addArrow, addOutline } from "../renderer/outlines.js";
import { notifyEdit } from "../undo.js";

/**
 * @typedef {import("./tool_box.js").Spot} Spot
 * @typedef {import("../geometry.js").Pose} Pose
 * @typedef {import("../protocol.js").PreviewBody} PreviewBody
 *
 * @typedef {object} Plan  what is spawned
 * @property {string} file
 * @property {() => string} nextName  returns a name that is not in use
 * @property {string} namespace  empty to use the name
 * @property {PreviewBody[]} bodies
 */

/** Movement above which a click becomes a drag [CSS pixels]. */
const DRAG_DISTANCE = 6;
/** Time of a double click [ms]. */
const DOUBLE_CLICK = 400;

/**
 * Places a new model. The pointer sets first the position of the outline, then the heading.
 *
 * @implements {Tool}
 * @typedef {import("./tool_box.js").Tool} Tool
 */
export class SpawnTool {
  /**
   * @param {import("../session.js").Session} session
   * @param {import("../stage.js").Stage} stage
   */
  constructor(session, stage) {
    this.session = session;
    this.stage = stage;
    /** @type {Plan | null} */
    this.plan = null;
    /** @type {Pose | null} */
    this.pose = null;
    /** @type {"position" | "heading"} */
    this.phase = "position";
    /** @type {Spot | null} */
    this.anchor = null;
    this.anchorTime = 0;
    /** Called when the model has been placed or the tool is cancelled. */
    this.onDone = () => {};
  }

  get hint() {
    if (!this.plan) return "";
    const name = this.plan.nextName();
    return `${name}: click or Enter sets the ${this.phase}, Escape cancels`;
  }

  /**
   * Shows the outline in the centre of the view, for users without a mouse.
   *
   * @param {Plan} plan
   */
  begin(plan) {
    const { x, y } = this.stage.camera;
    this.plan = plan;
    this.pose = [x, y, 0];
    this.phase = "position";
    this.stage.invalidate();
  }

  /** @param {Spot} spot */
  down(spot) {
    if (this.phase === "position") {
      this.pose = [spot.x, spot.y, 0];
      this.anchor = spot;
      this.anchorTime = performance.now();
    }
    this.stage.invalidate();
    return true;
  }

  /** @param {Spot} spot */
  drag(spot) {
    if (this.anchor && this.distance(spot) > DRAG_DISTANCE) {
      this.phase = "heading";
      this.turn(spot);
    }
  }

  /** @param {Spot} spot */
  up(spot) {
    if (this.phase === "position") this.phase = "heading";
    else if (this.anchor) {
      const isDouble = performance.now() - this.anchorTime < DOUBLE_CLICK;
      if (!(isDouble && this.distance(spot) < DRAG_DISTANCE)) this.turn(spot);
      this.spawn();
    }
    this.stage.invalidate();
  }

  /** @param {Spot} spot */
  hover(spot) {
    if (this.phase === "position") this.pose = [spot.x, spot.y, 0];
    else this.turn(spot);
    this.stage.invalidate();
    return "cross";
  }

  /** @param {Spot} spot */
  distance(spot) {
    return this.anchor ? Math.hypot(spot.px - this.anchor.px, spot.py - this.anchor.py) : 0;
  }

  /** @param {Spot} spot */
  turn({ x, y }) {
    if (!this.pose) return;
    const [dx, dy] = [x - this.pose[0], y - this.pose[1]];
    this.pose = [this.pose[0], this.pose[1], dx || dy ? Math.atan2(dy, dx) : 0];
    this.stage.invalidate();
  }

  async spawn() {
    const { plan, pose, session } = this;
    if (!plan || !pose) return;
    const name = plan.nextName();
    this.leave();
    this.onDone();
    await spawnModel(session, plan.file, name, plan.namespace, pose);
  }

  cancel() {
    if (!this.plan) return false;
    this.leave();
    this.onDone();
    return true;
  }

  leave() {
    this.plan = this.pose = this.anchor = null;
    this.phase = "position";
    this.stage.invalidate();
  }

  /** @type {import("../renderer/renderer.js").Overlay} */
  draw(batch, labels, { camera }, palette) {
    const { plan, pose } = this;
    if (!plan || !pose) return;
    const color = packColor(palette.accent);
    for (const body of plan.bodies) {
      addOutline(batch, body.shapes, composePoses(pose, body.pose), color, 2);
    }
    addArrow(batch, pose, 40 / camera.zoom, packColor(palette.warning));
    labels.add(plan.nextName(), pose[0], pose[1], 24);
  }
}

/**
 * Spawns a model and selects it; returns whether it was spawned.
 *
 * @param {import("../session.js").Session} session
 * @param {string} file
 * @param {string} name
 * @param {string} namespace  empty to use the name
 * @param {Pose} pose
 * @param {string} [text]  of the notice
 */
export async function spawnModel(session, file, name, namespace, pose, text = `Spawned ${name}`) {
  const fields = { file, name, pose, namespace: namespace || name };
  if (!(await session.attempt("spawn", fields))) return false;
  notifyEdit(session, text);
  session.select(name);
  return true;
}
