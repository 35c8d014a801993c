import {
  FLOAT_TEXTURE_WIDTH,
  addAttributes,
  createFloatTexture,
  createProgram,
  uploadFloatTexture,
} from "./gl.js";
import { colorFragment, scanAreaVertex, scanPointsFragment, scanPointsVertex } from "./shaders.js";
import { lineWeight, useProgram } from "./view.js";

/** Diameter of a point [CSS pixels]. */
const POINT_SIZE = 3.2;
const AREA_OPACITY = 0.09;
/** Number of lasers up to which the areas of all scans are drawn, not only of the selected model. */
const MAX_AREAS = 8;

/**
 * @typedef {import("../world_state.js").LaserState} LaserState
 *
 * @typedef {object} Span  beams of a laser in the buffers
 * @property {LaserState} laser
 * @property {number} start
 * @property {number} count
 */

/** Programs that draw scans; shared by all worlds. */
export class ScanPrograms {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.points = createProgram(gl, scanPointsVertex, scanPointsFragment, ["a_beam", "a_range"]);
    this.areas = createProgram(gl, scanAreaVertex, colorFragment, ["a_beam", "a_range", "a_nextRange"]);
  }
}

/**
 * The latest scans of a world. All ranges are in one buffer; the poses and angles of the lasers are
 * in a texture, and the graphics processor computes the end points.
 */
export class ScanClouds {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {ScanPrograms} programs
   */
  constructor(gl, programs) {
    this.gl = gl;
    this.programs = programs;
    this.texture = createFloatTexture(gl);
    this.beamBuffer = gl.createBuffer();
    this.rangeBuffer = gl.createBuffer();
    this.pointArray = gl.createVertexArray();
    this.areaArray = gl.createVertexArray();
    addAttributes(gl, this.pointArray, this.beamBuffer, 8, 0, [{ location: 0, size: 2 }]);
    addAttributes(gl, this.pointArray, this.rangeBuffer, 2, 0, [
      { location: 1, size: 1, type: gl.UNSIGNED_SHORT },
    ]);
    /** @type {Span[]} */
    this.spans = [];
    this.layout = "";
    this.ranges = new Uint16Array(1);
    this.lasers = new Float32Array(0);
    this.version = -1;
  }

  /** @param {import("../world_state.js").WorldState} world */
  update(world) {
    if (this.version === world.scansVersion) return;
    this.version = world.scansVersion;
    const { gl } = this;
    const present = [...world.lasers.values()].filter((laser) => laser.ranges !== null);
    const layout = present.map(({ info, ranges }) => `${info.id}:${ranges?.length}`).join();
    if (layout !== this.layout) this.arrange(present, layout);
    let index = 0;
    for (const span of this.spans) {
      span.laser = present[index];
      const { info, model, pose, ranges } = span.laser;
      if (ranges) this.ranges.set(ranges, span.start);
      this.lasers.set([...pose, info.range_max], 8 * index);
      this.lasers.set([info.angle_min, info.angle_increment, span.count, model.index % 8], 8 * index + 4);
      index++;
    }
    if (index === 0) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.rangeBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, this.ranges, gl.STREAM_DRAW);
    uploadFloatTexture(gl, this.texture, this.lasers);
  }

  /**
   * Assigns parts of the buffers to lasers.
   *
   * @param {LaserState[]} lasers
   * @param {string} layout
   */
  arrange(lasers, layout) {
    const { gl } = this;
    this.layout = layout;
    this.spans = [];
    let start = 0;
    for (const laser of lasers) {
      const count = laser.ranges?.length ?? 0;
      this.spans.push({ laser, start, count });
      start += count;
    }
    const beams = new Float32Array(2 * start);
    this.spans.forEach((span, index) => {
      for (let i = 0; i < span.count; i++) beams.set([index, i], 2 * (span.start + i));
    });
    // One more range, because each triangle also reads the range of the next beam.
    this.ranges = new Uint16Array(start + 1);
    const rows = Math.max(1, Math.ceil((2 * lasers.length) / FLOAT_TEXTURE_WIDTH));
    this.lasers = new Float32Array(4 * FLOAT_TEXTURE_WIDTH * rows);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.beamBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, beams, gl.STATIC_DRAW);
  }

  /**
   * @param {import("./view.js").Viewport} viewport
   * @param {import("./palette.js").Palette} palette
   * @param {import("../world_state.js").Model | null} selected
   */
  drawAreas(viewport, palette, selected) {
    const all = this.spans.length <= MAX_AREAS;
    const shown = this.spans.filter((span) => span.count > 1 && (all || span.laser.model === selected));
    if (shown.length === 0) return;
    const { gl } = this;
    const program = this.programs.areas;
    this.prepare(program, viewport, palette);
    gl.uniform1f(program.uniform("u_opacity"), AREA_OPACITY);
    for (const { start, count } of shown) {
      addAttributes(gl, this.areaArray, this.beamBuffer, 8, 1, [{ location: 0, size: 2, offset: 8 * start }]);
      addAttributes(gl, this.areaArray, this.rangeBuffer, 2, 1, [
        { location: 1, size: 1, type: gl.UNSIGNED_SHORT, offset: 2 * start },
        { location: 2, size: 1, type: gl.UNSIGNED_SHORT, offset: 2 * start + 2 },
      ]);
      gl.bindVertexArray(this.areaArray);
      gl.drawArraysInstanced(gl.TRIANGLES, 0, 3, count - 1);
    }
  }

  /**
   * @param {import("./view.js").Viewport} viewport
   * @param {import("./palette.js").Palette} palette
   */
  drawPoints(viewport, palette) {
    const last = this.spans.at(-1);
    if (!last) return;
    const { gl } = this;
    const program = this.programs.points;
    this.prepare(program, viewport, palette);
    gl.uniform1f(program.uniform("u_pointSize"), POINT_SIZE * lineWeight(viewport) * viewport.ratio);
    gl.bindVertexArray(this.pointArray);
    gl.drawArrays(gl.POINTS, 0, last.start + last.count);
  }

  /**
   * @param {import("./gl.js").Program} program
   * @param {import("./view.js").Viewport} viewport
   * @param {import("./palette.js").Palette} palette
   */
  prepare(program, viewport, palette) {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    useProgram(gl, program, viewport);
    gl.uniform3fv(program.uniform("u_palette"), palette.series.flat());
  }

  dispose() {
    const { gl } = this;
    gl.deleteTexture(this.texture);
    gl.deleteBuffer(this.beamBuffer);
    gl.deleteBuffer(this.rangeBuffer);
    gl.deleteVertexArray(this.pointArray);
    gl.deleteVertexArray(this.areaArray);
  }
}
