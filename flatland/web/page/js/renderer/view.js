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
