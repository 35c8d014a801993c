import { composePoses, transformPoint } from "../geometry.js";
import { hasShapes, isRobot } from "../robots.js";
import { shapesExtent } from "../shapes.js";
import { packColor } from "./edge_batch.js";
import { modelColor } from "./model_colors.js";
import { readable } from "./palette.js";

/**
 * @typedef {import("./edge_batch.js").EdgeBatch} EdgeBatch
 * @typedef {import("./label_places.js").LabelPlaces} LabelPlaces
 * @typedef {import("./palette.js").Palette} Palette
 * @typedef {import("./view.js").Viewport} Viewport
 * @typedef {import("../world_state.js").WorldState} WorldState
 */

/** Smallest distance of lines of the grid [CSS pixels]. */
const GRID_SPACING = 28;
/** Number of lines that are tried for the name of a frame. */
const FRAME_LINES = 8;

/**
 * Returns the distance of the lines of the grid: 1, 2 or 5 times a power of ten [m].
 *
 * @param {number} zoom  [pixels per metre]
 */
export function gridStep(zoom) {
  const least = GRID_SPACING / zoom;
  const power = 10 ** Math.floor(Math.log10(least));
  for (const factor of [1, 2, 5, 10]) if (factor * power >= least) return factor * power;
  return 10 * power;
}

/**
 * Adds the grid; every fifth line and the axes are stronger.
 *
 * @param {EdgeBatch} batch
 * @param {Viewport} viewport
 * @param {Palette} palette
 */
export function addGrid(batch, { camera }, palette) {
  const step = gridStep(camera.zoom);
  const reach = Math.hypot(camera.width, camera.height) / 2 / camera.zoom;
  const faint = packColor(palette.grid);
  const strong = packColor(palette.grid, 1.9);
  const axis = packColor(palette.gridAxis);
  for (const isVertical of [true, false]) {
    const center = isVertical ? camera.x : camera.y;
    const other = isVertical ? camera.y : camera.x;
    for (let i = Math.ceil((center - reach) / step); i * step <= center + reach; i++) {
      const at = i * step;
      const color = i === 0 ? axis : i % 5 === 0 ? strong : faint;
      if (isVertical) batch.add(at, other - reach, at, other + reach, color, 1);
      else batch.add(other - reach, at, other + reach, at, color, 1);
    }
  }
}

/**
 * Adds the joints: lines from the origins of the bodies to the anchors, and between the anchors.
 *
 * @param {EdgeBatch} batch
 * @param {WorldState} world
 * @param {Palette} palette
 */
export function addJoints(batch, world, palette) {
  const joints = [...world.models.values()].flatMap((model) => model.joints);
  for (const { bodies, anchors, color } of joints) {
    const first = world.bodyPose(world.bodies.get(bodies[0]));
    const second = world.bodyPose(world.bodies.get(bodies[1]));
    if (!first || !second) continue;
    const a = transformPoint(first, ...anchors[0]);
    const b = transformPoint(second, ...anchors[1]);
    const packed = packColor(readable(color, palette));
    batch.add(first[0], first[1], a[0], a[1], packed, 1.5);
    batch.add(a[0], a[1], b[0], b[1], packed, 1.5);
    batch.add(b[0], b[1], second[0], second[1], packed, 1.5);
  }
}

/**
 * Adds the axes of a pose: x red, y green.
 *
 * @param {EdgeBatch} batch
 * @param {ArrayLike<number>} pose
 * @param {number} length  [m]
 * @param {Palette} palette
 */
function addAxes(batch, pose, length, palette) {
  const red = packColor(palette.dark ? [1, 0.42, 0.42] : [0.8, 0.1, 0.1]);
  const green = packColor(palette.dark ? [0.42, 0.85, 0.45] : [0.1, 0.5, 0.15]);
  batch.add(pose[0], pose[1], ...transformPoint(pose, length, 0), red, 2.5);
  batch.add(pose[0], pose[1], ...transformPoint(pose, 0, length), green, 2.5);
}

/**
 * Returns the poses of TF frames in the world, by name.
 *
 * @param {import("../protocol.js").FrameInfo[]} frames
 */
