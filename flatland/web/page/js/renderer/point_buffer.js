import { addAttributes } from "./gl.js";
import { modelColor } from "./model_colors.js";

/**
 * @typedef {object} Span  consecutive points of the same colour
 * @property {import("../world_state.js").Model} model  which has this colour
 * @property {number} start  index of the first point
 * @property {number} count
 */

/** Points in the world frame with few different colours; replaced all at once. */
export class PointBuffer {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.gl = gl;
    this.buffer = gl.createBuffer();
    this.array = gl.createVertexArray();
    addAttributes(gl, this.array, this.buffer, 8, [{ location: 0, size: 2 }]);
    /** Coordinates of the points [m]. */
    this.values = new Float32Array(0);
    this.count = 0;
    /** @type {Span[]} */
    this.spans = [];
  }

  /**
   * Removes all points.
   *
   * @param {number} capacity  largest number of points until the next call
   */
  begin(capacity) {
    if (this.values.length < 2 * capacity) this.values = new Float32Array(4 * capacity);
    this.count = 0;
    this.spans = [];
  }

  /**
   * Adds a point.
   *
   * @param {number} x  [m]
   * @param {number} y  [m]
   */
  add(x, y) {
    this.values[2 * this.count] = x;
    this.values[2 * this.count + 1] = y;
    this.count++;
  }

  /**
   * Ends a span, which contains all points since the end of the previous span.
   *
   * @param {import("../world_state.js").Model} model  which has the colour of the points
   */
  endSpan(model) {
    const last = this.spans.at(-1);
    const start = last ? last.start + last.count : 0;
    if (this.count > start) this.spans.push({ model, start, count: this.count - start });
  }

  upload() {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, this.values.subarray(0, 2 * this.count), gl.STREAM_DRAW);
  }

  /**
   * Draws each span with the active program.
   *
   * @param {number} mode
   * @param {import("./gl.js").Program} program
   * @param {import("./palette.js").Palette} palette
   * @param {number} opacity
   */
  draw(mode, program, palette, opacity) {
    const { gl } = this;
    gl.bindVertexArray(this.array);
    for (const { model, start, count } of this.spans) {
      const [r, g, b] = modelColor(model, palette);
      gl.uniform4f(program.uniform("u_color"), r * opacity, g * opacity, b * opacity, opacity);
      gl.drawArrays(mode, start, count);
    }
  }

  dispose() {
    this.gl.deleteBuffer(this.buffer);
    this.gl.deleteVertexArray(this.array);
  }
}
