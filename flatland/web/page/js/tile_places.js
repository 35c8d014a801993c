/** Space between the tiles of the grid of worlds [CSS pixels]. */
const GAP = 6;
/** Width of a tile divided by its height, approximately. */
const ASPECT = 1.3;

/** @typedef {{left: number, top: number, width: number, height: number}} Place  [CSS pixels] */

/**
 * Returns the places of tiles of the same size that fill an area.
 *
 * @param {number} count
 * @param {number} width  of the area [CSS pixels]
 * @param {number} height  [CSS pixels]
 * @returns {Place[]} by rows
 */
export function tilePlaces(count, width, height) {
  let best = { columns: 1, size: 0 };
  for (let columns = 1; columns <= count; columns++) {
    const size = Math.min(width / columns / ASPECT, height / Math.ceil(count / columns));
    if (size > best.size) best = { columns, size };
  }
  const rows = Math.ceil(count / best.columns);
  const tileWidth = (width - GAP * (best.columns + 1)) / best.columns;
  const tileHeight = (height - GAP * (rows + 1)) / rows;
  return Array.from({ length: count }, (_, i) => ({
    left: GAP + (i % best.columns) * (tileWidth + GAP),
    top: GAP + Math.floor(i / best.columns) * (tileHeight + GAP),
    width: Math.max(1, tileWidth),
    height: Math.max(1, tileHeight),
  }));
}
