/**
 * @typedef {import("./geometry.js").Point} Point
 * @typedef {import("./geometry.js").Bounds} Bounds
 */

/** Limits of the scale [CSS pixels per metre]. */
const MIN_ZOOM = 0.05;
const MAX_ZOOM = 20_000;
/** Share of the view that a fitted area fills. */
const FIT_SHARE = 0.92;

/** The part of the plane that a viewport displays. Pixels are CSS pixels, relative to the viewport. */
export class Camera {
  constructor() {
    /** Position of the centre of the viewport [m]. */
    this.x = 0;
    this.y = 0;
    /** Scale [pixels per metre]. */
    this.zoom = 20;
    /** Rotation of the view, counter-clockwise [rad]. */
    this.angle = 0;
    /** Size of the viewport [pixels]. */
    this.width = 1;
    this.height = 1;
  }

  /**
   * Returns a camera with the same centre, scale and rotation.
   *
   * @param {number} width  of the viewport [pixels]
   * @param {number} height  [pixels]
   */
  copy(width, height) {
    return Object.assign(new Camera(), this, { width, height });
  }

  /**
   * @param {number} x  [m]
   * @param {number} y  [m]
   * @returns {Point} [pixels]
   */
  toScreen(x, y) {
    const c = Math.cos(this.angle) * this.zoom;
    const s = Math.sin(this.angle) * this.zoom;
    const dx = x - this.x;
    const dy = y - this.y;
    return [this.width / 2 + c * dx - s * dy, this.height / 2 - (s * dx + c * dy)];
  }

  /**
   * @param {number} px  [pixels]
   * @param {number} py  [pixels]
   * @returns {Point} [m]
   */
  toWorld(px, py) {
    const c = Math.cos(this.angle) / this.zoom;
    const s = Math.sin(this.angle) / this.zoom;
    const dx = px - this.width / 2;
    const dy = this.height / 2 - py;
    return [this.x + c * dx + s * dy, this.y - s * dx + c * dy];
  }

  /**
   * Moves the world by a distance on the screen.
   *
   * @param {number} dx  [pixels]
   * @param {number} dy  [pixels]
   */
  pan(dx, dy) {
    const [x, y] = this.toWorld(this.width / 2 - dx, this.height / 2 - dy);
    this.x = x;
    this.y = y;
  }

  /**
   * Scales and rotates the view; the point under (px, py) stays in place.
   *
   * @param {number} factor
   * @param {number} px  [pixels]
   * @param {number} py  [pixels]
   * @param {number} [turn]  [rad]
   */
  zoomAt(factor, px, py, turn = 0) {
    const before = this.toWorld(px, py);
    this.zoom = Math.min(MAX_ZOOM, Math.max(MIN_ZOOM, this.zoom * factor));
    this.angle += turn;
    const after = this.toWorld(px, py);
    this.x += before[0] - after[0];
    this.y += before[1] - after[1];
  }

  /**
   * Shows an area.
   *
   * @param {Bounds} bounds  [m]
   */
  fit([x0, y0, x1, y1]) {
    const c = Math.abs(Math.cos(this.angle));
    const s = Math.abs(Math.sin(this.angle));
    const width = Math.max(c * (x1 - x0) + s * (y1 - y0), 1e-3);
    const height = Math.max(s * (x1 - x0) + c * (y1 - y0), 1e-3);
    this.x = (x0 + x1) / 2;
    this.y = (y0 + y1) / 2;
    const zoom = FIT_SHARE * Math.min(this.width / width, this.height / height);
    this.zoom = Math.min(MAX_ZOOM, Math.max(MIN_ZOOM, Math.min(zoom, 400)));
  }
}
