import { Emitter } from "./events.js";

/**
 * @typedef {import("./protocol.js").TopicEntry} TopicEntry
 * @typedef {import("./protocol.js").MarksData} MarksData
 * @typedef {import("./protocol.js").GridData} GridData
 * @typedef {import("./protocol.js").PosePurpose} PosePurpose
 *
 * @typedef {object} CellGrid
 * @property {GridData} data
 * @property {Uint8Array} cells  255: unknown, 0: free, 100: occupied
 *
 * @typedef {object} ForeignTopicsEvents
 * @property {void} list  the topics or their states have changed
 * @property {void} demand  the user has selected other topics
 * @property {import("./protocol.js").TopicValuesMessage} values
 * @property {void} redraw
 */

/** Limits of what a page selects, below those of the server. */
export const MAX_SHOWN = 32;
export const MAX_INSPECTED = 16;
/** Character between a topic and the path of a number in its values. */
const SEPARATOR = ":";

/**
 * Returns the name of a plotted number.
 *
 * @param {string} topic
 * @param {string[]} path  names and indices
 */
export function seriesName(topic, path) {
  return `${topic}${SEPARATOR}${path.join("/")}`;
}

/**
 * Returns the numbers with given names in the values of a topic.
 *
 * @param {import("./protocol.js").TopicValuesMessage} message
 * @param {Iterable<string>} names  see `seriesName`
 */
export function numbersIn({ topic, value }, names) {
  /** @type {Record<string, number>} */
  const found = {};
  for (const name of names) {
    const [ofTopic, path] = name.split(SEPARATOR);
    if (ofTopic !== topic || path === undefined) continue;
    /** @type {unknown} */
    let part = value;
    for (const key of path.split("/")) {
      part = typeof part === "object" && part !== null ? Reflect.get(part, key) : undefined;
    }
    if (typeof part === "number" || typeof part === "boolean") found[name] = Number(part);
  }
  return found;
}

/**
 * Topics of other programs: those that exist, those that the user has selected, and their drawings.
 *
 * @extends {Emitter<ForeignTopicsEvents>}
 */
export class ForeignTopics extends Emitter {
  constructor() {
    super();
    /** Null in programs without such topics.
     * @type {TopicEntry[] | null} */
    this.entries = null;
    /** For each kind of pose the topics to which it can be sent, the default first.
     * @type {Record<PosePurpose, string[]>} */
    this.poseTopics = { goal: [], initial_pose: [] };
    /** Names of the topics that are drawn.
     * @type {Set<string>} */
    this.shown = new Set();
    /** Names of the topics whose values are displayed.
     * @type {Set<string>} */
    this.inspected = new Set();
    /** Names of the plotted numbers, see `seriesName`.
     * @type {string[]} */
    this.plotted = [];
    /** Whether a grid has the colours of a costmap, by the name of its topic.
     * @type {Map<string, boolean>} */
    this.costmaps = new Map();
    /** Lines, areas and texts by the id of the topic.
     * @type {Map<number, MarksData>} */
    this.marks = new Map();
    /** Grids by the id of the topic.
     * @type {Map<number, CellGrid>} */
    this.grids = new Map();
    /** Changes with everything that the grids look like. */
    this.gridsVersion = 0;
    /** The last grid of each topic that has arrived, also if it is still being decompressed.
     * @type {Map<number, GridData>} */
    this.latestGrids = new Map();
  }

  /**
   * Returns what the server is to send.
   *
   * @param {boolean} isListed  whether the world is displayed alone
   */
  demands(isListed) {
    return {
      topics: isListed ? [...this.shown] : null,
      topic_values: isListed
        ? [...new Set([...this.inspected, ...this.plotted.map((name) => name.split(SEPARATOR)[0])])]
        : [],
    };
  }

  /** Forgets what the server has sent, for a new connection; the selection of the user remains. */
  reset() {
    this.entries = null;
    this.clear();
    this.emit("list", undefined);
  }

