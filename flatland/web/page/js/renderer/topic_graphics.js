import { createColoredEdgeArray, EDGE_WORDS, packColor } from "./edge_batch.js";
import { addAttributes, createNearestTexture, createProgram } from "./gl.js";
import { forCorners } from "./quads.js";
import { cellsFragment, cellsVertex, coloredTrianglesVertex, colorFragment } from "./shaders.js";
import { useProgram } from "./view.js";

/** Width of lines without a width [CSS pixels]. */
const THIN = 2;
/** Words of a corner of a triangle: two coordinates, colour. */
const CORNER_WORDS = 3;

/**
 * @typedef {import("../foreign_topics.js").ForeignTopics} ForeignTopics
 * @typedef {import("../protocol.js").MarksData} MarksData
 * @typedef {import("./palette.js").Palette} Palette
 * @typedef {import("./view.js").Viewport} Viewport
 *
 * @typedef {object} MarkBuffers
 * @property {MarksData} data
 * @property {Palette} palette
 * @property {WebGLBuffer} lines
 * @property {WebGLVertexArrayObject} lineArray
 * @property {WebGLBuffer} triangles
 * @property {WebGLVertexArrayObject} triangleArray
 */

/** Draws topics of other programs. A frame uploads only the drawings that have changed. */
export class TopicGraphics {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {import("./gl.js").Program} edges  program of coloured edges
   * @param {import("./quads.js").Quads} quads
   */
  constructor(gl, edges, quads) {
    this.gl = gl;
    this.edges = edges;
    this.quads = quads;
    this.triangles = createProgram(gl, coloredTrianglesVertex, colorFragment, ["a_point", "a_color"]);
    this.cells = createProgram(gl, cellsVertex, cellsFragment, []);
    /** @type {Map<number, MarkBuffers>} */
    this.marks = new Map();
    /** @type {Map<number, {cells: Uint8Array, texture: WebGLTexture}>} */
    this.grids = new Map();
  }

  /**
   * Uploads the drawings that have changed, and releases those that do not exist any more.
   *
   * @param {ForeignTopics} topics
   * @param {Palette} palette
   */
  update(topics, palette) {
    const { gl } = this;
    for (const [id, buffers] of this.marks) {
      if (topics.marks.has(id)) continue;
      gl.deleteBuffer(buffers.lines);
      gl.deleteBuffer(buffers.triangles);
      gl.deleteVertexArray(buffers.lineArray);
      gl.deleteVertexArray(buffers.triangleArray);
      this.marks.delete(id);
    }
    for (const [id, { texture }] of this.grids) {
      if (topics.grids.has(id)) continue;
      gl.deleteTexture(texture);
      this.grids.delete(id);
    }
    for (const [id, data] of topics.marks) this.updateMarks(id, data, palette);
    for (const [id, { data, cells }] of topics.grids) this.updateGrid(id, data, cells);
  }

