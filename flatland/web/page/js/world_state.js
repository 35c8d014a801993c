import { shapesRadius } from "./shapes.js";
import { Trails } from "./trails.js";

/**
 * @typedef {import("./protocol.js").Pose} Pose
 * @typedef {import("./protocol.js").Bounds} Bounds
 * @typedef {import("./protocol.js").Shape} Shape
 *
 * @typedef {object} Layer
 * @property {string} name
 * @property {number[]} color
 * @property {boolean} visible
 * @property {Float32Array | null} edges  four numbers for each edge [m]
 *
 * @typedef {object} Body
 * @property {number} id
 * @property {number[]} color
 * @property {Shape[]} shapes
 * @property {number} slot  index of the pose in `WorldState.poses`
 * @property {Model} model
 * @property {number} radius  radius of the circle around the origin that contains all shapes [m]
 *
 * @typedef {object} Model
 * @property {number} id
 * @property {string} name
 * @property {string} namespace  of its topics
 * @property {string} file
 * @property {Body[]} bodies
 * @property {import("./protocol.js").LaserInfo[]} lasers
 * @property {import("./protocol.js").JointInfo[]} joints
 * @property {string[]} commands  topics of velocity commands
 * @property {number} index  position in the order of arrival; selects the colour
 *
 * @typedef {object} LaserState
 * @property {import("./protocol.js").LaserInfo} info
 * @property {Model} model
 * @property {Pose} pose  of the latest scan [m, rad]
 * @property {Float32Array | null} ranges  of the latest scan [m]
 */

const INITIAL_SLOTS = 256;
/** State of a laser before its first scan.
 * @type {{pose: Pose, ranges: null}} */
const NO_SCAN = { pose: [0, 0, 0], ranges: null };

/** Everything that the page has received about a world. Renderers compare the version counters. */
export class WorldState {
  /**
   * @param {number} index
   * @param {string} name
   */
  constructor(index, name) {
    this.index = index;
    this.name = name;
    /** Whether the server has described the world. */
    this.present = false;
    this.layersVersion = 0;
    this.shapesVersion = 0;
    this.posesVersion = 0;
    this.scansVersion = 0;
    /** Bodies of the last poses.
     * @type {Uint32Array} */
    this.movedIds = new Uint32Array();
    /** @type {Bounds | null} */
    this.bounds = null;
    this.stepSize = 0;
    /** @type {Layer[]} */
    this.layers = [];
    /** @type {Map<number, Model>} */
    this.models = new Map();
    /** @type {Map<number, Body>} */
    this.bodies = new Map();
    /** @type {Map<number, LaserState>} */
    this.lasers = new Map();
    /** @type {import("./protocol.js").FrameInfo[]} */
    this.frames = [];
    /** @type {import("./protocol.js").StatusMessage | null} */
    this.status = null;
    /** Earlier states, null if the server has not sent them.
     * @type {import("./protocol.js").HistoryMessage | null} */
    this.history = null;
    this.time = 0;
    /** Pose of each slot: x, y, heading, 1 if it is known. */
    this.poses = new Float32Array(4 * INITIAL_SLOTS);
    this.slots = 0;
    /** @type {number[]} */
    this.freeSlots = [];
    /** Number of models that have ever arrived. */
    this.arrivals = 0;
    this.trails = new Trails();
  }

  /** @param {import("./protocol.js").WorldMessage} message */
  applyWorld(message) {
    const before = this.layers;
    this.present = true;
    this.name = message.name;
    this.bounds = message.bounds;
    this.stepSize = message.step_size;
    // The server sends the edges of a layer again only if they have changed.
    this.layers = message.layers.map(({ name, color }, index) => ({
      name,
      color,
      visible: before.find((layer) => layer.name === name)?.visible ?? true,
      edges: before[index]?.edges ?? null,
    }));
    this.layersVersion++;
  }

  /** @param {import("./protocol.js").EdgesData} data */
  applyEdges(data) {
    const layer = this.layers[data.layer];
    if (!layer) return;
    layer.edges = data.edges;
    this.layersVersion++;
  }

