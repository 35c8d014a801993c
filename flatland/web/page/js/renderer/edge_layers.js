import { sortIntoCells, visibleRanges } from "./edge_cells.js";
import { addAttributes, createProgram } from "./gl.js";
import { readable } from "./palette.js";
import { forCorners } from "./quads.js";
import { edgesFragment, edgesVertex, flatFragment, flatVertex } from "./shaders.js";
import { lineWeight, useProgram } from "./view.js";

/** Width of the edges of a layer [CSS pixels]. */
const WIDTH = 1.6;
/** Number of edges above which a view from far away draws lines of one pixel. */
const MANY_EDGES = 20_000;

/**
 * @typedef {object} LayerBuffer
 * @property {WebGLBuffer} quadBuffer
 * @property {WebGLBuffer} lineBuffer
 * @property {WebGLVertexArrayObject} wide  a quad for each edge
 * @property {WebGLVertexArrayObject} thin  two vertices for each edge
 * @property {import("./edge_cells.js").Cell[]} cells
 * @property {number} meanLength  [m]
 */

/** Programs that draw the static edges of layers; shared by all worlds. */
export class EdgeProgram {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.wide = createProgram(gl, edgesVertex, edgesFragment, ["a_segment"]);
    this.thin = createProgram(gl, flatVertex, flatFragment, ["a_point"]);
  }
}

/** The static edges of the layers of a world, each in a buffer that is filled once. */
export class EdgeLayers {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {EdgeProgram} program
   * @param {import("./quads.js").Quads} quads
   */
  constructor(gl, program, quads) {
    this.gl = gl;
    this.program = program;
    this.quads = quads;
    /** @type {Map<Float32Array, LayerBuffer>} */
    this.buffers = new Map();
    this.version = -1;
  }

  /** @param {import("../world_state.js").WorldState} world */
  update(world) {
    if (this.version === world.layersVersion) return;
    this.version = world.layersVersion;
    this.keepOnly(new Set(world.layers.map((layer) => layer.edges)));
    for (const { edges } of world.layers) {
      if (edges && edges.length > 0 && !this.buffers.has(edges)) this.buffers.set(edges, this.upload(edges));
    }
  }

  /** @param {Set<Float32Array | null>} used */
  keepOnly(used) {
    for (const [edges, { quadBuffer, lineBuffer, wide, thin }] of this.buffers) {
      if (used.has(edges)) continue;
      this.gl.deleteBuffer(quadBuffer);
      this.gl.deleteBuffer(lineBuffer);
      this.gl.deleteVertexArray(wide);
      this.gl.deleteVertexArray(thin);
      this.buffers.delete(edges);
    }
  }

  dispose() {
    this.keepOnly(new Set());
  }

  /**
   * @param {Float32Array} edges
   * @returns {LayerBuffer}
   */
  upload(edges) {
    const { gl } = this;
    const sorted = sortIntoCells(edges);
    const quadBuffer = gl.createBuffer();
    const lineBuffer = gl.createBuffer();
    const wide = gl.createVertexArray();
    const thin = gl.createVertexArray();
    addAttributes(gl, wide, quadBuffer, 16, [{ location: 0, size: 4 }]);
    addAttributes(gl, thin, lineBuffer, 8, [{ location: 0, size: 2 }]);
    this.quads.attach(wide);
    gl.bindBuffer(gl.ARRAY_BUFFER, quadBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, forCorners(sorted.edges, 4), gl.STATIC_DRAW);
    gl.bindBuffer(gl.ARRAY_BUFFER, lineBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, sorted.edges, gl.STATIC_DRAW);
    let length = 0;
    for (let i = 0; i < edges.length; i += 4) {
      length += Math.hypot(edges[i + 2] - edges[i], edges[i + 3] - edges[i + 1]);
    }
    const meanLength = (4 * length) / edges.length;
    return { quadBuffer, lineBuffer, wide, thin, cells: sorted.cells, meanLength };
  }

  /**
   * @param {import("./view.js").Viewport} viewport
   * @param {import("../world_state.js").WorldState} world
   * @param {import("./palette.js").Palette} palette
   */
  draw(viewport, world, palette) {
    const { gl } = this;
    for (const layer of world.layers) {
      const entry = layer.visible && layer.edges ? this.buffers.get(layer.edges) : undefined;
      if (!entry) continue;
      const ranges = visibleRanges(entry.cells, viewport.camera);
      const count = ranges.reduce((sum, range) => sum + range.count, 0);
      // From far away, thousands of edges are shorter than their width: plain lines look the same.
      const isThin = count > MANY_EDGES && entry.meanLength * viewport.camera.zoom < 4;
      const program = isThin ? this.program.thin : this.program.wide;
      useProgram(gl, program, viewport);
      const [r, g, b, a] = readable(layer.color, palette);
      gl.uniform4f(program.uniform("u_color"), r * a, g * a, b * a, a);
      if (isThin) {
        gl.bindVertexArray(entry.thin);
        for (const range of ranges) gl.drawArrays(gl.LINES, 2 * range.start, 2 * range.count);
        continue;
      }
      gl.uniform1f(program.uniform("u_width"), WIDTH * lineWeight(viewport) * viewport.ratio);
      for (const { start, count: length } of ranges) this.quads.draw(entry.wide, start, length);
    }
  }
}
