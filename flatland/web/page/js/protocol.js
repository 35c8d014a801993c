/**
 * Messages of the subprotocol `flatland.1`, see docs/web_protocol.md.
 *
 * @typedef {import("./geometry.js").Point} Point
 * @typedef {import("./geometry.js").Pose} Pose
 * @typedef {import("./geometry.js").Bounds} Bounds
 *
 * @typedef {null | boolean | number | string | Json[] | {[key: string]: Json}} Json
 *
 * @typedef {{kind: "circle", center: Point, radius: number}} CircleShape
 * @typedef {{kind: "polygon" | "edges", points: Point[]}} LineShape
 * @typedef {CircleShape | LineShape} Shape
 *
 * @typedef {{id: number, name: string, color: number[], shapes: Shape[]}} BodyInfo
 * @typedef {{id: number, topic: string, body: number, origin: Pose, angle_min: number,
 *   angle_increment: number, count: number, range_max: number}} LaserInfo
 * @typedef {{name: string, color: number[], bodies: [number, number],
 *   anchors: [Point, Point]}} JointInfo  anchors in the frames of the two bodies
 * @typedef {{id: number, name: string, file: string | null, namespace?: string, bodies: BodyInfo[], lasers: LaserInfo[],
 *   joints: JointInfo[], commands: string[]}} ModelInfo
 * @typedef {{name: string, color: number[], edges: number}} LayerInfo
 * @typedef {{label: string, path: string}} ModelFile
 * @typedef {{parent: string, child: string, pose: Pose}} FrameInfo
 * @typedef {{topic: string, type: string, time: number | null, value: Json, kind: string}} TopicValue
 * @typedef {{name: string, type: string, parameters: Record<string, Json>}} PluginInfo
 * @typedef {{color: number[], pose: Pose, shapes: Shape[]}} PreviewBody
 * @typedef {"info" | "warning" | "error"} Level  of a notice
 *
 * Text messages of the server:
 *
 * @typedef {{type: "hello", title: string, read_only: boolean,
 *   worlds: {world: number, name: string}[]}} HelloMessage
 * @typedef {{type: "world", world: number, name: string, bounds: Bounds | null, step_size: number,
 *   layers: LayerInfo[]}} WorldMessage
 * @typedef {{type: "models", world: number, complete: boolean, models: ModelInfo[],
 *   removed: number[]}} ModelsMessage
 * @typedef {{type: "status", world: number, time: number, paused: boolean, rate: number | null,
 *   real_time_factor: number | null, stale: number}} StatusMessage
 * @typedef {{type: "details", world: number, model: number, velocity: [number, number, number] | null,
 *   mass: number, inertia: number, contacts: string[], plugins: PluginInfo[],
 *   topics: TopicValue[]}} DetailsMessage
 * @typedef {{type: "values", world: number, time: number, series: Record<string, number>}} ValuesMessage
 * @typedef {{type: "frames", world: number, frames: FrameInfo[]}} FramesMessage
 * @typedef {{moment: number, time: number, label: string}} Moment
 * @typedef {{type: "history", world: number, moments: Moment[], current: number | null,
 *   obstacle: string}} HistoryMessage
 * @typedef {"goal" | "initial_pose"} PosePurpose
 * @typedef {{id: number, topic: string, type: string, drawn_as: "marks" | "grid" | null,
 *   status: string}} TopicEntry
 * @typedef {{type: "topics", world: number, topics: TopicEntry[],
 *   pose_topics: Record<PosePurpose, string[]>}} TopicsMessage
 * @typedef {{type: "topic_values", world: number, topic: string, time: number,
 *   value: Json}} TopicValuesMessage
 * @typedef {{type: "gone", world: number}} GoneMessage
 * @typedef {{type: "notice", level: Level, text: string}} NoticeMessage
 * @typedef {{type: "reply", id: number, ok: true, result: unknown}
 *   | {type: "reply", id: number, ok: false, error: string}} ReplyMessage
 * @typedef {WorldMessage | ModelsMessage | StatusMessage | DetailsMessage | ValuesMessage
 *   | FramesMessage | HistoryMessage | TopicsMessage | TopicValuesMessage | GoneMessage} MessageOfWorld
 * @typedef {HelloMessage | NoticeMessage | MessageOfWorld} StateMessage
 *
 * Binary messages of the server:
 *
 * @typedef {{kind: "edges", world: number, time: number, layer: number,
 *   edges: Float32Array}} EdgesData  four numbers for each edge
 * @typedef {{kind: "poses", world: number, time: number, ids: Uint32Array | null,
 *   poses: Float32Array}} PosesData  three numbers for each body; without ids, the bodies are those
 *   of the previous poses
 * @typedef {{id: number, pose: Pose, ranges: Float32Array}} Scan
 * @typedef {{kind: "scans", world: number, time: number, scans: Scan[]}} ScansData
 *
 * @typedef {{kind: "marks", world: number, time: number, topic: number, lines: Float32Array,
 *   lineColors: Uint32Array, triangles: Float32Array, triangleColors: Uint32Array,
 *   texts: [number, number, string][]}} MarksData  five numbers for each line, six for each triangle
 * @typedef {{kind: "grid", world: number, time: number, topic: number, width: number, height: number,
 *   pose: Pose, resolution: number, compressed: Uint8Array<ArrayBuffer>}} GridData
 *
 * @typedef {{worlds: number[], scans: boolean, compact_scans: boolean, frames: boolean, history: boolean,
 *   inspect: number | null, series: string[], topics: string[] | null, topic_values: string[],
 *   hidden: boolean}} Demands  fields of `look`
 *
 * The requests of the page by type, with their fields and results.
 *
 * @typedef {object} Requests
 * @property {{fields: Demands, result: unknown}} look
 * @property {{fields: object, result: unknown}} pause
 * @property {{fields: object, result: unknown}} resume
 * @property {{fields: {n: number}, result: unknown}} step
 * @property {{fields: {rate: number}, result: unknown}} set_rate
 * @property {{fields: {model: number, pose: Pose}, result: {overlap?: string}}} move
 * @property {{fields: {model: number}, result: unknown}} hold
 * @property {{fields: {model: number}, result: unknown}} release
 * @property {{fields: {file: string, name: string, pose: Pose, namespace: string}, result: unknown}} spawn
 * @property {{fields: {file: string}, result: {bodies: PreviewBody[]}}} preview
 * @property {{fields: {model: number}, result: {can_undo: boolean}}} delete
 * @property {{fields: object, result: {text: string, effect: string}}} undo
 * @property {{fields: object, result: {text: string, effect: string}}} redo
 * @property {{fields: object, result: {can_undo: boolean, effect: string}}} reset
 * @property {{fields: object, result: {text: string, name: string, folder: string, notes: string[]}}} save
 * @property {{fields: {moment: number}, result: {effect?: string, superseded?: boolean}}} visit
 * @property {{fields: {model: number, command: string, linear: Point, angular: number},
 *   result: unknown}} drive
 * @property {{fields: object, result: ModelFile[]}} files
 * @property {{fields: object, result: string[]}} describe_series
 * @property {{fields: {purpose: PosePurpose, topic: string, pose: Pose},
 *   result: {received?: boolean}}} publish_pose
 */

