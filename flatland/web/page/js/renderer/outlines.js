import { composePoses, inversePoint, transformPoint } from "../geometry.js";
import { shapeEdges } from "../shapes.js";

/**
 * Outlines of models that a tool moves or places.
 *
 * @typedef {import("./edge_batch.js").EdgeBatch} EdgeBatch
 */

/**
 * Adds the outline of shapes at a pose.
 *
 * @param {EdgeBatch} batch
 * @param {import("../protocol.js").Shape[]} shapes
 * @param {ArrayLike<number>} pose
 * @param {number} color
 * @param {number} width  [CSS pixels]
 */
export function addOutline(batch, shapes, pose, color, width) {
  for (const shape of shapes) {
    for (const [ax, ay, bx, by] of shapeEdges(shape)) {
      batch.add(...transformPoint(pose, ax, ay), ...transformPoint(pose, bx, by), color, width);
    }
  }
}

/**
 * Adds the outlines of all bodies of a model, as if the model had another pose.
 *
 * @param {EdgeBatch} batch
 * @param {import("../world_state.js").WorldState} world
 * @param {import("../world_state.js").Model} model
 * @param {import("../geometry.js").Pose} pose
 * @param {number} color
 * @param {number} width  [CSS pixels]
 */
export function addModelAt(batch, world, model, pose, color, width) {
  const origin = world.modelPose(model);
  if (!origin) return;
  for (const body of model.bodies) {
    const own = world.bodyPose(body);
    if (!own) continue;
    const [x, y] = inversePoint(origin, own[0], own[1]);
    addOutline(batch, body.shapes, composePoses(pose, [x, y, own[2] - origin[2]]), color, width);
  }
}

/**
 * Adds an arrow along the x axis of a pose.
 *
 * @param {EdgeBatch} batch
 * @param {ArrayLike<number>} pose
 * @param {number} length  [m]
 * @param {number} color
 */
export function addArrow(batch, pose, length, color) {
  const tip = transformPoint(pose, length, 0);
  batch.add(pose[0], pose[1], ...tip, color, 2);
  batch.add(...tip, ...transformPoint(pose, 0.78 * length, 0.13 * length), color, 2);
  batch.add(...tip, ...transformPoint(pose, 0.78 * length, -0.13 * length), color, 2);
}
