import { packColor } from "../renderer/edge_batch.js";
import { addArrow } from "../renderer/outlines.js";

/** Length of the arrow [CSS pixels]. */
const ARROW_LENGTH = 56;

/**
 * Publishes a pose: a press sets the position, the drag sets the heading. After a click without a
 * drag, the next click sets the heading.
 *
 * @implements {Tool}
 * @typedef {import("./tool_box.js").Tool} Tool
 * @typedef {import("./tool_box.js").Spot} Spot
 */
export class PoseTool {
  /**
   * @param {import("../session.js").Session} session
   * @param {import("../stage.js").Stage} stage
   * @param {import("../protocol.js").PosePurpose} purpose
   * @param {string} label  name of the pose for users
   */
  constructor(session, stage, purpose, label) {
    this.session = session;
    this.stage = stage;
    this.purpose = purpose;
    this.label = label;
    /** Topic that the user has selected, empty for that of the selected model. */
    this.chosenTopic = "";
    /** @type {import("../geometry.js").Pose | null} */
    this.pose = null;
    /** Whether the position was set by an earlier click. */
    this.isPlaced = false;
    /** Called when the pose has been published. */
    this.onDone = () => {};
  }

  /** Topic of the pose, null if the program publishes no poses. */
  get topic() {
    const { topics, selected } = this.session;
    if (topics.poseTopics[this.purpose]?.includes(this.chosenTopic)) return this.chosenTopic;
    return topics.poseTopic(this.purpose, selected?.namespace ?? "");
  }

  get hint() {
    const step = this.pose ? "set the heading" : "press at the position and drag to the heading";
    return `${this.label} on ${this.topic ?? "no topic"}: ${step}`;
  }

  /** @param {Spot} spot */
  down({ x, y }) {
    this.isPlaced = this.pose !== null;
    this.pose ??= [x, y, 0];
    this.stage.invalidate();
    return true;
  }

  /** @param {Spot} spot */
  drag(spot) {
    this.turn(spot);
  }

  /**
   * @param {Spot} spot
   * @param {boolean} moved
   */
  up(spot, moved) {
    if (!this.pose) return;
    this.turn(spot);
    if (moved || this.isPlaced) this.publish(this.pose);
  }

  /** @param {Spot} spot */
  hover(spot) {
    this.turn(spot);
    return "cross";
  }

  /** @param {Spot} spot */
  turn({ x, y }) {
    if (!this.pose) return;
    const [dx, dy] = [x - this.pose[0], y - this.pose[1]];
    if (dx || dy) this.pose[2] = Math.atan2(dy, dx);
    this.stage.invalidate();
  }

  /** @param {import("../geometry.js").Pose} pose */
  async publish(pose) {
    const { session, purpose, topic, label } = this;
    this.leave();
    this.onDone();
    if (topic === null) return;
    const answer = await session.attempt("publish_pose", { purpose, topic, pose });
    if (!answer) return;
    if (answer.result.received === false) session.notify("warning", `No node subscribes to ${topic}`);
    else session.notify("info", `${label} published on ${topic}`);
  }

  cancel() {
    const had = this.pose !== null;
    this.leave();
    return had;
  }

  leave() {
    this.pose = null;
    this.stage.invalidate();
  }

  /** @type {import("../renderer/renderer.js").Overlay} */
  draw(batch, _labels, { camera }, palette) {
    if (this.pose) addArrow(batch, this.pose, ARROW_LENGTH / camera.zoom, packColor(palette.accent));
  }
}