/** Name of the WebSocket subprotocol. */
export const SUBPROTOCOL = "flatland.1";
/** Code that closes a connection without a valid token. */
export const WRONG_TOKEN = 4401;

const BINARY_VERSION = 1;
const HEADER_SIZE = 16;

/**
 * Returns the content of a binary message. The arrays are views of the buffer.
 *
 * @param {ArrayBuffer} buffer
 * @returns {EdgesData | PosesData | ScansData | MarksData | GridData | null} null for an unknown kind
 * @throws {RangeError} if the message is shorter than its counts state
 * @throws {Error} if the version of the message is not supported
 */
export function decodeBinary(buffer) {
  const view = new DataView(buffer);
  const kind = view.getUint8(0);
  const version = view.getUint8(1);
  if (version !== BINARY_VERSION) throw new Error(`unsupported version ${version} of a binary message`);
  const header = {
    world: view.getUint16(2, true),
    time: view.getFloat64(8, true),
  };
  const first = view.getUint32(HEADER_SIZE, true);
  const start = HEADER_SIZE + 4;
  if (kind === 1) {
    const count = view.getUint32(start, true);
    return { kind: "edges", ...header, layer: first, edges: new Float32Array(buffer, start + 4, 4 * count) };
  }
  if (kind === 2) {
    return {
      kind: "poses",
      ...header,
      ids: new Uint32Array(buffer, start, first),
      poses: new Float32Array(buffer, start + 4 * first, 3 * first),
    };
  }
  if (kind === 3 || kind === 5) {
    return { kind: "scans", ...header, scans: decodeScans(view, start, first, kind === 5) };
  }
  if (kind === 4)
    return { kind: "poses", ...header, ids: null, poses: new Float32Array(buffer, start, 3 * first) };
  if (kind === 6) return { kind: "marks", ...header, topic: first, ...decodeMarks(view, start) };
  if (kind === 7) return { kind: "grid", ...header, topic: first, ...decodeGrid(view, start) };
  return null;
}

