/** Vertices of a quad. Its two triangles have six indices. */
const CORNERS = 4;
const INDICES = [0, 1, 2, 2, 1, 3];
const INITIAL_CAPACITY = 1024;

/**
 * Draws buffers of quads. The four vertices of a quad have the same record of data; the shader
 * distinguishes the vertices by their index. Unlike instances of four vertices, this is fast on all
 * drivers.
 */
export class Quads {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.gl = gl;
    this.buffer = gl.createBuffer();
    this.capacity = 0;
    this.reserve(INITIAL_CAPACITY);
  }

  /** @param {number} count  number of quads */
  reserve(count) {
    if (count <= this.capacity) return;
    const { gl } = this;
    this.capacity = Math.max(count, 2 * this.capacity);
    const indices = new Uint32Array(INDICES.length * this.capacity);
    for (let i = 0; i < indices.length; i++) {
      indices[i] = CORNERS * Math.floor(i / INDICES.length) + INDICES[i % INDICES.length];
    }
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
  }

  /**
   * Adds the indices to a vertex array.
   *
   * @param {WebGLVertexArrayObject} array
   */
  attach(array) {
    const { gl } = this;
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffer);
    gl.bindVertexArray(null);
  }

  /**
   * Draws consecutive quads with the active program.
   *
   * @param {WebGLVertexArrayObject} array
   * @param {number} start  index of the first quad
   * @param {number} count
   */
  draw(array, start, count) {
    const { gl } = this;
    this.reserve(start + count);
    gl.bindVertexArray(array);
    gl.drawElements(gl.TRIANGLES, INDICES.length * count, gl.UNSIGNED_INT, 4 * INDICES.length * start);
  }
}

/**
 * Returns the records of the vertices of quads: each record four times.
 *
 * @param {Float32Array} records
 * @param {number} size  words of a record
 */
export function forCorners(records, size) {
  // Copied as integers, because records also contain colours.
  const words = new Uint32Array(records.buffer, records.byteOffset, records.length);
  const copies = new Uint32Array(CORNERS * words.length);
  for (let i = 0; i < words.length; i += size) {
    const record = words.subarray(i, i + size);
    for (let corner = 0; corner < CORNERS; corner++) copies.set(record, CORNERS * i + corner * size);
  }
  return copies;
}
