import { createProgram } from "./gl.js";
import { colorKey } from "./model_colors.js";
import { PointBuffer } from "./point_buffer.js";
import { flatFragment, flatVertex, pointsFragment, pointsVertex } from "./shaders.js";
import { lineWeight, useProgram } from "./view.js";

/** Diameter of a point [CSS pixels]. */
const POINT_SIZE = 3.2;
/** Least distance of the drawn points of a scan, as a share of their diameter. */
const SPACING = 0.35;
/** Change of the scale of the view after which the points to draw are selected again. */
const SCALE_STEP = 1.25;
const AREA_OPACITY = 0.09;
/** Number of lasers up to which the areas of all scans are drawn, not only of the selected model. */
const MAX_AREAS = 8;

/**
 * @typedef {import("../world_state.js").LaserState} LaserState
 * @typedef {import("../world_state.js").Model} Model
 * @typedef {import("../world_state.js").WorldState} WorldState
 * @typedef {import("./palette.js").Palette} Palette
 * @typedef {import("./view.js").Viewport} Viewport
 */

/** Programs that draw scans; shared by all worlds. */
export class ScanPrograms {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.points = createProgram(gl, pointsVertex, pointsFragment, ["a_point"]);
    this.areas = createProgram(gl, flatVertex, flatFragment, ["a_point"]);
  }
}

/**
 * The points and the areas of the latest scans of a world. They are computed when scans arrive,
 * which is less frequent than drawing.
 */
export class ScanClouds {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {ScanPrograms} programs
   */
  constructor(gl, programs) {
    this.gl = gl;
    this.programs = programs;
    this.points = new PointBuffer(gl);
    this.areas = new PointBuffer(gl);
    /** Cosine and sine of the angle of each beam.
     * @type {WeakMap<import("../protocol.js").LaserInfo, Float32Array>} */
    this.directions = new WeakMap();
    this.ends = new Float32Array(0);
    this.pointsVersion = -1;
    this.areasVersion = -1;
    this.spacing = 0;
    /** @type {Model | null} */
    this.selected = null;
  }

  /**
   * @param {Viewport} viewport
   * @param {WorldState} world
   * @param {Palette} palette
   * @param {Model | null} selected
   */
  drawAreas(viewport, world, palette, selected) {
    if (this.areasVersion !== world.scansVersion || this.selected !== selected) {
      this.areasVersion = world.scansVersion;
      this.selected = selected;
      this.setAreas(lasersWithScans(world), selected);
    }
    const { gl, programs } = this;
    useProgram(gl, programs.areas, viewport);
    this.areas.draw(gl.TRIANGLE_FAN, programs.areas, palette, AREA_OPACITY);
  }

  /**
   * @param {Viewport} viewport
   * @param {WorldState} world
   * @param {Palette} palette
   */
  drawPoints(viewport, world, palette) {
    const size = POINT_SIZE * lineWeight(viewport);
    const spacing = (SPACING * size) / viewport.camera.zoom;
    const isScaled = spacing > SCALE_STEP * this.spacing || SCALE_STEP * spacing < this.spacing;
    if (this.pointsVersion !== world.scansVersion || isScaled) {
      this.pointsVersion = world.scansVersion;
      this.spacing = spacing;
      this.setPoints(lasersWithScans(world), spacing);
    }
    const { gl, programs } = this;
    useProgram(gl, programs.points, viewport);
    gl.uniform1f(programs.points.uniform("u_pointSize"), size * viewport.ratio);
    this.points.draw(gl.POINTS, programs.points, palette, 1);
  }

  /**
   * Collects the points that beams have hit.
   *
   * @param {LaserState[]} lasers
   * @param {number} spacing  least distance of consecutive points of a scan [m]
   */
  setPoints(lasers, spacing) {
    const { points } = this;
    points.begin(lasers.reduce((sum, { ranges }) => sum + (ranges?.length ?? 0), 0));
    /** @type {Map<string, LaserState[]>} */
    const byColor = new Map();
    for (const laser of lasers) {
      const key = colorKey(laser.model);
      const same = byColor.get(key);
      if (same) same.push(laser);
      else byColor.set(key, [laser]);
    }
    for (const same of byColor.values()) {
      for (const laser of same) this.addPoints(laser, spacing * spacing);
      points.endSpan(same[0].model);
    }
    points.upload();
  }

