/**
 * Colours of the canvas, which follow the theme of the page. Components are in [0, 1].
 *
 * @typedef {[number, number, number]} Rgb
 * @typedef {[number, number, number, number]} Rgba
 *
 * @typedef {object} Palette
 * @property {boolean} dark
 * @property {Rgb} background
 * @property {Rgb} gaps  between the tiles of a grid of worlds
 * @property {Rgba} grid
 * @property {Rgba} gridAxis
 * @property {Rgb} ink
 * @property {Rgba} accent
 * @property {Rgba} warning
 * @property {Rgb[]} series  eight distinguishable colours
 */

const DARK_SERIES = ["#ff8a65", "#4dd0e1", "#ffd54f", "#ba9bff", "#81c784", "#f48fb1", "#64b5f6", "#dce775"];
const LIGHT_SERIES = ["#d84315", "#00838f", "#9a6700", "#6a3fc4", "#2e7d32", "#c2185b", "#1565c0", "#6b7a00"];

/**
 * @param {string} hex
 * @returns {Rgb}
 */
function rgb(hex) {
  const value = parseInt(hex.slice(1), 16);
  return [(value >> 16) / 255, ((value >> 8) & 255) / 255, (value & 255) / 255];
}

/**
 * Returns the colours of a theme.
 *
 * @param {boolean} dark
 * @returns {Palette}
 */
export function createPalette(dark) {
  return {
    dark,
    background: rgb(dark ? "#14181d" : "#f7f8fa"),
    gaps: rgb(dark ? "#0b0e11" : "#d5dae1"),
    grid: dark ? [1, 1, 1, 0.055] : [0, 0.05, 0.1, 0.07],
    gridAxis: dark ? [1, 1, 1, 0.16] : [0, 0.05, 0.1, 0.2],
    ink: rgb(dark ? "#e6eaf0" : "#1c232b"),
    accent: [...rgb(dark ? "#5aa9ff" : "#0b63ce"), 1],
    warning: [...rgb(dark ? "#ffb454" : "#a85b00"), 1],
    series: (dark ? DARK_SERIES : LIGHT_SERIES).map(rgb),
  };
}

/** Smallest difference of luminance between a line and the background. */
const CONTRAST = 0.38;

/** @param {ArrayLike<number>} color */
function luminance(color) {
  return 0.299 * color[0] + 0.587 * color[1] + 0.114 * color[2];
}

/**
 * Returns a colour of the world, made darker or lighter if it would be invisible on the background.
 *
 * @param {ArrayLike<number>} color  red, green, blue and optionally opacity
 * @param {Palette} palette
 * @returns {Rgba}
 */
export function readable(color, palette) {
  const own = luminance(color);
  const ground = luminance(palette.background);
  const alpha = Math.max(color[3] ?? 1, 0.35);
  if (Math.abs(own - ground) >= CONTRAST) return [color[0], color[1], color[2], alpha];
  if (palette.dark) {
    const share = Math.min(1, (ground + CONTRAST - own) / Math.max(1 - own, 1e-6) + 0.05);
    return [mix(color[0], 1, share), mix(color[1], 1, share), mix(color[2], 1, share), alpha];
  }
  const scale = Math.max(0, (ground - CONTRAST) / Math.max(own, 1e-6));
  return [color[0] * scale, color[1] * scale, color[2] * scale, alpha];
}

/**
 * @param {number} a
 * @param {number} b
 * @param {number} t
 */
function mix(a, b, t) {
  return a + (b - a) * t;
}

/**
 * Returns a colour as the style of a 2-D canvas.
 *
 * @param {ArrayLike<number>} color
 */
export function css(color) {
  const [r, g, b] = [color[0], color[1], color[2]].map((part) => Math.round(255 * part));
  return `rgb(${r} ${g} ${b} / ${color[3] ?? 1})`;
}
