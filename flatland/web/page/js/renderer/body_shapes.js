import { shapeEdges, shapePoints } from "../shapes.js";
import { addAttributes, createFloatTexture, createProgram, uploadFloatTexture } from "./gl.js";
import { readable } from "./palette.js";
import { bodyEdgesVertex, bodyFillVertex, colorFragment, coloredEdgesFragment } from "./shaders.js";
import { lineWeight, useProgram } from "./view.js";

/** Width of outlines [CSS pixels]. */
const WIDTH = 1.8;
const FILL_OPACITY = 0.28;
/** Bytes of a vertex of a fill: two floats, a slot and a colour. */
const FILL_STRIDE = 16;
/** Bytes of an edge: four floats, a slot and a colour. */
const EDGE_STRIDE = 24;

/** Programs that draw bodies; shared by all worlds. */
export class BodyPrograms {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    const names = ["a_color", "a_slot"];
    this.fill = createProgram(gl, bodyFillVertex, colorFragment, ["a_point", ...names]);
    this.edges = createProgram(gl, bodyEdgesVertex, coloredEdgesFragment, ["a_segment", ...names]);
  }
}

/**
 * The shapes of all bodies of a world: one buffer of triangles and one of edges in the frames of
 * the bodies, and a texture of poses. A frame uploads the poses only.
 */
export class BodyShapes {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {BodyPrograms} programs
   */
  constructor(gl, programs) {
    this.gl = gl;
    this.programs = programs;
    this.texture = createFloatTexture(gl);
    this.fillBuffer = gl.createBuffer();
    this.edgeBuffer = gl.createBuffer();
    this.fillArray = gl.createVertexArray();
    this.edgeArray = gl.createVertexArray();
    addAttributes(gl, this.fillArray, this.fillBuffer, FILL_STRIDE, 0, [
      { location: 0, size: 2 },
      { location: 1, size: 4, type: gl.UNSIGNED_BYTE, normalized: true, offset: 12 },
      { location: 2, size: 1, offset: 8 },
    ]);
    addAttributes(gl, this.edgeArray, this.edgeBuffer, EDGE_STRIDE, 1, [
      { location: 0, size: 4 },
      { location: 1, size: 4, type: gl.UNSIGNED_BYTE, normalized: true, offset: 20 },
      { location: 2, size: 1, offset: 16 },
    ]);
    this.fillCount = 0;
    this.edgeCount = 0;
    this.shapesVersion = -1;
    this.posesVersion = -1;
    /** @type {import("./palette.js").Palette | null} */
    this.palette = null;
  }

  /**
   * @param {import("../world_state.js").WorldState} world
   * @param {import("./palette.js").Palette} palette
   */
  update(world, palette) {
    if (this.shapesVersion !== world.shapesVersion || this.palette !== palette) {
      this.shapesVersion = world.shapesVersion;
      this.palette = palette;
      this.rebuild(world, palette);
    }
    if (this.posesVersion !== world.posesVersion) {
      this.posesVersion = world.posesVersion;
      uploadFloatTexture(this.gl, this.texture, world.poses);
    }
  }

  /**
   * @param {import("../world_state.js").WorldState} world
   * @param {import("./palette.js").Palette} palette
   */
  rebuild(world, palette) {
    const { gl } = this;
    /** @type {number[]} */
    const fills = [];
    /** @type {number[]} */
    const edges = [];
    const packed = new Uint32Array(1);
    const bytes = new Uint8Array(packed.buffer);
    for (const body of world.bodies.values()) {
      bytes.set(readable(body.color, palette).map((part) => Math.round(255 * part)));
      const color = packed[0];
      for (const shape of body.shapes) {
        for (const edge of shapeEdges(shape)) edges.push(...edge, body.slot, color);
        if (shape.kind === "edges") continue;
        const points = shapePoints(shape);
        for (let i = 2; i < points.length; i++) {
          for (const [x, y] of [points[0], points[i - 1], points[i]]) fills.push(x, y, body.slot, color);
        }
      }
    }
    this.fillCount = fills.length / 4;
    this.edgeCount = edges.length / 6;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.fillBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, packWithColor(fills, 4), gl.STATIC_DRAW);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.edgeBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, packWithColor(edges, 6), gl.STATIC_DRAW);
  }

  /** @param {import("./view.js").Viewport} viewport */
  draw(viewport) {
    const { gl, programs } = this;
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    if (this.fillCount > 0) {
      useProgram(gl, programs.fill, viewport);
      gl.uniform1f(programs.fill.uniform("u_opacity"), FILL_OPACITY);
      gl.bindVertexArray(this.fillArray);
      gl.drawArrays(gl.TRIANGLES, 0, this.fillCount);
    }
    if (this.edgeCount > 0) {
      useProgram(gl, programs.edges, viewport);
      gl.uniform1f(programs.edges.uniform("u_width"), WIDTH * lineWeight(viewport) * viewport.ratio);
      gl.bindVertexArray(this.edgeArray);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, this.edgeCount);
    }
  }

  dispose() {
    const { gl } = this;
    gl.deleteTexture(this.texture);
    gl.deleteBuffer(this.fillBuffer);
    gl.deleteBuffer(this.edgeBuffer);
    gl.deleteVertexArray(this.fillArray);
    gl.deleteVertexArray(this.edgeArray);
  }
}

/**
 * Returns records of floats whose last word is a colour of four bytes.
 *
 * @param {number[]} values
 * @param {number} size  words of a record
 */
function packWithColor(values, size) {
  const floats = new Float32Array(values);
  const words = new Uint32Array(floats.buffer);
  for (let i = size - 1; i < values.length; i += size) words[i] = values[i];
  return floats;
}
