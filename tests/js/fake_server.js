/** A connection without a server, and a session that shows a room. */

import { Emitter } from "../../flatland/web/page/js/events.js";
import { Session } from "../../flatland/web/page/js/session.js";
import { Stage } from "../../flatland/web/page/js/stage.js";
import { openPage } from "./fake_page.js";

/** Records requests; a request fails if `replies` has an error for its type. */
export class FakeConnection extends Emitter {
  constructor() {
    super();
    this.state = "connected";
    this.requests = [];
    this.replies = {};
  }

  async request(type, fields) {
    this.requests.push({ type, ...fields });
    const reply = this.replies[type];
    if (reply instanceof Error) throw reply;
    return reply;
  }

  probe(type, fields) {
    this.requests.push({ type: `probe ${type}`, ...fields });
  }

  /** Returns the requests of a type since the last call, without their type. */
  take(type) {
    const found = this.requests.filter((request) => request.type === type);
    this.requests = this.requests.filter((request) => request.type !== type);
    return found.map(({ type: _, ...fields }) => fields);
  }
}

export const SQUARE = [
  [-0.5, -0.5],
  [0.5, -0.5],
  [0.5, 0.5],
  [-0.5, 0.5],
];

/** Returns the description of a model with one body, a disc of 0.4 m unless shapes are given. */
export function describeModel(id, name, fields = {}) {
  const shapes = [{ kind: "circle", center: [0, 0], radius: 0.4 }];
  const body = { id: 10 * id, name: "base", color: [1, 0, 0, 1], shapes, ...fields.body };
  const rest = { file: "/w/m.yaml", lasers: [], joints: [], commands: [], ...fields };
  return { id, name, ...rest, bodies: fields.bodies ?? [body] };
}

/** Returns a message with all models of a world. */
export function models(list, { world = 0, complete = true, removed = [] } = {}) {
  return { type: "models", world, complete, models: list, removed };
}

/** Returns a message about a world with a layer. */
export function worldMessage(world, fields = {}) {
  const layers = [{ name: "walls", color: [1, 1, 1, 1], edges: 1 }];
  const rest = { name: `room ${world}`, bounds: [-5, -5, 5, 5], step_size: 0.005, layers };
  return { type: "world", world, ...rest, ...fields };
}

/** Returns the first message of a connection; `worlds` are numbers. */
export function hello(worlds, fields = {}) {
  const names = worlds.map((world) => ({ world, name: `room ${world}` }));
  return { type: "hello", title: "flatland", read_only: false, worlds: names, ...fields };
}

export function status(fields = {}) {
  const rest = { time: 1, paused: false, rate: 200, real_time_factor: 1, stale: 0 };
  return { type: "status", world: 0, ...rest, ...fields };
}

/** Returns poses of bodies: `{id: [x, y, heading]}`. */
export function poses(byId, { world = 0, time = 1 } = {}) {
  const ids = Object.keys(byId).map(Number);
  return {
    kind: "poses",
    world,
    time,
    ids: new Uint32Array(ids),
    poses: new Float32Array(ids.flatMap((id) => byId[id])),
  };
}

export const ROBOT = 1;
export const CRATE = 2;

/**
 * Returns a session that shows a room: a robot at (-2, 1), a crate of 1 m at (2, -2).
 *
 * The result contains the texts of all notices.
 */
export function showRoom({ readOnly = false, worlds = 1 } = {}) {
  const connection = new FakeConnection();
  const session = new Session(connection);
  const notices = [];
  session.on("notice", ({ text }) => notices.push(text));
  const numbers = Array.from({ length: worlds }, (_, world) => world);
  connection.emit("message", hello(numbers, { read_only: readOnly }));
  for (const world of numbers) {
    connection.emit("message", worldMessage(world));
    const edges = new Float32Array([-5, -5, 5, 5]);
    connection.emit("data", { kind: "edges", world, time: 0, layer: 0, edges });
    const robot = describeModel(ROBOT, "robot", { commands: ["/cmd_vel"] });
    const crate = describeModel(CRATE, "crate", { body: { shapes: [{ kind: "polygon", points: SQUARE }] } });
    connection.emit("message", models([robot, crate], { world }));
    connection.emit("data", poses({ 10: [-2, 1, 0], 20: [2, -2, 0] }, { world }));
    connection.emit("message", status({ world }));
  }
  return { connection, session, notices, world: session.world };
}

/** Opens the page anew, and shows a room on its stage; returns all of its parts. */
export function openRoom({ hash = "", search = "", ...options } = {}) {
  const elements = openPage({ hash, search });
  const shown = showRoom(options);
  return { elements, stage: createStage(shown.session), ...shown };
}

/** Returns a stage of 200 by 100 pixels that shows 20 pixels per metre around the origin. */
export function createStage(session) {
  const stage = new Stage(document.getElementById("canvas"), session, false);
  stage.isFitting = false;
  return stage;
}

/** Returns the position of the pointer at a point of the world. */
export function spotAt(stage, x, y, isTouch = false) {
  const [px, py] = stage.camera.toScreen(x, y);
  return { px, py, x, y, isTouch };
}
