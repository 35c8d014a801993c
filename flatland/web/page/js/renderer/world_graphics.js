import { BodyShapes } from "./body_shapes.js";
import { EdgeLayers } from "./edge_layers.js";
import { ScanClouds } from "./scan_clouds.js";
import { TrailLines } from "./trail_lines.js";

/**
 * @typedef {object} Programs  shared by all worlds
 * @property {import("./edge_layers.js").EdgeProgram} layers
 * @property {import("./body_shapes.js").BodyPrograms} bodies
 * @property {import("./scan_clouds.js").ScanPrograms} scans
 * @property {import("./gl.js").Program} coloredEdges
 * @property {import("./quads.js").Quads} quads
 */

/** The buffers and textures of a world. */
export class WorldGraphics {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {Programs} programs
   */
  constructor(gl, programs) {
    this.layers = new EdgeLayers(gl, programs.layers, programs.quads);
    this.bodies = new BodyShapes(gl, programs.bodies, programs.quads);
    this.scans = new ScanClouds(gl, programs.scans);
    this.trails = new TrailLines(gl, programs.coloredEdges, programs.quads);
  }

  /**
   * Uploads everything that has changed.
   *
   * @param {import("../world_state.js").WorldState} world
   * @param {import("./palette.js").Palette} palette
   */
  update(world, palette) {
    this.layers.update(world);
    this.bodies.update(world, palette);
    this.trails.update(world, palette);
  }

  dispose() {
    this.layers.dispose();
    this.bodies.dispose();
    this.scans.dispose();
    this.trails.dispose();
  }
}
