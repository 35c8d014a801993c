import { Emitter } from "./events.js";
import { ForeignTopics } from "./foreign_topics.js";
import { WorldState } from "./world_state.js";

/**
 * @typedef {"layers" | "models" | "scans" | "frames" | "names" | "trails"} Display
 * @typedef {import("./protocol.js").Requests} Requests
 *
 * @typedef {object} SessionEvents
 * @property {void} hello  the server has sent the list of worlds
 * @property {WorldState} world  a world has been replaced
 * @property {WorldState} models  models have been added, removed or changed
 * @property {WorldState} status
 * @property {void} current  another world, or all worlds, are displayed
 * @property {void} selection
 * @property {void} displays
 * @property {void} redraw  something that is displayed has changed
 * @property {import("./protocol.js").DetailsMessage} details
 * @property {import("./protocol.js").ValuesMessage} values
 * @property {WorldState} history  the earlier states of a world have changed
 * @property {void} outdated  the edit of the last notice cannot be undone, or is not the last one
 * @property {{level: import("./protocol.js").Level, text: string, topic: string,
 *   action?: NoticeAction}} notice  replaces those of its topic
 *
 * @typedef {{text: string, run: () => void}} NoticeAction  a button of a notice
 */

/** @type {Display[]} */
export const DISPLAYS = ["layers", "models", "scans", "frames", "names", "trails"];

/**
 * Returns the text of an error for users.
 *
 * @param {unknown} error
 */
export function errorText(error) {
  return error instanceof Error ? error.message : String(error);
}

/**
 * The worlds of the server, and the view and selection of the user.
 *
 * @extends {Emitter<SessionEvents>}
 */
export class Session extends Emitter {
  /** @param {import("./connection.js").Connection} connection */
  constructor(connection) {
    super();
    this.connection = connection;
    this.title = "flatland";
    this.readOnly = false;
    /** @type {Map<number, WorldState>} */
    this.worlds = new Map();
    /** Index of the displayed world, null for the grid of all worlds.
     * @type {number | null} */
    this.currentIndex = null;
    /** Name of the selected model of the displayed world.
     * @type {string | null} */
    this.selectedName = null;
    /** @type {Record<Display, boolean>} */
    this.displays = { layers: true, models: true, scans: true, frames: false, names: true, trails: false };
    /** @type {Set<string>} */
    this.series = new Set();
    this.topics = new ForeignTopics();
    this.hidden = document.hidden;
    this.ready = false;
    this.lookScheduled = false;
    connection.on("message", (message) => this.receive(message));
    connection.on("data", (data) => this.receiveData(data));
    connection.on("state", (state) => {
      if (state !== "connected") this.ready = false;
      this.emit("redraw", undefined);
    });
    this.topics.on("demand", () => this.look());
    this.topics.on("redraw", () => this.emit("redraw", undefined));
  }

  /** The displayed world, null for the grid. */
  get world() {
    return this.currentIndex === null ? null : (this.worlds.get(this.currentIndex) ?? null);
  }

  /** The selected model, null if there is none. */
  get selected() {
    return this.selectedName === null ? null : (this.world?.modelByName(this.selectedName) ?? null);
  }

  /**
   * Sends a request about the displayed world.
   *
   * @template {keyof Requests} Type
   * @param {Type} type
   * @param {Requests[Type]["fields"] & {world?: number}} fields
   */
  request(type, fields) {
    return this.connection.request(type, { world: this.currentIndex ?? 0, ...fields });
  }

  /**
   * Sends a request about the displayed world and shows its error as a notice.
   *
   * @template {keyof Requests} Type
   * @param {Type} type
   * @param {Requests[Type]["fields"] & {world?: number}} fields
   * @returns {Promise<{result: Requests[Type]["result"]} | null>} null after an error
   */
  async attempt(type, fields) {
    try {
      return { result: await this.request(type, fields) };
    } catch (error) {
      this.notify("error", errorText(error));
      return null;
    }
  }

  /**
   * Moves a model, and reports what it overlaps at its new pose.
   *
   * @param {number} model  id
   * @param {import("./geometry.js").Pose} pose
   */
  async move(model, pose) {
    const name = this.world?.models.get(model)?.name;
    const answer = await this.attempt("move", { model, pose });
    if (answer) this.emit("outdated", undefined);
    const overlap = answer?.result?.overlap;
    if (overlap) this.notify("warning", `Model "${name}" ${overlap}; the physics separates them`, "overlap");
  }

  /**
   * @param {import("./protocol.js").Level} level
   * @param {string} text
   * @param {string} [topic]  earlier notices of the same topic are removed
   * @param {NoticeAction} [action]
   */
  notify(level, text, topic = text, action = undefined) {
    this.emit("notice", { level, text, topic, ...(action && { action }) });
  }

  /**
   * Reports what a time that was set back does to other programs.
   *
   * @param {string | undefined} effect  empty for nothing
   */
  notifySetBack(effect) {
    if (effect) this.notify("warning", effect, "set back");
  }

