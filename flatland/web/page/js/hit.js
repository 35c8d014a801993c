import { inversePoint, isInside, segmentDistance } from "./geometry.js";
import { shapeEdges } from "./shapes.js";

/**
 * @typedef {import("./world_state.js").WorldState} WorldState
 * @typedef {import("./world_state.js").Model} Model
 */

/**
 * Returns the smallest model at a point.
 *
 * @param {WorldState} world
 * @param {number} x  [m]
 * @param {number} y  [m]
 * @param {number} tolerance  distance from the point up to which a model counts as hit [m]
 * @returns {Model | null}
 */
export function modelAt(world, x, y, tolerance) {
  /** @type {Model | null} */
  let found = null;
  let foundSize = Infinity;
  for (const body of world.bodies.values()) {
    const pose = world.bodyPose(body);
    if (!pose || Math.hypot(x - pose[0], y - pose[1]) > body.radius + tolerance) continue;
    // A model without shapes is hit at its origin, but models with shapes take precedence.
    const size = body.radius > 0 ? body.radius : 1e9;
    if (size < foundSize && isHit(body, inversePoint(pose, x, y), tolerance)) {
      found = body.model;
      foundSize = size;
    }
  }
  return found;
}

/**
 * @param {import("./world_state.js").Body} body
 * @param {[number, number]} point  in the frame of the body
 * @param {number} tolerance
 */
function isHit(body, [x, y], tolerance) {
  if (body.shapes.length === 0) return true;
  return body.shapes.some((shape) => {
    if (shape.kind === "circle") {
      return Math.hypot(x - shape.center[0], y - shape.center[1]) <= shape.radius + tolerance;
    }
    if (shape.kind === "polygon" && isInside(x, y, shape.points)) return true;
    return shapeEdges(shape).some(
      ([ax, ay, bx, by]) => segmentDistance(x, y, [ax, ay], [bx, by]) <= tolerance,
    );
  });
}

/**
 * Returns the radius of the circle around the origin of a model that contains all of its bodies.
 *
 * @param {WorldState} world
 * @param {Model} model
 */
export function modelRadius(world, model) {
  const origin = world.modelPose(model);
  let radius = 0;
  for (const body of model.bodies) {
    const pose = world.bodyPose(body);
    if (origin && pose) {
      radius = Math.max(radius, Math.hypot(pose[0] - origin[0], pose[1] - origin[1]) + body.radius);
    }
  }
  return radius;
}
