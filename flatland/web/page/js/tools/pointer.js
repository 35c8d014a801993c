/**
 * @typedef {import("./tool_box.js").Spot} Spot
 * @typedef {import("./tool_box.js").ToolBox} ToolBox
 */

/** Movement above which a press is not a click [CSS pixels]. */
const CLICK_DISTANCE = 4;
const TOUCH_CLICK_DISTANCE = 9;
const WHEEL_SPEED = 0.0016;
/** Rotation of the view for each pixel of a drag with the right button [rad]. */
const TURN_SPEED = 0.006;

/** Translates mouse, pen and touch on the canvas into actions of tools and of the view. */
export class PointerInput {
  /**
   * @param {import("../stage.js").Stage} stage
   * @param {import("../session.js").Session} session
   * @param {ToolBox} tools
   * @param {(spot: Spot, event: MouseEvent) => void} openMenu
   */
  constructor(stage, session, tools, openMenu) {
    this.stage = stage;
    this.session = session;
    this.tools = tools;
    this.openMenu = openMenu;
    /** Pressed pointers by id.
     * @type {Map<number, {px: number, py: number}>} */
    this.pointers = new Map();
    /** Effect of the movement of a single pointer.
     * @type {"tool" | "pan" | "turn" | null} */
    this.action = null;
    this.moved = false;
    /** @type {Spot | null} */
    this.start = null;
    /** Position of the mouse in the view, null outside.
     * @type {{px: number, py: number} | null} */
    this.hovered = null;
    const { canvas } = stage;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", (event) => this.up(event));
    canvas.addEventListener("pointercancel", (event) => this.abort(event));
    canvas.addEventListener("pointerleave", () => {
      this.hovered = null;
    });
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    canvas.addEventListener("contextmenu", (event) => this.menu(event));
    canvas.addEventListener("dblclick", (event) => this.doubleClick(event));
  }

  /**
   * @param {MouseEvent} event
   * @returns {Spot}
   */
  spot(event) {
    const bounds = this.stage.canvas.getBoundingClientRect();
    const px = event.clientX - bounds.left;
    const py = event.clientY - bounds.top;
    const [x, y] = this.stage.camera.toWorld(px, py);
    const isTouch = event instanceof PointerEvent && event.pointerType === "touch";
    return { px, py, x, y, isTouch };
  }

  /** @param {PointerEvent} event */
  down(event) {
    if (!this.session.world) return;
    const spot = this.spot(event);
    this.stage.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, spot);
    if (this.pointers.size === 2) {
      // The second finger turns the gesture into a pinch.
      if (this.action === "tool") this.tools.active.cancel();
      this.action = null;
      return;
    }
    if (this.pointers.size > 2) return;
    this.start = spot;
    this.moved = false;
    if (event.button === 2) this.action = "turn";
    else if (event.button === 1 || event.shiftKey) this.action = "pan";
    else this.action = this.tools.active.down(spot) ? "tool" : "pan";
    this.tools.updateHint();
  }

  /** @param {PointerEvent} event */
  move(event) {
    if (!this.session.world) return;
    const spot = this.spot(event);
    this.hovered = spot;
    const before = this.pointers.get(event.pointerId);
    if (!before) {
      if (event.pointerType !== "touch") this.setCursor(this.tools.active.hover(spot));
      this.tools.updateHint();
      return;
    }
    if (this.pointers.size === 2) {
      this.pinch(event.pointerId, spot);
      return;
    }
    if (!this.action || !this.start) return;
    const limit = spot.isTouch ? TOUCH_CLICK_DISTANCE : CLICK_DISTANCE;
    const far = Math.hypot(spot.px - this.start.px, spot.py - this.start.py) > limit;
    if (far && !this.moved) {
      this.moved = true;
      if (this.action === "pan") this.stage.follow(null);
    }
    if (this.action === "tool") this.tools.active.drag(spot);
    else if (this.moved) this.moveView(this.action, spot.px - before.px, spot.py - before.py);
    this.pointers.set(event.pointerId, spot);
    this.tools.updateHint();
  }

  /**
   * @param {"pan" | "turn"} action
   * @param {number} dx
   * @param {number} dy
   */
  moveView(action, dx, dy) {
    this.setCursor("grabbing");
    this.stage.moveView((camera) => {
      if (action === "pan") camera.pan(dx, dy);
      else camera.zoomAt(1, camera.width / 2, camera.height / 2, -dx * TURN_SPEED);
    });
  }

  /**
   * Zooms, moves and turns the view by two fingers.
   *
   * @param {number} id  id of the finger that moves
   * @param {Spot} spot
   */
  pinch(id, spot) {
    const other = [...this.pointers].find(([key]) => key !== id)?.[1];
    const before = this.pointers.get(id);
    if (!other || !before) return;
    this.pointers.set(id, spot);
    const [ax, ay] = [before.px - other.px, before.py - other.py];
    const [bx, by] = [spot.px - other.px, spot.py - other.py];
    const lengths = [Math.hypot(ax, ay), Math.hypot(bx, by)];
    if (lengths[0] < 1 || lengths[1] < 1) return;
    // Screen coordinates have y down, so that the sign of the angle is reversed.
    const turn = Math.atan2(ay, ax) - Math.atan2(by, bx);
    this.stage.moveView((camera) => {
      camera.zoomAt(lengths[1] / lengths[0], other.px, other.py, Math.atan2(Math.sin(turn), Math.cos(turn)));
    });
  }

  /** @param {PointerEvent} event */
  up(event) {
    if (!this.pointers.delete(event.pointerId)) return;
    const action = this.action;
    if (this.pointers.size > 0) return;
    this.action = null;
    const spot = this.spot(event);
    if (action === "tool") this.tools.active.up(spot, this.moved);
    else if (action === "pan" && !this.moved && event.button === 0) this.tools.active.up(spot, false);
    this.setCursor("default");
    this.tools.updateHint();
  }

  /** @param {PointerEvent} event */
  abort(event) {
    this.pointers.delete(event.pointerId);
    if (this.action === "tool") this.tools.active.cancel();
    this.action = null;
    this.tools.updateHint();
  }

  /** @param {WheelEvent} event */
  wheel(event) {
    event.preventDefault();
    if (!this.session.world) return;
    const { px, py } = this.spot(event);
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
    const speed = event.ctrlKey ? 6 * WHEEL_SPEED : WHEEL_SPEED;
    const delta = Math.max(-240, Math.min(240, event.deltaY * lines));
    const { camera } = this.stage;
    // While the view follows a model, the model stays in the centre.
    const isFollowing = this.stage.followed !== null;
    this.stage.moveView((view) => {
      view.zoomAt(
        Math.exp(-delta * speed),
        isFollowing ? camera.width / 2 : px,
        isFollowing ? camera.height / 2 : py,
      );
    });
  }

  /** @param {MouseEvent} event */
  menu(event) {
    event.preventDefault();
    if (this.session.world && !this.moved) this.openMenu(this.spot(event), event);
  }

  /** @param {MouseEvent} event */
  doubleClick(event) {
    if (this.tools.name !== "select") return;
    const { world, selected } = this.session;
    const pose = selected && world?.modelPose(selected);
    const { x, y } = this.spot(event);
    const near = pose && Math.hypot(x - pose[0], y - pose[1]) * this.stage.camera.zoom < 120;
    if (near) this.stage.centerOn(pose[0], pose[1]);
  }

  /** @param {string} name */
  setCursor(name) {
    this.stage.canvas.dataset.cursor = name;
  }
}
