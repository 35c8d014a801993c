/** @typedef {import("./protocol.js").Shape} Shape */

/** Number of edges of the outline of a circle. */
const CIRCLE_EDGES = 40;

/**
 * Returns the radius of the circle around the origin that contains all shapes.
 *
 * @param {Shape[]} shapes
 */
export function shapesRadius(shapes) {
  let radius = 0;
  for (const shape of shapes) {
    if (shape.kind === "circle") {
      radius = Math.max(radius, Math.hypot(...shape.center) + shape.radius);
    } else {
      for (const [ax, ay, bx, by] of shapeEdges(shape)) {
        radius = Math.max(radius, Math.hypot(ax, ay), Math.hypot(bx, by));
      }
    }
  }
  return radius;
}

/**
 * Returns how far shapes extend from the origin in a direction.
 *
 * @param {Shape[]} shapes
 * @param {number} x  of a unit vector
 * @param {number} y
 * @returns {number} [m]
 */
export function shapesExtent(shapes, x, y) {
  let extent = 0;
  for (const shape of shapes) {
    if (shape.kind === "circle") {
      extent = Math.max(extent, shape.center[0] * x + shape.center[1] * y + shape.radius);
    } else for (const point of shape.points) extent = Math.max(extent, point[0] * x + point[1] * y);
  }
  return extent;
}

/**
 * Returns the outline of a shape as edges.
 *
 * @param {Shape} shape
 * @returns {number[][]} x1, y1, x2, y2 of each edge [m]
 */
export function shapeEdges(shape) {
  const points = shapePoints(shape);
  const closed = shape.kind !== "edges";
  const edges = [];
  for (let i = closed ? 0 : 1; i < points.length; i++) {
    const [ax, ay] = points[(i + points.length - 1) % points.length];
    edges.push([ax, ay, ...points[i]]);
  }
  return edges;
}

/**
 * Returns the vertices of a shape.
 *
 * @param {Shape} shape
 * @returns {import("./protocol.js").Point[]}
 */
export function shapePoints(shape) {
  if (shape.kind !== "circle") return shape.points;
  const { center, radius } = shape;
  return Array.from({ length: CIRCLE_EDGES }, (_, i) => {
    const angle = (2 * Math.PI * i) / CIRCLE_EDGES;
    return [center[0] + radius * Math.cos(angle), center[1] + radius * Math.sin(angle)];
  });
}
