/**
 * Poses and points in the plane. Positions are in metres, angles in radians.
 *
 * @typedef {[number, number]} Point
 * @typedef {[number, number, number]} Pose  x, y, heading
 * @typedef {[number, number, number, number]} Bounds  minimum x and y, maximum x and y
 */

/**
 * Returns an angle wrapped to (-pi, pi].
 *
 * @param {number} angle
 */
export function wrapAngle(angle) {
  const turn = 2 * Math.PI;
  const wrapped = angle - turn * Math.floor((angle + Math.PI) / turn);
  return wrapped === -Math.PI ? Math.PI : wrapped;
}

/**
 * Returns a point of a frame in the frame's parent.
 *
 * @param {ArrayLike<number>} pose  pose of the frame in its parent
 * @param {number} x
 * @param {number} y
 * @returns {Point}
 */
export function transformPoint(pose, x, y) {
  const c = Math.cos(pose[2]);
  const s = Math.sin(pose[2]);
  return [pose[0] + c * x - s * y, pose[1] + s * x + c * y];
}

/**
 * Returns a point of the parent in a frame; the inverse of `transformPoint`.
 *
 * @param {ArrayLike<number>} pose  pose of the frame in its parent
 * @param {number} x
 * @param {number} y
 * @returns {Point}
 */
export function inversePoint(pose, x, y) {
  const c = Math.cos(pose[2]);
  const s = Math.sin(pose[2]);
  const dx = x - pose[0];
  const dy = y - pose[1];
  return [c * dx + s * dy, -s * dx + c * dy];
}

/**
 * Returns the product of two poses.
 *
 * @param {ArrayLike<number>} a
 * @param {ArrayLike<number>} b  pose in the frame of `a`
 * @returns {Pose}
 */
export function composePoses(a, b) {
  const [x, y] = transformPoint(a, b[0], b[1]);
  return [x, y, wrapAngle(a[2] + b[2])];
}

/**
 * Returns the inverse of a pose.
 *
 * @param {ArrayLike<number>} pose
 * @returns {Pose}
 */
export function inversePose(pose) {
  const [x, y] = inversePoint(pose, 0, 0);
  return [x, y, wrapAngle(-pose[2])];
}

/**
 * Returns the distance of a point from a line segment.
 *
 * @param {number} x
 * @param {number} y
 * @param {ArrayLike<number>} a
 * @param {ArrayLike<number>} b
 */
export function segmentDistance(x, y, a, b) {
  const dx = b[0] - a[0];
  const dy = b[1] - a[1];
  const square = dx * dx + dy * dy;
  const t = square > 0 ? Math.min(1, Math.max(0, ((x - a[0]) * dx + (y - a[1]) * dy) / square)) : 0;
  return Math.hypot(x - a[0] - t * dx, y - a[1] - t * dy);
}

/**
 * Returns whether a point is inside a polygon.
 *
 * @param {number} x
 * @param {number} y
 * @param {Point[]} points
 */
export function isInside(x, y, points) {
  let inside = false;
  for (let i = 0, j = points.length - 1; i < points.length; j = i++) {
    const [xi, yi] = points[i];
    const [xj, yj] = points[j];
    if (yi > y !== yj > y && x < ((xj - xi) * (y - yi)) / (yj - yi) + xi) inside = !inside;
  }
  return inside;
}
