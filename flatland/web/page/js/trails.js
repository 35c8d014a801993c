/** Longest step of a model that is part of its trail [m]; a longer one is a move by a client. */
const LONGEST_STEP = 1.5;
/** Shortest segment of a trail [m]. */
const SHORTEST_STEP = 0.04;
/** Largest number of segments of a world. */
export const TRAIL_CAPACITY = 16_384;
/** Simulated time after which a segment disappears [s]. */
export const TRAIL_LIFETIME = 30;

/** The most recent paths of all models, as a ring of segments. */
export class Trails {
  constructor() {
    /** Start and end of each segment [m]. */
    this.segments = new Float32Array(4 * TRAIL_CAPACITY);
    /** Simulated time of each segment [s], relative to `epoch`. */
    this.times = new Float32Array(TRAIL_CAPACITY);
    /** Index of the model of each segment. */
    this.colors = new Uint16Array(TRAIL_CAPACITY);
    /** Number of segments ever added. */
    this.added = 0;
    this.epoch = 0;
    /** Incremented when all segments are removed. */
    this.generation = 0;
    /** @type {Map<number, {x: number, y: number}>} */
    this.last = new Map();
    this.time = 0;
  }

  /** Removes all segments. */
  clear() {
    this.added = 0;
    this.generation++;
    this.last.clear();
  }

  /**
   * Sets the simulated time of the next segments. The trails restart if time runs backwards.
   *
   * @param {number} time  [s]
   */
  setTime(time) {
    if (time < this.time || this.added === 0) {
      if (time < this.time) this.clear();
      this.epoch = time;
    }
    this.time = time;
  }

  /**
   * Continues the trail of a model.
   *
   * @param {number} id
   * @param {number} x  [m]
   * @param {number} y  [m]
   * @param {number} color  index of the model, which selects the colour
   */
  extend(id, x, y, color) {
    const last = this.last.get(id);
    if (!last) {
      this.last.set(id, { x, y });
      return;
    }
    const length = Math.hypot(x - last.x, y - last.y);
    if (length < SHORTEST_STEP) return;
    if (length < LONGEST_STEP) {
      const index = this.added % TRAIL_CAPACITY;
      this.segments.set([last.x, last.y, x, y], 4 * index);
      this.times[index] = this.time - this.epoch;
      this.colors[index] = color;
      this.added++;
    }
    last.x = x;
    last.y = y;
  }

  /**
   * Ends the trail of a model, so that its next position starts a new one.
   *
   * @param {number} id
   */
  interrupt(id) {
    this.last.delete(id);
  }
}
