import { Backdrop } from "./backdrop.js";
import { BodyPrograms } from "./body_shapes.js";
import { createColoredEdgeProgram, EdgeBatch } from "./edge_batch.js";
import { EdgeProgram } from "./edge_layers.js";
import { LabelPlaces } from "./label_places.js";
import { addFrames, addGrid, addJoints, addNames, addShapelessModels, addSmallRobots } from "./marks.js";
import { createPalette } from "./palette.js";
import { Quads } from "./quads.js";
import { ScanPrograms } from "./scan_clouds.js";
import { TextLabels } from "./text_labels.js";
import { TopicGraphics } from "./topic_graphics.js";
import { WorldGraphics } from "./world_graphics.js";

/**
 * @typedef {import("../world_state.js").WorldState} WorldState
 * @typedef {import("./view.js").Viewport} Viewport
 *
 * Draws the marks of tools in the enlarged world: selection, handles, outlines, measurements.
 * @typedef {(batch: EdgeBatch, labels: TextLabels, viewport: Viewport,
 *   palette: import("./palette.js").Palette) => void} Overlay
 *
 * @typedef {object} Frame
 * @property {{world: WorldState, viewport: Viewport}[]} views
 * @property {Record<import("../session.js").Display, boolean>} displays
 * @property {import("../world_state.js").Model | null} selected
 * @property {import("../foreign_topics.js").ForeignTopics | null} topics
 * @property {Overlay | null} overlay
 * @property {boolean} isGrid  whether the views are tiles on the background of a grid
 */

/** Draws worlds into viewports of a canvas. */
export class Renderer {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {boolean} dark  whether the theme is dark
   */
  constructor(gl, dark) {
    this.gl = gl;
    this.palette = createPalette(dark);
    /** @type {import("./world_graphics.js").Programs} */
    this.programs = {
      layers: new EdgeProgram(gl),
      bodies: new BodyPrograms(gl),
      scans: new ScanPrograms(gl),
      coloredEdges: createColoredEdgeProgram(gl),
      quads: new Quads(gl),
    };
    this.batch = new EdgeBatch(gl, this.programs.coloredEdges, this.programs.quads);
    this.labels = new TextLabels(gl, this.programs.quads);
    this.topics = new TopicGraphics(gl, this.programs.coloredEdges, this.programs.quads);
    this.backdrop = new Backdrop(gl);
    /** @type {Map<WorldState, WorldGraphics>} */
    this.graphics = new Map();
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  }

  /** @param {boolean} dark */
  setTheme(dark) {
    this.palette = createPalette(dark);
  }

  /**
   * Releases the graphics of worlds that no longer exist.
   *
   * @param {Iterable<WorldState>} worlds
   */
  keepOnly(worlds) {
    const kept = new Set(worlds);
    for (const [world, graphics] of this.graphics) {
      if (kept.has(world)) continue;
      graphics.dispose();
      this.graphics.delete(world);
      this.backdrop.forget();
    }
  }

  /** @param {Frame} frame */
  draw(frame) {
    const { gl, palette } = this;
    gl.disable(gl.SCISSOR_TEST);
    if (frame.isGrid) {
      gl.clearColor(...palette.gaps, 1);
      gl.clear(gl.COLOR_BUFFER_BIT);
      gl.enable(gl.SCISSOR_TEST);
    }
    for (const { world, viewport } of frame.views) {
      const { left, bottom, width, height } = viewport;
      gl.viewport(left, bottom, width, height);
      gl.scissor(left, bottom, width, height);
      this.drawWorld(world, viewport, frame);
    }
    gl.bindVertexArray(null);
  }

  /**
   * @param {WorldState} world
   * @param {Viewport} viewport
   * @param {Frame} frame
   */
  drawWorld(world, viewport, frame) {
    const { batch, labels, palette } = this;
    const { displays, selected, topics, overlay, isGrid } = frame;
    let graphics = this.graphics.get(world);
    if (!graphics) {
      graphics = new WorldGraphics(this.gl, this.programs);
      this.graphics.set(world, graphics);
    }
    graphics.update(world, palette);
    if (topics) this.topics.update(topics, palette);
    labels.begin(viewport.ratio);
    viewport = this.drawGround(world, graphics.layers, viewport, frame);
    if (topics) this.topics.drawMarks(viewport, labels);
    if (displays.scans) graphics.scans.drawAreas(viewport, world, palette, selected);
    if (displays.trails) graphics.trails.draw(viewport, world.trails);
    // Below the bodies, which are hardly visible below the points of many scans.
    if (displays.scans) graphics.scans.drawPoints(viewport, world, palette);
    if (displays.models) {
      graphics.bodies.draw(viewport);
      addJoints(batch, world, palette);
      addShapelessModels(batch, viewport, world, palette);
      addSmallRobots(batch, viewport, world, palette);
    }
    batch.flush(viewport);
    const places = new LabelPlaces();
    if (displays.names && !isGrid) addNames(labels, places, viewport, world);
    if (displays.frames) addFrames(batch, labels, places, viewport, world, palette);
    overlay?.(batch, labels, viewport, palette);
    batch.flush(viewport);
    labels.draw(viewport, palette);
  }

  /**
   * Draws the background, the grid and the layers.
   *
   * @param {WorldState} world
   * @param {import("./edge_layers.js").EdgeLayers} layers
   * @param {Viewport} viewport
   * @param {Frame} frame
   * @returns {Viewport} the viewport for the rest of the world
   */
  drawGround(world, layers, viewport, { displays, topics, isGrid }) {
    const { gl, batch, palette } = this;
    /** @param {Viewport} view */
    const paint = (view) => {
      gl.clearColor(...palette.background, 1);
      gl.clear(gl.COLOR_BUFFER_BIT);
      addGrid(batch, view, palette);
      batch.flush(view);
      if (topics) this.topics.drawGrids(view, topics);
      if (displays.layers) layers.draw(view, world, palette);
    };
    if (isGrid) {
      paint(viewport);
      return viewport;
    }
    const shown = displays.layers ? world.layers.map((layer) => Number(layer.visible)) : [];
    return this.backdrop.draw(
      viewport,
      [world.index, world.layersVersion, palette.dark, topics?.gridsVersion, shown].join(),
      paint,
    );
  }
}
