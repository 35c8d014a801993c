import { addAttributes, createProgram } from "./gl.js";
import { coloredEdgesFragment, coloredEdgesVertex } from "./shaders.js";
import { useProgram } from "./view.js";

/** Words of an edge: four coordinates, colour, width, time. */
export const EDGE_WORDS = 7;
const STRIDE = 4 * EDGE_WORDS;
/** Words of the four vertices of an edge. */
const QUAD_WORDS = 4 * EDGE_WORDS;

/**
 * Returns the program that draws edges of which each has its own colour.
 *
 * @param {WebGL2RenderingContext} gl
 */
export function createColoredEdgeProgram(gl) {
  const names = ["a_segment", "a_color", "a_width", "a_time"];
  return createProgram(gl, coloredEdgesVertex, coloredEdgesFragment, names);
}

/**
 * Returns a vertex array of a buffer of coloured edges.
 *
 * @param {WebGL2RenderingContext} gl
 * @param {WebGLBuffer} buffer
 * @param {import("./quads.js").Quads} quads
 */
export function createColoredEdgeArray(gl, buffer, quads) {
  const array = gl.createVertexArray();
  addAttributes(gl, array, buffer, STRIDE, [
    { location: 0, size: 4 },
    { location: 1, size: 4, type: gl.UNSIGNED_BYTE, normalized: true, offset: 16 },
    { location: 2, size: 1, offset: 20 },
    { location: 3, size: 1, offset: 24 },
  ]);
  quads.attach(array);
  return array;
}

/**
 * Returns a colour as four bytes.
 *
 * @param {ArrayLike<number>} color
 * @param {number} [opacity]  factor
 */
export function packColor(color, opacity = 1) {
  const [r, g, b] = [color[0], color[1], color[2]].map((part) => Math.round(255 * part));
  const a = Math.round(255 * (color[3] ?? 1) * opacity);
  return ((a << 24) | (b << 16) | (g << 8) | r) >>> 0;
}

/** Coloured edges that change with each frame: grid, joints, frames, handles. */
export class EdgeBatch {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {import("./gl.js").Program} program
   * @param {import("./quads.js").Quads} quads
   */
  constructor(gl, program, quads) {
    this.gl = gl;
    this.program = program;
    this.quads = quads;
    this.floats = new Float32Array(QUAD_WORDS * 256);
    this.words = new Uint32Array(this.floats.buffer);
    this.count = 0;
    this.buffer = gl.createBuffer();
    this.array = createColoredEdgeArray(gl, this.buffer, quads);
  }

  /**
   * Adds an edge.
   *
   * @param {number} x1  [m]
   * @param {number} y1
   * @param {number} x2
   * @param {number} y2
   * @param {number} color  see `packColor`
   * @param {number} width  [CSS pixels]
   */
  add(x1, y1, x2, y2, color, width) {
    const at = QUAD_WORDS * this.count++;
    if (at + QUAD_WORDS > this.floats.length) {
      const floats = new Float32Array(2 * this.floats.length);
      floats.set(this.floats);
      this.floats = floats;
      this.words = new Uint32Array(floats.buffer);
    }
    this.floats[at] = x1;
    this.floats[at + 1] = y1;
    this.floats[at + 2] = x2;
    this.floats[at + 3] = y2;
    this.words[at + 4] = color;
    this.floats[at + 5] = width;
    this.floats[at + 6] = 0;
    for (let i = EDGE_WORDS; i < QUAD_WORDS; i += EDGE_WORDS) {
      this.words.copyWithin(at + i, at, at + EDGE_WORDS);
    }
  }

  /**
   * Adds a circle.
   *
   * @param {number} x  [m]
   * @param {number} y
   * @param {number} radius  [m]
   * @param {number} color
   * @param {number} width  [CSS pixels]
   */
  addCircle(x, y, radius, color, width) {
    const count = 48;
    let [px, py] = [x + radius, y];
    for (let i = 1; i <= count; i++) {
      const angle = (2 * Math.PI * i) / count;
      const qx = x + radius * Math.cos(angle);
      const qy = y + radius * Math.sin(angle);
      this.add(px, py, qx, qy, color, width);
      px = qx;
      py = qy;
    }
  }

  /**
   * Draws all edges and removes them.
   *
   * @param {import("./view.js").Viewport} viewport
   */
  flush(viewport) {
    if (this.count === 0) return;
    const { gl, program } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, this.words.subarray(0, QUAD_WORDS * this.count), gl.STREAM_DRAW);
    useProgram(gl, program, viewport);
    gl.uniform1f(program.uniform("u_lifetime"), 0);
    gl.uniform1f(program.uniform("u_ratio"), viewport.ratio);
    this.quads.draw(this.array, 0, this.count);
    this.count = 0;
  }
}
