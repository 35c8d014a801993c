import { Camera } from "../camera.js";
import { createNearestTexture, createProgram } from "./gl.js";
import { copyFragment, copyVertex } from "./shaders.js";

/** Width of the part of the picture around the view, within which the view moves [CSS pixels]. */
const MARGIN = 128;
/** Displacement of the view up to which the picture is not drawn again [device pixels]. */
const EXACT = 0.02;

/**
 * @typedef {import("./view.js").Viewport} Viewport
 */

/**
 * Keeps a picture of everything that does not move in the world, somewhat larger than the view.
 * While the view is not scaled or turned, a frame copies the picture, which takes the same time for
 * any number of edges.
 */
export class Backdrop {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.gl = gl;
    this.framebuffer = gl.createFramebuffer();
    this.texture = createNearestTexture(gl);
    this.program = createProgram(gl, copyVertex, copyFragment, []);
    this.width = 0;
    this.height = 0;
    /** View of the picture, and the key of everything else that the picture depends on. */
    this.camera = new Camera();
    this.state = "";
    /** View and key of the last frame. */
    this.seenState = "";
    this.seenX = NaN;
    this.seenY = NaN;
  }

  /** Discards the picture, so that the next frame draws a new one. */
  forget() {
    this.state = this.seenState = "";
  }

  /**
   * Draws everything that does not move.
   *
   * @param {Viewport} viewport
   * @param {string} key  changes with everything that the picture depends on, except the view
   * @param {(viewport: Viewport) => void} paint  draws the picture
   * @returns {Viewport} the viewport for the rest of the frame, which is displaced by less than a
   *   pixel while the view moves
   */
  draw(viewport, key, paint) {
    const { camera, width, height, ratio } = viewport;
    const state = [key, camera.zoom, camera.angle, width, height, ratio].join();
    const isMoving = camera.x !== this.seenX || camera.y !== this.seenY;
    this.seenX = camera.x;
    this.seenY = camera.y;
    if (state !== this.seenState) {
      // A picture whose key changes with each frame would not be used again.
      this.seenState = state;
      paint(viewport);
      return viewport;
    }
    const margin = Math.round(MARGIN * ratio);
    let [dx, dy] = this.state === state ? this.displacement(viewport) : [NaN, NaN];
    const error = Math.max(Math.abs(dx - Math.round(dx)), Math.abs(dy - Math.round(dy)));
    const isUsable = Math.abs(dx) <= margin && Math.abs(dy) <= margin && (isMoving || error < EXACT);
    if (!isUsable) {
      this.paint(viewport, margin, paint);
      this.state = state;
      dx = dy = 0;
    }
    dx = Math.round(dx);
    dy = Math.round(dy);
    this.copy(viewport, margin + dx, margin + dy);
    const shown = this.camera.copy(width / ratio, height / ratio);
    shown.pan(-dx / ratio, dy / ratio);
    return { ...viewport, camera: shown };
  }

  /**
   * Returns the distance of the view from the centre of the picture, to the right and up.
   *
   * @param {Viewport} viewport
   * @returns {number[]} [device pixels]
   */
  displacement({ camera, ratio }) {
    const [px, py] = this.camera.toScreen(camera.x, camera.y);
    return [(px - this.camera.width / 2) * ratio, (this.camera.height / 2 - py) * ratio];
  }

  /**
   * Draws the picture around a view.
   *
   * @param {Viewport} viewport
   * @param {number} margin  [device pixels]
   * @param {(viewport: Viewport) => void} paint
   */
  paint({ width, height, ratio, camera }, margin, paint) {
    const { gl } = this;
    const [fullWidth, fullHeight] = [width + 2 * margin, height + 2 * margin];
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    if (fullWidth !== this.width || fullHeight !== this.height) {
      [this.width, this.height] = [fullWidth, fullHeight];
      gl.bindTexture(gl.TEXTURE_2D, this.texture);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, fullWidth, fullHeight, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.texture, 0);
    }
    this.camera = camera.copy(fullWidth / ratio, fullHeight / ratio);
    gl.viewport(0, 0, fullWidth, fullHeight);
    paint({ left: 0, bottom: 0, width: fullWidth, height: fullHeight, ratio, camera: this.camera });
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  /**
   * Copies a part of the picture to a viewport.
   *
   * @param {Viewport} viewport
   * @param {number} x  of the lower left corner of the part [device pixels]
   * @param {number} y
   */
  copy({ left, bottom, width, height }, x, y) {
    const { gl, program } = this;
    gl.viewport(left, bottom, width, height);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.useProgram(program.handle);
    const part = [x / this.width, y / this.height, width / this.width, height / this.height];
    gl.uniform4fv(program.uniform("u_part"), part);
    gl.disable(gl.BLEND);
    gl.bindVertexArray(null);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.enable(gl.BLEND);
  }
}
