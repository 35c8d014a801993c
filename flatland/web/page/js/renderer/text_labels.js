import { addAttributes, createProgram } from "./gl.js";
import { textFragment, textVertex } from "./shaders.js";
import { useProgram } from "./view.js";

const FONT_SIZE = 12.5;
const ATLAS_SIZE = 1024;
/** Words of a glyph: anchor, box, texels. */
const GLYPH_WORDS = 10;
/** Space around a glyph for its halo [CSS pixels]. */
const HALO = 2;

/** @typedef {{x: number, y: number, width: number, height: number, advance: number}} Glyph */

/** Text at points of the world. Glyphs are drawn once into an atlas; a frame is two draw calls. */
export class TextLabels {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.gl = gl;
    this.program = createProgram(gl, textVertex, textFragment, ["a_anchor", "a_box", "a_texels"]);
    this.texture = gl.createTexture();
    this.buffer = gl.createBuffer();
    this.array = gl.createVertexArray();
    addAttributes(gl, this.array, this.buffer, 4 * GLYPH_WORDS, 1, [
      { location: 0, size: 2 },
      { location: 1, size: 4, offset: 8 },
      { location: 2, size: 4, offset: 24 },
    ]);
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = ATLAS_SIZE;
    this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    /** @type {Map<string, Glyph>} */
    this.glyphs = new Map();
    this.ratio = 0;
    this.penX = 0;
    this.penY = 0;
    this.isChanged = false;
    /** @type {number[]} */
    this.words = [];
  }

  /**
   * Starts the labels of a frame.
   *
   * @param {number} ratio  device pixels per CSS pixel
   */
  begin(ratio) {
    this.words.length = 0;
    if (this.ratio === ratio) return;
    this.ratio = ratio;
    this.glyphs.clear();
    this.penX = this.penY = 0;
    this.context.clearRect(0, 0, ATLAS_SIZE, ATLAS_SIZE);
    this.context.font = `500 ${FONT_SIZE * ratio}px system-ui, sans-serif`;
    this.context.textBaseline = "middle";
    this.context.lineJoin = "round";
    this.context.lineWidth = 3 * ratio;
    this.isChanged = true;
  }

  /** @param {string} character */
  glyph(character) {
    const known = this.glyphs.get(character);
    if (known) return known;
    const { context, ratio } = this;
    const advance = context.measureText(character).width;
    const width = Math.ceil(advance + 2 * HALO * ratio);
    const height = Math.ceil(FONT_SIZE * 1.6 * ratio);
    if (this.penX + width > ATLAS_SIZE) {
      this.penX = 0;
      this.penY += height + 1;
    }
    if (this.penY + height > ATLAS_SIZE) return null;
    const [x, y] = [this.penX, this.penY];
    context.globalCompositeOperation = "lighter";
    context.strokeStyle = "#0f0";
    context.strokeText(character, x + HALO * ratio, y + height / 2);
    context.fillStyle = "#f00";
    context.fillText(character, x + HALO * ratio, y + height / 2);
    this.penX += width + 1;
    this.isChanged = true;
    const made = { x, y, width, height, advance };
    this.glyphs.set(character, made);
    return made;
  }

  /**
   * Returns the width of a line of text [CSS pixels].
   *
   * @param {string} text
   */
  width(text) {
    let sum = 0;
    for (const character of text) sum += this.glyph(character)?.advance ?? 0;
    return sum / this.ratio;
  }

  /**
   * Adds a line of text whose centre is above or below a point.
   *
   * @param {string} text
   * @param {number} x  [m]
   * @param {number} y  [m]
   * @param {number} dy  distance of the centre from the point, positive: below [CSS pixels]
   */
  add(text, x, y, dy) {
    const glyphs = [...text].map((character) => this.glyph(character) ?? this.glyphs.get("?"));
    const total = glyphs.reduce((sum, glyph) => sum + (glyph?.advance ?? 0), 0);
    let left = Math.round(-total / 2 - HALO * this.ratio);
    let exact = left;
    for (const glyph of glyphs) {
      if (!glyph) continue;
      const top = Math.round(dy * this.ratio - glyph.height / 2);
      left = Math.round(exact);
      this.words.push(
        x,
        y,
        left,
        top,
        glyph.width,
        glyph.height,
        glyph.x,
        glyph.y,
        glyph.width,
        glyph.height,
      );
      exact += glyph.advance;
    }
  }

  /**
   * Draws the labels of the frame.
   *
   * @param {import("./view.js").Viewport} viewport
   * @param {import("./palette.js").Palette} palette
   */
  draw(viewport, palette) {
    if (this.words.length === 0) return;
    const { gl, program } = this;
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    if (this.isChanged) {
      this.isChanged = false;
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, this.context.canvas);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(this.words), gl.STREAM_DRAW);
    useProgram(gl, program, viewport);
    gl.uniform2f(program.uniform("u_atlasSize"), ATLAS_SIZE, ATLAS_SIZE);
    gl.bindVertexArray(this.array);
    // All halos first, so that none covers a neighbouring glyph.
    gl.uniform3fv(program.uniform("u_color"), palette.background);
    gl.uniform2f(program.uniform("u_channels"), 0.8, 0.8);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, this.words.length / GLYPH_WORDS);
    gl.uniform3fv(program.uniform("u_color"), palette.ink);
    gl.uniform2f(program.uniform("u_channels"), 1, 0);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, this.words.length / GLYPH_WORDS);
  }
}
