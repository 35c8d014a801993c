/** Helpers for WebGL 2. */

/**
 * @typedef {object} Program
 * @property {WebGLProgram} handle
 * @property {(name: string) => WebGLUniformLocation | null} uniform
 */

/**
 * Returns the WebGL 2 context of a canvas.
 *
 * @param {HTMLCanvasElement} canvas
 * @returns {WebGL2RenderingContext | null} null if the browser does not support WebGL 2
 */
export function createContext(canvas) {
  return canvas.getContext("webgl2", {
    alpha: false,
    antialias: false,
    depth: false,
    stencil: false,
    powerPreference: "high-performance",
  });
}

/**
 * Returns a linked program.
 *
 * @param {WebGL2RenderingContext} gl
 * @param {string} vertex  source of the vertex shader
 * @param {string} fragment  source of the fragment shader
 * @param {string[]} attributes  names of the attributes, in the order of their locations
 * @returns {Program}
 */
export function createProgram(gl, vertex, fragment, attributes) {
  const handle = gl.createProgram();
  /** @type {[number, string][]} */
  const sources = [
    [gl.VERTEX_SHADER, vertex],
    [gl.FRAGMENT_SHADER, fragment],
  ];
  for (const [kind, source] of sources) {
    const shader = gl.createShader(kind);
    if (!shader) throw new Error("the browser cannot create a shader");
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(handle, shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
      throw new Error(`shader: ${gl.getShaderInfoLog(shader)}`);
    }
  }
  for (const [location, name] of attributes.entries()) gl.bindAttribLocation(handle, location, name);
  gl.linkProgram(handle);
  if (!gl.getProgramParameter(handle, gl.LINK_STATUS) && !gl.isContextLost()) {
    throw new Error(`shader program: ${gl.getProgramInfoLog(handle)}`);
  }
  /** @type {Map<string, WebGLUniformLocation | null>} */
  const locations = new Map();
  return {
    handle,
    uniform(name) {
      if (!locations.has(name)) locations.set(name, gl.getUniformLocation(handle, name));
      return locations.get(name) ?? null;
    },
  };
}

/**
 * Describes an attribute of a vertex array.
 *
 * @typedef {object} Attribute
 * @property {number} location
 * @property {number} size  number of components
 * @property {number} [type]  FLOAT by default
 * @property {boolean} [normalized]
 * @property {number} [offset]  [bytes]
 */

/**
 * Adds attributes of a buffer to a vertex array.
 *
 * @param {WebGL2RenderingContext} gl
 * @param {WebGLVertexArrayObject} array
 * @param {WebGLBuffer} buffer
 * @param {number} stride  [bytes]
 * @param {Attribute[]} attributes
 */
export function addAttributes(gl, array, buffer, stride, attributes) {
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  for (const { location, size, type = gl.FLOAT, normalized = false, offset = 0 } of attributes) {
    gl.enableVertexAttribArray(location);
    gl.vertexAttribPointer(location, size, type, normalized, stride, offset);
  }
  gl.bindVertexArray(null);
}

/**
 * Returns a texture without filtering, which is bound.
 *
 * @param {WebGL2RenderingContext} gl
 */
export function createNearestTexture(gl) {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
    gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
  }
  return texture;
}

/** Width of float textures [texels]. */
export const FLOAT_TEXTURE_WIDTH = 256;

/**
 * Replaces the contents of a float texture.
 *
 * @param {WebGL2RenderingContext} gl
 * @param {WebGLTexture} texture
 * @param {Float32Array} data  a multiple of FLOAT_TEXTURE_WIDTH texels
 */
export function uploadFloatTexture(gl, texture, data) {
  gl.bindTexture(gl.TEXTURE_2D, texture);
  const rows = data.length / (4 * FLOAT_TEXTURE_WIDTH);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, FLOAT_TEXTURE_WIDTH, rows, 0, gl.RGBA, gl.FLOAT, data);
}