/**
 * @param {DataView} view
 * @param {number} offset
 * @param {number} groups
 * @param {boolean} isCompact  whether each group states the size of its ranges
 */
function decodeScans(view, offset, groups, isCompact) {
  const { buffer } = view;
  /** @type {Scan[]} */
  const scans = [];
  for (let group = 0; group < groups; group++) {
    const count = view.getUint32(offset, true);
    const beams = view.getUint32(offset + 4, true);
    const bits = isCompact ? view.getUint32(offset + 8, true) : 32;
    offset += isCompact ? 12 : 8;
    const ids = new Uint32Array(buffer, offset, count);
    offset += 4 * count;
    const poses = new Float32Array(buffer, offset, 3 * count);
    offset += 12 * count;
    let ranges;
    if (bits === 16) {
      const resolutions = new Float32Array(buffer, offset, count);
      offset += 4 * count;
      ranges = decodeRanges(new Uint16Array(buffer, offset, beams * count), resolutions, beams);
      offset += 4 * Math.ceil((beams * count) / 2);
    } else if (bits === 32) {
      ranges = new Float32Array(buffer, offset, beams * count);
      offset += 4 * beams * count;
    } else throw new Error(`unsupported ranges of ${bits} bits`);
    for (let i = 0; i < count; i++) {
      scans.push({
        id: ids[i],
        pose: [poses[3 * i], poses[3 * i + 1], poses[3 * i + 2]],
        ranges: ranges.subarray(beams * i, beams * (i + 1)),
      });
    }
  }
  return scans;
}

/** Codes of ranges that are no multiples of the resolution. */
const NO_HIT = 65_535;
const TOO_CLOSE = 65_534;

/**
 * Returns the ranges of codes [m].
 *
 * @param {Uint16Array} codes
 * @param {Float32Array} resolutions  of the scans [m]
 * @param {number} beams  of each scan
 */
function decodeRanges(codes, resolutions, beams) {
  const ranges = new Float32Array(codes.length);
  for (let i = 0; i < codes.length; i++) {
    const code = codes[i];
    if (code === NO_HIT) ranges[i] = NaN;
    else if (code === TOO_CLOSE) ranges[i] = -Infinity;
    else ranges[i] = code * resolutions[Math.floor(i / beams)];
  }
  return ranges;
}

/**
 * @param {DataView} view
 * @param {number} offset
 */
function decodeMarks(view, offset) {
  const { buffer } = view;
  const lineCount = view.getUint32(offset, true);
  const triangleCount = view.getUint32(offset + 4, true);
  const textSize = view.getUint32(offset + 8, true);
  offset += 12;
  const lines = new Float32Array(buffer, offset, 5 * lineCount);
  offset += lines.byteLength;
  const triangles = new Float32Array(buffer, offset, 6 * triangleCount);
  offset += triangles.byteLength;
  const lineColors = new Uint32Array(buffer, offset, lineCount);
  offset += lineColors.byteLength;
  const triangleColors = new Uint32Array(buffer, offset, triangleCount);
  offset += triangleColors.byteLength;
  const text = new TextDecoder().decode(new Uint8Array(buffer, offset, textSize));
  /** @type {[number, number, string][]} */
  const texts = text ? JSON.parse(text) : [];
  return { lines, lineColors, triangles, triangleColors, texts };
}

/**
 * @param {DataView} view
 * @param {number} offset
 */
function decodeGrid(view, offset) {
  /** @type {(index: number) => number} */
  const number = (index) => view.getFloat32(offset + 8 + 4 * index, true);
  /** @type {Pose} */
  const pose = [number(0), number(1), number(2)];
  return {
    width: view.getUint32(offset, true),
    height: view.getUint32(offset + 4, true),
    pose,
    resolution: number(3),
    // The view is of an ArrayBuffer, which the type of the property `buffer` does not state.
    compressed: new Uint8Array(/** @type {ArrayBuffer} */ (view.buffer), offset + 24),
  };
}