  /**
   * Displays a world, or the grid of all worlds.
   *
   * @param {number | null} index
   */
  show(index) {
    if (index === this.currentIndex) return;
    // The address may contain the name of a model before the server has listed the worlds.
    if (this.currentIndex !== null) this.selectedName = null;
    this.currentIndex = index;
    this.emit("current", undefined);
    this.emit("selection", undefined);
    this.look();
  }

  /** @param {string | null} name  name of a model */
  select(name) {
    if (name === this.selectedName) return;
    this.selectedName = name;
    this.emit("selection", undefined);
    this.emit("redraw", undefined);
    this.look();
  }

  /**
   * @param {Display} display
   * @param {boolean} shown
   */
  setDisplay(display, shown) {
    this.displays[display] = shown;
    this.emit("displays", undefined);
    this.emit("redraw", undefined);
    this.look();
  }

  /** @param {string[]} names  numbers to plot */
  setSeries(names) {
    this.series = new Set(names);
    this.look();
  }

  /** @param {boolean} hidden  whether the page is in the background */
  setHidden(hidden) {
    this.hidden = hidden;
    if (hidden) this.topics.clear();
    if (!hidden) this.connection.probe("look", this.demands());
    else if (this.ready) this.connection.request("look", this.demands()).catch(() => {});
  }

  /** Sends the request `look` to the server, once for all changes of a task. */
  look() {
    if (this.lookScheduled) return;
    this.lookScheduled = true;
    queueMicrotask(() => {
      this.lookScheduled = false;
      if (!this.ready) return;
      this.connection.request("look", this.demands()).catch((error) => {
        if (this.ready) this.notify("error", error.message);
      });
    });
  }

  /** @returns {import("./protocol.js").Demands} */
  demands() {
    const shown = this.world ? [this.world] : [...this.worlds.values()];
    return {
      worlds: shown.map((world) => world.index),
      scans: this.displays.scans,
      // The resolution of at most 1 mm is that of a pixel at 1000 pixels per metre.
      compact_scans: true,
      frames: this.displays.frames && this.world !== null,
      history: this.world !== null && !this.readOnly,
      inspect: this.selected?.id ?? null,
      series: this.world ? [...this.series] : [],
      ...this.topics.demands(this.world !== null),
      hidden: this.hidden,
    };
  }

  /** @param {import("./protocol.js").StateMessage} message */
  receive(message) {
    if (message.type === "hello") this.applyHello(message);
    else if (message.type === "notice") this.notify(message.level, message.text);
    else {
      const world = this.worlds.get(message.world);
      if (world) this.receiveWorld(world, message);
    }
  }

  /** @param {import("./protocol.js").HelloMessage} message */
  applyHello(message) {
    this.title = message.title;
    this.readOnly = message.read_only;
    // The first message of a connection: ids of an earlier connection are invalid.
    const before = this.ready ? this.worlds : new Map();
    if (!this.ready) this.topics.reset();
    this.ready = true;
    this.worlds = new Map();
    for (const { world, name } of message.worlds) {
      this.worlds.set(world, before.get(world) ?? new WorldState(world, name));
    }
    this.showExisting();
    this.emit("hello", undefined);
    this.look();
  }

  /** Displays the only world, or all worlds if the displayed world does not exist any more. */
  showExisting() {
    const present = [...this.worlds.keys()];
    if (present.length === 1) this.show(present[0]);
    else if (this.currentIndex !== null && !this.worlds.has(this.currentIndex)) this.show(null);
  }

  /** @param {WorldState} world */
  removeWorld(world) {
    this.worlds.delete(world.index);
    this.showExisting();
    this.emit("hello", undefined);
  }

  /**
   * @param {WorldState} world
   * @param {import("./protocol.js").MessageOfWorld} message
   */
  receiveWorld(world, message) {
    switch (message.type) {
      case "world":
        world.applyWorld(message);
        this.emit("world", world);
        break;
      case "models": {
        const inspected = this.selected?.id;
        world.applyModels(message);
        if (world === this.world && this.selected?.id !== inspected) {
          this.emit("selection", undefined);
          this.look();
        }
        this.emit("models", world);
        break;
      }
      case "status":
        world.status = message;
        this.emit("status", world);
        return;
      case "history":
        world.history = message;
        this.emit("history", world);
        return;
      case "frames":
        world.frames = message.frames;
        break;
      case "details":
        if (world === this.world) this.emit("details", message);
        return;
      case "values":
        if (world === this.world) this.emit("values", message);
        return;
      case "topics":
        this.topics.receiveList(message);
        return;
      case "topic_values":
        this.topics.receiveValues(message);
        return;
      case "gone":
        this.removeWorld(world);
        break;
      default:
        return;
    }
    this.emit("redraw", undefined);
  }

  /** @param {import("./connection.js").ConnectionEvents["data"]} data */
  receiveData(data) {
    const world = this.worlds.get(data.world);
    if (!world?.present) return;
    if (data.kind === "edges") world.applyEdges(data);
    else if (data.kind === "poses") world.applyPoses(data);
    else if (data.kind === "marks") this.topics.receiveMarks(data);
    else if (data.kind === "grid") this.topics.receiveGrid(data);
    else world.applyScans(data);
    this.emit("redraw", undefined);
  }
}
