import { Camera } from "./camera.js";
import { Emitter } from "./events.js";
import { createContext } from "./renderer/gl.js";
import { Renderer } from "./renderer/renderer.js";
import { tilePlaces } from "./tile_places.js";

/**
 * @typedef {import("./world_state.js").WorldState} WorldState
 * @typedef {import("./tile_places.js").Place & {world: WorldState}} Tile
 */

/** Duration of an animated change of the view [ms]. */
const GLIDE_TIME = 220;
const MAX_PIXEL_RATIO = 2;
/** Area that the view of an empty world shows [m].
 * @type {import("./geometry.js").Bounds} */
const EMPTY_BOUNDS = [-5, -5, 5, 5];

/**
 * The canvas: places the views of the worlds, and draws a frame when something has changed.
 *
 * @extends {Emitter<{view: void, frame: void, theme: void}>}
 */
export class Stage extends Emitter {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {import("./session.js").Session} session
   * @param {boolean} dark
   */
  constructor(canvas, session, dark) {
    super();
    this.canvas = canvas;
    this.session = session;
    this.camera = new Camera();
    /** Number of frames drawn. */
    this.frames = 0;
    /** Mean processor time of the last frames [ms]. */
    this.frameCost = 0;
    /** Whether the view is fitted to the world until the user moves it. */
    this.isFitting = true;
    /** Name of the model that the view follows.
     * @type {string | null} */
    this.followed = null;
    /** @type {import("./renderer/renderer.js").Overlay | null} */
    this.overlay = null;
    /** @type {WeakMap<WorldState, Camera>} */
    this.tileCameras = new WeakMap();
    /** Area that each camera was fitted to last.
     * @type {WeakMap<Camera, {world: WorldState, key: string, bounds: import("./geometry.js").Bounds}>} */
    this.fitted = new WeakMap();
    this.dark = dark;
    /** Whether a frame is to be drawn, which is then requested. */
    this.isDirty = false;
    /** @type {Renderer | null} */
    this.renderer = null;
    /** @type {{from: number[], to: number[], start: number} | null} */
    this.glide = null;
    this.restore();
    canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.renderer = null;
    });
    canvas.addEventListener("webglcontextrestored", () => this.restore());
    new ResizeObserver(() => this.resize()).observe(canvas);
    session.on("redraw", () => this.invalidate());
    session.on("hello", () => this.renderer?.keepOnly(session.worlds.values()));
    session.on("current", () => this.invalidate());
    this.resize();
  }

  /** Whether the browser supports WebGL 2. */
  get isSupported() {
    return this.renderer !== null;
  }

  restore() {
    const gl = createContext(this.canvas);
    this.renderer = gl ? new Renderer(gl, this.dark) : null;
    this.invalidate();
  }

  /** @param {boolean} dark */
  setTheme(dark) {
    this.dark = dark;
    this.renderer?.setTheme(dark);
    this.invalidate();
    this.emit("theme", undefined);
  }

  /** Draws a frame as soon as the browser shows one. */
  invalidate() {
    if (this.isDirty) return;
    this.isDirty = true;
    // Requested when needed: requests in each frame would keep the browser busy while nothing moves.
    window.requestAnimationFrame(() => {
      if (this.isDirty) this.draw();
    });
  }

  resize() {
    const ratio = Math.min(window.devicePixelRatio, MAX_PIXEL_RATIO);
    const { clientWidth, clientHeight } = this.canvas;
    this.canvas.width = Math.max(1, Math.round(clientWidth * ratio));
    this.canvas.height = Math.max(1, Math.round(clientHeight * ratio));
    this.camera.width = Math.max(1, clientWidth);
    this.camera.height = Math.max(1, clientHeight);
    this.invalidate();
    // Drawn immediately, because a change of the size clears the canvas.
    this.draw();
  }

  /**
   * Changes the view on behalf of the user, which ends fitting.
   *
   * @param {(camera: Camera) => void} change
   */
  moveView(change) {
    this.glide = null;
    this.isFitting = false;
    change(this.camera);
    this.invalidate();
    this.emit("view", undefined);
  }

  /** Fits the view to the world until the user moves it. */
  fit() {
    this.followed = null;
    this.isFitting = true;
    this.fitted.delete(this.camera);
    this.invalidate();
    this.emit("view", undefined);
  }

  /** @param {string | null} name  model to follow */
  follow(name) {
    this.followed = name;
    if (name !== null) this.isFitting = false;
    this.invalidate();
    this.emit("view", undefined);
  }

  /**
   * Moves the centre of the view to a point.
   *
   * @param {number} x  [m]
   * @param {number} y  [m]
   */
  centerOn(x, y) {
    this.isFitting = false;
    this.followed = null;
    const { camera } = this;
    if (window.matchMedia("(prefers-reduced-motion: reduce)").matches) [camera.x, camera.y] = [x, y];
    else this.glide = { from: [camera.x, camera.y], to: [x, y], start: performance.now() };
    this.invalidate();
    this.emit("view", undefined);
  }

  /** Moves the camera to the followed model, or fits the view. */
  updateCamera() {
    const { camera, session, glide } = this;
    const { world } = session;
    if (!world) return;
    if (glide) {
      const t = Math.min(1, (performance.now() - glide.start) / GLIDE_TIME);
      const eased = t * t * (3 - 2 * t);
      camera.x = glide.from[0] + (glide.to[0] - glide.from[0]) * eased;
      camera.y = glide.from[1] + (glide.to[1] - glide.from[1]) * eased;
      if (t === 1) this.glide = null;
      else this.invalidate();
    }
    const model = this.followed === null ? null : world.modelByName(this.followed);
    const pose = model && world.modelPose(model);
    if (pose) [camera.x, camera.y] = pose;
    else if (this.isFitting && world.present) this.fitTo(camera, world);
  }

  /**
   * Fits a view to a world. While the size of the view and the shapes in the world stay the same,
   * moving models only enlarge the area, so that the view is steady.
   *
   * @param {Camera} camera
   * @param {WorldState} world
   */
  fitTo(camera, world) {
    const key = [world.layersVersion, world.shapesVersion, camera.width, camera.height, camera.angle].join();
    const last = this.fitted.get(camera);
    let bounds = world.fitBounds();
    if (!bounds) {
      camera.fit(EMPTY_BOUNDS);
      return;
    }
    if (last && last.world === world && last.key === key) {
      const [x0, y0, x1, y1] = last.bounds;
      bounds = [
        Math.min(x0, bounds[0]),
        Math.min(y0, bounds[1]),
        Math.max(x1, bounds[2]),
        Math.max(y1, bounds[3]),
      ];
    }
    this.fitted.set(camera, { world, key, bounds });
    camera.fit(bounds);
  }

  /**
   * Returns the tiles of the grid of worlds, one for the whole canvas if a world is enlarged.
   *
   * @returns {Tile[]}
   */
  tiles() {
    const { width, height } = this.camera;
    const { world, worlds } = this.session;
    if (world) return [{ world, left: 0, top: 0, width, height }];
    const places = tilePlaces(worlds.size, width, height);
    return [...worlds.values()].map((each, i) => ({ world: each, ...places[i] }));
  }

  /** @param {Tile} tile */
  viewport({ world, left, top, width, height }) {
    const ratio = this.canvas.width / this.camera.width;
    let camera = this.camera;
    if (!this.session.world) {
      camera = this.tileCameras.get(world) ?? new Camera();
      this.tileCameras.set(world, camera);
      camera.width = width;
      camera.height = height;
      this.fitTo(camera, world);
    }
    return {
      left: Math.round(left * ratio),
      bottom: Math.round((this.camera.height - top - height) * ratio),
      width: Math.round(width * ratio),
      height: Math.round(height * ratio),
      ratio,
      camera,
    };
  }

  draw() {
    this.isDirty = false;
    const { renderer, session } = this;
    if (!renderer) return;
    const start = performance.now();
    this.updateCamera();
    renderer.draw({
      views: this.tiles().map((tile) => ({ world: tile.world, viewport: this.viewport(tile) })),
      displays: session.displays,
      selected: session.selected,
      topics: session.world ? session.topics : null,
      overlay: session.world ? this.overlay : null,
      isGrid: !session.world,
    });
    this.frames++;
    this.frameCost += (performance.now() - start - this.frameCost) / 30;
    this.emit("frame", undefined);
  }
}
