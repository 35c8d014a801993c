/** Number of edges up to which a layer is one cell. */
const FEW_EDGES = 2000;
/** Mean number of edges of a cell. */
const CELL_EDGES = 250;

/**
 * @typedef {object} Cell  consecutive edges that are close together
 * @property {number} start  index of the first edge
 * @property {number} count
 * @property {import("../geometry.js").Bounds} bounds  of the edges [m]
 */

/**
 * Sorts edges into the cells of a grid, so that a view draws only the cells that it contains.
 *
 * @param {Float32Array} edges  four numbers for each edge [m]
 * @returns {{edges: Float32Array, cells: Cell[]}} sorted edges, and their cells by rows
 */
export function sortIntoCells(edges) {
  const count = edges.length / 4;
  const whole = boundsOf(edges, 0, count);
  if (count <= FEW_EDGES) return { edges, cells: [{ start: 0, count, bounds: whole }] };
  const [x0, y0, x1, y1] = whole;
  const size = Math.sqrt(Math.max((x1 - x0) * (y1 - y0), 1e-9) / (count / CELL_EDGES)) || 1;
  const columns = Math.max(1, Math.min(256, Math.ceil((x1 - x0) / size)));
  const rows = Math.max(1, Math.min(256, Math.ceil((y1 - y0) / size)));
  const keys = new Uint32Array(count);
  const starts = new Uint32Array(columns * rows + 1);
  for (let i = 0; i < count; i++) {
    const x = (edges[4 * i] + edges[4 * i + 2]) / 2;
    const y = (edges[4 * i + 1] + edges[4 * i + 3]) / 2;
    const column = Math.max(0, Math.min(columns - 1, Math.floor((x - x0) / size)));
    const row = Math.max(0, Math.min(rows - 1, Math.floor((y - y0) / size)));
    keys[i] = row * columns + column;
    starts[keys[i] + 1]++;
  }
  for (let i = 1; i < starts.length; i++) starts[i] += starts[i - 1];
  const next = starts.slice();
  const sorted = new Float32Array(edges.length);
  for (let i = 0; i < count; i++) {
    sorted.set(edges.subarray(4 * i, 4 * i + 4), 4 * next[keys[i]]++);
  }
  /** @type {Cell[]} */
  const cells = [];
  for (let i = 0; i + 1 < starts.length; i++) {
    const cell = { start: starts[i], count: starts[i + 1] - starts[i] };
    if (cell.count > 0) cells.push({ ...cell, bounds: boundsOf(sorted, cell.start, cell.count) });
  }
  return { edges: sorted, cells };
}

/**
 * Returns the ranges of edges in a view. Neighbouring cells are one range.
 *
 * @param {Cell[]} cells
 * @param {import("../camera.js").Camera} camera
 * @returns {{start: number, count: number}[]}
 */
export function visibleRanges(cells, camera) {
  const reach = Math.hypot(camera.width, camera.height) / 2 / camera.zoom;
  /** @type {{start: number, count: number}[]} */
  const ranges = [];
  for (const { start, count, bounds } of cells) {
    const [x0, y0, x1, y1] = bounds;
    const isOutside =
      x0 > camera.x + reach || x1 < camera.x - reach || y0 > camera.y + reach || y1 < camera.y - reach;
    if (isOutside) continue;
    const last = ranges.at(-1);
    if (last && last.start + last.count === start) last.count += count;
    else ranges.push({ start, count });
  }
  return ranges;
}

/**
 * @param {Float32Array} edges
 * @param {number} start
 * @param {number} count
 * @returns {import("../geometry.js").Bounds}
 */
function boundsOf(edges, start, count) {
  let [x0, y0, x1, y1] = [Infinity, Infinity, -Infinity, -Infinity];
  for (let i = 4 * start; i < 4 * (start + count); i += 2) {
    x0 = Math.min(x0, edges[i]);
    y0 = Math.min(y0, edges[i + 1]);
    x1 = Math.max(x1, edges[i]);
    y1 = Math.max(y1, edges[i + 1]);
  }
  return [x0, y0, x1, y1];
}
