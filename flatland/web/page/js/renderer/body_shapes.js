import { shapeEdges, shapePoints } from "../shapes.js";
import { addAttributes, createNearestTexture, createProgram, uploadFloatTexture } from "./gl.js";
import { bodyColor } from "./model_colors.js";
import { forCorners } from "./quads.js";
import {
  bodyDiscsFragment,
  bodyDiscsVertex,
  bodyEdgesVertex,
  bodyFillVertex,
  coloredEdgesFragment,
  colorFragment,
} from "./shaders.js";
import { lineWeight, useProgram } from "./view.js";

/** Width of outlines [CSS pixels]. */
const WIDTH = 1.8;
const FILL_OPACITY = 0.28;
/** Words of a record: coordinates, slot of the body, colour. */
const FILL_WORDS = 4;
const EDGE_WORDS = 6;
const DISC_WORDS = 5;

/** Programs that draw bodies; shared by all worlds. */
export class BodyPrograms {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    const names = ["a_slot", "a_color"];
    this.fill = createProgram(gl, bodyFillVertex, colorFragment, ["a_point", ...names]);
    this.edges = createProgram(gl, bodyEdgesVertex, coloredEdgesFragment, ["a_segment", ...names]);
    this.discs = createProgram(gl, bodyDiscsVertex, bodyDiscsFragment, ["a_disc", ...names]);
  }
}

/** Records of one kind of shapes in a buffer. */
class ShapeBuffer {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {number} words  of a record
   */
  constructor(gl, words) {
    this.gl = gl;
    this.words = words;
    this.count = 0;
    this.buffer = gl.createBuffer();
    this.array = gl.createVertexArray();
    addAttributes(gl, this.array, this.buffer, 4 * words, [
      { location: 0, size: words - 2 },
      { location: 1, size: 1, offset: 4 * (words - 2) },
      { location: 2, size: 4, type: gl.UNSIGNED_BYTE, normalized: true, offset: 4 * (words - 1) },
    ]);
  }

  /**
   * Replaces all records.
   *
   * @param {number[]} values  words of the records; the last one of each is a colour of four bytes
   * @param {boolean} isQuad  whether a record describes the four vertices of a quad, or one vertex
   */
  set(values, isQuad) {
    const { gl, words } = this;
    const floats = new Float32Array(values);
    const integers = new Uint32Array(floats.buffer);
    for (let i = words - 1; i < values.length; i += words) integers[i] = values[i];
    this.count = values.length / words;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, isQuad ? forCorners(floats, words) : floats, gl.STATIC_DRAW);
  }

  dispose() {
    this.gl.deleteBuffer(this.buffer);
    this.gl.deleteVertexArray(this.array);
  }
}

/**
 * The shapes of all bodies of a world in the frames of the bodies, and a texture of poses. A frame
 * uploads the poses only.
 */
export class BodyShapes {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {BodyPrograms} programs
   * @param {import("./quads.js").Quads} quads
   */
  constructor(gl, programs, quads) {
    this.gl = gl;
    this.programs = programs;
    this.quads = quads;
    this.texture = createNearestTexture(gl);
    this.fills = new ShapeBuffer(gl, FILL_WORDS);
    this.edges = new ShapeBuffer(gl, EDGE_WORDS);
    this.discs = new ShapeBuffer(gl, DISC_WORDS);
    quads.attach(this.edges.array);
    quads.attach(this.discs.array);
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
    /** @type {number[]} */
    const fills = [];
    /** @type {number[]} */
    const edges = [];
    /** @type {number[][]} */
    const discs = [];
    const packed = new Uint32Array(1);
    const bytes = new Uint8Array(packed.buffer);
    for (const body of world.bodies.values()) {
      bytes.set(bodyColor(body, palette).map((part) => Math.round(255 * part)));
      const color = packed[0];
      for (const shape of body.shapes) {
        if (shape.kind === "circle") {
          discs.push([...shape.center, shape.radius, body.slot, color]);
          continue;
        }
        for (const edge of shapeEdges(shape)) edges.push(...edge, body.slot, color);
        if (shape.kind === "edges") continue;
        const points = shapePoints(shape);
        for (let i = 2; i < points.length; i++) {
          for (const [x, y] of [points[0], points[i - 1], points[i]]) fills.push(x, y, body.slot, color);
        }
      }
    }
    // The inside of a large disc is below the outlines of smaller ones.
    discs.sort((a, b) => b[2] - a[2]);
    this.fills.set(fills, false);
    this.edges.set(edges, true);
    this.discs.set(discs.flat(), true);
  }

  /** @param {import("./view.js").Viewport} viewport */
  draw(viewport) {
    const { gl, programs, fills, edges, discs } = this;
    const width = WIDTH * lineWeight(viewport) * viewport.ratio;
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    if (fills.count > 0) {
      useProgram(gl, programs.fill, viewport);
      gl.uniform1f(programs.fill.uniform("u_opacity"), FILL_OPACITY);
      gl.bindVertexArray(fills.array);
      gl.drawArrays(gl.TRIANGLES, 0, fills.count);
    }
    if (discs.count > 0) {
      useProgram(gl, programs.discs, viewport);
      gl.uniform1f(programs.discs.uniform("u_opacity"), FILL_OPACITY);
      gl.uniform1f(programs.discs.uniform("u_width"), width);
      gl.uniform1f(programs.discs.uniform("u_scale"), viewport.camera.zoom * viewport.ratio);
      this.quads.draw(discs.array, 0, discs.count);
    }
    if (edges.count > 0) {
      useProgram(gl, programs.edges, viewport);
      gl.uniform1f(programs.edges.uniform("u_width"), width);
      this.quads.draw(edges.array, 0, edges.count);
    }
  }

  dispose() {
    this.gl.deleteTexture(this.texture);
    this.fills.dispose();
    this.edges.dispose();
    this.discs.dispose();
  }
}
