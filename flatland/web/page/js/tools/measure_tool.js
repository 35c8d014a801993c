import { fixed } from "../format.js";
import { packColor } from "../renderer/edge_batch.js";

/** @typedef {import("./tool_box.js").Spot} Spot */

/**
 * Measures distances between points.
 *
 * @implements {Tool}
 * @typedef {import("./tool_box.js").Tool} Tool
 */
export class MeasureTool {
  /** @param {import("../stage.js").Stage} stage */
  constructor(stage) {
    this.stage = stage;
    /** @type {{x1: number, y1: number, x2: number, y2: number}[]} */
    this.lines = [];
    /** Whether the last line still follows the pointer. */
    this.isOpen = false;
  }

  get hint() {
    const line = this.lines.at(-1);
    if (!line) return "Select the first point";
    const dx = line.x2 - line.x1;
    const dy = line.y2 - line.y1;
    const angle = (Math.atan2(dy, dx) * 180) / Math.PI;
    return `${fixed(Math.hypot(dx, dy), 3)} m  (Δx ${fixed(dx, 3)} m, Δy ${fixed(dy, 3)} m, ${fixed(angle, 1)}°)`;
  }

  /** @param {Spot} spot */
  down({ x, y }) {
    if (this.isOpen) this.follow(x, y);
    else this.lines.push({ x1: x, y1: y, x2: x, y2: y });
    return true;
  }

  /** @param {Spot} spot */
  drag({ x, y }) {
    this.follow(x, y);
  }

  /**
   * @param {Spot} spot
   * @param {boolean} moved
   */
  up({ x, y }, moved) {
    this.follow(x, y);
    this.isOpen = !this.isOpen && !moved;
  }

  /** @param {Spot} spot */
  hover({ x, y }) {
    if (this.isOpen) this.follow(x, y);
    return "cross";
  }

  /**
   * @param {number} x  [m]
   * @param {number} y  [m]
   */
  follow(x, y) {
    const line = this.lines.at(-1);
    if (line) [line.x2, line.y2] = [x, y];
    this.stage.invalidate();
  }

  cancel() {
    const had = this.lines.length > 0;
    this.leave();
    return had;
  }

  leave() {
    this.lines = [];
    this.isOpen = false;
    this.stage.invalidate();
  }

  /** @type {import("../renderer/renderer.js").Overlay} */
  draw(batch, labels, { camera }, palette) {
    const color = packColor(palette.warning);
    for (const { x1, y1, x2, y2 } of this.lines) {
      batch.add(x1, y1, x2, y2, color, 2);
      for (const [x, y] of [
        [x1, y1],
        [x2, y2],
      ]) {
        batch.add(x, y, x + 1e-6 / camera.zoom, y, color, 7);
      }
      labels.add(`${Math.hypot(x2 - x1, y2 - y1).toFixed(3)} m`, (x1 + x2) / 2, (y1 + y2) / 2, -14);
    }
  }
}