  /**
   * @param {LaserState} laser
   * @param {number} least  square of the least distance of consecutive points [m²]
   */
  addPoints(laser, least) {
    const { ranges } = laser;
    if (!ranges) return;
    const ends = this.endPoints(laser, ranges);
    const maximum = laser.info.range_max;
    let [lastX, lastY] = [Infinity, Infinity];
    for (let i = 0; i < ranges.length; i++) {
      if (!isHit(ranges[i], maximum)) continue;
      const x = ends[2 * i];
      const y = ends[2 * i + 1];
      if ((x - lastX) ** 2 + (y - lastY) ** 2 < least) continue;
      this.points.add(x, y);
      lastX = x;
      lastY = y;
    }
  }

  /**
   * Sets the areas that the beams cover, as fans around the lasers.
   *
   * @param {LaserState[]} lasers
   * @param {Model | null} selected
   */
  setAreas(lasers, selected) {
    const { areas } = this;
    const wide = lasers.filter(({ ranges }) => ranges && ranges.length > 1);
    const shown = wide.length <= MAX_AREAS ? wide : wide.filter(({ model }) => model === selected);
    areas.begin(shown.reduce((sum, { ranges }) => sum + 1 + (ranges?.length ?? 0), 0));
    for (const laser of shown) {
      const { model, pose, ranges } = laser;
      if (!ranges) continue;
      const ends = this.endPoints(laser, ranges);
      areas.add(pose[0], pose[1]);
      for (let i = 0; i < ranges.length; i++) areas.add(ends[2 * i], ends[2 * i + 1]);
      areas.endSpan(model);
    }
    areas.upload();
  }

  /**
   * Returns the end points of the beams of a scan: at a hit, or at the largest range.
   *
   * @param {LaserState} laser
   * @param {Float32Array} ranges
   * @returns {Float32Array} two coordinates for each beam [m], valid until the next call
   */
  endPoints({ info, pose }, ranges) {
    if (this.ends.length < 2 * ranges.length) this.ends = new Float32Array(2 * ranges.length);
    const { ends } = this;
    const [x, y, heading] = pose;
    const c = Math.cos(heading);
    const s = Math.sin(heading);
    const maximum = info.range_max;
    const directions = this.directionsOf(info, ranges.length);
    for (let i = 0; i < ranges.length; i++) {
      // -inf stands for a hit that is too close.
      const range = isHit(ranges[i], maximum) ? Math.max(ranges[i], 0) : maximum;
      const dx = range * directions[2 * i];
      const dy = range * directions[2 * i + 1];
      ends[2 * i] = x + c * dx - s * dy;
      ends[2 * i + 1] = y + s * dx + c * dy;
    }
    return ends;
  }

  /**
   * Returns the directions of the beams in the frame of the laser.
   *
   * @param {import("../protocol.js").LaserInfo} info
   * @param {number} count
   */
  directionsOf(info, count) {
    let directions = this.directions.get(info);
    if (directions?.length === 2 * count) return directions;
    directions = new Float32Array(2 * count);
    for (let i = 0; i < count; i++) {
      const angle = info.angle_min + i * info.angle_increment;
      directions[2 * i] = Math.cos(angle);
      directions[2 * i + 1] = Math.sin(angle);
    }
    this.directions.set(info, directions);
    return directions;
  }

  dispose() {
    this.points.dispose();
    this.areas.dispose();
  }
}

/**
 * Returns whether a beam has hit something. Otherwise, its range is the largest range, inf or NaN.
 *
 * @param {number} range  [m]
 * @param {number} maximum  largest range of the laser [m]
 */
function isHit(range, maximum) {
  return range < maximum;
}

/** @param {WorldState} world */
function lasersWithScans(world) {
  return [...world.lasers.values()].filter((laser) => laser.ranges !== null);
}