  /**
   * @param {number} id
   * @param {MarksData} data
   * @param {Palette} palette
   */
  updateMarks(id, data, palette) {
    const { gl } = this;
    let buffers = this.marks.get(id);
    if (buffers?.data === data && buffers.palette === palette) return;
    if (!buffers) {
      const lines = gl.createBuffer();
      const triangles = gl.createBuffer();
      const triangleArray = gl.createVertexArray();
      addAttributes(gl, triangleArray, triangles, 4 * CORNER_WORDS, [
        { location: 0, size: 2 },
        { location: 1, size: 4, type: gl.UNSIGNED_BYTE, normalized: true, offset: 8 },
      ]);
      const lineArray = createColoredEdgeArray(gl, lines, this.quads);
      buffers = { data, palette, lines, lineArray, triangles, triangleArray };
      this.marks.set(id, buffers);
    }
    Object.assign(buffers, { data, palette });
    const own = packColor(palette.series[id % palette.series.length]);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers.lines);
    gl.bufferData(gl.ARRAY_BUFFER, packLines(data, own), gl.DYNAMIC_DRAW);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers.triangles);
    gl.bufferData(gl.ARRAY_BUFFER, packTriangles(data, own), gl.DYNAMIC_DRAW);
  }

  /**
   * @param {number} id
   * @param {import("../protocol.js").GridData} data
   * @param {Uint8Array} cells
   */
  updateGrid(id, { width, height }, cells) {
    const { gl } = this;
    const before = this.grids.get(id);
    if (before?.cells === cells) return;
    const texture = before?.texture ?? createNearestTexture(gl);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) {
      gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    }
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R8, width, height, 0, gl.RED, gl.UNSIGNED_BYTE, cells);
    this.grids.set(id, { cells, texture });
  }

  /**
   * Draws the grids, which are below everything else.
   *
   * @param {Viewport} viewport
   * @param {ForeignTopics} topics
   */
  drawGrids(viewport, topics) {
    if (topics.grids.size === 0) return;
    const { gl, cells: program } = this;
    useProgram(gl, program, viewport);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindVertexArray(null);
    for (const [id, { data }] of topics.grids) {
      const { pose, resolution, width, height } = data;
      gl.bindTexture(gl.TEXTURE_2D, this.grids.get(id)?.texture ?? null);
      gl.uniform3fv(program.uniform("u_pose"), pose);
      gl.uniform2f(program.uniform("u_extent"), width * resolution, height * resolution);
      const isCostmap = topics.isCostmap(topics.entry(id)?.topic ?? "");
      gl.uniform1i(program.uniform("u_isCostmap"), Number(isCostmap));
      gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    }
  }

  /**
   * Draws areas, lines and texts.
   *
   * @param {Viewport} viewport
   * @param {import("./text_labels.js").TextLabels} labels
   */
  drawMarks(viewport, labels) {
    const { gl, edges } = this;
    for (const { data, triangleArray, lineArray } of this.marks.values()) {
      const corners = 3 * data.triangleColors.length;
      if (corners > 0) {
        useProgram(gl, this.triangles, viewport);
        gl.bindVertexArray(triangleArray);
        gl.drawArrays(gl.TRIANGLES, 0, corners);
      }
      if (data.lineColors.length > 0) {
        useProgram(gl, edges, viewport);
        gl.uniform1f(edges.uniform("u_lifetime"), 0);
        gl.uniform1f(edges.uniform("u_ratio"), viewport.ratio);
        this.quads.draw(lineArray, 0, data.lineColors.length);
      }
      for (const [x, y, text] of data.texts) labels.add(text, x, y, 0);
    }
  }
}

/**
 * Returns a colour of a mark, or the colour of its topic if it has none.
 *
 * @param {number} color
 * @param {number} own
 */
function markColor(color, own) {
  return color >>> 24 === 0 ? own : color;
}

/**
 * Returns the vertices of lines. Widths in metres are negative.
 *
 * @param {MarksData} data
 * @param {number} own  colour of the topic
 */
export function packLines({ lines, lineColors }, own) {
  const floats = new Float32Array(EDGE_WORDS * lineColors.length);
  const words = new Uint32Array(floats.buffer);
  for (let i = 0; i < lineColors.length; i++) {
    const at = EDGE_WORDS * i;
    for (let k = 0; k < 4; k++) floats[at + k] = lines[5 * i + k];
    const width = lines[5 * i + 4];
    words[at + 4] = markColor(lineColors[i], own);
    floats[at + 5] = width > 0 ? -width : THIN;
  }
  return forCorners(floats, EDGE_WORDS);
}

/**
 * Returns the corners of triangles.
 *
 * @param {MarksData} data
 * @param {number} own  colour of the topic
 */
export function packTriangles({ triangles, triangleColors }, own) {
  const floats = new Float32Array(3 * CORNER_WORDS * triangleColors.length);
  const words = new Uint32Array(floats.buffer);
  for (let i = 0; i < 3 * triangleColors.length; i++) {
    floats[CORNER_WORDS * i] = triangles[2 * i];
    floats[CORNER_WORDS * i + 1] = triangles[2 * i + 1];
    words[CORNER_WORDS * i + 2] = markColor(triangleColors[Math.floor(i / 3)], own);
  }
  return words;
}
