import { fixed } from "../format.js";
import { modelAt, modelRadius } from "../hit.js";
import { packColor } from "../renderer/edge_batch.js";
import { addArrow, addModelAt } from "../renderer/outlines.js";
import { ModelDrag } from "./model_drag.js";

/**
 * @typedef {import("./tool_box.js").Spot} Spot
 * @typedef {import("../world_state.js").Model} Model
 */

/** Distance up to which a click hits a model or a handle [CSS pixels]. */
const TOLERANCE = 6;
const TOUCH_TOLERANCE = 16;
/** Distance between the ring around a model and the shapes of the model [CSS pixels]. */
const RING_DISTANCE = 14;
const LEAST_RING = 26;
/** Movement above which a click becomes a drag [CSS pixels]. */
const DRAG_DISTANCE = 4;

/**
 * Selects models, and moves and turns them.
 *
 * @implements {Tool}
 * @typedef {import("./tool_box.js").Tool} Tool
 */
export class SelectTool {
  hint = "";

  /**
   * @param {import("../session.js").Session} session
   * @param {import("../stage.js").Stage} stage
   */
  constructor(session, stage) {
    this.session = session;
    this.stage = stage;
    /** @type {ModelDrag | null} */
    this.dragged = null;
    /** @type {{model: Model, mode: "move" | "turn", spot: Spot} | null} */
    this.pressed = null;
    /** The pose of a dropped model until the server sends it.
     * @type {ModelDrag | null} */
    this.settling = null;
  }

  /** @param {Spot} spot */
  modelUnder({ x, y, isTouch }) {
    const { world } = this.session;
    if (!world || !this.session.displays.models) return null;
    return modelAt(world, x, y, (isTouch ? TOUCH_TOLERANCE : TOLERANCE) / this.stage.camera.zoom);
  }

  /**
   * Returns the radius of the ring that turns the selected model.
   *
   * @param {Model} model
   */
  ringRadius(model) {
    const { world } = this.session;
    const { zoom } = this.stage.camera;
    if (!world) return 0;
    return Math.max(modelRadius(world, model) + RING_DISTANCE / zoom, LEAST_RING / zoom);
  }

  /** @param {Spot} spot */
  isOnRing({ x, y, isTouch }) {
    const { selected, world, readOnly } = this.session;
    const pose = selected && world?.modelPose(selected);
    if (!pose || readOnly) return false;
    const tolerance = (isTouch ? TOUCH_TOLERANCE : TOLERANCE) / this.stage.camera.zoom;
    return Math.abs(Math.hypot(x - pose[0], y - pose[1]) - this.ringRadius(selected)) < tolerance;
  }

  /** @param {Spot} spot */
  down(spot) {
    const { selected, readOnly } = this.session;
    const under = this.modelUnder(spot);
    if (selected && under !== selected && this.isOnRing(spot)) {
      this.pressed = { model: selected, mode: "turn", spot };
      return true;
    }
    if (!under) return false;
    // A finger moves only the selected model, so that other models do not move by mistake.
    const canMove = !readOnly && (!spot.isTouch || under === selected);
    if (!canMove) return false;
    this.pressed = { model: under, mode: "move", spot };
    return true;
  }

  /** @param {Spot} spot */
  drag(spot) {
    const { session, pressed } = this;
    if (!pressed) return;
    if (!this.dragged) {
      if (Math.hypot(spot.px - pressed.spot.px, spot.py - pressed.spot.py) < DRAG_DISTANCE) return;
      const pose = session.world?.modelPose(pressed.model);
      if (!pose) return;
      session.select(pressed.model.name);
      this.dragged = new ModelDrag(session, pressed.model, pressed.mode, pose, pressed.spot);
    }
    this.dragged.to(spot);
    const [x, y, theta] = this.dragged.pose.map((part) => fixed(part));
    this.hint = `x ${x} m, y ${y} m, θ ${theta} rad`;
    this.stage.invalidate();
  }

  /**
   * @param {Spot} spot
   * @param {boolean} moved
   */
  up(spot, moved) {
    const drag = this.dragged;
    this.pressed = this.dragged = null;
    this.hint = "";
    if (drag) {
      this.settling = drag;
      drag.drop().finally(() => {
        // Another model may have been dropped since.
        if (this.settling === drag) this.settling = null;
        this.stage.invalidate();
      });
    } else if (!moved) this.session.select(this.modelUnder(spot)?.name ?? null);
  }

  /** @param {Spot} spot */
  hover(spot) {
    const under = this.modelUnder(spot);
    if (this.session.selected && under !== this.session.selected && this.isOnRing(spot)) return "grab";
    return under && !this.session.readOnly ? "move" : "default";
  }

  cancel() {
    const drag = this.dragged;
    const hadSelection = this.session.selectedName !== null;
    this.pressed = this.dragged = null;
    this.hint = "";
    if (drag) drag.cancel();
    else this.session.select(null);
    this.stage.invalidate();
    return drag !== null || hadSelection;
  }

  leave() {
    if (this.dragged) this.cancel();
  }

  /** @type {import("../renderer/renderer.js").Overlay} */
  draw(batch, _labels, { camera }, palette) {
    const { world, selected, readOnly } = this.session;
    if (!world || !selected) return;
    const pose = world.modelPose(selected);
    if (!pose) return;
    const accent = packColor(palette.accent);
    const shown = this.dragged ?? this.settling;
    if (shown) addModelAt(batch, world, shown.model, shown.pose, accent, 2.5);
    const [x, y, heading] = shown?.pose ?? pose;
    addModelAt(batch, world, selected, pose, packColor(palette.accent, shown ? 0.4 : 1), 2);
    const radius = this.ringRadius(selected);
    addArrow(batch, [x, y, heading], radius, accent);
    if (readOnly) return;
    batch.addCircle(x, y, radius, packColor(palette.accent, 0.45), 1.5);
    const knob = [x + radius * Math.cos(heading), y + radius * Math.sin(heading)];
    batch.add(knob[0], knob[1], knob[0] + 1e-6 / camera.zoom, knob[1], accent, 11);
  }
}