  /** Removes all drawings; the server sends them again to a page that becomes visible. */
  clear() {
    this.marks.clear();
    this.grids.clear();
    this.latestGrids.clear();
    this.gridsVersion++;
  }

  /** @param {import("./protocol.js").TopicsMessage} message */
  receiveList({ topics, pose_topics }) {
    this.entries = topics;
    this.poseTopics = pose_topics;
    this.emit("list", undefined);
  }

  /** @param {import("./protocol.js").TopicValuesMessage} message */
  receiveValues(message) {
    this.emit("values", message);
  }

  /** @param {MarksData} data */
  receiveMarks(data) {
    if (!this.isShown(data.topic)) return;
    this.removeGrid(data.topic);
    this.marks.set(data.topic, data);
  }

  /** @param {GridData} data */
  async receiveGrid(data) {
    if (!this.isShown(data.topic)) return;
    this.latestGrids.set(data.topic, data);
    const cells = await inflate(data.compressed);
    // A newer grid, or none, may have replaced it in the meantime.
    if (this.latestGrids.get(data.topic) !== data || cells.length !== data.width * data.height) return;
    this.grids.set(data.topic, { data, cells });
    this.gridsVersion++;
    this.emit("redraw", undefined);
  }

  /** @param {number} id */
  removeGrid(id) {
    this.latestGrids.delete(id);
    if (this.grids.delete(id)) this.gridsVersion++;
  }

  /** @param {number} id  of a topic */
  entry(id) {
    return this.entries?.find((each) => each.id === id);
  }

  /** @param {number} id  of a topic */
  isShown(id) {
    return this.shown.has(this.entry(id)?.topic ?? "");
  }

  /**
   * Draws a topic, or removes its drawing.
   *
   * @param {string} topic
   * @param {boolean} isShown
   */
  show(topic, isShown) {
    if (isShown) this.shown.add(topic);
    else this.shown.delete(topic);
    const id = this.entries?.find((each) => each.topic === topic)?.id;
    if (!isShown && id !== undefined) {
      this.marks.delete(id);
      this.removeGrid(id);
    }
    this.emit("demand", undefined);
    this.emit("redraw", undefined);
  }

  /**
   * Displays the values of a topic.
   *
   * @param {string} topic
   * @param {boolean} isInspected
   */
  inspect(topic, isInspected) {
    if (isInspected) this.inspected.add(topic);
    else this.inspected.delete(topic);
    this.emit("demand", undefined);
  }

  /** @param {string[]} names  of the plotted numbers, also those of other sources */
  setPlotted(names) {
    this.plotted = names.filter((name) => name.includes(SEPARATOR));
    this.emit("demand", undefined);
  }

  /** @param {string} topic */
  isCostmap(topic) {
    return this.costmaps.get(topic) ?? topic.includes("costmap");
  }

  /**
   * @param {string} topic
   * @param {boolean} isCostmap  whether its grid has the colours of a costmap
   */
  setCostmap(topic, isCostmap) {
    this.costmaps.set(topic, isCostmap);
    this.gridsVersion++;
    this.emit("redraw", undefined);
  }

  /**
   * Returns the topic for a pose: that of the namespace of a model if there is one.
   *
   * @param {PosePurpose} purpose
   * @param {string} namespace  of the selected model; may be empty
   * @returns {string | null} null if the program publishes no poses
   */
  poseTopic(purpose, namespace) {
    const topics = this.poseTopics[purpose] ?? [];
    const prefix = `/${namespace.replace(/^\/|\/$/g, "")}/`;
    const own = prefix === "//" ? undefined : topics.find((topic) => topic.startsWith(prefix));
    return own ?? topics[0] ?? null;
  }
}

/**
 * Returns the contents of zlib data.
 *
 * @param {Uint8Array<ArrayBuffer>} compressed
 */
async function inflate(compressed) {
  const stream = new Blob([compressed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}
