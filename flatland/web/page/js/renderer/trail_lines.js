import { TRAIL_CAPACITY, TRAIL_LIFETIME } from "../trails.js";
import { createColoredEdgeArray, EDGE_WORDS, packColor } from "./edge_batch.js";
import { modelColor } from "./model_colors.js";
import { forCorners } from "./quads.js";
import { useProgram } from "./view.js";

const WIDTH = 2;
const OPACITY = 0.75;
const QUAD_BYTES = 4 * 4 * EDGE_WORDS;

/** Draws the trails of a world. A frame uploads only the segments added since the last one. */
export class TrailLines {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {import("./gl.js").Program} program  of coloured edges
   * @param {import("./quads.js").Quads} quads
   */
  constructor(gl, program, quads) {
    this.gl = gl;
    this.program = program;
    this.quads = quads;
    this.buffer = gl.createBuffer();
    this.array = createColoredEdgeArray(gl, this.buffer, quads);
    this.isAllocated = false;
    this.uploaded = 0;
    this.generation = -1;
    /** @type {import("./palette.js").Palette | null} */
    this.palette = null;
  }

  /**
   * @param {import("../world_state.js").WorldState} world
   * @param {import("./palette.js").Palette} palette
   */
  update(world, palette) {
    const { gl } = this;
    const { trails } = world;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    if (!this.isAllocated) {
      gl.bufferData(gl.ARRAY_BUFFER, QUAD_BYTES * TRAIL_CAPACITY, gl.DYNAMIC_DRAW);
      this.isAllocated = true;
    }
    if (this.generation !== trails.generation || this.palette !== palette) this.uploaded = 0;
    this.generation = trails.generation;
    this.palette = palette;
    let from = Math.max(this.uploaded, trails.added - TRAIL_CAPACITY);
    if (from === trails.added) return;
    const colors = new Map(
      [...world.models.values()].map((model) => [model.index, modelColor(model, palette)]),
    );
    while (from < trails.added) {
      const start = from % TRAIL_CAPACITY;
      const count = Math.min(trails.added - from, TRAIL_CAPACITY - start);
      gl.bufferSubData(
        gl.ARRAY_BUFFER,
        QUAD_BYTES * start,
        packSegments(trails, start, count, colors, palette),
      );
      from += count;
    }
    this.uploaded = trails.added;
  }

  /**
   * @param {import("./view.js").Viewport} viewport
   * @param {import("../trails.js").Trails} trails
   */
  draw(viewport, trails) {
    const count = Math.min(trails.added, TRAIL_CAPACITY);
    if (count === 0) return;
    const { gl, program } = this;
    useProgram(gl, program, viewport);
    gl.uniform1f(program.uniform("u_time"), trails.time - trails.epoch);
    gl.uniform1f(program.uniform("u_lifetime"), TRAIL_LIFETIME);
    gl.uniform1f(program.uniform("u_ratio"), viewport.ratio);
    this.quads.draw(this.array, 0, count);
  }

  dispose() {
    this.gl.deleteBuffer(this.buffer);
    this.gl.deleteVertexArray(this.array);
  }
}

/**
 * @param {import("../trails.js").Trails} trails
 * @param {number} start
 * @param {number} count
 * @param {Map<number, import("./palette.js").Rgba>} colors  of the models, by index
 * @param {import("./palette.js").Palette} palette
 */
function packSegments(trails, start, count, colors, palette) {
  const floats = new Float32Array(EDGE_WORDS * count);
  const words = new Uint32Array(floats.buffer);
  for (let i = 0; i < count; i++) {
    const at = EDGE_WORDS * i;
    floats.set(trails.segments.subarray(4 * (start + i), 4 * (start + i) + 4), at);
    const model = trails.colors[start + i];
    // A trail can be longer than the life of its model.
    const [r, g, b] = colors.get(model) ?? palette.series[model % palette.series.length];
    words[at + 4] = packColor([r, g, b], OPACITY);
    floats[at + 5] = WIDTH;
    floats[at + 6] = trails.times[start + i];
  }
  return forCorners(floats, EDGE_WORDS);
}
