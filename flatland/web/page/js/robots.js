/** @typedef {import("./world_state.js").Model} Model */

/**
 * Returns whether a model has velocity commands.
 *
 * @param {Model} model
 */
export function isDrivable(model) {
  return model.commands.length > 0;
}

/**
 * Returns whether a model can be driven or has a laser.
 *
 * @param {Model} model
 */
export function isRobot(model) {
  return isDrivable(model) || model.lasers.length > 0;
}

/**
 * Returns whether a model has shapes. A model without shapes can be a frame, such as `map_to_odom`.
 *
 * @param {Model} model
 */
export function hasShapes(model) {
  return model.bodies.some((body) => body.radius > 0);
}