export function resolveFrames(frames) {
  const byChild = new Map(frames.map((frame) => [frame.child, frame]));
  /** @type {Map<string, import("../geometry.js").Pose>} */
  const resolved = new Map();
  /** @type {(name: string, depth: number) => import("../geometry.js").Pose} */
  const resolve = (name, depth) => {
    const known = resolved.get(name);
    if (known) return known;
    const frame = byChild.get(name);
    // Limited to the number of frames, in case the parents form a loop.
    /** @type {import("../geometry.js").Pose} */
    const pose =
      !frame || depth > frames.length
        ? [0, 0, 0]
        : composePoses(resolve(frame.parent, depth + 1), frame.pose);
    resolved.set(name, pose);
    return pose;
  };
  for (const { parent, child } of frames) {
    resolve(parent, 0);
    resolve(child, 0);
  }
  return resolved;
}

/**
 * Adds the TF frames with their names, and lines to their parents.
 *
 * @param {EdgeBatch} batch
 * @param {import("./text_labels.js").TextLabels} labels
 * @param {LabelPlaces} places
 * @param {Viewport} viewport
 * @param {WorldState} world
 * @param {Palette} palette
 */
export function addFrames(batch, labels, places, { camera }, world, palette) {
  const poses = resolveFrames(world.frames);
  const link = packColor([...palette.warning.slice(0, 3), 0.5]);
  for (const { parent, child } of world.frames) {
    const [a, b] = [poses.get(parent), poses.get(child)];
    if (a && b) batch.add(a[0], a[1], b[0], b[1], link, 1);
  }
  for (const [name, pose] of poses) {
    addAxes(batch, pose, 24 / camera.zoom, palette);
    addLabel(labels, places, camera, name, pose, 14, FRAME_LINES);
  }
}

/**
 * Adds a label below a point unless the label would cover others.
 *
 * @param {import("./text_labels.js").TextLabels} labels
 * @param {LabelPlaces} places
 * @param {import("../camera.js").Camera} camera
 * @param {string} text
 * @param {ArrayLike<number>} point  [m]
 * @param {number} dy  distance of the first line from the point [CSS pixels]
 * @param {number} lines  number of lines to try
 */
function addLabel(labels, places, camera, text, point, dy, lines) {
  const [px, py] = camera.toScreen(point[0], point[1]);
  if (px < -80 || py < -40 - dy || px > camera.width + 80 || py > camera.height + 40) return;
  const shift = places.take(px, py + dy, labels.width(text), lines);
  if (shift !== null) labels.add(text, point[0], point[1], dy + shift);
}

/**
 * Adds the names of the models in the view, below the models.
 *
 * @param {import("./text_labels.js").TextLabels} labels
 * @param {LabelPlaces} places
 * @param {Viewport} viewport
 * @param {WorldState} world
 */
export function addNames(labels, places, { camera }, world) {
  for (const model of world.models.values()) {
    const body = model.bodies[0];
    const pose = world.bodyPose(body);
    if (!pose) continue;
    const heading = camera.angle + pose[2];
    const extent = shapesExtent(body.shapes, -Math.sin(heading), -Math.cos(heading));
    addLabel(labels, places, camera, model.name, pose, Math.min(extent * camera.zoom, 400) + 11, 1);
  }
}

/**
 * Adds crosses for models without shapes, which would otherwise be invisible.
 *
 * @param {EdgeBatch} batch
 * @param {Viewport} viewport
 * @param {WorldState} world
 * @param {Palette} palette
 */
export function addShapelessModels(batch, { camera }, world, palette) {
  const size = 6 / camera.zoom;
  const color = packColor([...palette.ink, 0.5]);
  for (const model of world.models.values()) {
    if (hasShapes(model)) continue;
    const pose = world.modelPose(model);
    if (!pose) continue;
    batch.add(pose[0] - size, pose[1], pose[0] + size, pose[1], color, 1.5);
    batch.add(pose[0], pose[1] - size, pose[0], pose[1] + size, color, 1.5);
  }
}

/** Least size of a robot on the screen [CSS pixels]. */
const LEAST_SIZE = 10;

/**
 * Adds discs for robots that would be too small to be seen or selected.
 *
 * @param {EdgeBatch} batch
 * @param {Viewport} viewport
 * @param {WorldState} world
 * @param {Palette} palette
 */
export function addSmallRobots(batch, { camera }, world, palette) {
  for (const model of world.models.values()) {
    if (!isRobot(model) || !hasShapes(model)) continue;
    const radius = Math.max(...model.bodies.map((body) => body.radius));
    const pose = world.modelPose(model);
    if (!pose || 2 * radius * camera.zoom >= LEAST_SIZE) continue;
    const [r, g, b] = modelColor(model, palette);
    batch.add(pose[0], pose[1], pose[0], pose[1], packColor([r, g, b]), LEAST_SIZE);
  }
}
