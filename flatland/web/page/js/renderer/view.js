/**
 * A viewport of the canvas and the camera of its view.
 *
 * @typedef {object} Viewport
 * @property {number} left  [device pixels]
 * @property {number} bottom  [device pixels]
 * @property {number} width  [device pixels]
 * @property {number} height  [device pixels]
 * @property {number} ratio  device pixels per CSS pixel
 * @property {import("../camera.js").Camera} camera
 */

/** Scale below which lines and points become thinner [CSS pixels per metre]. */
const FULL_WEIGHT_ZOOM = 14;
const LEAST_WEIGHT = 0.6;

/**
 * Returns the factor of the widths of lines and points, which keeps small views legible.
 *
 * @param {Viewport} viewport
 */
export function lineWeight({ camera }) {
  return Math.max(LEAST_WEIGHT, Math.min(1, camera.zoom / FULL_WEIGHT_ZOOM));
}

/**
 * Activates a program and sets the uniforms of the view.
 *
 * @param {WebGL2RenderingContext} gl
 * @param {import("./gl.js").Program} program
 * @param {Viewport} viewport
 */
export function useProgram(gl, program, viewport) {
  const { camera, ratio, width, height } = viewport;
  const scale = camera.zoom * ratio;
  const c = Math.cos(camera.angle) * scale;
  const s = Math.sin(camera.angle) * scale;
  gl.useProgram(program.handle);
  gl.uniform2f(program.uniform("u_center"), camera.x, camera.y);
  gl.uniform4f(program.uniform("u_matrix"), c, s, -s, c);
  gl.uniform2f(program.uniform("u_size"), width, height);
}