  /** @param {import("./protocol.js").ModelsMessage} message */
  applyModels(message) {
    const removed = [...message.removed];
    if (message.complete) {
      const sent = new Set(message.models.map((info) => info.id));
      removed.push(...[...this.models.keys()].filter((id) => !sent.has(id)));
    }
    for (const id of removed) this.removeModel(id);
    for (const info of message.models) {
      const before = this.models.get(info.id);
      /** @type {Model} */
      const model = {
        id: info.id,
        name: info.name,
        namespace: info.namespace ?? "",
        file: info.file ?? "",
        bodies: [],
        lasers: info.lasers,
        joints: info.joints,
        commands: info.commands,
        index: before?.index ?? this.arrivals++,
      };
      const kept = new Set(info.bodies.map((body) => body.id));
      for (const body of before?.bodies ?? []) if (!kept.has(body.id)) this.removeBody(body);
      model.bodies = info.bodies.map((body) => this.addBody(body, model));
      // The server does not send the last scans again if only the appearance of a model has changed.
      const scans = new Map(model.lasers.map((laser) => [laser.id, this.lasers.get(laser.id)]));
      for (const laser of before?.lasers ?? []) this.lasers.delete(laser.id);
      for (const laser of model.lasers) {
        const { pose, ranges } = scans.get(laser.id) ?? NO_SCAN;
        this.lasers.set(laser.id, { info: laser, model, pose, ranges });
      }
      this.models.set(info.id, model);
    }
    this.shapesVersion++;
    this.scansVersion++;
  }

  /**
   * @param {import("./protocol.js").BodyInfo} info
   * @param {Model} model
   */
  addBody(info, model) {
    const slot = this.bodies.get(info.id)?.slot ?? this.freeSlots.pop() ?? this.slots++;
    if (4 * this.slots > this.poses.length) {
      const grown = new Float32Array(2 * this.poses.length);
      grown.set(this.poses);
      this.poses = grown;
    }
    const radius = shapesRadius(info.shapes);
    const { id, color, shapes } = info;
    const body = { id, color, shapes, slot, model, radius };
    this.bodies.set(id, body);
    return body;
  }

  /** @param {Body} body */
  removeBody(body) {
    this.bodies.delete(body.id);
    this.poses[4 * body.slot + 3] = 0;
    this.freeSlots.push(body.slot);
    this.posesVersion++;
  }

  /** @param {number} id */
  removeModel(id) {
    const model = this.models.get(id);
    if (!model) return;
    for (const body of model.bodies) this.removeBody(body);
    for (const laser of model.lasers) this.lasers.delete(laser.id);
    this.trails.interrupt(id);
    this.models.delete(id);
  }

  /** @param {import("./protocol.js").PosesData} data */
  applyPoses({ ids, poses, time }) {
    if (ids) this.movedIds = ids;
    this.time = time;
    this.trails.setTime(time);
    for (let i = 0; i < this.movedIds.length; i++) {
      const body = this.bodies.get(this.movedIds[i]);
      if (!body) continue;
      const at = 4 * body.slot;
      this.poses[at] = poses[3 * i];
      this.poses[at + 1] = poses[3 * i + 1];
      this.poses[at + 2] = poses[3 * i + 2];
      this.poses[at + 3] = 1;
      if (body.model.bodies[0] === body) {
        this.trails.extend(body.model.id, poses[3 * i], poses[3 * i + 1], body.model.index);
      }
    }
    this.posesVersion++;
  }

  /** @param {import("./protocol.js").ScansData} data */
  applyScans({ scans }) {
    for (const { id, pose, ranges } of scans) {
      const laser = this.lasers.get(id);
      if (!laser) continue;
      laser.pose = pose;
      laser.ranges = ranges;
    }
    this.scansVersion++;
  }

  /**
   * Returns the pose of a body, null before the first pose has arrived.
   *
   * @param {Body | undefined} body
   * @returns {Pose | null}
   */
  bodyPose(body) {
    if (!body) return null;
    const at = 4 * body.slot;
    if (!this.poses[at + 3]) return null;
    return [this.poses[at], this.poses[at + 1], this.poses[at + 2]];
  }

  /**
   * Returns the pose of a model, which is that of its first body.
   *
   * @param {Model} model
   */
  modelPose(model) {
    return this.bodyPose(model.bodies[0]);
  }

  /** @param {string} name */
  modelByName(name) {
    for (const model of this.models.values()) if (model.name === name) return model;
    return null;
  }

  /**
   * Returns the bounds of all layers, or of the models of a world without layers.
   *
   * @returns {Bounds | null} null for an empty world
   */
  fitBounds() {
    if (this.bounds && this.layers.some((layer) => layer.edges?.length)) return this.bounds;
    let [x0, y0, x1, y1] = [Infinity, Infinity, -Infinity, -Infinity];
    for (const body of this.bodies.values()) {
      const pose = this.bodyPose(body);
      if (!pose) continue;
      x0 = Math.min(x0, pose[0] - body.radius);
      y0 = Math.min(y0, pose[1] - body.radius);
      x1 = Math.max(x1, pose[0] + body.radius);
      y1 = Math.max(y1, pose[1] + body.radius);
    }
    return x0 <= x1 && y0 <= y1 ? [x0, y0, x1, y1] : null;
  }
}
