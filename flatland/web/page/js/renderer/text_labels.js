import { context2d } from "../dom.js";
import { addAttributes, createNearestTexture, createProgram } from "./gl.js";
import { forCorners } from "./quads.js";
import { textFragment, textVertex } from "./shaders.js";
import { useProgram } from "./view.js";

const FONT_SIZE = 12.5;
const ATLAS_SIZE = 2048;
/** Words of a label: anchor, box, texel. */
const LABEL_WORDS = 8;
/** Space around a text for its halo [CSS pixels]. */
const HALO = 2;

/** @typedef {{x: number, y: number, width: number, height: number}} Sprite  [texels] */

/** Text at points of the world. A text is drawn once into an atlas; a frame is one draw call. */
export class TextLabels {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {import("./quads.js").Quads} quads
   */
  constructor(gl, quads) {
    this.gl = gl;
    this.quads = quads;
    this.program = createProgram(gl, textVertex, textFragment, ["a_anchor", "a_box", "a_texel"]);
    this.texture = createNearestTexture(gl);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, ATLAS_SIZE, ATLAS_SIZE);
    this.buffer = gl.createBuffer();
    this.array = gl.createVertexArray();
    addAttributes(gl, this.array, this.buffer, 4 * LABEL_WORDS, [
      { location: 0, size: 2 },
      { location: 1, size: 4, offset: 8 },
      { location: 2, size: 2, offset: 24 },
    ]);
    quads.attach(this.array);
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = ATLAS_SIZE;
    this.context = context2d(canvas, { willReadFrequently: true });
    /** @type {Map<string, Sprite>} */
    this.sprites = new Map();
    this.ratio = 0;
    this.penX = 0;
    this.penY = 0;
    this.isFull = false;
    /** Rows of the atlas that the texture does not contain yet. */
    this.changed = { from: ATLAS_SIZE, to: 0 };
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
    if (this.ratio === ratio && !this.isFull) return;
    this.ratio = ratio;
    this.isFull = false;
    this.sprites.clear();
    this.penX = this.penY = 0;
    this.context.clearRect(0, 0, ATLAS_SIZE, ATLAS_SIZE);
    this.context.font = `500 ${FONT_SIZE * ratio}px system-ui, sans-serif`;
    this.context.textBaseline = "middle";
    this.context.lineJoin = "round";
    this.context.lineWidth = 3 * ratio;
    this.context.globalCompositeOperation = "lighter";
  }

  /**
   * Returns the picture of a text.
   *
   * @param {string} text
   * @returns {Sprite | null} null if the atlas is full; the atlas is emptied before the next frame
   */
  sprite(text) {
    const known = this.sprites.get(text);
    if (known) return known;
    const { context, ratio, changed } = this;
    const height = Math.ceil(FONT_SIZE * 1.6 * ratio);
    const full = Math.ceil(context.measureText(text).width + 2 * HALO * ratio);
    const width = Math.min(full, ATLAS_SIZE);
    if (this.penX + width > ATLAS_SIZE) {
      this.penX = 0;
      this.penY += height;
    }
    this.isFull = this.penY + height > ATLAS_SIZE;
    if (this.isFull) return null;
    const made = { x: this.penX, y: this.penY, width, height };
    const [x, y] = [made.x + HALO * ratio, made.y + height / 2];
    context.strokeStyle = "#0f0";
    context.strokeText(text, x, y);
    context.fillStyle = "#f00";
    context.fillText(text, x, y);
    this.penX += width;
    changed.from = Math.min(changed.from, made.y);
    changed.to = Math.max(changed.to, made.y + height);
    this.sprites.set(text, made);
    return made;
  }

  /**
   * Returns the width of a line of text [CSS pixels].
   *
   * @param {string} text
   */
  width(text) {
    return (this.sprite(text)?.width ?? 0) / this.ratio - 2 * HALO;
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
    const sprite = this.sprite(text);
    if (!sprite) return;
    const { width, height } = sprite;
    const left = Math.round(-width / 2);
    const top = Math.round(dy * this.ratio - height / 2);
    this.words.push(x, y, left, top, width, height, sprite.x, sprite.y);
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
    this.upload();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    const labels = forCorners(new Float32Array(this.words), LABEL_WORDS);
    gl.bufferData(gl.ARRAY_BUFFER, labels, gl.STREAM_DRAW);
    useProgram(gl, program, viewport);
    gl.uniform1f(program.uniform("u_atlasSize"), ATLAS_SIZE);
    gl.uniform3fv(program.uniform("u_ink"), palette.ink);
    gl.uniform3fv(program.uniform("u_halo"), palette.background);
    this.quads.draw(this.array, 0, this.words.length / LABEL_WORDS);
  }

  /** Copies changed rows of the atlas to the texture. */
  upload() {
    const { gl, context, changed } = this;
    const rows = changed.to - changed.from;
    if (rows <= 0) return;
    const image = context.getImageData(0, changed.from, ATLAS_SIZE, rows);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, changed.from, gl.RGBA, gl.UNSIGNED_BYTE, image);
    this.changed = { from: ATLAS_SIZE, to: 0 };
  }
}
