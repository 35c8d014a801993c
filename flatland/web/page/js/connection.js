import { Emitter } from "./events.js";
import { decodeBinary, SUBPROTOCOL, WRONG_TOKEN } from "./protocol.js";

/** Delays before the attempts to reconnect [ms]; the last delay is repeated. */
const RECONNECT_DELAYS = [250, 500, 1000, 2000, 3000];
/** Time limit of a reply [ms]. */
const REPLY_TIMEOUT = 20_000;
/** Time limit of the reply to the check whether the connection is open after a sleep [ms]. */
const PROBE_TIMEOUT = 4000;

/** The server rejected a request, or the connection was lost before its reply. */
export class RequestError extends Error {}

/**
 * @typedef {import("./protocol.js").Requests} Requests
 *
 * @typedef {"connecting" | "connected" | "reconnecting" | "refused"} ConnectionState
 *
 * @typedef {object} ConnectionEvents
 * @property {ConnectionState} state
 * @property {string} reason  why the server closed the connection
 * @property {import("./protocol.js").StateMessage} message
 * @property {NonNullable<ReturnType<typeof decodeBinary>>} data
 */

/**
 * A WebSocket that reconnects, with requests that have replies.
 *
 * @extends {Emitter<ConnectionEvents>}
 */
export class Connection extends Emitter {
  /** @param {string} url  address of the WebSocket */
  constructor(url) {
    super();
    this.url = url;
    /** @type {ConnectionState} */
    this.state = "connecting";
    /** @type {WebSocket | null} */
    this.socket = null;
    this.attempts = 0;
    this.nextId = 1;
    /** Number of messages received. */
    this.received = 0;
    /** @type {number | undefined} */
    this.timer = undefined;
    /** @type {Map<number, {resolve: (result: unknown) => void, reject: (error: Error) => void, timer: number}>} */
    this.pending = new Map();
  }

  /** Opens the connection; also skips the delay of an attempt to reconnect. */
  open() {
    clearTimeout(this.timer);
    if (this.state === "refused") return;
    if (this.socket) {
      if (this.socket.readyState <= WebSocket.OPEN) return;
      // The server has closed the connection, but the browser has not reported that yet.
      this.lose(this.socket, "");
      clearTimeout(this.timer);
    }
    const socket = new WebSocket(this.url, [SUBPROTOCOL]);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.onopen = () => {
      this.attempts = 0;
      this.setState("connected");
    };
    socket.onmessage = (event) => this.receive(event.data);
    socket.onclose = (event) => {
      if (event.code === WRONG_TOKEN) this.setState("refused");
      this.lose(socket, event.reason);
    };
  }

  /** Closes the connection of a page that the user has left; `open` opens it again. */
  close() {
    if (this.socket) this.lose(this.socket, "");
    clearTimeout(this.timer);
  }

  /**
   * Sends a request.
   *
   * @template {keyof Requests} Type
   * @param {Type} type
   * @param {Requests[Type]["fields"] & {world?: number}} fields
   * @param {number} [timeout]  [ms]
   * @returns {Promise<Requests[Type]["result"]>} result of the request
   * @throws {RequestError} if it is rejected, if there is no connection, or without a reply
   */
  async request(type, fields, timeout = REPLY_TIMEOUT) {
    const { socket } = this;
    if (socket?.readyState !== WebSocket.OPEN) throw new RequestError("not connected to the simulator");
    const id = this.nextId++;
    return new Promise((resolve, reject) => {
      const timer = window.setTimeout(() => {
        this.pending.delete(id);
        reject(new RequestError(`no reply to "${type}"`));
      }, timeout);
      this.pending.set(id, { resolve, reject, timer });
      socket.send(JSON.stringify({ id, type, ...fields }));
    });
  }

  /**
   * Reconnects unless the server replies soon: the connection may be dead after a sleep.
   *
   * @template {keyof Requests} Type
   * @param {Type} type
   * @param {Requests[Type]["fields"]} fields
   */
  async probe(type, fields) {
    const { socket, received: before } = this;
    if (socket?.readyState !== WebSocket.OPEN) {
      this.open();
      return;
    }
    try {
      await this.request(type, fields, PROBE_TIMEOUT);
    } catch {
      if (this.socket === socket && this.received === before) this.lose(socket, "");
    }
  }

  /** @param {string | ArrayBuffer} data */
  receive(data) {
    this.received++;
    if (typeof data !== "string") {
      const decoded = decodeBinary(data);
      if (decoded) this.emit("data", decoded);
      return;
    }
    /** @type {import("./protocol.js").StateMessage | import("./protocol.js").ReplyMessage} */
    const message = JSON.parse(data);
    if (message.type !== "reply") {
      this.emit("message", message);
      return;
    }
    const request = this.pending.get(message.id);
    if (!request) return;
    this.pending.delete(message.id);
    clearTimeout(request.timer);
    if (message.ok) request.resolve(message.result);
    else request.reject(new RequestError(message.error));
  }

  /**
   * Rejects all pending requests and schedules the next attempt.
   *
   * @param {WebSocket} socket
   * @param {string} reason
   */
  lose(socket, reason) {
    if (this.socket !== socket) return;
    this.socket = null;
    socket.onopen = socket.onmessage = socket.onclose = null;
    socket.close();
    for (const { reject, timer } of this.pending.values()) {
      clearTimeout(timer);
      reject(new RequestError("the connection was lost"));
    }
    this.pending.clear();
    if (reason) this.emit("reason", reason);
    if (this.state === "refused") return;
    this.setState("reconnecting");
    const delay = RECONNECT_DELAYS[Math.min(this.attempts++, RECONNECT_DELAYS.length - 1)];
    this.timer = window.setTimeout(() => this.open(), delay);
  }

  /** @param {ConnectionState} state */
  setState(state) {
    if (state === this.state) return;
    this.state = state;
    this.emit("state", state);
  }
}
